"""The sorties of a UAS: from each take-off to the landing after it. A file holds one of them."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from uas_coverage_env.flight.record import LANDED, FlightRecord
from uas_coverage_env.world.packs import pack_records

TAKE_OFF_HEIGHT_M = 3.0
"""Height at which a take-off ends and a landing begins."""


class Sortie(NamedTuple):
    """One of them.

    Attributes:
        first: The sample at which the UAS begins, at rest on the ground.
        landed: The first sample at which it has landed, or is lost.
        rest_s: How long it was on the ground before; 0 for the first one [s].
        fresh: Whether it flies with a fresh pack.
    """

    first: int
    landed: int
    rest_s: float = 0.0
    fresh: bool = True


def sorties_of(flight: FlightRecord, uas: int) -> list[Sortie]:
    """All sorties of a UAS, in their order; none where it was never up.

    Where it is still in the air at the end, its last one ends there.

    Args:
        flight: The flight.
        uas: Index of the UAS.
    """
    flying = np.flatnonzero(flight.mode[:, uas] < LANDED)
    if not len(flying):
        return []
    landed = min(int(flying[-1]) + 1, len(flight.x) - 1)
    starts = [(0, 0), *_rests(flight, uas, landed)]
    ends = [rest[0] for rest in starts[1:]] + [landed]
    mine = [swap for swap in flight.swaps if swap.uas == flight.names[uas]]
    swapped = {round(swap.time_s / flight.scenario.dt_s) for swap in mine}
    return [
        Sortie(
            first=start[1],
            landed=end,
            rest_s=_on_the_ground_s(flight, uas, *start, swapped=start[1] in swapped),
            fresh=start[1] == 0 or start[1] in swapped,
        )
        for start, end in zip(starts, ends, strict=True)
    ]


def _rests(flight: FlightRecord, uas: int, landed: int) -> list[tuple[int, int]]:
    """First and last sample of each time on the ground between two sorties."""
    drawn = flight.current_A[:landed, uas] > 0.0
    if not drawn.any():
        return []
    began = int(drawn.argmax())
    moved = (np.diff(flight.x[: landed + 1, uas, :3], axis=0) != 0.0).any(axis=1)
    active = np.flatnonzero(drawn | moved)
    return [(int(a) + 1, int(b)) for a, b in pairwise(active) if a >= began and b > a + 1]


def _on_the_ground_s(
    flight: FlightRecord, uas: int, landed: int, first: int, *, swapped: bool
) -> float:
    """How long a UAS was on the ground; climbs and descents are parts of files."""
    dt_s = flight.scenario.dt_s
    rest_s = (first - landed) * dt_s
    sorties = flight.scenario.sorties
    if not swapped or sorties is None or sorties.together:
        return rest_s
    phases_s = int(pack_records(flight.scenario)[uas]["swap_steps"]) * dt_s - sorties.swap_s
    return max(rest_s - max(phases_s, 0.0), sorties.swap_s)
