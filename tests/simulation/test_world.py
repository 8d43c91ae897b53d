import copy
import json
import os
import pickle
import subprocess
import sys

import numpy as np
import pytest
from small_worlds import meadow, mover

from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo, SwarmState, Velocity, Wrench

SHORT_FLIGHT = """
import sys
import numpy as np
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Velocity, Acceleration, GoTo, Wrench

def fly(n_steps, **switches):
    world = World(load_scenario("village"), **switches)
    parts = []
    for k in range(n_steps):
        kinds = (
            Velocity(6.0, 4.0 + k, 9.0), Acceleration(0.5, -0.2, -0.1), GoTo(14 + k),
            Wrench(0.4, 0.001, -0.002, 0.0), GoTo(None),
        )
        world.step({"uas_1": kinds[k % 5], "uas_2": GoTo(21)})
        parts.append(world.state.x.copy())
    return np.array(parts)
"""


def short_flight(**switches):
    namespace = {}
    exec(SHORT_FLIGHT, namespace)
    return namespace["fly"](4, **switches)


def test_the_same_commands_give_the_same_flight_to_the_last_bit():
    switches = {"return_mode": True, "safety_filter": True}
    np.testing.assert_array_equal(short_flight(**switches), short_flight(**switches))


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_plain_python_flies_the_same_as_compiled_code(dynamics):
    script = SHORT_FLIGHT + (
        f"flown = fly(4, dynamics={dynamics!r}, return_mode=True, safety_filter=True)\n"
        "sys.stdout.buffer.write(flown.tobytes())\n"
    )
    plain = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        timeout=120,
        check=False,
    )
    assert plain.returncode == 0, plain.stderr.decode()
    flown = np.frombuffer(plain.stdout).reshape(4, 2, 14)
    compiled = short_flight(dynamics=dynamics, return_mode=True, safety_filter=True)
    np.testing.assert_allclose(flown, compiled, rtol=0, atol=1e-9)


def test_reset_goes_back_to_the_start():
    world = World(load_scenario("village"))
    start = world.state.copy()
    outcomes = []
    for _ in range(2):
        for _ in range(5):
            outcome = world.step({name: GoTo(21) for name in world.names})
        outcomes.append(outcome)
        world.reset()
        for now, then in zip(world.state, start, strict=True):
            np.testing.assert_array_equal(now, then)
    assert outcomes[0].tobytes() == outcomes[1].tobytes()
    assert outcomes[0] is not outcomes[1]


def test_a_copy_of_the_state_is_its_own():
    world = World(meadow())
    copied = world.state.copy()
    world.step({"uas_1": Velocity(5.0, 0.0, 5.0)})
    assert copied.step[0] == 0
    assert world.state.step[0] == 1


@pytest.mark.parametrize("duplicate", [copy.deepcopy, lambda w: pickle.loads(pickle.dumps(w))])
def test_a_copy_of_a_world_flies_on_by_itself(duplicate):
    world = World(load_scenario("village"), return_mode=True, safety_filter=True)
    go = {name: GoTo(21) for name in world.names}
    for _ in range(3):
        world.step(go)
    copied = duplicate(world)
    outcomes = [w.step(go) for w in (copied, world)]
    assert outcomes[0].tobytes() == outcomes[1].tobytes()
    copied.step(go)
    assert copied.state.step[0] == world.state.step[0] + 1 == 5


def test_the_state_of_a_world_is_written_and_not_replaced():
    world = World(meadow())
    with pytest.raises(AttributeError):
        world.state = world.state.copy()


def test_packed_commands_may_lie_anywhere_in_memory():
    commands = np.zeros(2, dtype=COMMAND_DTYPE)
    commands["values"] = (3.0, 1.0, 10.0, 0.0), (-2.0, 4.0, 12.0, 0.0)
    apart = [commands, np.repeat(commands, 3)[::3], commands[::-1].copy()[::-1]]
    assert [packed.flags.c_contiguous for packed in apart] == [True, False, False]
    flown = []
    for packed in apart:
        world = World(meadow([(60.0, 60.0, -10.0), (90.0, 90.0, -10.0)]))
        world.step(packed)
        flown.append(world.state.x.copy())
    np.testing.assert_array_equal(flown[1], flown[0])
    np.testing.assert_array_equal(flown[2], flown[0])


