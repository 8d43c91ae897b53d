"""An acceleration, held over a step."""

from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import ACCELERATION as COMMAND
from uas_coverage_env.entities.commands import Acceleration
from uas_coverage_env.env.actions.kind import ActionKind, Range
from uas_coverage_env.env.actions.landing import refuse_landing_unless_departed
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams


def _ranges(vehicle: VehicleParams, scenario: Scenario) -> tuple[Range, ...]:
    airframe, limits = vehicle.airframe, vehicle.limits
    level = airframe.gravity_mps2 * limits.tilt_max_rad
    up, down = limits.lift_max_N / airframe.mass_kg, -limits.lift_min_N / airframe.mass_kg
    return (-level, 0.0, level), (-level, 0.0, level), (-up, 0.0, down)


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, values, command):
    """Write the command, see `ActionKind`."""
    write_command(command, COMMAND, values[0], values[1], values[2])


def _express(arena, state, tables, learners, i, parameters, command):
    if not isinstance(command, Acceleration):
        raise ValueError("it flies an Acceleration")
    refuse_landing_unless_departed(state, i, command)
    return command.north_mps2, command.east_mps2, command.down_mps2


ACCELERATION = ActionKind(
    name="acceleration",
    meaning=(
        "North and east acceleration in units of g · tilt limit; down acceleration, -1 at the "
        "largest lift, 0 at hover, 1 at the smallest."
    ),
    write=write,
    numbers=("north_mps2", "east_mps2", "down_mps2"),
    ranges=_ranges,
    express=_express,
)
