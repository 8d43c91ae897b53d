"""What a scenario is made of: area, obstacles, waypoints and fleet (Gasche et al., Sec. IV).

Frame: NED in metres, x north, y east, z down (z < 0 above ground). The fields are those of the
scenario files; see `village.toml`.
"""

import itertools
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    ValidationInfo,
    field_validator,
    model_serializer,
    model_validator,
)

from uas_coverage_env.files.names import Name
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.vehicle import vehicle_names


def _as_tuple(value: Any) -> Any:
    """Lists and arrays of Python code as the tuples that a hashable record holds."""
    if isinstance(value, np.ndarray):
        value = value.tolist()
    return tuple(_as_tuple(item) for item in value) if isinstance(value, list | tuple) else value


Label = Annotated[str, Field(min_length=1, max_length=100)]
Coordinate_m = Annotated[float, Field(ge=-100_000.0, le=100_000.0)]
Distance_m = Annotated[float, Field(ge=0.0, le=10_000.0)]
Length_m = Annotated[float, Field(gt=0.0, le=10_000.0)]
Speed_mps = Annotated[float, Field(ge=-1_000.0, le=1_000.0)]
Position_m = Annotated[tuple[Coordinate_m, Coordinate_m, Coordinate_m], BeforeValidator(_as_tuple)]
Level_m = Annotated[tuple[Coordinate_m, Coordinate_m], BeforeValidator(_as_tuple)]
Velocity_mps = Annotated[tuple[Speed_mps, Speed_mps, Speed_mps], BeforeValidator(_as_tuple)]
Points_m = Annotated[
    tuple[tuple[Coordinate_m, Coordinate_m, Coordinate_m], ...],
    BeforeValidator(_as_tuple),
    Field(min_length=4, max_length=1000),
]
Gaps_s = Annotated[
    tuple[Annotated[float, Field(gt=0.0, le=86_400.0)], ...],
    BeforeValidator(_as_tuple),
    Field(max_length=100),
]
_Angle_deg = Annotated[float, Field(gt=0.0, lt=170.0)]
Outline_m = Annotated[
    tuple[tuple[Coordinate_m, Coordinate_m], ...],
    BeforeValidator(_as_tuple),
    Field(min_length=3),
]


class Geofence(StrictModel):
    """The convex volume that no UAS may leave (Gasche et al., eq. OCP_5).

    Attributes:
        margin_m: Distance that a planner keeps from the inside of the fence [m].
        vertices_m: Points whose convex hull is the fence, (V, 3) [m].
    """

    margin_m: Distance_m
    vertices_m: Points_m

    @cached_property
    def hull(self) -> ConvexPolytope:
        """The fence as plane inequalities."""
        return ConvexPolytope.from_points(self.vertices_m)


class Obstacle(StrictModel):
    """A fixed convex obstacle (Gasche et al., eq. OCP_6).

    Attributes:
        name: Unique among the obstacles.
        kind: Free label; it chooses a colour in pictures, and cameras see the tops of `terrain`.
        safe_distance_m: Kept from the hull in addition to the radius of the UAS [m].
        vertices_m: Points whose convex hull is the obstacle, (V, 3) [m].
    """

    name: Name
    kind: Label | None = None
    safe_distance_m: Distance_m
    vertices_m: Points_m

    @cached_property
    def hull(self) -> ConvexPolytope:
        """The obstacle as plane inequalities."""
        return ConvexPolytope.from_points(self.vertices_m)


class NoFlyZone(Obstacle):
    """A convex volume in which nothing stands, and which is kept clear of like an obstacle.

    To be in it, or too near, is a breach, no contact.
    """


class ScheduledVelocity(StrictModel):
    """A velocity that a moving obstacle has from a time on.

    Attributes:
        from_s: Start of the piece [s].
        velocity_mps: North, east, down [m/s].
    """

    from_s: Annotated[float, Field(ge=0.0, le=1e6)]
    velocity_mps: Velocity_mps


