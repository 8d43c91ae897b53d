"""A step in moving air, and under a force that is no drag, with the models of still air.

In air that moves at a constant velocity a UAS flies as it does in still air, seen from the air:
drag, trim tilt and the power of both models follow from the velocity relative to it. So a step is
flown with that velocity, and the way of the air is added. For the drag, which is linear, this is
the force drag · wind of the still air's model, to the last term of its series.

A force that is held over the step adds to position and velocity what the discrete model says; both
models' translation is linear in it. Of the power, it has no part in this step.
"""

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.vehicle import layout as S


@inlined_kernel
def enter_air(x, wind_mps):
    """Make the velocity of a state one relative to the air; wind_mps (3,) NED [m/s]."""
    for axis in range(3):
        x[S.VX + axis] -= wind_mps[axis]


@inlined_kernel
def leave_air(vehicle, x, wind_mps):
    """Make the velocity one over ground again, after a step.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state at the end of the step; written.
        wind_mps: (3,) NED [m/s].
    """
    for axis in range(3):
        x[S.VX + axis] += wind_mps[axis]
        x[S.X + axis] += vehicle.dt_s * wind_mps[axis]


@inlined_kernel
def push(vehicle, x, force_N):
    """Add to position and velocity, after a step, what a force has done that was held over it.

    Args:
        vehicle: record of VEHICLE_DTYPE.
        x: (14,) state at the end of the step; written.
        force_N: (3,) NED [N].
    """
    for axis in range(2):
        x[S.X + axis] += vehicle.horizontal_force_B[S.POSITION] * force_N[axis]
        x[S.VX + axis] += vehicle.horizontal_force_B[S.SPEED] * force_N[axis]
    # lift is a force, too, but it acts upward
    x[S.Z] -= vehicle.vertical_B[S.POSITION] * force_N[2]
    x[S.VZ] -= vehicle.vertical_B[S.SPEED] * force_N[2]
