"""What a planner may know about a mission before it is flown."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.scenario import (
    Decoration,
    Execution,
    Geofence,
    MovingObstacle,
    Obstacle,
    Place,
    Scenario,
    ScheduledVelocity,
    Sorties,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.conditions import Conditions
from uas_coverage_env.scenario.payload import who_covers
from uas_coverage_env.scenario.planar import Planar
from uas_coverage_env.scenario.reserve import LandingReserve
from uas_coverage_env.vehicle import VehicleParams


class MovingObstacleBrief(StrictModel):
    """A moving obstacle as a planner knows it: an upright cylinder, and where it is at t = 0.

    Where it is later, and how fast, each `SwarmState` shows; its schedule stays with the world.

    Attributes:
        name: Unique among the moving obstacles.
        kind: Free label.
        radius_m: Radius [m].
        height_m: Full height [m].
        safe_distance_m: Kept from the cylinder in addition to the radius of the UAS [m].
        start_m: Centre of the cylinder at t = 0, as the first `SwarmState` shows it [m].
    """

    name: str
    kind: str | None
    radius_m: float
    height_m: float
    safe_distance_m: float
    start_m: tuple[float, float, float]


class MissionBrief(StrictModel):
    """Everything about a mission that a planner may know, and nothing that only the world knows.

    The fields are those of `Scenario` under the same names. They are the whole list: a field that
    `Scenario` gains is hidden until it is added here. Immutable, hashable, can be pickled.

    Attributes:
        schema_version: Version of the scenario's file format.
        name: Name of the scenario.
        dt_s: Length of a time step [s].
        max_steps: Steps after which a flight ends.
        landing_distance_m: A UAS this close to its home can land [m].
        landing_speed_mps: ... when it is slower than this [m/s].
        uas_safe_distance_m: Kept between two UAS in addition to their radii [m].
        min_height_m: Least height above the ground and above roofs; 0: no such rule [m].
        route_margin_m: What routes keep beyond what counts as a breach; None: derived [m].
        from_ground: Whether charge is drawn for take-off before t = 0, and for landing at the end.
        planar: The height at which all UAS fly; None where they fly in space.
        geofence: The volume to stay in.
        obstacles: Fixed obstacles.
        doors_m: Middles of openings at which routes may turn, (D, 2) [m].
        moving_obstacles: Moving obstacles, without their schedules.
        uas: The fleet, with home positions and charge at t = 0.
        vehicles: The vehicle of each UAS, in their order.
        waypoints: What is to be covered.
        decorations: Drawn only.
        place: Where on the Earth it is; None where the scenario does not say.
        conditions: Stated bounds of wind and of the true vehicles, never what is drawn; None where
            nothing pushes back.
        execution: What flies it in the end, and how exactly; None where the scenario does not say.
        sorties: Packs of each UAS, and how long swapping takes. They are swapped in this flight
            where `together` is false; otherwise the brief is that of one sortie. None: one pack.
        reserve: Charge with which UAS land at the latest; None: what `dod_max` leaves.
    """

    schema_version: int
    name: str
    dt_s: float
    max_steps: int
    landing_distance_m: float
    landing_speed_mps: float
    uas_safe_distance_m: float
    min_height_m: float
    from_ground: bool
    geofence: Geofence
    obstacles: tuple[Obstacle, ...]
    moving_obstacles: tuple[MovingObstacleBrief, ...]
    uas: tuple[Uas, ...]
    vehicles: tuple[VehicleParams, ...]
    waypoints: tuple[Waypoint, ...]
    decorations: tuple[Decoration, ...]
    planar: Planar | None = None
    doors_m: tuple[tuple[float, float], ...] = ()
    place: Place | None = None
    route_margin_m: float | None = None
    conditions: Conditions | None = None
    execution: Execution | None = None
    sorties: Sorties | None = None
    reserve: LandingReserve | None = None

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_"):
                return super().__getattr__(name)
            raise AttributeError(
                f"a MissionBrief has no {name!r}; it has {', '.join(type(self).model_fields)}, "
                f"fence and hulls. To simulate the mission, take as_scenario()"
            )

    @classmethod
    def of(cls, scenario: Scenario) -> MissionBrief:
        """The brief of a scenario."""
        known = {name: getattr(scenario, name) for name in cls.model_fields}
        known["moving_obstacles"] = tuple(
            MovingObstacleBrief(
                **{name: getattr(obstacle, name) for name in MovingObstacleBrief.model_fields}
            )
            for obstacle in scenario.moving_obstacles
        )
        return cls(**known)

    @property
    def fence(self) -> ConvexPolytope:
        """The geofence as plane inequalities."""
        return self.geofence.hull

    @cached_property
    def hulls(self) -> tuple[ConvexPolytope, ...]:
        """One hull per fixed obstacle, in their order."""
        return tuple(obstacle.hull for obstacle in self.obstacles)

    @cached_property
    def can_cover(self) -> NDArray[np.bool_]:
        """(U, W) whether each UAS carries the sensor that each waypoint asks for."""
        return who_covers(self.uas, self.waypoints)

    @property
    def kept_hulls(self) -> tuple[ConvexPolytope, ...]:
        """See `Scenario.kept_hulls`."""
        return self._motionless.kept_hulls

    @property
    def dod_landed(self) -> tuple[float, ...]:
        """See `Scenario.dod_landed`: what planners plan to."""
        return self._motionless.dod_landed

    @property
    def landing_zone_m(self) -> float:
        """See `Scenario.landing_zone_m`."""
        return self._motionless.landing_zone_m

    def as_scenario(self) -> Scenario:
        """A scenario to simulate: that of the brief, in which moving obstacles never move.

        They stand at `start_m`. A planner that simulates more writes its own prediction of them
        into the arrays that it simulates with.
        """
        return self._motionless

    @cached_property
    def _motionless(self) -> Scenario:
        still = (ScheduledVelocity(from_s=0.0, velocity_mps=(0.0, 0.0, 0.0)),)
        known = {name: getattr(self, name) for name in type(self).model_fields}
        vehicles, conditions = known.pop("vehicles"), known.pop("conditions")
        known["schema"] = known.pop("schema_version")
        known["moving_obstacles"] = tuple(
            MovingObstacle.model_construct(**obstacle.model_dump(), schedule=still)
            for obstacle in self.moving_obstacles
        )
        # checked before, when the scenario was read; and a vehicle file may be elsewhere by now
        scenario = Scenario.model_construct(**known)
        vars(scenario)["vehicles"] = vehicles
        # what is stated, not the wind that it is stated of
        vars(scenario)["conditions"] = conditions
        return scenario
