"""When no plan comes, the last one's backup trajectory is flown; no UAS touches anything."""

import dataclasses

import numpy as np
import pytest
from practice_missions import fly, mission, planner
from toy_problems import flown
from uas_coverage_baselines.milp_mpc import moving_horizon as planner_module
from uas_coverage_baselines.milp_mpc.fallback.reasons import Reason
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble

from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Velocity, Wrench

decide_in_earnest = planner_module.decide


class RoughDecisions:
    """Plans out of the blue: wild flights that hold by our own geometry, or none.

    What the planner does with plans does not depend on how good they are, so that these stand in
    for the solver's: they come in a millisecond, and more of them lead towards walls.
    """

    def __init__(self, refused, seed=0):
        self.refused, self.draw, self.calls = refused, np.random.default_rng(seed), 0

    def __call__(self, problem, previous, dt_s, effort, **rest):
        self.calls += 1
        if self.refused(self.calls - 1):
            return Reason.NO_TIME
        for _ in range(12):
            plan = self._wild(problem, dt_s)
            if first_trouble(problem, plan) is None:
                return plan
        return Reason.NO_PLAN

    def _wild(self, problem, dt_s):
        flights = []
        for vehicle, x0 in zip(problem.vehicles, problem.x0, strict=True):
            ways = self.draw.uniform((-12.0, -12.0, -2.5), (12.0, 12.0, 1.5), (2, 3))
            turn = self.draw.integers(1, problem.horizon)
            commands = np.repeat(ways, [turn, problem.horizon - turn], axis=0)
            flights.append(flown(vehicle, x0, commands, dt_s))
        x, u = (np.array([flight[k] for flight in flights]) for k in range(2))
        covers = np.zeros((*u.shape[:2], problem.n_scenario_waypoints), bool)
        return Plan(problem.names, x, u, covers, 0.0, -np.inf)


def flown_with(monkeypatch, scenario, decide, steps, dynamics="lpv"):
    """Positions, decisions and outcomes of a flight whose plans come from `decide`."""
    monkeypatch.setattr(planner_module, "decide", decide)
    world, made = World(scenario, dynamics=dynamics), planner(scenario)
    positions, decisions, outcomes = [], [], []
    for _ in range(steps):
        if world.done:
            break
        commands = made.act(world.swarm_state())
        assert set(commands) == set(world.active)
        decisions.append(made.last_decision)
        outcomes.append(world.step(commands))
        positions.append(world.state.x[:, :3].copy())
    return np.array(positions), decisions, np.array(outcomes)


PATTERNS = {
    "never": lambda call: False,
    "now_and_then": lambda call: call % 7 in (2, 3),
    "mostly": lambda call: call % 5 != 0,
    "at_random": lambda call: np.random.default_rng(call).random() < 0.5,
    "all_after_ten": lambda call: call >= 10,
    "first_ones": lambda call: call < 6,
}


@pytest.mark.parametrize("pattern", PATTERNS)
@pytest.mark.parametrize("name", ["open_field", "village", "corridor"])
def test_no_uas_touches_anything_however_often_there_is_no_plan(monkeypatch, name, pattern):
    scenario = load_scenario(name)
    decide = RoughDecisions(PATTERNS[pattern], seed=3)
    positions, decisions, outcomes = flown_with(monkeypatch, scenario, decide, 50)
    assert (outcomes["contact"] == 0).all()
    for call, decision in enumerate(decisions):
        if PATTERNS[pattern](call):
            assert decision.fallback
            assert decision.reason == Reason.NO_TIME
            assert decision.mip_gap is None
    moved_m = np.linalg.norm(positions[-1] - positions[0], axis=1).max()
    assert moved_m > 10.0, "a flight that stays at home proves nothing"


