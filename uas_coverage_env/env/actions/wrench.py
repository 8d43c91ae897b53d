"""The paper's inputs: lift and torques, held over a step (Gasche et al., Sec. II)."""

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import WRENCH as COMMAND
from uas_coverage_env.entities.commands import Wrench
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.landing import refuse_landing_unless_departed
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams


def _ranges(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    limits = vehicle.limits
    xy_radps2 = limits.angular_acceleration_xy_max_radps2
    fastest_radps2 = (xy_radps2, xy_radps2, limits.angular_acceleration_z_max_radps2)
    torques = [
        inertia * radps2
        for inertia, radps2 in zip(vehicle.airframe.inertia_kgm2, fastest_radps2, strict=True)
    ]
    lift = (limits.lift_min_N, 0.0, limits.lift_max_N)
    return lift, *((-torque, 0.0, torque) for torque in torques)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`."""
    command.kind = COMMAND
    for k in range(4):
        command.values[k] = values[k]


def _express(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, Wrench):
        raise ValueError("it flies a Wrench")
    refuse_landing_unless_departed(state, i, command)
    values = (command.lift_N, command.tau_x_Nm, command.tau_y_Nm, command.tau_z_Nm)
    values = values[-len(tables.ranges[i]) :]  # in the plane, without lift
    # as the world saturates its inputs
    limits = zip(values, tables.ranges[i], strict=True)
    return tuple(min(max(value, lowest), highest) for value, (lowest, _, highest) in limits)


WRENCH = ActionKind(
    name="wrench",
    meaning=(
        "Lift, -1 the smallest, 0 the weight alone, 1 the largest; three torques in units of the "
        "limits."
    ),
    write=write,
    numbers=("lift_N", "tau_x_Nm", "tau_y_Nm", "tau_z_Nm"),
    ranges=_ranges,
    express=_express,
)
