"""Planners inside of environments: their commands as actions, for imitation."""

import copy
from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
import pytest
from own_actions import CLIMB_RATE, heading_and_speed
from practice_grounds import practice_ground

from uas_coverage_env import (
    Acceleration,
    Command,
    GoTo,
    Velocity,
    World,
    Wrench,
    load_planner,
    load_scenario,
    rollout,
    uas_coverage_v0,
)
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.scenario import Scenario

FULL = practice_ground(n_uas=2, tower=True, n_moving=1)


class Scripted:
    """A planner that gives one command after another, the same to all."""

    def __init__(self, *commands: Command) -> None:
        self.commands = commands

    def reset(self, brief, seed):
        """Nothing is drawn."""

    def act(self, swarm) -> Mapping[str, Command]:
        command = self.commands[swarm.step % len(self.commands)]
        return {name: command for name in swarm.active}


def flown_inside(env: Any, planner: Any, **options: Any) -> np.ndarray:
    """The states of a flight by a planner inside of an environment."""
    env.reset(seed=0)
    planner.reset(env.brief, 0)
    states = [env.swarm_state().x]
    while env.agents:
        env.step(env.actions_of(planner.act(env.swarm_state()), **options))
        states.append(env.swarm_state().x)
    return np.array(states)


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize("helped", [False, True])
@pytest.mark.parametrize("name", ["nearest-waypoint", "lawnmower"])
def test_a_planner_flies_velocity_actions_as_it_flies_by_itself(name, helped, dynamics):
    settings = {"dynamics": dynamics, "return_mode": helped, "safety_filter": helped}
    flight = rollout(FULL, name, **settings)
    env = uas_coverage_v0.parallel_env(FULL, action="velocity", **settings)
    inside = flown_inside(env, load_planner(name))
    assert inside.shape == flight.x.shape
    np.testing.assert_allclose(inside, flight.x, atol=1e-4)
    assert (~env.swarm_state().uncovered).sum() == flight.covered[-1] == 3


def test_a_planner_flies_waypoint_actions_as_it_flies_by_itself_to_the_bit():
    flight = rollout(FULL, "nearest-waypoint")
    assistants = {"return_mode": flight.return_mode, "safety_filter": flight.safety_filter}
    env = uas_coverage_v0.parallel_env(FULL, action="waypoint", **assistants)
    inside = flown_inside(env, load_planner("nearest-waypoint"))
    np.testing.assert_array_equal(inside, flight.x)


SCRIPTS = {
    "velocity": (Velocity(3.0, -2.0, 12.0), Velocity(-20.0, 15.0, 8.0), Velocity(0.0, 0.0, 30.0)),
    "acceleration": (Acceleration(0.8, -1.0, -0.5), Acceleration(-0.8, 1.0, 0.4)),
    "wrench": (Wrench(1.0, 1e-4, 0.0, 0.0), Wrench(99.0, -1e-4, 0.0, 0.0), Wrench(-1.0, 0, 0, 0)),
}


@pytest.mark.parametrize("action", SCRIPTS)
def test_every_kind_flies_the_commands_that_it_is_made_for(action):
    script = Scripted(*SCRIPTS[action])
    flight = rollout(FULL, script, max_steps=8)
    env = uas_coverage_v0.parallel_env(FULL, action=action, max_cycles=8)
    np.testing.assert_allclose(flown_inside(env, script), flight.x, atol=1e-4)


def test_an_own_kind_flies_the_commands_that_it_says():
    script = Scripted(*SCRIPTS["velocity"][:2])
    flight = rollout(FULL, script, max_steps=8)
    env = uas_coverage_v0.parallel_env(FULL, action=heading_and_speed(5.0), max_cycles=8)
    np.testing.assert_allclose(flown_inside(env, script, clip=True), flight.x, atol=1e-3)


def test_an_action_is_one_of_the_space():
    for action, commands in SCRIPTS.items():
        env = uas_coverage_v0.parallel_env(FULL, action=action)
        env.reset()
        for command in commands:
            assert env.action_space("uas_1").contains(env.action_of("uas_1", command))
    env = uas_coverage_v0.parallel_env(FULL, action="waypoint")
    env.reset()
    assert env.action_space("uas_1").contains(env.action_of("uas_1", GoTo(2)))


