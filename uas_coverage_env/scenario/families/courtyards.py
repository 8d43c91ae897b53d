"""Courtyards: blocks built around yards that can be entered from above alone."""

import math

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import (
    GAP_M,
    MARGIN_M,
    Rng,
    Size,
    Square,
    Wanted,
    outline,
    prism,
    tag,
)
from uas_coverage_env.scenario.fields import Obstacle
from uas_coverage_env.scenario.model import Scenario

_DEPTH_M = 9.0
_YARD_M, _HEIGHT_M = (26.0, 34.0), (10.0, 17.0)
_LOT_M = _YARD_M[1] + 2.0 * _DEPTH_M + GAP_M
_YARD_ALTITUDE_M, _YARD_RADIUS_M = 6.0, 5.0
_STREET_ALTITUDE_M = 12.0
_MOST_YARDS = 9


def courtyards(rng: Rng, size: Size) -> Scenario:
    """A waypoint at the bottom of every yard, the others around and above the blocks."""
    n_uas, n_waypoints = size.draw(rng)
    lots = max(1, math.floor(math.sqrt(min(_MOST_YARDS, n_waypoints // 3))))
    square = Square.of(n_uas, lots * _LOT_M + 2.0 * MARGIN_M)
    walls: list[Obstacle] = []
    wanted: list[Wanted] = []
    for i in range(lots):
        for j in range(lots):
            yard_m, shift = rng.uniform(*_YARD_M), rng.uniform(-1.0, 1.0, size=2)
            spare_m = 0.5 * (_YARD_M[1] - yard_m) * shift
            north_m = MARGIN_M + _LOT_M * (i + 0.5) + spare_m[0]
            east_m = square.west_m + MARGIN_M + _LOT_M * (j + 0.5) + spare_m[1]
            yard = f"{len(wanted) + 1}"
            walls += _block(yard, north_m, east_m, yard_m, float(rng.uniform(*_HEIGHT_M)))
            wanted.append(Wanted((north_m, east_m), _YARD_ALTITUDE_M, "yard", 2.0, _YARD_RADIUS_M))
    places = square.spread_places(rng, n_waypoints - len(wanted))
    wanted += [Wanted(place, _STREET_ALTITUDE_M, "street", radius_m=10.0) for place in places]
    return square.site(walls).scenario(rng, f"courtyards-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"courtyards": Family(courtyards)}


def _block(
    name: str, north_m: float, east_m: float, yard_m: float, height_m: float
) -> list[Obstacle]:
    """Four wings around a square yard."""
    inner, outer = 0.5 * yard_m, 0.5 * yard_m + _DEPTH_M
    north, east = (north_m - outer, north_m + outer), (east_m - outer, east_m + outer)
    wings = {
        "south": ((north[0], north_m - inner), east),
        "north": ((north_m + inner, north[1]), east),
        "west": ((north_m - inner, north_m + inner), (east[0], east_m - inner)),
        "east": ((north_m - inner, north_m + inner), (east_m + inner, east[1])),
    }
    return [
        prism(f"block_{name}_{side}", "residential", outline(*spans), height_m)
        for side, spans in wings.items()
    ]