def test_planners_see_the_present_velocity_of_moving_obstacles_and_nothing_else():
    turning = mover((50.0, 50.0, -10.0), (0.0, (2.0, 0.0, 0.0)), (2.0, (0.0, -3.0, 1.0)))
    world = World(meadow(moving_obstacles=[turning]))
    seen = []
    for _ in range(4):
        swarm = world.swarm_state()
        seen.append((*swarm.moving_position_m[0], *swarm.moving_velocity_mps[0]))
        world.step({"uas_1": Velocity(0.0, 0.0, 1.0)})
    assert seen == [
        (50.0, 50.0, -10.0, 2.0, 0.0, 0.0),
        (52.0, 50.0, -10.0, 2.0, 0.0, 0.0),
        (54.0, 50.0, -10.0, 0.0, -3.0, 1.0),
        (54.0, 47.0, -9.0, 0.0, -3.0, 1.0),
    ]
    fields = set(SwarmState.__dataclass_fields__)
    assert not {field for field in fields if "path" in field or "schedule" in field}


def test_a_planner_cannot_change_the_world_through_what_it_sees():
    world = World(meadow())
    swarm = world.swarm_state()
    before = world.state.copy()
    for name in ("x", "status", "uncovered", "home_m", "moving_position_m"):
        getattr(swarm, name)[...] = 1
    for now, then in zip(world.state, before, strict=True):
        np.testing.assert_array_equal(now, then)
    assert world.swarm_state().home_m.tolist() == [[100.0, 100.0, -1.0]]


def test_what_planners_see_can_be_sent_to_another_process():
    swarm = pickle.loads(pickle.dumps(World(load_scenario("village")).swarm_state()))
    assert swarm.active == ("uas_1", "uas_2")
    assert (swarm.status == FLYING).all()
    assert swarm.time_s == 0.0


def test_time_counts_in_steps_of_the_scenario():
    world = World(meadow(dt_s=0.5))
    for _ in range(3):
        world.step({"uas_1": Velocity(0.0, 0.0, 1.0)})
    assert world.time_s == 1.5
    assert world.swarm_state().step == 3


def test_unknown_dynamics_are_refused_with_the_known_ones():
    with pytest.raises(ValueError, match=r"'newton'.*lpv.*nonlinear"):
        World(meadow(), dynamics="newton")


def test_after_a_wrench_the_inner_loop_goes_on_from_the_velocity_reached():
    world = World(meadow([(100.0, 100.0, -20.0)]))
    for torque in (0.004, -0.004, 0.0):
        world.step({"uas_1": Wrench(0.0, 0.0, torque, 0.0)})
    assert np.abs(world.state.x[0, 3]) > 0.5
    np.testing.assert_array_equal(world.state.uas[0].reference_mps[:], world.state.x[0, 3:5])


def test_a_mission_can_be_flown_beyond_its_last_step():
    slow = mover((20.0, 20.0, -9.0), (0.0, (0.1, 0.0, 0.0)))
    world = World(meadow(max_steps=2, moving_obstacles=[slow]))
    for _ in range(80):
        world.step({"uas_1": Velocity(0.0, 0.0, 1.0)})
    assert world.state.step[0] == 80
    assert world.swarm_state().moving_position_m.shape == (1, 3)


@pytest.fixture
def guided(monkeypatch):
    """Whether guidance was asked for, each time that a world asked for assistants."""
    asked = []

    def noted(*given, goes_to):
        asked.append(goes_to)
        return assistants(*given, goes_to=goes_to)

    monkeypatch.setattr("uas_coverage_env.simulation.world.assistants", noted)
    return asked


def test_guidance_is_compiled_once_a_command_names_a_place(guided):
    world, same = World(meadow()), World(meadow())
    same.step({"uas_1": GoTo(0)})
    same.reset()
    guided.clear()
    north, home = Velocity(3.0, 0.0, 9.0), Velocity(-1.0, 0.0, 9.0, "return")
    for command in (north, north, home, GoTo(0), north, GoTo(None)):
        flown = world.step({"uas_1": command})
        assert flown.tobytes() == same.step({"uas_1": command}).tobytes()
        assert flown["returning"][0] == (command in (home, GoTo(None)))
    assert guided == [False, True]


def test_where_an_event_may_send_a_uas_home_there_is_guidance_from_the_start(guided):
    lost = {"kind": "radio_lost", "at_s": 1.0, "uas": "uas_1", "for_s": 9.0}
    fields = meadow().model_dump(mode="json", by_alias=True)
    for then in ("hover", "return"):
        world = World(
            Scenario.model_validate_json(json.dumps({**fields, "events": [lost | {"then": then}]}))
        )
        for _ in range(4):
            flown = world.step({"uas_1": Velocity(3.0, 0.0, 9.0)})
        assert flown["returning"][0] == (then == "return")
    assert guided == [False, True]
