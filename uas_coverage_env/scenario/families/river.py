"""River and woods: a winding river with its banks, and woods that are covered from above."""

import math

import numpy as np

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import (
    MARGIN_M,
    Place_m,
    Rng,
    Size,
    Square,
    Wanted,
    prism,
    tag,
)
from uas_coverage_env.scenario.fields import Decoration
from uas_coverage_env.scenario.model import Scenario

_PITCH_M = 58.0
_RIVER_M = 24.0
_WOOD_RADIUS_M, _WOOD_HEIGHT_M = (16.0, 30.0), (14.0, 20.0)
_CORNERS = 7
_TRIES = 40
_WATER_ALTITUDE_M = 8.0


def river(rng: Rng, size: Size) -> Scenario:
    """Waypoints low along the river and over the woods weigh twice those of the fields."""
    n_uas, n_waypoints = size.draw(rng)
    square = Square.at_pitch(n_uas, n_waypoints, _PITCH_M)
    side_m, west_m = square
    phase, waves = rng.uniform(0.0, 2.0 * math.pi), rng.uniform(0.7, 1.4)
    middle_m, wide_m = west_m + side_m * rng.uniform(0.35, 0.65), side_m * rng.uniform(0.08, 0.2)

    def course_m(north_m: float) -> float:
        return middle_m + wide_m * math.sin(phase + waves * 2.0 * math.pi * north_m / side_m)

    woods: list[tuple[Place_m, float]] = []
    for _ in range(_TRIES):
        radius_m = float(rng.uniform(*_WOOD_RADIUS_M))
        lowest = MARGIN_M + radius_m
        north_m = float(rng.uniform(lowest, side_m - lowest))
        east_m = float(rng.uniform(west_m + lowest, west_m + side_m - lowest))
        dry = abs(east_m - course_m(north_m)) > radius_m + _RIVER_M
        apart = all(
            math.dist(place, (north_m, east_m)) > radius + radius_m + 20.0
            for place, radius in woods
        )
        if dry and apart and len(woods) < max(2, n_waypoints // 5):
            woods.append(((north_m, east_m), radius_m))
    patches = []
    for k, ((north_m, east_m), radius_m) in enumerate(woods):
        turns = 2.0 * math.pi * (np.arange(_CORNERS) + rng.uniform(-0.3, 0.3, _CORNERS)) / _CORNERS
        corners = [
            (north_m + radius_m * math.cos(a), east_m + radius_m * math.sin(a)) for a in turns
        ]
        height_m = float(rng.uniform(*_WOOD_HEIGHT_M))
        patches.append(prism(f"wood_{k + 1}", "forest", corners, height_m))
    wet = np.arange(MARGIN_M + 10.0, side_m - MARGIN_M, _PITCH_M).tolist()
    wanted = [
        Wanted((north, course_m(north)), _WATER_ALTITUDE_M, "water", 2.0, 12.0) for north in wet
    ]
    wanted += [Wanted(place, kind="forest", weight=2.0) for place, _ in woods]
    wanted = wanted[:n_waypoints]
    places = square.spread_places(
        rng,
        max(1, n_waypoints - len(wanted)),
        lambda north, east: abs(east - course_m(north)) > 1.2 * _RIVER_M,
    )
    wanted += [Wanted(place) for place in places[: n_waypoints - len(wanted)]]
    along = np.linspace(0.0, side_m, 17).tolist()
    banks = [(north, course_m(north) - 0.5 * _RIVER_M) for north in along]
    banks += [(north, course_m(north) + 0.5 * _RIVER_M) for north in reversed(along)]
    water = Decoration(
        name="river",
        kind="water",
        polygon_m=tuple((round(north, 1), round(east, 1)) for north, east in banks),
    )
    site = square.site(patches, decorations=(water,))
    return site.scenario(rng, f"river-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"river": Family(river)}