class MovingObstacle(StrictModel):
    """An upright cylinder that moves with piecewise constant velocity.

    Attributes:
        name: Unique among the moving obstacles.
        kind: Free label; it chooses a colour in pictures.
        radius_m: Radius [m].
        height_m: Full height [m].
        safe_distance_m: Kept from the cylinder in addition to the radius of the UAS [m].
        start_m: Centre of the cylinder at t = 0 [m].
        schedule: Velocities in order of time; the last one holds for ever. Planners never see it.
    """

    name: Name
    kind: Label | None = None
    radius_m: Length_m
    height_m: Length_m
    safe_distance_m: Distance_m
    start_m: Position_m
    schedule: Annotated[tuple[ScheduledVelocity, ...], Strict(False), Field(min_length=1)]

    @field_validator("schedule")
    @classmethod
    def _starts_at_zero_and_increases(
        cls, schedule: tuple[ScheduledVelocity, ...]
    ) -> tuple[ScheduledVelocity, ...]:
        times = [piece.from_s for piece in schedule]
        if times[0] != 0.0:
            raise ValueError(f"starts at from_s = {times[0]:g}; add a first entry at from_s = 0")
        for earlier, later in itertools.pairwise(times):
            if later <= earlier:
                raise ValueError(
                    f"from_s = {later:g} follows {earlier:g}; list the entries in order of time"
                )
        return schedule


class Waypoint(StrictModel):
    """A point that is covered once a UAS has been near it (Gasche et al., eq. OCP_8).

    Attributes:
        kind: Free label; it chooses a colour in pictures.
        position_m: Centre of the sphere [m].
        radius_m: Radius of the sphere, δ_WP [m].
        weight: How much earlier coverage is worth [-].
        sensor: Only a UAS that carries a sensor of this name covers it; without it, any does.
        heights_m: It is covered only from a height above the ground (z = 0) between these two,
            its centre among them; without it, from any [m].
        max_speed_mps: It is covered only by a UAS that is no faster, as its exposure allows;
            without it, at any speed [m/s].
        again_after_s: It is asked for again so long after each time it was covered, once for each
            number; without it, once covered is covered [s].
    """

    kind: Label | None = None
    position_m: Position_m
    radius_m: Length_m
    weight: Annotated[float, Field(gt=0.0, le=1e6)]
    sensor: Name | None = None
    heights_m: Annotated[tuple[Distance_m, Distance_m], BeforeValidator(_as_tuple)] | None = None
    max_speed_mps: Annotated[float, Field(gt=0.0, le=100.0)] | None = None
    again_after_s: Gaps_s = ()

    @property
    def visits(self) -> int:
        """How often it is to be covered."""
        return 1 + len(self.again_after_s)

    def again(self) -> Self:
        """What is asked for once it has been covered and the time between has passed."""
        return self.model_copy(update={"again_after_s": self.again_after_s[1:]})

    @model_validator(mode="after")
    def _lies_between_its_heights(self) -> Self:
        if self.heights_m is not None:
            lowest_m, highest_m = self.heights_m
            height_m = -self.position_m[2]
            if not lowest_m <= height_m <= highest_m:
                raise ValueError(
                    f"heights_m from {lowest_m:g} to {highest_m:g} do not hold the height "
                    f"{height_m:g} of position_m; change one of them"
                )
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_not_asked(self, serialise: SerializerFunctionWrapHandler) -> Any:
        # files, and what is computed from them, are those of scenarios before the fields
        data = serialise(self)
        for name in ("sensor", "heights_m", "max_speed_mps"):
            if getattr(self, name) is None:
                data.pop(name, None)
        if not self.again_after_s:
            data.pop("again_after_s", None)
        return data


class Sensor(StrictModel):
    """What a UAS carries to cover waypoints that ask for it; with a field of view, a camera.

    Attributes:
        name: What waypoints ask for, such as `camera`, `thermal`, `gas`; unique on its UAS.
        field_of_view_deg: Opening angles of the picture, from side to side and from front to back
            of a UAS that faces north: from west to east, and from south to north; without it, the
            sensor shows no ground [degrees].
        stabilised: Whether it looks straight down at any tilt of the UAS; if not, it tilts with it.
        max_tilt_deg: Largest tilt of the UAS at which pictures are useful; without it, any
            [degrees].
    """

    name: Name
    field_of_view_deg: (
        Annotated[tuple[_Angle_deg, _Angle_deg], BeforeValidator(_as_tuple)] | None
    ) = None
    stabilised: bool = True
    max_tilt_deg: Annotated[float, Field(gt=0.0, lt=90.0)] | None = None

    @model_serializer(mode="wrap")
    def _without_what_is_absent(self, serialise: SerializerFunctionWrapHandler) -> Any:
        # of what is no camera, nothing but the name
        data = serialise(self)
        for name in ("field_of_view_deg", "max_tilt_deg"):
            if getattr(self, name) is None:
                data.pop(name, None)
        return data


