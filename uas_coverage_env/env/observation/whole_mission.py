"""The whole mission, the same for all UAS but for their order: for central critics and planners."""

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.state import FLYING, LANDED, SWAPPING
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock, flag
from uas_coverage_env.env.observation.relative import charge_left, within
from uas_coverage_env.scenario import MissionSource
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.vehicle import layout as S

_MOVING_MPS = 20.0

_POSITION = Feature("position", 3, -1, 1, "north, east, up in the box around the fence")
_UAS = (
    flag("valid", "1 for a UAS of the mission, in its order there; all are 0 where there is none"),
    flag("itself", "1 for the UAS that observes"),
    flag("flying", "1 while it flies"),
    flag("landed", "1 once it has landed"),
    _POSITION,
    Feature("velocity", 3, -2, 2, "north, east, down / the vehicle's limits"),
    Feature("charge_left", 1, -1, 1, "(dod_max - dod) / dod_max"),
)
_WAYPOINT = (
    flag("valid", "1 for a waypoint, in the scenario's order; all are 0 where there is none"),
    flag("open", "1 while it is to be covered"),
    _POSITION,
    flag("weight", "weight / heaviest of the scenario"),
)
_MOVING = (
    flag("valid", "1 for a moving obstacle, in its order; all are 0 where there is none"),
    _POSITION,
    Feature("velocity", 3, -2, 2, "north, east, down / 20 m/s"),
)

_U, _W, _M = (Group("", 1, table).columns for table in (_UAS, _WAYPOINT, _MOVING))
_U_WIDTH, _W_WIDTH, _M_WIDTH = (Group("", 1, table).width for table in (_UAS, _WAYPOINT, _MOVING))


@kernel
def _place(scale, x, y, z, row, at):
    """Write a position in the box around the fence."""
    row[at] = within((x - scale.centre_m[0]) * scale.per_half_side[0], -1.0, 1.0)
    row[at + 1] = within((y - scale.centre_m[1]) * scale.per_half_side[1], -1.0, 1.0)
    row[at + 2] = within((scale.centre_m[2] - z) * scale.per_half_side[2], -1.0, 1.0)


@kernel
def _write_uas(arena, state, tables, learners, i, parameters, row):
    for k in range(row.shape[0]):
        row[k] = 0.0
    for j in range(min(state.uas.shape[0], row.shape[0] // _U_WIDTH)):
        x = state.x[j]
        status = state.uas[j].status
        scale = tables.scales[j]
        at = _U_WIDTH * j
        row[at + _U.valid] = 1.0
        row[at + _U.itself] = 1.0 if j == i else 0.0
        row[at + _U.flying] = 1.0 if status == FLYING else 0.0
        row[at + _U.landed] = 1.0 if status in (LANDED, SWAPPING) else 0.0
        _place(scale, x[S.X], x[S.Y], x[S.Z], row, at + _U.position)
        row[at + _U.velocity] = within(x[S.VX] * scale.per_v_xy, -2.0, 2.0)
        row[at + _U.velocity + 1] = within(x[S.VY] * scale.per_v_xy, -2.0, 2.0)
        row[at + _U.velocity + 2] = within(x[S.VZ] * scale.per_v_z, -2.0, 2.0)
        row[at + _U.charge_left] = charge_left(arena, state, j)


@kernel
def _write_waypoints(arena, state, tables, learners, i, parameters, row):
    scale = tables.scales[i]
    for k in range(row.shape[0]):
        row[k] = 0.0
    for w in range(min(state.uncovered.shape[0], row.shape[0] // _W_WIDTH)):
        waypoint = arena.waypoints[w]
        place_m = waypoint.position_m
        at = _W_WIDTH * w
        row[at + _W.valid] = 1.0
        row[at + _W.open] = 1.0 if state.uncovered[w] else 0.0
        _place(scale, place_m[0], place_m[1], place_m[2], row, at + _W.position)
        row[at + _W.weight] = within(waypoint.weight * scale.per_heaviest, 0.0, 1.0)


@kernel
def _write_moving(arena, state, tables, learners, i, parameters, row):
    scale = tables.scales[i]
    sample = min(state.step[0], arena.moving_path_m.shape[0] - 1)
    for k in range(row.shape[0]):
        row[k] = 0.0
    for m in range(min(arena.moving.shape[0], row.shape[0] // _M_WIDTH)):
        centre_m = arena.moving_path_m[sample, m]
        velocity_mps = arena.moving_velocity_mps[sample, m]
        at = _M_WIDTH * m
        row[at + _M.valid] = 1.0
        _place(scale, centre_m[0], centre_m[1], centre_m[2], row, at + _M.position)
        for k in range(3):
            row[at + _M.velocity + k] = within(velocity_mps[k] / _MOVING_MPS, -2.0, 2.0)


def full_state(n_uas: int, n_waypoints: int, n_moving: int = 4) -> tuple[ObservationBlock, ...]:
    """All UAS, all waypoints and all moving obstacles, in the order of the scenario.

    Args:
        n_uas: For how many UAS there is room. What a mission has beyond that is left out, here and
            for the others; `full_state_of` gives room for the largest mission.
        n_waypoints: For how many waypoints.
        n_moving: For how many moving obstacles.

    Raises:
        ValueError: A number is no whole one, or there is no room for a UAS and a waypoint.
    """
    rooms = {"n_uas": (n_uas, 1), "n_waypoints": (n_waypoints, 1), "n_moving": (n_moving, 0)}
    for name, (room, least) in rooms.items():
        if type(room) is not int or room < least:
            raise ValueError(f"{name} is {room!r}; give a whole number from {least} on")
    blocks = (
        ObservationBlock("all_uas", n_uas, _UAS, _write_uas),
        ObservationBlock("all_waypoints", n_waypoints, _WAYPOINT, _write_waypoints),
        ObservationBlock("all_moving_obstacles", n_moving, _MOVING, _write_moving),
    )
    return tuple(block for block in blocks if block.repeats)


def full_state_of(scenario: ScenarioLike) -> tuple[ObservationBlock, ...]:
    """`full_state` with room for the largest mission of a scenario, a family or a generator."""
    return full_state(*MissionSource.of(scenario).room)
