"""Irregular areas: a fence with many corners, and in it an area that is not convex."""

import math

import numpy as np

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import (
    MARGIN_M,
    Place_m,
    Rng,
    Site,
    Size,
    Square,
    Wanted,
    outline,
    prism,
    tag,
)
from uas_coverage_env.scenario.fields import Obstacle
from uas_coverage_env.scenario.model import Scenario

_PITCH_M = 66.0
_MIDDLE_M = 25.0  # between ground and ceiling
_HOUSE_M, _HEIGHT_M = (14.0, 24.0), (7.0, 30.0)
_HOUSES_PER_WAYPOINT = 0.15


def irregular(rng: Rng, size: Size) -> Scenario:
    """Waypoints in three discs that touch or overlap; some houses."""
    n_uas, n_waypoints = size.draw(rng)
    square = Square.at_pitch(n_uas, n_waypoints, _PITCH_M)
    side_m, west_m = square
    # what is cut off at the corners in the north-east and the south-east
    ne_east_m, ne_north_m, se_north_m, se_east_m = rng.uniform(0.15, 0.3, size=4) * side_m
    far_m = west_m + side_m
    fence = [
        (0.0, 0.0), (side_m, 0.0), (side_m, far_m - ne_east_m), (side_m - ne_north_m, far_m),
        (se_north_m, far_m), (0.0, far_m - se_east_m),
    ]  # fmt: skip
    radius_m = side_m * rng.uniform(0.26, 0.34, size=3)
    turns = rng.uniform(0.0, 2.0 * math.pi) + np.array([0.0, 2.1, 4.2])
    discs = [
        (
            0.5 * side_m + 0.25 * side_m * math.cos(turn),
            west_m + 0.5 * side_m + 0.25 * side_m * math.sin(turn),
        )
        for turn in turns
    ]

    empty = Site(fence)

    def is_inside(north_m: float, east_m: float) -> bool:
        near = any(
            math.dist((north_m, east_m), disc) < radius
            for disc, radius in zip(discs, radius_m, strict=True)
        )
        return near and empty.clearance_m((north_m, east_m, -_MIDDLE_M)) > MARGIN_M

    places = square.spread_places(rng, n_waypoints, is_inside)
    houses = [
        _house(rng, k, place)
        for k, place in enumerate(places[:: max(1, round(1.0 / _HOUSES_PER_WAYPOINT))])
    ]
    site = Site(fence, houses)
    wanted = [Wanted(place) for place in places]
    return site.scenario(rng, f"irregular-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"irregular": Family(irregular)}


def _house(rng: Rng, k: int, place: Place_m) -> Obstacle:
    half_m = 0.5 * rng.uniform(*_HOUSE_M, size=2)
    height_m = float(rng.uniform(*_HEIGHT_M))
    return prism(
        f"house_{k + 1}",
        "residential" if height_m < 20.0 else "high_rise",
        outline(
            (place[0] - half_m[0], place[0] + half_m[0]),
            (place[1] - half_m[1], place[1] + half_m[1]),
        ),
        height_m,
    )