class Uas(StrictModel):
    """One member of the fleet: a vehicle, where it starts, and what its battery may give.

    Attributes:
        name: Unique; the agent's name in the environments.
        vehicle: A shipped vehicle, such as `s500_v2`, or the path of a vehicle file, relative to
            the scenario file; held as an absolute path.
        start_m: Where it takes off [m].
        land_m: Where it lands; without it, at its start [m].
        soc_0: State of charge at t = 0 [-].
        radius_m: Radius of the sphere that holds the machine, δ_UAV [m].
        dod_max: Depth of discharge beyond which the UAS is lost [-].
        sensors: What it carries; without it, nothing that a waypoint could ask for.
        heading: Where it looks: `north` always, as in the paper, or `course`, where it flies.
    """

    name: Name
    vehicle: Annotated[str, Field(min_length=1, max_length=4096)]
    start_m: Position_m
    land_m: Position_m | None = None
    soc_0: Annotated[float, Field(gt=0.0, le=1.0)]
    radius_m: Annotated[float, Field(gt=0.0, le=100.0)]
    dod_max: Annotated[float, Field(gt=0.0, lt=1.0)]
    sensors: Annotated[tuple[Sensor, ...], Strict(False), Field(max_length=16)] = ()
    heading: Literal["north", "course"] = "north"

    @field_validator("sensors")
    @classmethod
    def _names_are_unique(cls, sensors: tuple[Sensor, ...]) -> tuple[Sensor, ...]:
        names = [sensor.name for sensor in sensors]
        for name in names:
            if names.count(name) > 1:
                raise ValueError(f"{name!r} is carried twice; give each sensor its own name")
        return sensors

    @model_serializer(mode="wrap")
    def _without_what_is_usual(self, serialise: SerializerFunctionWrapHandler) -> Any:
        # files, and what is computed from them, are those of scenarios before the fields
        data = serialise(self)
        for name, usual in (("land_m", None), ("sensors", ()), ("heading", "north")):
            if getattr(self, name) == usual:
                data.pop(name, None)
        return data

    @property
    def home_m(self) -> tuple[float, float, float]:
        """Its home: where it lands [m]."""
        return self.start_m if self.land_m is None else self.land_m

    @field_validator("vehicle")
    @classmethod
    def _is_known(cls, vehicle: str, info: ValidationInfo) -> str:
        if vehicle in vehicle_names():
            return vehicle
        path = Path(vehicle)
        if path.suffix != ".toml":
            shipped = f"take {', '.join(vehicle_names())} or the path of a .toml file"
            instead = did_you_mean(vehicle, vehicle_names(), shipped)
            raise ValueError(f"unknown vehicle {vehicle[:80]!r}; {instead}")
        folder = Path((info.context or {}).get("folder", "."))
        try:
            path = (folder / path).resolve()
            found = path.is_file()
        except (OSError, RuntimeError) as error:  # too long, closed to us, a loop of links
            reason = (getattr(error, "strerror", None) or str(error)).lower()
            raise ValueError(
                f"vehicle file {vehicle[:80]!r} cannot be read ({reason}); correct the path"
            ) from None
        if not found:
            raise ValueError(f"no vehicle file at {path}; correct the path")
        return str(path)


class Decoration(StrictModel):
    """Something drawn on the ground that no planner has to avoid.

    Attributes:
        name: Unique among the decorations.
        kind: Free label; it chooses a colour in pictures.
        polygon_m: Corners, north and east, (V, 2) [m].
    """

    name: Name
    kind: Label | None = None
    polygon_m: Outline_m


class Place(StrictModel):
    """Where the origin of the local metres lies on the Earth (WGS 84); nothing in flight uses it.

    The metres are those of an azimuthal equidistant map about the origin (`operations.LocalFrame`).

    Attributes:
        latitude_deg: Of the origin, positive north [degrees].
        longitude_deg: Of the origin, positive east [degrees].
        height_m: Of the ground at the origin, z = 0, above mean sea level [m].
    """

    latitude_deg: Annotated[float, Field(ge=-90.0, le=90.0)]
    longitude_deg: Annotated[float, Field(ge=-180.0, le=180.0)]
    height_m: Annotated[float, Field(ge=-1_000.0, le=10_000.0)] = 0.0
