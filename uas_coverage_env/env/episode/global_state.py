"""The whole mission as one vector, for learners with a central critic.

For each UAS its `own` group of the observation, then whether it has landed and whether it is lost;
for each moving obstacle its place in the box around the fence (north, east, up; ±1 are the sides)
and its velocity (north, east, down / 20 m/s); for each waypoint whether it is still to be covered.
There is room for the largest mission of the environment, and for four moving obstacles at least:
what a mission lacks is zero. So the size is the same wherever fleet and number of waypoints (with a
family or generator, the most that it may have) are the same and no more than four obstacles move.
"""

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.entities.state import LANDED, LOST, SWAPPING
from uas_coverage_env.env.observation.layout import observation_bounds
from uas_coverage_env.env.observation.own import OWN
from uas_coverage_env.scenario.room import Room

_MOVING_BOUND = 2.0
_MOVING_MPS = 20.0


def global_space(room: Room) -> spaces.Box:
    """The space of the vector; its size depends on the largest mission."""
    n_uas, n_waypoints, n_moving = room
    own_low, own_high = observation_bounds([OWN])
    low = np.concatenate(
        [
            np.tile(np.append(own_low, [0, 0]), n_uas),
            np.full(6 * n_moving, -_MOVING_BOUND),
            np.zeros(n_waypoints),
        ]
    )
    high = np.concatenate(
        [
            np.tile(np.append(own_high, [1, 1]), n_uas),
            np.full(6 * n_moving, _MOVING_BOUND),
            np.ones(n_waypoints),
        ]
    )
    return spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)


def global_state(
    own: NDArray[np.float32],
    status: NDArray[np.int64],
    uncovered: NDArray[np.bool_],
    moving_position_m: NDArray[np.float64],
    moving_velocity_mps: NDArray[np.float64],
    scale: np.void,
    room: Room,
) -> NDArray[np.float32]:
    """The vector.

    Args:
        own: (U, size) the group `own` of all UAS, as each observed it last.
        status: (U,) FLYING, LANDED, LOST or SWAPPING.
        uncovered: (W,).
        moving_position_m: (M, 3) [m] centres.
        moving_velocity_mps: (M, 3) [m/s].
        scale: A record of SCALES_DTYPE, for the box around the fence.
        room: The largest mission.
    """
    landed = (status == LANDED) | (status == SWAPPING)
    uas = np.column_stack([own, landed, status == LOST])
    place = (moving_position_m - scale["centre_m"]) * scale["per_half_side"] * [1, 1, -1]
    moving = np.column_stack([place, moving_velocity_mps / _MOVING_MPS])
    moving = np.clip(moving, -_MOVING_BOUND, _MOVING_BOUND)
    first_moving = room.n_uas * uas.shape[1]
    first_waypoint = first_moving + room.n_moving * 6
    vector = np.zeros(first_waypoint + room.n_waypoints, np.float32)
    for first, part in ((0, uas), (first_moving, moving), (first_waypoint, uncovered)):
        vector[first : first + part.size] = part.ravel()
    return vector
