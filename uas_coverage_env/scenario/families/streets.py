"""Streets and blocks: houses, towers and parks on a grid of streets, covered from both levels."""

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
from uas_coverage_env.scenario.model import Scenario

_LOT_M = 62.0
_STREET_ALTITUDE_M = 9.0
_LOW_M, _HIGH_M = (7.0, 14.0), (24.0, 42.0)
_TOWERS, _PARKS = 0.25, 0.15
_LARGEST_SIDE = 6


def streets(rng: Rng, size: Size) -> Scenario:
    """Blocks along streets; waypoints low in the streets, and over roofs that are low enough."""
    n_uas, n_waypoints = size.draw(rng)
    lots = min(_LARGEST_SIDE, max(2, round(0.75 * math.sqrt(n_waypoints))))
    square = Square.of(n_uas, lots * _LOT_M + 2.0 * MARGIN_M)
    street_m = rng.uniform(GAP_M, GAP_M + 6.0)
    blocks = []
    for i in range(lots):
        for j in range(lots):
            use, depth, width, height = rng.uniform(size=4)
            if use < _PARKS:
                continue
            tower = use > 1.0 - _TOWERS
            room_m = _LOT_M - street_m
            longest_m = (0.55 if tower else 1.0) * room_m
            depth_m, width_m = longest_m * (0.8 + 0.2 * depth), longest_m * (0.8 + 0.2 * width)
            north_m = MARGIN_M + _LOT_M * (i + 0.5)
            east_m = square.west_m + MARGIN_M + _LOT_M * (j + 0.5)
            low, high = _HIGH_M if tower else _LOW_M
            blocks.append(
                prism(
                    f"block_{len(blocks) + 1}",
                    "high_rise" if tower else "residential",
                    outline(
                        (north_m - 0.5 * depth_m, north_m + 0.5 * depth_m),
                        (east_m - 0.5 * width_m, east_m + 0.5 * width_m),
                    ),
                    low + (high - low) * height,
                )
            )
    places = square.spread_places(rng, n_waypoints)
    wanted = [Wanted(place, _STREET_ALTITUDE_M, "street", radius_m=12.0) for place in places]
    return square.site(blocks).scenario(rng, f"streets-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"streets": Family(streets)}
