"""The fields of a scenario together; see `Scenario`."""

from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    Field,
    SerializerFunctionWrapHandler,
    Strict,
    create_model,
    model_serializer,
    model_validator,
)

from uas_coverage_env.features.event import EventTable
from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.sensing import Sensing
from uas_coverage_env.features.table import FeatureTable, shipped
from uas_coverage_env.features.wind import Wind
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.scenario.conditions import Conditions, conditions_of
from uas_coverage_env.scenario.disturbance_tables import DisturbanceTables
from uas_coverage_env.scenario.events import Events
from uas_coverage_env.scenario.execution import Execution
from uas_coverage_env.scenario.fields import (
    Decoration,
    Distance_m,
    Geofence,
    Length_m,
    Level_m,
    MovingObstacle,
    Name,
    Obstacle,
    Place,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.payload import who_covers
from uas_coverage_env.scenario.planar import Planar, completed
from uas_coverage_env.scenario.walls import Wall
from uas_coverage_env.vehicle import VehicleParams, load_vehicle

GLIDE = 2.0
"""Way over height of the flattest descent from the least height to a start, and of the climb."""


_ALWAYS = ("obstacles", "moving_obstacles", "decorations")
"""In files where they are empty, too."""


_NAMED = ("wind", "uncertainty", "sensing")
"""The tables of features that something here reads by name."""

if TYPE_CHECKING:
    _Tables = StrictModel
else:
    _tables = [each for each in shipped(FeatureTable) if each.table not in _NAMED]
    _fields = {each.table: (each | None, None) for each in _tables}
    _Tables = create_model("_Tables", __base__=StrictModel, **_fields)


class UncheckedScenario(_Tables):
    """The fields of a `Scenario`, each allowed by itself; what checks and estimates read."""

    schema_version: int = Field(alias="schema", ge=1, le=1)
    name: Name
    dt_s: Annotated[float, Field(ge=0.02, le=10.0)]
    max_steps: Annotated[int, Field(ge=1, le=100_000)]
    landing_distance_m: Length_m
    landing_speed_mps: Annotated[float, Field(gt=0.0, le=100.0)]
    uas_safe_distance_m: Distance_m
    min_height_m: Distance_m = 0.0
    route_margin_m: Distance_m | None = None
    from_ground: bool = False
    relaunch: bool = False
    doors_m: Annotated[tuple[Level_m, ...], Strict(False)] = ()
    planar: Planar | None = None
    geofence: Geofence
    obstacles: Annotated[tuple[Obstacle, ...], Strict(False)] = ()
    walls: Annotated[tuple[Wall, ...], Strict(False)] = ()
    moving_obstacles: Annotated[tuple[MovingObstacle, ...], Strict(False)] = ()
    uas: Annotated[tuple[Uas, ...], Strict(False), Field(min_length=1)]
    waypoints: Annotated[tuple[Waypoint, ...], Strict(False), Field(min_length=1)]
    decorations: Annotated[tuple[Decoration, ...], Strict(False)] = ()
    place: Place | None = None
    wind: Wind | None = None
    uncertainty: Uncertainty | None = None
    disturbances: DisturbanceTables = ()
    sensing: Sensing | None = None
    events: Events = ()
    sorties: Sorties | None = None
    execution: Execution | None = None

    @model_validator(mode="after")
    def _walls_are_obstacles(self) -> Self:
        """Put boxes in the place of walls: what reads obstacles need not know of walls."""
        named = [(f"wall_{k + 1}", wall) for k, wall in enumerate(self.walls)]
        if named:
            boxes = [box for name, wall in named for box in wall.obstacles(name)]
            middles_m = [middle_m for wall in self.walls for middle_m in wall.door_middles_m()]
            # the record is frozen for everything else
            object.__setattr__(self, "obstacles", (*self.obstacles, *boxes))
            object.__setattr__(self, "doors_m", (*self.doors_m, *middles_m))
            object.__setattr__(self, "walls", ())
        return self

    @classmethod
    def completed(cls, data: Mapping[str, Any]) -> Mapping[str, Any]:
        """The data of a file with what it may leave out, see `planar.completed`."""
        return completed(data)

    @model_serializer(mode="wrap")
    def _without_absent_tables(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        # files, and what is computed from their content, are those of scenarios before the field
        data = serialise(self)
        for name, field in type(self).model_fields.items():
            usual = not field.is_required() and getattr(self, name) == field.default
            if usual and name not in _ALWAYS:
                data.pop(name, None)
        return data

    @property
    def feature_tables(self) -> tuple[FeatureTable, ...]:
        """The tables of features that the scenario has."""
        own = (getattr(self, name) for name in type(self).model_fields)
        others = (table for _, table in self.disturbances)
        return tuple(each for each in (*own, *others) if isinstance(each, FeatureTable))

    @cached_property
    def fence(self) -> ConvexPolytope:
        """The geofence as plane inequalities."""
        return self.geofence.hull

    @cached_property
    def hulls(self) -> tuple[ConvexPolytope, ...]:
        """One hull per fixed obstacle, in their order."""
        return tuple(obstacle.hull for obstacle in self.obstacles)

    @cached_property
    def conditions(self) -> Conditions | None:
        """What is stated of wind and vehicles; None where nothing pushes back."""
        return conditions_of(self.wind, self.uncertainty)

    @property
    def kept_hulls(self) -> tuple[ConvexPolytope, ...]:
        """What commands keep the safe distance from: the hulls, raised where that is not enough.

        Beyond a face of a raised hull by radius and safe distance, the least height above the
        roof is kept as well. In a planar mission: what of them is at its height, see `Planar`.
        """
        radius_m = min(uas.radius_m for uas in self.uas)
        kept_m = [radius_m + obstacle.safe_distance_m for obstacle in self.obstacles]
        raised = (
            hull.raised(self.min_height_m, distance_m)
            for hull, distance_m in zip(self.hulls, kept_m, strict=True)
        )
        if self.planar is None:
            return tuple(raised)
        return tuple(map(self.planar.kept, raised, kept_m))

    @property
    def landing_zone_m(self) -> float:
        """Horizontal distance from its start within which a UAS may fly low [m]."""
        return self.landing_distance_m + GLIDE * self.min_height_m

    def after(self, event: EventTable, time_s: float, uas: int = 0) -> Self:
        """What the scenario is from an event on.

        Args:
            event: One that changes the scene; others change nothing here.
            time_s: When it happens [s].
            uas: Index of the UAS that it concerns.
        """
        return self._with(event.revised(self, time_s, uas))

    @property
    def asks_again(self) -> bool:
        """Whether any waypoint is to be covered more than once."""
        return any(waypoint.again_after_s for waypoint in self.waypoints)

    def asked_again(self, w: int) -> Self:
        """What the scenario is once a waypoint that was covered is asked for again: it comes last.

        Args:
            w: Its number; it is to be covered more than once.
        """
        return self._with({"waypoints": (*self.waypoints, self.waypoints[w].again())})

    def with_waypoints(self, kept: Iterable[int]) -> Self:
        """The scenario with these of its waypoints only.

        Args:
            kept: Their numbers, in order; there may be none.
        """
        return self._with({"waypoints": tuple(self.waypoints[w] for w in kept)})

    def _with(self, changes: Mapping[str, Any]) -> Self:
        known = {name: getattr(self, name) for name in type(self).model_fields}
        known |= changes
        known["schema"] = known.pop("schema_version")
        # checked when the scenario was read; and a vehicle file may be elsewhere by now
        revised = type(self).model_construct(**known)
        vars(revised)["vehicles"] = self.vehicles
        return revised

    @cached_property
    def can_cover(self) -> NDArray[np.bool_]:
        """(U, W) whether each UAS carries the sensor that each waypoint asks for."""
        return who_covers(self.uas, self.waypoints)

    @cached_property
    def vehicles(self) -> tuple[VehicleParams, ...]:
        """The vehicle of each UAS, in their order."""
        loaded = {name: load_vehicle(name) for name in {uas.vehicle for uas in self.uas}}
        if self.execution is not None:
            loaded = {name: self.execution.set_to(vehicle) for name, vehicle in loaded.items()}
        return tuple(loaded[uas.vehicle] for uas in self.uas)