def test_an_expert_is_asked_on_the_states_that_another_policy_visits():
    env = uas_coverage_v0.parallel_env(FULL, action="velocity")
    env.reset(seed=0)
    expert: Any = load_planner("nearest-waypoint")
    expert.reset(env.brief, 0)
    rng = np.random.default_rng(0)
    world = World(FULL)
    for _ in range(12):
        swarm = env.swarm_state()
        commands = expert.act(swarm)
        labels = env.actions_of(commands, clip=True)
        # what the labels fly from here is what the expert's commands fly from here
        world.state.x[:], world.state.uas["reference_mps"][:] = swarm.x, swarm.reference_mps
        world.state.uas["status"][:], world.state.uas["departed"][:] = swarm.status, swarm.departed
        world.state.uncovered[:], world.state.step[0] = swarm.uncovered, swarm.step
        world.step(commands)
        student = copy.deepcopy(env)
        student.step(labels)
        np.testing.assert_allclose(student.swarm_state().x, world.state.x, atol=1e-5)
        env.step({agent: rng.uniform(-0.5, 0.5, 3) for agent in env.agents})
        assert env.agents == ["uas_1", "uas_2"]


def test_the_swarm_as_one_agent_and_many_missions_fly_the_same_actions():
    many: Any = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        scenario=[FULL, practice_ground(n_uas=1)],
        action="velocity",
    )
    single = gymnasium.make("UASCoverage-v0", scenario=FULL, action="velocity")
    many.reset(seed=0, options={"scenario": [0, 1]})
    single.reset(seed=0)
    alone: Any = single.unwrapped
    planners: list[Any] = [load_planner("nearest-waypoint") for _ in range(3)]
    for planner, brief in zip(planners, (alone.brief, *many.call("brief")), strict=True):
        planner.reset(brief, 0)
    for _ in range(6):
        joint = alone.actions_of(planners[0].act(alone.swarm_state()))
        states = many.call("swarm_state")
        commands = [p.act(state) for p, state in zip(planners[1:], states, strict=True)]
        actions = many.actions_of(commands)
        assert single.action_space.contains(joint)
        assert many.action_space.contains(actions)
        np.testing.assert_array_equal(actions[0], joint)
        single.step(joint)
        many.step(actions)
    ours, theirs = alone.swarm_state().x, many.call("swarm_state")
    np.testing.assert_array_equal(theirs[0].x, ours)
    flight = rollout(practice_ground(n_uas=1), "nearest-waypoint", **OFF, max_steps=6)
    np.testing.assert_allclose(theirs[1].x, flight.x[-1], atol=1e-4)


OFF = {"return_mode": False, "safety_filter": False}


def test_a_planner_flies_turn_by_turn():
    turns = uas_coverage_v0.env(FULL, action="waypoint", max_cycles=8)
    turns.reset(seed=0)
    planner: Any = load_planner("nearest-waypoint")
    planner.reset(turns.brief, 0)
    commands: Mapping[str, Command] = {}
    for agent in turns.agent_iter():
        *_, terminated, truncated, _ = turns.last()
        if terminated or truncated:
            turns.step(None)
            continue
        if agent == "uas_1":
            commands = planner.act(turns.swarm_state())
        turns.step(turns.action_of(agent, commands[agent]))
    flight = rollout(FULL, "nearest-waypoint", **OFF, max_steps=8)
    np.testing.assert_array_equal(turns.swarm_state().x, flight.x[-1])


def test_lanes_that_have_ended_take_no_commands():
    batch = CoverageBatch(2, practice_ground(), action="waypoint", max_cycles=1)
    batch.reset(0)
    batch.step(batch.actions_of([{"uas_1": GoTo(0), "uas_2": GoTo(1)}] * 2))
    with pytest.raises(ValueError, match="uas_2 has no command"):
        batch.actions_of([{"uas_1": GoTo(0)}, {"uas_1": GoTo(0)}])
    with pytest.raises(ValueError, match="commands for 1 of 2 environments"):
        batch.actions_of([{}])