def test_when_plans_stop_coming_every_uas_ends_in_a_hover(monkeypatch):
    decide = RoughDecisions(PATTERNS["all_after_ten"], seed=5)
    # before they follow routes, after 30 s without progress
    positions, decisions, _ = flown_with(monkeypatch, load_scenario("village"), decide, 36)
    assert all(decision.fallback for decision in decisions[10:])
    assert np.abs(np.diff(positions[-5:], axis=0)).max() < 0.05
    assert (np.ptp(positions[:12], axis=0).max(axis=1) > 1.0).any()


def test_a_fallback_flies_what_it_says(monkeypatch):
    decide = RoughDecisions(PATTERNS["mostly"], seed=1)
    scenario = load_scenario("open_field")
    positions, decisions, _ = flown_with(monkeypatch, scenario, decide, 30)
    names = [uas.name for uas in scenario.uas]
    followed = 0
    for now, decision in enumerate(decisions):
        for row, name in enumerate(names):
            path = decision.predicted_m[name]
            if len(path) > 1:
                assert path[1] == pytest.approx(positions[now][row], abs=1e-6)
                followed += decision.fallback
    assert followed > 20


def test_when_plans_stop_coming_the_nonlinear_plant_comes_to_a_hover_too(monkeypatch):
    decide = RoughDecisions(PATTERNS["all_after_ten"], seed=0)
    positions, _, outcomes = flown_with(
        monkeypatch, load_scenario("open_field"), decide, 36, dynamics="nonlinear"
    )
    assert (outcomes["contact"] == 0).all()
    assert np.abs(np.diff(positions[-5:], axis=0)).max() < 0.1


def test_a_backup_trajectory_that_a_moving_obstacle_has_come_to_cross_is_not_flown(monkeypatch):
    balloon = {
        "name": "balloon",
        "radius_m": 5.0,
        "height_m": 10.0,
        "safe_distance_m": 3.0,
        "start_m": (150.0, 150.0, -20.0),
        "schedule": [{"from_s": 0.0, "velocity_mps": (0.0, 0.0, 0.0)}],
    }
    scenario = mission(
        [((190.0, 10.0, -8.0), 8.0)], [(50.0, 50.0, -20.0)], moving_obstacles=[balloon]
    )
    world, made = World(scenario), planner(scenario)
    monkeypatch.setattr(planner_module, "decide", AlwaysNorth())
    for _ in range(3):
        world.step(made.act(world.swarm_state()))
    monkeypatch.setattr(planner_module, "decide", lambda *args, **rest: Reason.NO_PLAN)
    ahead_m = world.state.x[0, :3] + np.array([25.0, 0.0, 0.0])
    seen = dataclasses.replace(
        world.swarm_state(),
        moving_position_m=ahead_m[None],
        moving_velocity_mps=np.array([[-2.0, 0.0, 0.0]]),
    )
    made.act(seen)
    assert made.last_decision.fallback
    path = made.last_decision.predicted_m["uas_1"]
    balloon_m = ahead_m + np.arange(len(path))[:, None] * np.array([-2.0, 0.0, 0.0])
    level_m = np.hypot(*(path - balloon_m)[:, :2].T)
    clear_m = np.maximum(level_m - 5.0, np.abs((path - balloon_m)[:, 2]) - 5.0)
    assert clear_m.min() > 0.36, "braking or getting out of the way, nothing is touched"


class AlwaysNorth(RoughDecisions):
    """Plans that lead straight north at full speed."""

    def __init__(self):
        super().__init__(refused=PATTERNS["never"])

    def _wild(self, problem, dt_s):
        commands = np.tile((12.0, 0.0, 0.0), (problem.horizon, 1))
        x, u = flown(problem.vehicles[0], problem.x0[0], commands, dt_s)
        covers = np.zeros((1, len(u), problem.n_scenario_waypoints), bool)
        return Plan(problem.names, x[None], u[None], covers, 0.0, -np.inf)


@pytest.mark.parametrize("limit_s", [1e-3, 0.05])
def test_a_planner_without_time_still_commands_every_uas(limit_s):
    scenario = load_scenario("village")
    world = World(scenario)
    made = planner(scenario, time_limit_s=limit_s)
    for _ in range(3):
        commands = made.act(world.swarm_state())
        assert set(commands) == set(world.active)
        outcome = world.step(commands)
        assert (outcome["contact"] == 0).all()


