"""The outline of a body seen from above."""

import numpy as np
from numpy.typing import NDArray

_Place = tuple[float, float]


def outline_of(points_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(C, 2) [m] north and east of the corners of the convex hull of points seen from above.

    From the westernmost on, counter-clockwise on a map with north up; no corner lies on a straight
    edge. Fewer than three different points are their own outline.

    Args:
        points_m: (P, 2 or 3) north, east and what else there is [m].
    """
    points = sorted({(float(east), float(north)) for north, east in points_m[:, :2]})
    if len(points) >= 3:
        points = [*_chain(points), *_chain(points[::-1])]
    return np.array(points).reshape(-1, 2)[:, ::-1]


def _chain(points: list[_Place]) -> list[_Place]:
    """One side of the hull of sorted points, without its last corner (Andrew's monotone chain)."""
    chain: list[_Place] = []
    for point in points:
        while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= 0:
            chain.pop()
        chain.append(point)
    return chain[:-1]


def _turn(a: _Place, b: _Place, c: _Place) -> float:
    """More than 0 where three places turn to the left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
