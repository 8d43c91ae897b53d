"""The UAS itself: where it is, how it moves, what its battery holds, and how much is left to do."""

from uas_coverage_env.compiled.kernels import inlined_kernel, rarely
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.home import note_way_home
from uas_coverage_env.env.observation.relative import charge_left, within
from uas_coverage_env.env.observation.remaining import note_open_weight
from uas_coverage_env.env.observation.scales import MARGIN
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.inner_loop import within_half_turn

_FEATURES = (
    Feature("position", 3, -1, 1, "north, east, up in the box around the fence; ±1: its sides"),
    Feature("velocity", 3, -2, 2, "north, east, down / the vehicle's limits"),
    Feature(
        "attitude",
        3,
        -2,
        2,
        "roll, pitch / tilt limit, yaw / yaw limit (heading = course: yaw in ±pi / pi)",
    ),
    Feature("rates", 3, -2, 2, "body rates / the vehicle's limits"),
    Feature("reference", 2, -2, 2, "velocity that the inner loop tracks, as `velocity`"),
    flag("flying", "1 while it flies, 0 once landed or lost"),
    flag("departed", "1 once it has left its start: it may land there"),
    flag("returning", "1 while return mode flies it home"),
    flag("rank", "its place in the fleet, 0 the first, 1 the last"),
    flag("dod", "depth of discharge"),
    Feature("polarisation", 1, -1, 1, "polarisation voltage of the battery / 1 V"),
    Feature("charge_left", 1, -1, 1, "(dod_max - dod) / dod_max"),
    Feature(
        "energy_margin",
        1,
        -1,
        1,
        "dod left at home if it flew there now at top speed / 0.3",
    ),
    flag("time_left", "steps left / max_cycles"),
    flag("uncovered", "share of the waypoints' weight still to be covered"),
)

_AT = Group("own", 1, _FEATURES).columns


@inlined_kernel
def write(arena, state, tables, learners, i, parameters, row):
    """Write the group, see `ObservationBlock`."""
    x = state.x[i]
    notes = learners.notes[i]
    scale = tables.scales[i]
    max_steps = arena.rules[0].max_steps
    row[_AT.position] = within((x[S.X] - scale.centre_m[0]) * scale.per_half_side[0], -1.0, 1.0)
    row[_AT.position + 1] = within((x[S.Y] - scale.centre_m[1]) * scale.per_half_side[1], -1.0, 1.0)
    row[_AT.position + 2] = within((scale.centre_m[2] - x[S.Z]) * scale.per_half_side[2], -1.0, 1.0)
    row[_AT.velocity] = within(x[S.VX] * scale.per_v_xy, -2.0, 2.0)
    row[_AT.velocity + 1] = within(x[S.VY] * scale.per_v_xy, -2.0, 2.0)
    row[_AT.velocity + 2] = within(x[S.VZ] * scale.per_v_z, -2.0, 2.0)
    row[_AT.attitude] = within(x[S.PHI] * scale.per_tilt, -2.0, 2.0)
    row[_AT.attitude + 1] = within(x[S.THETA] * scale.per_tilt, -2.0, 2.0)
    yaw = x[S.PSI]
    if rarely(arena.vehicles[i].follows_course):
        yaw = within_half_turn(yaw)
    row[_AT.attitude + 2] = within(yaw * scale.per_yaw, -2.0, 2.0)
    row[_AT.rates] = within(x[S.WX] * scale.per_rate, -2.0, 2.0)
    row[_AT.rates + 1] = within(x[S.WY] * scale.per_rate, -2.0, 2.0)
    row[_AT.rates + 2] = within(x[S.WZ] * scale.per_yaw_rate, -2.0, 2.0)
    row[_AT.reference] = within(state.uas[i].reference_mps[0] * scale.per_v_xy, -2.0, 2.0)
    row[_AT.reference + 1] = within(state.uas[i].reference_mps[1] * scale.per_v_xy, -2.0, 2.0)
    row[_AT.flying] = 1.0 if state.uas[i].status == FLYING else 0.0
    row[_AT.departed] = 1.0 if state.uas[i].departed else 0.0
    row[_AT.returning] = 1.0 if state.uas[i].returning else 0.0
    row[_AT.rank] = scale.rank
    row[_AT.dod] = within(x[S.DOD], 0.0, 1.0)
    row[_AT.polarisation] = within(x[S.U_TH], -1.0, 1.0)
    row[_AT.charge_left] = charge_left(arena, state, i)
    row[_AT.energy_margin] = within(
        (arena.uas[i].dod_max - x[S.DOD] - notes.home_dod) / MARGIN, -1.0, 1.0
    )
    row[_AT.time_left] = within((max_steps - state.step[0]) / max_steps, 0.0, 1.0)
    row[_AT.uncovered] = within(notes.open_share, 0.0, 1.0)


OWN = ObservationBlock("own", 1, _FEATURES, write, needs=(note_way_home, note_open_weight))
