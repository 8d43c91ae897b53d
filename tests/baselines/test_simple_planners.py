import dataclasses
from itertools import chain
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from uas_coverage_baselines.hover import Hover, HoverOptions
from uas_coverage_baselines.lawnmower import Lawnmower, back_and_forth, plan_runs
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.random_walk import RandomWalk, RandomWalkOptions

from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.flight import Assistants, AssistedOptions, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario, generate_scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo


@pytest.fixture(scope="module")
def village() -> Scenario:
    return load_scenario("village")


@pytest.fixture(scope="module")
def at_start(village):
    return World(village).swarm_state()


def changed(scenario, **fields):
    return parse(scenario.model_dump(by_alias=True) | fields, Scenario, "changed")


def leaving(swarm, *waypoints):
    """The swarm with these waypoints left to cover."""
    uncovered = np.zeros_like(swarm.uncovered)
    uncovered[list(waypoints)] = True
    return dataclasses.replace(swarm, uncovered=uncovered)


def distances_m(scenario, swarm, name):
    places_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    return np.linalg.norm(places_m - swarm.x[swarm.names.index(name), :3], axis=1)


def ready(planner, scenario) -> Any:
    planner.reset(MissionBrief.of(scenario), 0)
    return planner


def test_nearest_waypoint_sends_each_uas_to_the_nearest_one_that_no_other_flies_to(
    village, at_start
):
    commands = ready(NearestWaypoint(), village).act(at_start)
    first, second = (commands[name].waypoint for name in ("uas_1", "uas_2"))
    assert first == distances_m(village, at_start, "uas_1").argmin()
    assert second != first
    others_m = distances_m(village, at_start, "uas_2")
    others_m[first] = np.inf
    assert second == others_m.argmin()


@pytest.mark.parametrize("planner_class", [NearestWaypoint, Lawnmower])
def test_a_target_is_kept_until_it_is_covered(planner_class, village, at_start):
    planner = ready(planner_class(), village)
    first = planner.act(at_start)["uas_1"].waypoint
    x = at_start.x.copy()
    x[0, :3] = village.waypoints[(first + 20) % 49].position_m
    elsewhere = dataclasses.replace(at_start, x=x)
    assert planner.act(elsewhere)["uas_1"].waypoint == first
    uncovered = at_start.uncovered.copy()
    uncovered[first] = False
    assert planner.act(dataclasses.replace(at_start, uncovered=uncovered))["uas_1"] != GoTo(first)


@pytest.mark.parametrize("planner_class", [NearestWaypoint, Lawnmower, RandomWalk])
def test_every_uas_flies_home_when_everything_is_covered(planner_class, village, at_start):
    commands = ready(planner_class(), village).act(leaving(at_start))
    assert commands == {"uas_1": GoTo(None), "uas_2": GoTo(None)}


@pytest.mark.parametrize("planner_class", [NearestWaypoint, Lawnmower])
def test_the_last_waypoint_is_shared_as_its_uas_may_be_called_home(
    planner_class, village, at_start
):
    commands = ready(planner_class(), village).act(leaving(at_start, 5))
    assert {command.waypoint for command in commands.values()} == {5}


@pytest.mark.parametrize("planner_class", [NearestWaypoint, Lawnmower])
def test_a_waypoint_under_the_helicopter_waits_until_nothing_else_is_left(
    planner_class, village, at_start
):
    helicopter_m = village.moving_positions(0.0)[0]
    places_m = np.array([waypoint.position_m for waypoint in village.waypoints])
    blocked = int(np.linalg.norm(places_m - helicopter_m, axis=1).argmin())
    planner = ready(planner_class(), village)
    free = (blocked + 10) % 49
    commands = planner.act(leaving(at_start, blocked, free))
    assert {command.waypoint for command in commands.values()} == {free}
    gone = dataclasses.replace(at_start, moving_position_m=village.moving_positions(180.0))
    commands = planner.act(leaving(gone, blocked))
    assert {command.waypoint for command in commands.values()} == {blocked}


@pytest.mark.parametrize(("columns", "rows"), [(7, 7), (5, 3), (2, 9), (6, 1), (1, 1)])
def test_the_order_back_and_forth_is_as_short_as_a_grid_allows(columns, rows):
    grid = np.array([[40.0 * i, 40.0 * j, -10.0] for i in range(columns) for j in range(rows)])
    shuffled = np.random.default_rng(columns).permutation(grid)
    order = back_and_forth(shuffled)
    assert sorted(order) == list(range(len(grid)))
    legs_m = np.linalg.norm(np.diff(shuffled[order], axis=0), axis=1)
    np.testing.assert_allclose(legs_m, 40.0)


@settings(max_examples=20, deadline=None, derandomize=True)
@given(seed=st.integers(0, 1000), n_uas=st.integers(1, 4), n_waypoints=st.integers(1, 40))
def test_runs_share_out_every_waypoint_once(seed, n_uas, n_waypoints):
    scenario = generate_scenario(seed, n_uas=n_uas, n_waypoints=n_waypoints, n_obstacles=0)
    order = list(np.random.default_rng(seed).permutation(n_waypoints))
    runs = plan_runs(MissionBrief.of(scenario), order)
    assert len(runs) == n_uas
    assert sorted(chain.from_iterable(runs)) == list(range(n_waypoints))


def test_runs_are_of_about_equal_time_where_charge_allows(village):
    full = [{**uas.model_dump(), "soc_0": 1.0} for uas in village.uas]
    order = back_and_forth(np.array([waypoint.position_m for waypoint in village.waypoints]))
    first, second = map(len, plan_runs(MissionBrief.of(changed(village, uas=full)), order))
    assert 49 / 3 < first < 2 * 49 / 3
    assert first + second == 49


