"""What guidance flies of a wish that leaves no room to brake."""

import math

import numpy as np

AS_WISHED, LEVEL, IN_PLACE, STRAIGHT_ON = range(4)


def _tries() -> np.ndarray:
    """(T, 3) what is flown of a wish, the first that leaves room to brake: see `guidance`.

    Factors by which its velocity is shortened and turned (along and to the right of it), and the
    height: slower and without descending, up or down in place, straight on without climbing, to one
    side. Speeds are shares of the wish, turns are in radians.
    """
    shares, when_turned = (1.0, 0.7, 0.4, 0.15), 0.4
    turns_rad = (0.9, -0.9, 1.8, -1.8, 2.7, -2.7)
    rows = [(share, 0.0, height) for share in shares for height in (AS_WISHED, LEVEL)]
    rows += [(0.0, 0.0, IN_PLACE), *((share, 0.0, STRAIGHT_ON) for share in shares)]
    for turn_rad in turns_rad:
        rows.append((when_turned * math.cos(turn_rad), when_turned * math.sin(turn_rad), LEVEL))
    return np.array(rows)


TRIES = _tries()
