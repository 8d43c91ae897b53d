"""The way home past obstacles."""

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.commands import HOME as HOME_TARGET
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.relative import close, direction, within
from uas_coverage_env.env.observation.scales import HEIGHT_M
from uas_coverage_env.env.ways import seconds_of, way_to
from uas_coverage_env.vehicle import layout as S

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
    x = state.x[i]
    leg_x, leg_y, way_m, below_m = way_to(arena, i, HOME_TARGET, x[S.X], x[S.Y], x[S.Z])
    flight_s = seconds_of(arena, i, way_m, 0.0, max(0.0, below_m))
    notes.leg_m[0] = leg_x
    notes.leg_m[1] = leg_y
    notes.way_m = way_m
    notes.below_m = below_m
    notes.home_dod = flight_s * arena.uas[i].dod_per_s


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
