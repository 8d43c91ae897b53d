"""An obstacle that sets off at a UAS: how far it has to be for the UAS to get out of its way."""

import dataclasses

import numpy as np
import pytest
from practice_missions import mission
from uas_coverage_baselines.milp_mpc.fallback.evasion import evasion
from uas_coverage_baselines.milp_mpc.getaway import getaway_margin_m
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder

from uas_coverage_env.flight import rollout
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import VY

S500 = load_vehicle("s500_v2")
KEEP_OUT_M = 8.0 + 25.0 + 0.36  # of the village's helicopter
SETS_OFF = 8.0


def test_the_faster_an_obstacle_may_set_off_the_farther_a_uas_stays():
    margins = [getaway_margin_m(S500, 1.0, KEEP_OUT_M, a, 15.0) for a in (1.0, 3.0, 15.0)]
    assert margins == sorted(margins)
    assert 0.0 < margins[0] < margins[-1] < 100.0
    slow = getaway_margin_m(S500, 1.0, KEEP_OUT_M, 15.0, 6.0)
    assert slow < margins[-1]


@pytest.mark.parametrize("approach_mps", [0.0, 6.0, 12.0])
def test_at_the_margin_the_planner_gets_out_of_the_way_of_the_villages_helicopter(approach_mps):
    # at 121 s it takes up 15 m/s to the east in one sample; the UAS is east of it
    village = load_scenario("village")
    builder = MilpMpc(MilpMpcOptions(moving_margin_m=0.0))
    brief = MissionBrief.of(village)
    builder.reset(brief, 0)
    margin_m = getaway_margin_m(S500, 1.0, KEEP_OUT_M, 15.0, 15.0)
    way_m = {0.0: 0.0, 6.0: 15.0, 12.0: 40.0}[approach_mps]  # it could just stop at the margin

    def nearest_m(beyond_m):
        """Distance from the keep-out on the flight out of the way."""
        swarm = first_sight(brief)
        x = swarm.x.copy()
        x[0, :3], x[0, VY] = (250.0, 300.0, -21.0), -approach_mps
        away_m = KEEP_OUT_M + beyond_m + way_m
        swarm = dataclasses.replace(
            swarm,
            x=x,
            moving_position_m=np.array([[250.0, 300.0 - away_m, -21.0]]),
            moving_velocity_mps=np.array([[0.0, 15.0, 0.0]]),
        )
        plan = evasion(builder.problem(swarm).only(0), village.dt_s)
        assert plan is not None
        path = plan.x[0, :13, :2]
        helicopter = np.array([250.0, 300.0 - away_m]) + np.outer(np.arange(13), [0.0, 15.0])
        return np.linalg.norm(path - helicopter, axis=1).min() - KEEP_OUT_M

    assert nearest_m(margin_m) >= 0.0
    assert nearest_m(3.0 - way_m) < 0.0  # with the margin of a step it is too late


def lively(setting_off_s):
    """A waypoint in front of something that stands, and then sets off at 15 m/s in a sample."""
    truck = {
        "name": "truck",
        "radius_m": 4.0,
        "height_m": 60.0,
        "safe_distance_m": 10.0,
        "start_m": (100.0, 40.0, -5.0),
        "schedule": [
            {"from_s": 0.0, "velocity_mps": (0.0, 0.0, 0.0)},
            {"from_s": setting_off_s, "velocity_mps": (0.0, 15.0, 0.0)},
        ],
    }
    places = [((100.0, 68.0, -8.0), 8.0)]
    return mission(places, [(100.0, 90.0, -6.0)], moving_obstacles=[truck])


def breaches(scenario, **options):
    options = {"horizon": 8, "teams": 1} | options
    return rollout(scenario, MilpMpc(MilpMpcOptions(**options)), max_steps=45)


def test_a_uas_in_front_of_what_sets_off_is_caught_unless_that_is_reckoned_with():
    scenario = lively(SETS_OFF)
    caught = breaches(scenario)
    assert caught.breaches > 0
    clear = breaches(scenario, moving_acceleration_mps2=15.0)
    assert clear.breaches == 0
    assert not clear.violations
    assert clear.covered[-1] == 1  # once it has gone


def test_without_the_option_nothing_is_added_and_nothing_more_is_blocked():
    brief = MissionBrief.of(lively(SETS_OFF))
    swarm = first_sight(brief)
    plain, wary = (
        MilpMpc(MilpMpcOptions(moving_acceleration_mps2=a, limit_sides=8)) for a in (0.0, 15.0)
    )
    for made in (plain, wary):
        made.reset(brief, 0)
    margin_m = MilpMpcOptions().moving_margin_m
    assert plain.problem(swarm).moving_clearance_m == pytest.approx(10.36 + margin_m)
    assert (wary.problem(swarm).moving_clearance_m > 10.36 + margin_m).all()
    blocked = [
        ProblemBuilder(brief, made.options).blocked_waypoints(swarm) for made in (plain, wary)
    ]
    assert blocked == [set(), {0}]
