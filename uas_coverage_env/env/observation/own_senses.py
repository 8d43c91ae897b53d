"""What a UAS sees and hears by itself: nothing beyond a range, and nothing of the whole swarm."""

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, stack_array_f32
from uas_coverage_env.env.observation.block import Feature, Group, ObservationBlock
from uas_coverage_env.env.observation.home import HOME
from uas_coverage_env.env.observation.moving_obstacles import MOVING_OBSTACLES
from uas_coverage_env.env.observation.moving_obstacles import write as write_moving_obstacles
from uas_coverage_env.env.observation.others import OTHERS
from uas_coverage_env.env.observation.others import write as write_others
from uas_coverage_env.env.observation.own import OWN
from uas_coverage_env.env.observation.own import write as write_own
from uas_coverage_env.env.observation.relative import close
from uas_coverage_env.env.observation.surroundings import SURROUNDINGS
from uas_coverage_env.env.observation.waypoints import WAYPOINTS
from uas_coverage_env.env.observation.waypoints import write as write_waypoints

_OF_THE_SWARM = {
    "own": ("uncovered",),
    "waypoints": ("neighbour", "density", "nearest_uas", "taken"),
}


def _kept(group: Group) -> tuple[Feature, ...]:
    left_out = _OF_THE_SWARM[group.name]
    return tuple(feature for feature in group.features if feature.name not in left_out)


def _columns_kept(group: Group) -> tuple[int, ...]:
    """The columns of the features that are kept, in the first repeat of the group."""
    first, kept = group.columns, []
    for feature in _kept(group):
        column = getattr(first, feature.name)
        kept += range(column, column + feature.size)
    return tuple(kept)


_OWN, _WAYPOINTS = _columns_kept(OWN), _columns_kept(WAYPOINTS)
_N_OWN, _N_WAYPOINT = len(_OWN), len(_WAYPOINTS)
_OWN_SIZE, _WAYPOINTS_SIZE = OWN.size, WAYPOINTS.size
_WAYPOINT_WIDTH, _OTHER_WIDTH, _MOVING_WIDTH = WAYPOINTS.width, OTHERS.width, MOVING_OBSTACLES.width
_WAYPOINT_NEAR = WAYPOINTS.columns.closeness
_OTHER_NEAR, _MOVING_NEAR = OTHERS.columns.closeness, MOVING_OBSTACLES.columns.closeness


@inlined_kernel
def _forget(row, width, closeness, range_m):
    """Leave out what is farther away than the range."""
    least = close(range_m)
    for first in range(0, row.shape[0], width):
        if row[first + closeness] < least:
            for at in range(first, first + width):
                row[at] = 0.0


@kernel
def _write_own(arena, state, tables, learners, i, parameters, row):
    whole = stack_array_f32(_OWN_SIZE)
    write_own(arena, state, tables, learners, i, parameters, whole)
    for k in range(_N_OWN):
        row[k] = whole[_OWN[k]]


@kernel
def _write_waypoints(arena, state, tables, learners, i, parameters, row):
    whole = stack_array_f32(_WAYPOINTS_SIZE)
    write_waypoints(arena, state, tables, learners, i, parameters, whole)
    _forget(whole, _WAYPOINT_WIDTH, _WAYPOINT_NEAR, parameters[0])
    for c in range(_WAYPOINTS_SIZE // _WAYPOINT_WIDTH):
        for k in range(_N_WAYPOINT):
            row[_N_WAYPOINT * c + k] = whole[_WAYPOINT_WIDTH * c + _WAYPOINTS[k]]


@kernel
def _write_others(arena, state, tables, learners, i, parameters, row):
    write_others(arena, state, tables, learners, i, parameters, row)
    _forget(row, _OTHER_WIDTH, _OTHER_NEAR, parameters[0])


@kernel
def _write_moving(arena, state, tables, learners, i, parameters, row):
    write_moving_obstacles(arena, state, tables, learners, i, parameters, row)
    _forget(row, _MOVING_WIDTH, _MOVING_NEAR, parameters[0])


def local(range_m: float = 100.0) -> tuple[ObservationBlock, ...]:
    """The blocks of `OBSERVATION` for a UAS on its own, with a limited range.

    Open waypoints, other UAS and moving obstacles beyond the range are not there; what only the
    swarm as a whole knows (shares of what is left, and how dense and contested it is) is left out
    everywhere.

    Args:
        range_m: Of sensors and radio [m].

    Raises:
        ValueError: The range is no finite number above zero.
    """
    if not isinstance(range_m, int | float) or not range_m > 0.0:
        raise ValueError(f"range_m is {range_m!r}; give metres above zero")
    there = (float(range_m),)
    n = WAYPOINTS.repeats
    return (
        ObservationBlock("own", 1, _kept(OWN), _write_own, needs=OWN.needs),
        HOME,
        SURROUNDINGS,
        ObservationBlock("waypoints", n, _kept(WAYPOINTS), _write_waypoints, there),
        ObservationBlock("others", OTHERS.repeats, OTHERS.features, _write_others, there),
        ObservationBlock(
            "moving_obstacles",
            MOVING_OBSTACLES.repeats,
            MOVING_OBSTACLES.features,
            _write_moving,
            there,
        ),
    )
