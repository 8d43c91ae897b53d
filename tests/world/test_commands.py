import math
from dataclasses import replace

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env.entities.commands import COMMAND_DTYPE, HOME, KIND_NAMES, command_mode, pack
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Acceleration, GoTo, Velocity, Wrench

NAMES = ("uas_1", "uas_2")
GOOD = {"uas_1": Velocity(1.0, 2.0, 3.0), "uas_2": GoTo(0)}


@pytest.fixture(scope="module")
def world():
    return World(meadow([(50.0, 50.0, -5.0), (100.0, 100.0, -5.0)]))


def test_commands_are_packed_in_the_order_of_the_uas():
    commands = {
        "c": GoTo(None),
        "a": Wrench(1.0, 2.0, 3.0, 4.0),
        "b": Acceleration(1, np.float32(2.0), 3.0, "transit"),
        "d": GoTo(4, "covering"),
        "f": Velocity(5.0, 6.0, 7.0, "return"),
    }
    packed = pack(commands, "abcdef", "abcdf", 5)
    kinds = [KIND_NAMES[kind] for kind in packed["kind"]]
    assert kinds == ["wrench", "acceleration", "goto", "goto", "velocity", "velocity"]
    assert packed["values"].tolist() == [
        [1.0, 2.0, 3.0, 4.0],
        [1.0, 2.0, 3.0, 0.0],
        [HOME, 0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0],
        [5.0, 6.0, 7.0, 0.0],
    ]
    assert packed["returning"].tolist() == [False, False, True, False, False, True]
    assert packed.dtype == COMMAND_DTYPE


def test_a_command_claims_a_mode():
    assert command_mode(Velocity(0.0, 0.0, 0.0)) == "covering"
    assert command_mode(GoTo(3)) == "transit"
    assert command_mode(GoTo(None)) == "return"
    assert command_mode(GoTo(None, "covering")) == "covering"


BAD_COMMANDS = [
    (Velocity(math.nan, 0.0, 5.0), "north_mps is nan"),
    (Velocity(0.0, math.inf, 5.0), "east_mps is inf"),
    (Velocity(0.0, 0.0, "5"), "altitude_m is '5'"),
    (Velocity(0.0, 0.0, None), "altitude_m is None"),
    (Velocity(True, 0.0, 5.0), "north_mps is True"),
    (Velocity(1j, 0.0, 5.0), "north_mps is 1j"),
    (Velocity(10**400, 0.0, 5.0), "north_mps is 1000"),
    (Velocity(0.0, 0.0, np.zeros(1)), "altitude_m is array"),
    (Acceleration(0.0, 0.0, -math.inf), "down_mps2 is -inf"),
    (Wrench(0.0, math.nan, 0.0, 0.0), "tau_x_Nm is nan"),
    (GoTo(1), "waypoint is 1"),
    (GoTo(-1), "waypoint is -1"),
    (GoTo(True), "waypoint is True"),
    (GoTo(0.0), "waypoint is 0.0"),
    (Velocity(0.0, 0.0, 5.0, "landing"), "mode is 'landing'"),
    (Velocity(0.0, 0.0, 5.0, None), "mode is None"),
    (GoTo(0, "home"), "mode is 'home'"),
    ((0.0, 0.0, 5.0), "is (0.0, 0.0, 5.0); give a Velocity"),
    (None, "is None; give a Velocity"),
]


@pytest.mark.parametrize(("command", "words"), BAD_COMMANDS, ids=lambda part: str(part)[:40])
def test_a_bad_command_is_refused_by_name_and_changes_nothing(world, command, words):
    before = world.state.copy()
    with pytest.raises(ValueError, match="uas_2") as refused:
        world.step({**GOOD, "uas_2": command})
    assert words in str(refused.value)
    for now, then in zip(world.state, before, strict=True):
        np.testing.assert_array_equal(now, then)


@pytest.mark.parametrize(
    ("commands", "words"),
    [
        ({"uas_1": GoTo(0)}, "uas_2 has no command"),
        ({}, "uas_1 has no command"),
        ({**GOOD, "uas_3": GoTo(0)}, "no UAS 'uas_3'"),
        ({**GOOD, 7: GoTo(0)}, "no UAS 7"),
        ([GoTo(0), GoTo(0)], "mapping"),
        (None, "mapping"),
    ],
)
def test_commands_for_the_wrong_uas_are_refused_and_change_nothing(world, commands, words):
    before = world.state.copy()
    with pytest.raises(ValueError, match=words):
        world.step(commands)
    for now, then in zip(world.state, before, strict=True):
        np.testing.assert_array_equal(now, then)


def test_a_uas_that_does_not_fly_takes_no_command():
    world = World(meadow([(50.0, 50.0, -5.0), (100.0, 100.0, -5.0)]))
    world.step({**GOOD, "uas_1": Velocity(0.0, 0.0, 5.0, "return")})
    assert world.active == ("uas_2",)
    with pytest.raises(ValueError, match="uas_1 does not fly"):
        world.step(GOOD)
    world.step({"uas_2": GoTo(0)})


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("kind", 4),
        ("kind", 99),
        ("kind", -1),
        ("values", (math.nan, 0.0, 0.0, 0.0)),
        ("values", (0.0, 0.0, 0.0, math.inf)),
    ],
)
def test_packed_commands_are_checked_too(world, field, value):
    packed = pack(GOOD, NAMES, NAMES, 1)
    packed[field][1] = value
    before = world.state.copy()
    with pytest.raises(ValueError, match="uas_2"):
        world.step(packed)
    for now, then in zip(world.state, before, strict=True):
        np.testing.assert_array_equal(now, then)


@pytest.mark.parametrize("target", [1.0, 0.5, -2.0, 1e18])
def test_a_packed_index_has_to_be_that_of_a_waypoint(world, target):
    packed = pack(GOOD, NAMES, NAMES, 1)
    packed["values"][1, 0] = target
    with pytest.raises(ValueError, match="goto"):
        world.step(packed)


@pytest.mark.parametrize("commands", [np.zeros((2, 4)), np.zeros(3, COMMAND_DTYPE)])
def test_an_array_of_another_form_is_refused(world, commands):
    with pytest.raises(ValueError, match="COMMAND_DTYPE"):
        world.step(commands)


def test_commands_beyond_the_limits_of_the_vehicle_are_flown_as_far_as_it_goes():
    huge = Velocity(1e300, -1e300, 1e300)
    for command in (huge, replace(huge, altitude_m=-1e300), Acceleration(1e300, 0.0, -1e300)):
        world = World(meadow())
        for _ in range(3):
            if not world.done:
                world.step({"uas_1": command})
        assert np.isfinite(world.state.x).all()
    limits = world.scenario.vehicles[0].limits
    outcome = World(meadow()).step({"uas_1": Wrench(1e300, 1e300, -1e300, 1e300)})
    torque_Nm = world.scenario.vehicles[0].torque_max_Nm
    assert outcome["u"][0, 0] == limits.lift_max_N
    assert np.abs(outcome["u"][0, 1:4]) == pytest.approx(torque_Nm)


def test_a_planner_may_not_change_what_the_world_flies():
    command = Velocity(1.0, 0.0, 5.0)
    with pytest.raises(AttributeError):
        command.north_mps = 2.0
