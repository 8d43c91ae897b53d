"""From a command to the wrench that flies it."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.commands import ACCELERATION, CLIMB, N_VALUES, VELOCITY
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.inner_loop import (
    acceleration_wrench,
    velocity_climb_wrench,
    velocity_wrench,
)
from uas_coverage_env.vehicle.lpv import clip_wrench


@kernel
def write_command(command, kind, first, second, third):
    """Write kind and numbers of a record of COMMAND_DTYPE."""
    command.kind = kind
    command.values[0] = first
    command.values[1] = second
    command.values[2] = third
    command.values[N_VALUES - 1] = 0.0  # of a wrench alone


@kernel
def write_brake(command):
    """Write the command to stop and to hold still."""
    write_command(command, CLIMB, 0.0, 0.0, 0.0)


@inlined_kernel
def command_wrench(vehicle, x, reference, command, u):
    """Write into u the wrench for one step of a command, within the vehicle's limits."""
    steered_wrench(vehicle, x, reference, command, command.values[0], command.values[1], u)


@inlined_kernel
def steered_wrench(vehicle, x, reference, command, first, second, u):
    """`command_wrench` with two other numbers in the place of the command's first two.

    The command itself is not written: lanes that fly in several threads share some.
    """
    kind = command.kind
    values = command.values
    if kind == VELOCITY:
        velocity_wrench(vehicle, x, reference, first, second, values[2], u)
    elif kind == CLIMB:
        velocity_climb_wrench(vehicle, x, reference, first, second, values[2], u)
    elif kind == ACCELERATION:
        acceleration_wrench(vehicle, x, reference, first, second, values[2], u)
    else:
        for k in range(S.LIFT, S.TAU_Z + 1):
            u[k] = values[k]
    # the set U holds for every input, whoever made it
    clip_wrench(vehicle, u)