def test_without_any_plan_ever_every_uas_hovers_at_the_start(monkeypatch):
    scenario = load_scenario("village")
    positions, decisions, outcomes = flown_with(
        monkeypatch, scenario, lambda *args, **rest: Reason.NO_PLAN, 25
    )
    homes = np.array([uas.start_m for uas in scenario.uas])
    assert np.abs(positions - homes).max() < 0.1
    assert all(decision.fallback for decision in decisions)
    assert (outcomes["contact"] == 0).all()


def test_a_hover_command_names_the_altitude_and_no_speed(monkeypatch):
    monkeypatch.setattr(planner_module, "decide", lambda *args, **rest: Reason.NO_PLAN)
    scenario = load_scenario("open_field")
    commands = planner(scenario).act(World(scenario).swarm_state())
    assert set(commands.values()) == {Velocity(0.0, 0.0, 1.0, mode="covering")}


def test_a_plan_without_a_backup_trajectory_is_not_flown(monkeypatch):
    monkeypatch.setattr(planner_module, "backup_trajectory", lambda *args, **rest: None)
    scenario = load_scenario("open_field")
    made = planner(scenario)
    commands = made.act(World(scenario).swarm_state())
    assert made.last_decision.fallback
    assert made.last_decision.reason == Reason.NO_BACKUP
    assert all(isinstance(command, Velocity) for command in commands.values())


@pytest.fixture(scope="module")
def garden():
    return mission(
        [((80.0, 50.0, -8.0), 8.0), ((75.0, 90.0, -6.0), 8.0), ((45.0, 95.0, -8.0), 10.0)],
        [(50.0, 50.0, -1.0), (50.0, 70.0, -1.0)],
    )


def test_decisions_that_fail_in_between_do_not_end_a_mission(monkeypatch, garden):
    calls = iter(range(1000))

    def decide(*args, **rest):
        if PATTERNS["now_and_then"](next(calls)):
            return Reason.NO_TIME
        return decide_in_earnest(*args, **rest)

    _, decisions, outcomes = flown_with(monkeypatch, garden, decide, 60)
    refused = [PATTERNS["now_and_then"](call) for call in range(len(decisions))]
    assert [decision.fallback for decision in decisions] == refused
    assert (outcomes["contact"] == 0).all()
    assert outcomes["newly_covered"].sum() == 3
    assert outcomes["landed"].sum() == 2


def test_a_plan_is_flown_as_a_wrench_and_tells_where_it_leads(garden):
    world, made = World(garden), planner(garden)
    commands = made.act(world.swarm_state())
    assert all(isinstance(command, Wrench) for command in commands.values())
    assert not made.last_decision.fallback
    gap = made.last_decision.mip_gap
    assert gap is None or gap >= 0.0
    for row, name in enumerate(world.names):
        path = made.last_decision.predicted_m[name]
        assert path.shape == (9, 3)
        assert path[0] == pytest.approx(garden.uas[row].start_m)


def test_a_reset_forgets_the_last_mission(garden):
    world, made = World(garden), planner(garden)
    first = made.act(world.swarm_state())
    fly(world, made, 1)
    world.reset()
    made.reset(MissionBrief.of(garden), 0)
    assert made.last_decision is None
    assert made.act(world.swarm_state()) == first


def test_a_decision_is_told_what_is_left_of_the_backup_and_when_its_time_began(monkeypatch, garden):
    told = []

    def decide(problem, *rest, backup, began, **others):
        told.append((problem, backup, began))
        return decide_in_earnest(problem, *rest, backup=backup, began=began, **others)

    monkeypatch.setattr(planner_module, "decide", decide)
    world, made = World(garden), planner(garden)
    fly(world, made, 2)
    (_, nothing, first), (problem, out, second) = told
    assert nothing is None
    assert first < second
    assert out.x[:, 0] == pytest.approx(problem.x0, abs=1e-6)
