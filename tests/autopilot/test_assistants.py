"""Return mode, guidance and safety filter, which a step calls through their addresses."""

import copy
import pickle

import numpy as np
import pytest
from numba import njit
from numba.core.errors import TypingError

from uas_coverage_env.autopilot.assist import assist, assistants
from uas_coverage_env.autopilot.guidance import steer
from uas_coverage_env.autopilot.return_mode import call_home
from uas_coverage_env.autopilot.safety import filter_commands
from uas_coverage_env.entities.commands import COMMAND_DTYPE, GO_TO, VELOCITY
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.simulation.flight import fly_still
from uas_coverage_env.simulation.step import advance, begin_step, judge_contacts
from uas_coverage_env.simulation.world import initial_state
from uas_coverage_env.world import WorldState, build_arena
from uas_coverage_env.world.contacts import check_obstacles

SCENARIO = generate_scenario(3, n_uas=3, n_waypoints=20, n_obstacles=10)


def drawn(rng, commands):
    commands["kind"] = VELOCITY
    commands["values"][:, :3] = rng.uniform([-9, -9, 5], [9, 9, 30], (3, 3))


def test_a_uas_that_is_not_asked_for_is_left_out():
    home, guidance, keeper = assistants(True, True)
    assert list(assistants(False, False, goes_to=False)) == []
    assert list(assistants(False, False)) == [guidance]
    assert list(assistants(True, False, goes_to=False)) == [home, guidance]
    assert list(assistants(np.bool_(False), np.bool_(True), goes_to=False)) == [keeper]


def test_what_lies_at_the_addresses_does_what_the_functions_do():
    arena = build_arena(SCENARIO)
    rng = np.random.default_rng(1)
    called, direct = initial_state(SCENARIO), initial_state(SCENARIO)
    commands = np.zeros(3, COMMAND_DTYPE)
    outcome, expected = np.zeros(3, OUTCOME_DTYPE), np.zeros(3, OUTCOME_DTYPE)
    aboard = assistants(True, True)
    n_filtered = n_returning = 0
    for step in range(60):
        drawn(rng, commands)
        if step % 3 == 0:
            commands["kind"][0], commands["values"][0, 0] = GO_TO, step % 20
        if step == 40:
            called.uncovered[:] = direct.uncovered[:] = False
        advance(arena, called, commands, False, aboard, None, outcome)
        begin_step(direct, commands, expected)
        call_home(arena, direct, False, expected)
        steer(arena, direct, False, expected)
        filter_commands(arena, direct, False, expected)
        fly_still(arena, direct, expected)
        check_obstacles(arena, direct, expected)
        judge_contacts(arena, direct, False, expected)
        assert outcome.tobytes() == expected.tobytes()
        for left, right in zip(called, direct, strict=True):
            assert np.array_equal(left, right)
        n_filtered += int(outcome["filtered"].sum())
        n_returning += int(outcome["returning"].sum())
    assert n_filtered > 0
    assert n_returning > 0


def test_a_step_with_guidance_left_out_is_the_same_step():
    arena = build_arena(SCENARIO)
    rng = np.random.default_rng(1)
    states: list[WorldState] = [initial_state(SCENARIO) for _ in range(2)]
    commands = np.zeros(3, COMMAND_DTYPE)
    outcomes = [np.zeros(3, OUTCOME_DTYPE) for _ in range(2)]
    choices = [assistants(False, False, goes_to=goes_to) for goes_to in (False, True)]
    for _ in range(40):
        drawn(rng, commands)
        for state, outcome, aboard in zip(states, outcomes, choices, strict=True):
            advance(arena, state, commands, False, aboard, None, outcome)
        assert outcomes[0].tobytes() == outcomes[1].tobytes()
        for left, right in zip(*states, strict=True):
            assert np.array_equal(left, right)
    assert states[0].step[0] == 40


def test_a_call_with_other_arguments_is_refused_when_it_is_compiled():
    @njit
    def call(assistant, arena, state, outcome):
        assist(assistant, arena, state, False, outcome)

    arena, state = build_arena(SCENARIO), initial_state(SCENARIO)
    outcome = np.zeros((3, 2), OUTCOME_DTYPE)[:, 0]
    with pytest.raises(TypingError, match="a kernel here takes"):
        call(assistants(False, True)[-1], arena, state, outcome)


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda w: pickle.loads(pickle.dumps(w))])
def test_addresses_do_not_travel_with_a_world(duplicate):
    world = World(SCENARIO, return_mode=True, safety_filter=True)
    rng = np.random.default_rng(2)
    commands = np.zeros(3, COMMAND_DTYPE)
    drawn(rng, commands)
    world.step(commands)
    assert len(world._assistants) == 3
    twin = duplicate(world)
    assert len(twin._assistants) == 0
    drawn(rng, commands)
    assert world.step(commands).tobytes() == twin.step(commands).tobytes()