def test_a_uas_with_little_charge_gets_a_short_run(village):
    order = list(range(49))
    weak = [village.uas[0].model_dump(), {**village.uas[1].model_dump(), "soc_0": 0.3}]
    lengths = [len(run) for run in plan_runs(MissionBrief.of(changed(village, uas=weak)), order)]
    assert lengths[1] < 10 < lengths[0]


def test_charges_that_are_too_little_together_still_give_every_uas_a_run(village):
    weak = [{**uas.model_dump(), "soc_0": 0.28} for uas in village.uas]
    brief = MissionBrief.of(changed(village, uas=weak))
    lengths = [len(run) for run in plan_runs(brief, list(range(49)))]
    assert sum(lengths) == 49
    assert min(lengths) > 10


def test_lawnmower_flies_its_own_run_and_helps_when_it_is_done(village, at_start):
    planner = ready(Lawnmower(), village)
    order = back_and_forth(np.array([waypoint.position_m for waypoint in village.waypoints]))
    own, others = plan_runs(MissionBrief.of(village), order)
    assert planner.act(at_start)["uas_1"].waypoint == own[0]
    planner = ready(Lawnmower(), village)
    assert planner.act(leaving(at_start, *others))["uas_1"].waypoint in others


def test_hover_holds_every_uas_above_its_start(village, at_start):
    commands = ready(Hover(HoverOptions(climb_m=7.0)), village).act(at_start)
    assert {(c.north_mps, c.east_mps, c.altitude_m) for c in commands.values()} == {(0.0, 0.0, 8.0)}
    assert not hasattr(Hover(), "assistants"), "a baseline that fails is not helped"


def test_hover_covers_nothing_and_is_lost_with_its_battery():
    scenario = load_scenario("open_field")
    weak = [{**uas.model_dump(), "soc_0": 0.3} for uas in scenario.uas]
    flight = rollout(changed(scenario, uas=weak), "hover")
    assert {violation.kind for violation in flight.violations} == {"battery"}
    assert not accomplished(flight)
    still_m = np.abs(flight.x[5:, :, :2] - flight.x[0, :, :2])
    assert still_m.max() < 0.5


def test_a_random_walk_is_repeated_by_its_seed_alone(village, at_start):
    def walk(seed):
        planner = RandomWalk()
        planner.reset(MissionBrief.of(village), seed)
        return [planner.act(dataclasses.replace(at_start, step=k)) for k in range(30)]

    assert walk(1) == walk(1)
    assert walk(1) != walk(2)


def test_a_random_walk_holds_its_lots_and_keeps_to_its_speed_and_the_fence(village, at_start):
    planner: Any = RandomWalk(RandomWalkOptions(hold_s=4.0, speed=0.5))
    planner.reset(MissionBrief.of(village), 3)
    drawn = [planner.act(dataclasses.replace(at_start, step=k))["uas_1"] for k in range(40)]
    assert all(len(set(drawn[k : k + 4])) == 1 for k in range(0, 40, 4))
    assert len(set(drawn)) == 10
    fastest_mps = village.vehicles[0].limits.v_xy_max_mps
    for command in drawn:
        speed_mps = np.hypot(command.north_mps, command.east_mps)
        assert speed_mps == pytest.approx(0.5 * fastest_mps)
        assert 0.0 < command.altitude_m < 50.0


@pytest.mark.parametrize("planner_class", [NearestWaypoint, Lawnmower, RandomWalk])
def test_the_assistants_can_be_taken_away_one_by_one(planner_class):
    assert planner_class().assistants == Assistants(return_mode=True, safety_filter=True)
    options = planner_class.Options(filter=False)
    assert planner_class(options).assistants == Assistants(return_mode=True, safety_filter=False)
    options = AssistedOptions(return_mode=False)
    assert options.assistants == Assistants(return_mode=False, safety_filter=True)


@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower"])
def test_planners_that_go_from_waypoint_to_waypoint_accomplish_the_open_field(planner):
    flight = rollout("open_field", planner)
    assert accomplished(flight)
    assert flight.breaches == 0


@settings(max_examples=4, deadline=None, derandomize=True)
@given(seed=st.integers(0, 10_000), planner=st.sampled_from(["nearest-waypoint", "lawnmower"]))
def test_generated_missions_end_without_a_violation(seed, planner):
    scenario = generate_scenario(seed, n_uas=2, n_waypoints=12, n_obstacles=4)
    flight = rollout(scenario, planner)
    assert flight.violations == ()
    assert flight.covered[-1] == 12


def test_a_random_walk_with_its_assistants_touches_nothing(village):
    flight = rollout(village, RandomWalk(), seed=1, max_steps=120)
    assert flight.violations == ()


@pytest.mark.slow
@pytest.mark.parametrize("planner", ["nearest-waypoint", "lawnmower"])
def test_the_village_is_covered_and_every_uas_comes_home(village, planner):
    flight = rollout(village, planner)
    assert accomplished(flight)
    assert flight.breaches == 0


@pytest.mark.parametrize("planner", [NearestWaypoint, Lawnmower])
def test_what_the_first_decision_compiles_is_compiled_before_it(planner):
    class Counting(planner):
        acted = 0

        def act(self, swarm):
            Counting.acted += 1
            return super().act(swarm)

    scenario = load_scenario("open_field")
    flights = [rollout(scenario, Counting(), max_steps=3) for _ in range(2)]
    assert [len(flight.decisions) for flight in flights] == [3, 3]
    assert Counting.acted == 1 + 3 + 3, "once in a process, and no more"
    assert np.array_equal(flights[0].x, flights[1].x)