def wide(n_waypoints: int = 20) -> Scenario:
    points = [(10.0 + 9.0 * k, 30.0, -10.0) for k in range(n_waypoints)]
    return practice_ground(waypoints_m=points)


@pytest.mark.parametrize(
    ("scenario", "action", "command", "reason"),
    [
        (FULL, "velocity", Wrench(1.0, 0.0, 0.0, 0.0), "it flies a Velocity, or a GoTo as guid"),
        (FULL, "velocity", Velocity(1.0, 0.0, 1.0), "altitude_m is 1, .* from 1.5 to 38.5; clip"),
        (FULL, "velocity", GoTo(None), "it has not left its start"),
        (FULL, "velocity", Velocity(0.0, 0.0, 10.0, "return"), "it has not left its start"),
        (FULL, "acceleration", Acceleration(9.0, 0.0, 0.0), "north_mps2 is 9, .* from -4.2"),
        (FULL, "acceleration", GoTo(0), "it flies an Acceleration"),
        (FULL, "wrench", Velocity(1.0, 0.0, 10.0), "it flies a Wrench"),
        (FULL, "waypoint", Velocity(1.0, 0.0, 10.0), "it flies a GoTo"),
        (FULL, "waypoint", GoTo(9), "command of uas_1: waypoint is 9; give a whole number"),
        (wide(), "waypoint", GoTo(19), "waypoint 19 is not among the 12 nearest open ones"),
        (FULL, CLIMB_RATE, Velocity(1.0, 0.0, 10.0), "the kind has no `express`"),
        (FULL, "velocity", "north", "give a Velocity, Acceleration, Wrench or GoTo"),
        (FULL, "velocity", Velocity(np.nan, 0.0, 10.0), "give a finite number"),
    ],
)
def test_what_a_kind_cannot_express_is_refused_with_the_reason(scenario, action, command, reason):
    env = uas_coverage_v0.parallel_env(scenario, action=action)
    env.reset()
    with pytest.raises(ValueError, match=reason) as error:
        env.action_of("uas_1", command)
    assert "\n" not in str(error.value)
    assert "uas_1" in str(error.value)


def test_a_waypoint_that_is_covered_is_no_choice():
    env = uas_coverage_v0.parallel_env(FULL, action="waypoint")
    env.reset()
    while env.swarm_state().uncovered[0]:
        env.step(env.actions_of(dict.fromkeys(env.agents, GoTo(0))))
    with pytest.raises(ValueError, match="waypoint 0 is covered already"):
        env.action_of("uas_1", GoTo(0))


def test_only_agents_that_fly_are_given_actions():
    env = uas_coverage_v0.parallel_env(FULL, action="waypoint")
    env.reset()
    with pytest.raises(ValueError, match="there is no agent 'uas_9': uas_1, uas_2"):
        env.action_of("uas_9", GoTo(0))
    env.step(env.actions_of({"uas_1": GoTo(None), "uas_2": GoTo(0)}))
    assert env.agents == ["uas_2"]
    with pytest.raises(ValueError, match="uas_1 does not fly any more"):
        env.action_of("uas_1", GoTo(0))


def test_numbers_beyond_a_range_are_clipped_where_that_is_asked_for():
    env = uas_coverage_v0.parallel_env(FULL, action="velocity")
    env.reset()
    low = env.action_of("uas_1", Velocity(1.2, 0.0, 0.0), clip=True)
    assert low.tolist() == pytest.approx([0.1, 0.0, -1.0])
    assert low.dtype == np.float32


def test_a_planner_comes_home_in_a_shipped_scenario():
    scenario = load_scenario("open_field")
    flight = rollout(scenario, "nearest-waypoint")
    settings = {"return_mode": flight.return_mode, "safety_filter": flight.safety_filter}
    env = uas_coverage_v0.parallel_env(scenario, **settings)
    inside = flown_inside(env, load_planner("nearest-waypoint"), clip=True)
    assert inside.shape == flight.x.shape
    np.testing.assert_allclose(inside[:-1], flight.x[:-1], atol=1e-3)
