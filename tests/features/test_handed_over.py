"""Planners give the waypoints of a UAS that takes no commands to the others, and back to it."""

import numpy as np
import pytest
from eventful import WAYPOINTS, event, field
from uas_coverage_agents.route.planner import LearnedRoute
from uas_coverage_agents.velocity.planner import LearnedVelocity
from uas_coverage_baselines.milp_mpc import MilpMpc
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory import Trajectory

from uas_coverage_env import rollout
from uas_coverage_env.flight.metrics import accomplished

QUICK = {"at_once": 1, "horizon": 8, "threads": 1, "teams": 2}


def milp(order):
    return lambda: MilpMpc(MilpMpc.Options(**QUICK, order=order))


PLANNERS = {
    "nearest-waypoint": NearestWaypoint,
    "tour": lambda: Tour(Tour.Options(moves=20_000, changes=60)),
    "trajectory": lambda: Trajectory(Trajectory.Options(orders=1, moves=20_000, programs=20)),
    "learned-route": lambda: LearnedRoute(LearnedRoute.Options(samples=4)),
    "learned-velocity": LearnedVelocity,
    "milp-mpc": milp("none"),
    "milp-mpc along an order": milp("search"),
}

CORNERS = tuple(WAYPOINTS[i] for i in (0, 2, 6, 8))  # enough where a decision takes long

every_planner = pytest.mark.parametrize(
    ("planner", "waypoints"),
    [
        pytest.param(made, CORNERS if name.startswith("milp") else WAYPOINTS, id=name)
        for name, made in PLANNERS.items()
    ],
)


def visited_by(flight, name, since):
    """How many waypoints a UAS is in, from a sample on."""
    i, waypoints = flight.names.index(name), flight.scenario.waypoints
    centres_m = np.array([waypoint.position_m for waypoint in waypoints])
    away_m = np.linalg.norm(flight.x[since:, i, None, :3] - centres_m, axis=2)
    return int((away_m <= [waypoint.radius_m for waypoint in waypoints]).any(axis=0).sum())


@every_planner
def test_the_others_cover_what_a_uas_without_a_radio_leaves(planner, waypoints):
    silent = event("radio_lost", 12.0, uas="uas_1", for_s=120.0, then="hover")
    flight = rollout(field(silent, waypoints=waypoints), planner(), safety_filter=True)
    assert accomplished(flight)
    assert not flight.breaches
    assert flight.covered[:120].max() == len(waypoints)


@every_planner
def test_a_uas_that_takes_commands_again_gets_waypoints_again(planner, waypoints):
    silent = event("radio_lost", 2.0, uas="uas_1", for_s=8.0, then="hover")
    flight = rollout(field(silent, waypoints=waypoints), planner(), safety_filter=True)
    assert accomplished(flight)
    assert visited_by(flight, "uas_1", 10) >= 2
