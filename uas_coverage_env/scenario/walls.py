"""Walls with doors: `[[walls]]`, which are boxes and lintels among the obstacles once read."""

import math
from collections.abc import Iterator
from typing import Annotated, Self

import numpy as np
from pydantic import Field, Strict, model_validator

from uas_coverage_env.files.names import Name
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.scenario.fields import Distance_m, Level_m, Obstacle

_Thickness_m = Annotated[float, Field(ge=0.01, le=100.0)]
_Opening_m = Annotated[float, Field(ge=0.01, le=1_000.0)]

_ROUNDING_M = 1e-9
_THINNEST_M = 2e-3  # of a piece; a hull needs 1e-3
_KIND = "wall"


class Door(StrictModel):
    """An opening in a wall, from the ground up.

    Attributes:
        at_m: Of its middle, from the wall's `from_m` along the wall [m].
        width_m: Clear width [m].
        height_m: Clear height; without it, up to the top of the wall [m].
    """

    at_m: Distance_m
    width_m: _Opening_m
    height_m: _Opening_m | None = None

    @property
    def ends_m(self) -> tuple[float, float]:
        """Where it begins and ends along the wall [m]."""
        return self.at_m - 0.5 * self.width_m, self.at_m + 0.5 * self.width_m


class Wall(StrictModel):
    """A straight wall that stands on the ground.

    In the scenario that is read it is a box beside each door, named `wall_1_before_door_1`,
    `wall_1_after_door_1` and so on, and a lintel above it, `wall_1_above_door_1`.

    Attributes:
        name: Of the wall, with which the names of its boxes begin; without it, `wall_1` for the
            first wall of the file, and so on.
        from_m: One end of its middle line, north and east [m].
        to_m: The other end [m].
        thickness_m: Half of it lies on either side of the line [m].
        height_m: From the ground, z = 0, to its top [m].
        safe_distance_m: Kept from the wall in addition to the radius of the UAS [m].
        doors: Openings.
    """

    name: Name | None = None
    from_m: Level_m
    to_m: Level_m
    thickness_m: _Thickness_m
    height_m: _Opening_m
    safe_distance_m: Distance_m
    doors: Annotated[tuple[Door, ...], Strict(False), Field(max_length=100)] = ()

    @property
    def length_m(self) -> float:
        """From end to end [m]."""
        return math.dist(self.from_m, self.to_m)

    @model_validator(mode="after")
    def _has_room_for_its_doors(self) -> Self:
        length_m, until_m, before = self.length_m, 0.0, -1
        if length_m < self.thickness_m:
            raise ValueError(
                f"from_m and to_m are {length_m:.3g} m apart, less than thickness_m "
                f"{self.thickness_m:g}; move one of them"
            )
        for d in self._along:
            door, (begins_m, ends_m) = self.doors[d], self.doors[d].ends_m
            named = f"doors[{d}]"
            if begins_m < -_ROUNDING_M or ends_m > length_m + _ROUNDING_M:
                raise ValueError(
                    f"{named} goes from {begins_m:.4g} to {ends_m:.4g} m along a wall that is "
                    f"{length_m:.4g} m long; change at_m {door.at_m:g} or width_m {door.width_m:g}"
                )
            if begins_m < until_m - _ROUNDING_M:
                raise ValueError(
                    f"{named} begins at {begins_m:.4g} m, before doors[{before}] ends at "
                    f"{until_m:.4g} m; move one of them or make it narrower"
                )
            if door.height_m is not None and door.height_m > self.height_m:
                raise ValueError(
                    f"{named}.height_m {door.height_m:g} is more than the wall's height_m "
                    f"{self.height_m:g}; make the door lower or leave its height_m out"
                )
            until_m, before = ends_m, d
        return self

    @property
    def _along(self) -> list[int]:
        """The doors in their order along the wall."""
        return sorted(range(len(self.doors)), key=lambda d: self.doors[d].at_m)

    def obstacles(self, name: str) -> Iterator[Obstacle]:
        """What stands, along the wall; a piece without length is left out.

        Args:
            name: Of a wall that has none of its own.
        """
        name, doors = self.name or name, [self.doors[d] for d in self._along]
        begins_m = 0.0
        for d, door in enumerate(doors):
            opens_m, closes_m = door.ends_m
            side = f"before_door_{d + 1}" if d == 0 else f"after_door_{d}"
            yield from self._box(f"{name}_{side}", begins_m, opens_m, 0.0)
            if door.height_m is not None:
                yield from self._box(f"{name}_above_door_{d + 1}", opens_m, closes_m, door.height_m)
            begins_m = closes_m
        last = f"{name}_after_door_{len(doors)}" if doors else name
        yield from self._box(last, begins_m, self.length_m, 0.0)

    def door_middles_m(self) -> Iterator[tuple[float, float]]:
        """North and east of the middle of each door [m]."""
        yield from (self._at(door.at_m, 0.0) for door in self.doors)

    def _at(self, along_m: float, beside_m: float) -> tuple[float, float]:
        origin, end = np.array(self.from_m), np.array(self.to_m)
        north, east = (end - origin) / self.length_m
        place = origin + along_m * np.array([north, east]) + beside_m * np.array([-east, north])
        return round(float(place[0]), 9), round(float(place[1]), 9)

    def _box(self, name: str, from_m: float, to_m: float, base_m: float) -> Iterator[Obstacle]:
        """A piece of the wall, unless it is thinner than a body can be."""
        if min(to_m - from_m, self.height_m - base_m) < _THINNEST_M:
            return
        half_m = 0.5 * self.thickness_m
        corners = [(from_m, -half_m), (to_m, -half_m), (to_m, half_m), (from_m, half_m)]
        outline_m = [self._at(*corner) for corner in corners]
        yield Obstacle(
            name=name,
            kind=_KIND,
            safe_distance_m=self.safe_distance_m,
            vertices_m=tuple((*place, -z) for z in (base_m, self.height_m) for place in outline_m),
        )
