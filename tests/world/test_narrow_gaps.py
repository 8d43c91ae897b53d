"""Walls up to the ceiling that are passed through a gap little wider than what routes keep."""

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.obstacles import NODE_MARGIN_M


def behind_a_gap(gap_m):
    low, high = 90.0 - gap_m / 2.0, 90.0 + gap_m / 2.0
    walls = (
        box("south", (0.0, 98.0, -50.0), (low, 102.0, 0.0)),
        box("north", (high, 98.0, -50.0), (200.0, 102.0, 0.0)),
    )
    return meadow(
        ((150.0, 60.0, -1.0),), obstacles=walls, waypoints=[waypoint((150.0, 140.0, -20.0))]
    )


KEPT_M = 2.0 * float(build_arena(behind_a_gap(20.0)).obstacles["wall_m"][0])


@pytest.mark.parametrize("room_m", [0.3, 0.6, 1.2, 2.5])
def test_a_gap_little_wider_than_routes_keep_is_flown_through_and_back(room_m):
    flight = rollout(behind_a_gap(KEPT_M + room_m), "nearest-waypoint")
    assert accomplished(flight)
    assert flight.breaches == 0


def test_corners_lie_where_they_lay_where_every_waypoint_has_a_way_home():
    room_m = 2.5
    arena = build_arena(behind_a_gap(KEPT_M + room_m))
    middle_m, out_m = 90.0, NODE_MARGIN_M - room_m / 2.0
    assert np.unique(arena.nodes_m[:, 0].round(6)) == pytest.approx(
        [middle_m + out_m, middle_m - out_m]
    )
