"""The relief of a site: what `--terrain` makes of a grid of heights."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from shapely.geometry.base import BaseGeometry

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.seen import TERRAIN
from uas_coverage_env.operations.area_import.ground import FloatArray, Ground
from uas_coverage_env.operations.area_import.site import (
    LARGEST_UAS_M,
    SAFE_DISTANCE_M,
    MissionSite,
    Wall,
)
from uas_coverage_env.operations.area_import.terrain_obstacles import LOW_M, hills

LEVEL_M = 2.0
"""So far take-off places may differ in height: a file counts heights from that of its UAS."""

_FREE_M = SAFE_DISTANCE_M + LARGEST_UAS_M + 1.0


@dataclass(frozen=True, eq=False)
class Relief:
    """The ground of a site; flat, unless something is known of it.

    Attributes:
        ground: Its heights above the lowest take-off place; None: flat.
        walls: The ground that rises, as obstacles.
        start_m: Height of the lowest take-off place, as the grid counts it; None: not known [m].
    """

    ground: Ground | None = None
    walls: tuple[Wall, ...] = ()
    start_m: float | None = None

    def range_m(self, west: float, south: float, east: float, north: float) -> tuple[float, float]:
        """The lowest and the highest ground in a box [m]."""
        if self.ground is None:
            return 0.0, 0.0
        return self.ground.range_m(west, south, east, north)

    def highest_m(self, shapes: Sequence[BaseGeometry]) -> float:
        """No ground in the boxes round some shapes, nor the take-off places, is higher [m]."""
        highest_m = max(0.0, *(self.range_m(*shape.bounds)[1] for shape in shapes))
        return math.ceil(10.0 * highest_m - 1e-6) / 10.0

    def note(self, site: MissionSite) -> str:
        """What the ground is like, for the user."""
        low_m, high_m = self.range_m(*site.fence.bounds)
        start_m = self.start_m or 0.0
        return (
            f"heights of the grid, taken as metres: {round(start_m + low_m)} to "
            f"{round(start_m + high_m)}; "
            f"ground of {round(low_m)} to {round(high_m)} m above the lowest take-off place; what "
            f"is higher than {LOW_M:g} m is in {len(self.walls)} boxes that hold it"
            + ("; seen ground is counted too small over what is lower" if low_m < -LOW_M else "")
        )


def relief_of(path: Path, site: MissionSite, starts_m: FloatArray) -> Relief:
    """The relief of a site from a grid of heights.

    Args:
        path: The grid.
        site: In local metres.
        starts_m: (U, 2) east and north of where the UAS take off [m].

    Raises:
        InputError: The grid cannot be used, or the UAS take off from different heights.
    """
    from uas_coverage_env.operations.area_import.terrain_files import (
        read_ground,  # loads GDAL, rarely needed
    )

    ground, heights_m = read_ground(path, site.frame, site.fence, starts_m)
    lowest, highest = int(np.argmin(heights_m)), int(np.argmax(heights_m))
    apart_m = float(heights_m[highest] - heights_m[lowest])
    if apart_m > LEVEL_M:
        raise InputError(
            f"{path}: uas_{highest + 1} takes off {apart_m:.1f} m higher than uas_{lowest + 1}, "
            f"and files count heights from there; take off from places that differ by less than "
            f"{LEVEL_M:g} m"
        )
    walls = tuple(
        Wall(TERRAIN, hill.footprint, hill.top_m, SAFE_DISTANCE_M)
        for hill in hills(ground, starts_m, _FREE_M)
    )
    return Relief(ground, walls, float(heights_m[lowest]))
