"""What guidance writes into on the way to a command: made by the caller, so that guidance need not.

A kernel that makes arrays does not run on a GPU, where each UAS has a room of its own.
"""

from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.exit_overhang import MOST_PLACES, N_CELLS
from uas_coverage_env.compiled.kernels import allocating_kernel
from uas_coverage_env.compiled.memory import Memory


class Room(NamedTuple):
    """For one UAS at a time."""

    path_m: Annotated[NDArray[np.float64], "predicted", 3]
    """[m] where a command would lead it."""
    places_m: Annotated[NDArray[np.float64], "places", 3]
    """[m] a way past overhangs; none where nothing overhangs."""
    cells: Annotated[NDArray[np.int32], 3, "cells"]
    """The grid in which that is looked for; likewise."""


ROOM = Memory(Room)


@allocating_kernel
def new_room(arena):
    """Room for the missions of an arena."""
    overhangs = arena.rules[0].overhangs
    return Room(
        np.empty((arena.rules[0].lookahead_steps + 1, 3)),
        np.empty((MOST_PLACES if overhangs else 0, 3)),
        np.empty((3, N_CELLS if overhangs else 0), np.int32),
    )
