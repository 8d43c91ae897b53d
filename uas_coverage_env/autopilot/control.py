"""From a command to the wrench that flies it."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.entities.commands import ACCELERATION, CLIMB, VELOCITY
from uas_coverage_env.vehicle import (
    LIFT,
    TAU_Z,
    acceleration_wrench,
    clip_wrench,
    velocity_climb_wrench,
    velocity_wrench,
)


@kernel
def write_command(command, kind, first, second, third):
    """Write kind and numbers of a record of COMMAND_DTYPE."""
    command.kind = kind
    command.values[0] = first
    command.values[1] = second
    command.values[2] = third
    command.values[TAU_Z] = 0.0  # of a wrench alone


@kernel
def write_brake(command):
    """Write the command to stop and to hold still."""
    write_command(command, CLIMB, 0.0, 0.0, 0.0)


@inlined_kernel
def command_wrench(vehicle, x, reference, command, u):
    """Write into u the wrench for one step of a command, within the vehicle's limits.

    Args:
        vehicle: The compiled vehicle.
        x: (14,) state.
        reference: (2,) [m/s] the inner loop's governed velocity; updated.
        command: A record of COMMAND_DTYPE, of any kind but GO_TO.
        u: (5,) inputs; lift and torques are written.
    """
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
        for k in range(LIFT, TAU_Z + 1):
            u[k] = values[k]
    # the set U holds for every input, whoever made it
    clip_wrench(vehicle, u)
