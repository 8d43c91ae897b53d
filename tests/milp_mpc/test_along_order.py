"""`milp-mpc` with `order=search`: whole small missions, a lost UAS, a place that opens late."""

import dataclasses

import numpy as np
from practice_missions import mission
from uas_coverage_baselines.milp_mpc.planner import MilpMpc, MilpMpcOptions
from uas_coverage_baselines.milp_mpc.problem_builder import ProblemBuilder
from uas_coverage_baselines.milp_mpc.route_guide import RouteGuide, TourShape

from uas_coverage_env.entities.state import LOST
from uas_coverage_env.flight import rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.simulation import World

SEARCHED = MilpMpcOptions(horizon=10, order="search")
PLACES = [((60.0, 40.0 + 25.0 * k, -10.0), 8.0) for k in range(5)]
STARTS = [(20.0, 20.0, -1.0), (20.0, 180.0, -1.0)]


def parked(leaves_at_s):
    """A balloon that hides the last of the places until it moves off."""
    return {
        "name": "balloon",
        "radius_m": 14.0,
        "height_m": 30.0,
        "safe_distance_m": 2.0,
        "start_m": (60.0, 140.0, -16.0),
        "schedule": [
            {"from_s": 0.0, "velocity_mps": (0.0, 0.0, 0.0)},
            {"from_s": leaves_at_s, "velocity_mps": (3.0, 0.0, 0.0)},
        ],
    }


def guide(scenario):
    brief = MissionBrief.of(scenario)
    made = RouteGuide(brief, ProblemBuilder(brief, SEARCHED), TourShape())
    world = World(scenario)
    made.begin(world.swarm_state(), 0)
    return made, world


def test_a_generated_mission_is_covered_and_every_uas_comes_home():
    scenario = generate_scenario(3, n_uas=2, n_waypoints=8, n_obstacles=3)
    flight = rollout(scenario, MilpMpc(SEARCHED), seed=0)
    assert accomplished(flight)
    assert not flight.breaches
    assert not any(decision.fallback for decision in flight.decisions)


def test_what_the_moving_obstacle_is_going_to_do_changes_no_order():
    soon, late = (mission(PLACES, STARTS, moving_obstacles=[parked(t)]) for t in (1.0, 90.0))
    one, other = guide(soon)[0].order, guide(late)[0].order
    assert [r.tolist() for r in one.routes] == [r.tolist() for r in other.routes]


def test_a_lost_uass_waypoints_go_to_the_others():
    made, world = guide(mission(PLACES, STARTS))
    assert len(made.order.routes[1])
    seen = world.swarm_state()
    status = seen.status.copy()
    status[1] = LOST
    made.update(dataclasses.replace(seen, status=status))
    assert len(made.order.routes[1]) == 0
    assert sorted(made.order.routes[0]) == list(range(len(PLACES)))


def test_a_blocked_place_is_left_aside_and_covered_once_it_opens():
    scenario = mission(PLACES, STARTS, moving_obstacles=[parked(25.0)])
    seen = World(scenario).swarm_state()
    (blocked,) = ProblemBuilder(MissionBrief.of(scenario), SEARCHED).blocked_waypoints(seen)
    assert blocked == len(PLACES) - 1
    flight = rollout(scenario, MilpMpc(SEARCHED), seed=0)
    assert accomplished(flight)
    everything = np.flatnonzero(flight.covered == len(PLACES))
    assert everything[0] * scenario.dt_s > 25.0
