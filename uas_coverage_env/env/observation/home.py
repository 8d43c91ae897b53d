"""The way home past obstacles."""

from uas_coverage_env.autopilot.guidance import target_position
from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import HOME as HOME_TARGET
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.relative import close, direction, within
from uas_coverage_env.env.observation.scales import HEIGHT_M
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.range import (
    SpeedLimits,
    TravelTimeModel,
    flight_seconds,
)
from uas_coverage_env.world.routes import shortest_way

OBSERVED = TravelTimeModel(in_turn=True)
"""Of the observation of `uas_coverage_v0`, at the limits of the vehicle: trained networks read it.
"""

_FEATURES = (
    Feature("direction", 2, -1, 1, "unit vector of the first leg home past obstacles"),
    flag("closeness", "1/(1 + way home / 30 m)"),
    Feature("below", 1, -1, 1, "how far the start is below / 20 m"),
)

_AT = Group("home", 1, _FEATURES).columns


@inlined_kernel
def note_way_home(arena, state, tables, learners, i):
    """Note the way home, and what it costs at top speed."""
    notes = learners.notes[i]
    uas = arena.uas[i]
    x = state.x[i, S.X]
    y = state.x[i, S.Y]
    z = state.x[i, S.Z]
    target, x1, y1, z1 = target_position(arena, i, HOME_TARGET)
    leg_x, leg_y, way_m = shortest_way(arena, target, x, y, z, x1, y1, z1)
    speeds = SpeedLimits(uas.speed_mps, uas.climb_mps, uas.descent_mps)
    flight_s = flight_seconds(OBSERVED, speeds, 0.0, way_m, 0.0, max(0.0, z1 - z))
    notes.leg_m[0] = leg_x
    notes.leg_m[1] = leg_y
    notes.way_m = way_m
    notes.below_m = z1 - z
    notes.home_dod = flight_s * uas.dod_per_s


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    notes = learners.notes[i]
    direction(
        notes.leg_m[0] - state.x[i, S.X], notes.leg_m[1] - state.x[i, S.Y], row, _AT.direction
    )
    row[_AT.closeness] = close(notes.way_m)
    row[_AT.below] = within(notes.below_m * (1.0 / HEIGHT_M), -1.0, 1.0)


HOME = ObservationBlock("home", 1, _FEATURES, write, needs=(note_way_home,))
