"""A mapper and a searcher with other sensors fly one mission."""

import pytest
from uas_coverage_agents.velocity.planner import LearnedVelocity
from uas_coverage_baselines.lawnmower import Lawnmower
from uas_coverage_baselines.milp_mpc.paper_planner import MilpMpcPaper
from uas_coverage_baselines.milp_mpc.planner import MilpMpc
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.tour.planner import Tour, TourOptions
from uas_coverage_baselines.trajectory.planner import Trajectory, TrajectoryOptions

from uas_coverage_env import load_scenario, rollout
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.metrics import accomplished

PLANNERS = {
    "nearest-waypoint": NearestWaypoint,
    "lawnmower": Lawnmower,
    "tour": lambda: Tour(TourOptions(moves=20_000, changes=60)),
    "trajectory": lambda: Trajectory(TrajectoryOptions(orders=1, moves=20_000, programs=20)),
}


@pytest.mark.parametrize("name", PLANNERS)
def test_each_flies_what_it_can_cover_and_all_is_covered(name):
    flight = rollout(load_scenario("mixed_fleet"), PLANNERS[name]())
    assert accomplished(flight)
    assert flight.breaches == 0


@pytest.mark.parametrize("planner", [MilpMpc, MilpMpcPaper, LearnedVelocity])
def test_planners_that_do_not_know_of_sensors_refuse_the_mission(planner):
    with pytest.raises(InputError, match=r"refuses scenario 'mixed_fleet'.*asks for a sensor"):
        rollout(load_scenario("mixed_fleet"), planner(), max_steps=1)


@pytest.mark.parametrize("name", PLANNERS)
def test_what_no_uas_can_cover_keeps_none_in_the_air(name):
    whole = load_scenario("mixed_fleet")
    mapper = whole.uas[0]
    few = [whole.waypoints[w] for w in (2, 15, 18)]
    scenario = whole.model_copy(update={"uas": (mapper,), "waypoints": tuple(few)})
    flight = rollout(scenario, PLANNERS[name](), max_steps=60)
    assert flight.covered[-1] == 1
    assert flight.ended == "complete"
