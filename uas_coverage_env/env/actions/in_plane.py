"""What kinds of action are in planar missions: without their vertical number."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import ACCELERATION as OF_ACCELERATION
from uas_coverage_env.entities.commands import N_VALUES
from uas_coverage_env.entities.commands import VELOCITY as OF_VELOCITY
from uas_coverage_env.entities.commands import WRENCH as OF_WRENCH
from uas_coverage_env.env.actions.acceleration import ACCELERATION
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.planar import write as write_finely
from uas_coverage_env.env.actions.velocity import VELOCITY, VELOCITY_V1, express_landing
from uas_coverage_env.env.actions.wrench import WRENCH
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams

_LEVEL, _TORQUES = slice(0, 2), slice(1, 4)
_AT_HEIGHT = " In a planar mission, without the vertical number."


@inlined_kernel
def _write_velocity(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, OF_VELOCITY, values[0], values[1], arena.rules[0].floor_m)


@inlined_kernel
def _write_acceleration(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, OF_ACCELERATION, values[0], values[1], 0.0)


@inlined_kernel
def _write_wrench(arena, state, tables, learners, i, parameters, values, command):
    write_command(command, OF_WRENCH, 0.0, values[0], values[1])
    command.values[N_VALUES - 1] = values[2]


def _express_finely(arena, state, tables, learners, i, parameters, command):
    home_m = -float(arena.uas[i]["home_m"][2])  # at the height of the mission
    ranges = tables.ranges[i]
    return express_landing(arena, state, i, ranges, parameters, command, home_m, home_m)


def _of(kind: ActionKind, kept: slice, write: Any, express: Any = None) -> ActionKind:
    """A kind with some of its numbers, which its kernel takes."""
    own_ranges, own_express = kind.ranges, express or kind.express
    assert own_ranges is not None
    assert own_express is not None

    def ranges(vehicle: VehicleParams, scenario: Scenario) -> Sequence[Range]:
        return own_ranges(vehicle, scenario)[kept]

    def expressed(*given: Any) -> Sequence[float]:
        # a wrench has been told by its ranges that there is no lift
        return tuple(own_express(*given)[: kept.stop - kept.start])

    return replace(
        kind,
        meaning=kind.meaning + _AT_HEIGHT,
        write=write,
        numbers=kind.numbers[kept],
        ranges=ranges,
        express=expressed,
    )


IN_PLANE: Mapping[ActionKind, ActionKind] = {
    VELOCITY: _of(VELOCITY, _LEVEL, _write_velocity),
    VELOCITY_V1: _of(VELOCITY_V1, _LEVEL, write_finely, _express_finely),
    ACCELERATION: _of(ACCELERATION, _LEVEL, _write_acceleration),
    WRENCH: _of(WRENCH, _TORQUES, _write_wrench),
}
"""Kind -> what it is in the plane; all others stay as they are."""


def kind_in(kind: ActionKind, scenario: Scenario) -> ActionKind:
    """What a kind of action is in a scenario."""
    return IN_PLANE.get(kind, kind) if scenario.planar is not None else kind
