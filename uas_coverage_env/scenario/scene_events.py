"""Events that change the scene: what is to be covered, what is in the way, where home is."""

from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Literal, TypeVar

from pydantic import Field

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.features.event import EventTable, OfUas, happens
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.scenario.fields import (
    Distance_m,
    Length_m,
    MovingObstacle,
    Name,
    NoFlyZone,
    Obstacle,
    Points_m,
    Position_m,
    ScheduledVelocity,
    Uas,
    Velocity_mps,
    Waypoint,
)

T = TypeVar("T", MovingObstacle, Uas)


@rare_kernel
def _drop(arena, state, outcome, f):
    for e in range(arena.events.shape[0]):
        if arena.events[e].feature == f and happens(state, e):
            dropped = int(arena.events[e].values[0])
            state.uncovered[dropped] = False
            if state.due_step.shape[0] > 0:
                state.due_step[dropped] = 0


class WaypointDropped(EventTable):
    """A waypoint is not to be covered any more.

    Attributes:
        kind: `"waypoint_dropped"`.
        waypoint: Its place among the waypoints, from 0 on.
    """

    feature: ClassVar = MissionFeature("waypoint_dropped", {Point.MOVED: _drop})

    kind: Literal["waypoint_dropped"]
    waypoint: Annotated[int, Field(ge=0, le=10**6)]

    @property
    def values(self) -> tuple[float, ...]:
        """The waypoint."""
        return (float(self.waypoint),)

    def mistakes(self, scenario: Any) -> Iterator[str]:
        """A waypoint that there is not."""
        n = len(scenario.waypoints)
        if self.waypoint >= n:
            yield f"waypoint: {self.waypoint} is none of the {n} waypoints; take 0 to {n - 1}"


class WaypointAdded(EventTable):
    """One waypoint more is to be covered.

    Attributes:
        kind: `"waypoint_added"`.
        position_m: Centre of the sphere [m].
        radius_m: Radius of the sphere [m].
        weight: How much earlier coverage is worth [-].
    """

    changes_scene: ClassVar[bool] = True

    kind: Literal["waypoint_added"]
    position_m: Position_m
    radius_m: Length_m
    weight: Annotated[float, Field(gt=0.0, le=1e6)] = 1.0

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """The waypoint comes last."""
        new = Waypoint(position_m=self.position_m, radius_m=self.radius_m, weight=self.weight)
        return {"waypoints": (*scenario.waypoints, new)}


class ObstacleAdded(EventTable):
    """A fixed obstacle stands where none stood: a crane, a tree that has fallen.

    Attributes:
        kind: `"obstacle_added"`.
        name: Unique among the obstacles.
        safe_distance_m: Kept from the hull in addition to the radius of the UAS [m].
        vertices_m: Points whose convex hull is the obstacle, (V, 3) [m].
    """

    changes_scene: ClassVar[bool] = True

    kind: Literal["obstacle_added"]
    name: Name
    safe_distance_m: Distance_m
    vertices_m: Points_m

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """The obstacle comes last."""
        return {"obstacles": (*scenario.obstacles, self._body(Obstacle))}

    def _body(self, kind: type[Obstacle]) -> Obstacle:
        return kind(
            name=self.name, safe_distance_m=self.safe_distance_m, vertices_m=self.vertices_m
        )


class NoFlyZoneAdded(ObstacleAdded):
    """A convex volume is closed to flight: a UAS in it has to leave at once.

    To be in it, or nearer than the safe distance, is a breach at every sample, and no contact.
    Waypoints inside are dropped.

    Attributes:
        kind: `"no_fly_zone"`.
        name: Unique among the obstacles.
        safe_distance_m: Kept from the hull in addition to the radius of the UAS [m].
        vertices_m: Points whose convex hull is the zone, (V, 3) [m].
    """

    kind: Literal["no_fly_zone"]  # pyrefly: ignore[bad-override]

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """The zone comes last among the obstacles."""
        return {"obstacles": (*scenario.obstacles, self._body(NoFlyZone))}


class MovingObstacleAdded(EventTable):
    """A moving obstacle appears: an aircraft that enters the area, a balloon.

    Attributes:
        kind: `"moving_obstacle_added"`.
        name: Unique among the moving obstacles.
        radius_m: Radius [m].
        height_m: Full height [m].
        safe_distance_m: Kept from the cylinder in addition to the radius of the UAS [m].
        position_m: Centre of the cylinder when it appears [m].
        velocity_mps: Its velocity from then on: north, east, down [m/s].
    """

    changes_scene: ClassVar[bool] = True

    kind: Literal["moving_obstacle_added"]
    name: Name
    radius_m: Length_m
    height_m: Length_m
    safe_distance_m: Distance_m
    position_m: Position_m
    velocity_mps: Velocity_mps

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """The obstacle comes last; until now it has stood where it appears."""
        new = MovingObstacle(
            name=self.name,
            radius_m=self.radius_m,
            height_m=self.height_m,
            safe_distance_m=self.safe_distance_m,
            start_m=self.position_m,
            schedule=(
                ScheduledVelocity(from_s=0.0, velocity_mps=(0.0, 0.0, 0.0)),
                ScheduledVelocity(from_s=time_s, velocity_mps=self.velocity_mps),
            ),
        )
        return {"moving_obstacles": (*scenario.moving_obstacles, new)}


class MovingObstacleTurns(EventTable):
    """A moving obstacle leaves its schedule: from now on it has another velocity.

    Attributes:
        kind: `"moving_obstacle_turns"`.
        moving_obstacle: Its name.
        velocity_mps: Its velocity from then on: north, east, down [m/s].
    """

    changes_scene: ClassVar[bool] = True

    kind: Literal["moving_obstacle_turns"]
    moving_obstacle: Name
    velocity_mps: Velocity_mps

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """Its schedule ends with this velocity."""
        turn = ScheduledVelocity(from_s=time_s, velocity_mps=self.velocity_mps)
        return {
            "moving_obstacles": tuple(
                _with(obstacle, schedule=(*_before(obstacle, time_s), turn))
                if obstacle.name == self.moving_obstacle
                else obstacle
                for obstacle in scenario.moving_obstacles
            )
        }

    def mistakes(self, scenario: Any) -> Iterator[str]:
        """A moving obstacle that there is not."""
        known = [obstacle.name for obstacle in scenario.moving_obstacles]
        if self.moving_obstacle not in known:
            named = ", ".join(known[:8]) or "none"
            yield f"moving_obstacle: there is no {self.moving_obstacle!r}; there are: {named}"


class HomeClosed(OfUas):
    """The landing place of a UAS is closed; another takes its place.

    Attributes:
        kind: `"home_closed"`.
        alternative_m: Where it lands instead, at the height of a start [m].
    """

    changes_scene: ClassVar[bool] = True

    kind: Literal["home_closed"]
    alternative_m: Position_m

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """It lands at the other place."""
        fleet = list(scenario.uas)
        fleet[uas] = _with(fleet[uas], land_m=self.alternative_m)
        return {"uas": tuple(fleet)}


def _before(obstacle: MovingObstacle, time_s: float) -> tuple[ScheduledVelocity, ...]:
    return tuple(piece for piece in obstacle.schedule if piece.from_s < time_s)


def _with(entry: T, **changes: Any) -> T:
    # checked before; and a vehicle file may be elsewhere by now
    kind: Any = type(entry)
    return kind.model_construct(**{**dict(entry), **changes})


KINDS = (
    WaypointDropped,
    WaypointAdded,
    ObstacleAdded,
    NoFlyZoneAdded,
    MovingObstacleAdded,
    MovingObstacleTurns,
    HomeClosed,
)
