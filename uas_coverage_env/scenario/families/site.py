"""What all families are made of: a fenced site, things that stand on it, waypoints and a fleet.

Feasible by construction: every start and the centre of every waypoint keeps all distances from
everything that stands, and 1 m more, and so does the vertical line from it up to the ceiling or,
where something reaches up there, the level way out of it through a gap. Batteries are filled until
a plan that flies back and forth leaves 15 % of each.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.scenario.feasibility import back_and_forth
from uas_coverage_env.scenario.fields import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    Uas,
    Waypoint,
)
from uas_coverage_env.scenario.model import Scenario

Rng = np.random.Generator
Between = tuple[int, int]
"""Least and most."""
Place_m = tuple[float, float]
"""North and east."""
Inside = Callable[[float, float], bool]
"""(north, east) -> whether a place is wanted."""
Vertices_m = tuple[tuple[float, float, float], ...]

CEILING_M = 50.0
CLEARANCE_M = 3.76
"""Radius of the larger vehicle, and the safe distance from what stands."""
GAP_M = 2.0 * CLEARANCE_M + 6.0
"""Between two things that a UAS passes between."""
MARGIN_M = 18.0
"""From the border of the area to waypoints."""

DOD_MAX = 0.75
BETWEEN_STARTS_M = 20.0

_SAFE_DISTANCE_M, _FENCE_MARGIN_M = 3.0, 0.5
_RADIUS_M = {"s500_v2": 0.36, "hexacopter": 0.40}
_SPARE, _ENDLESS = 0.15, 100_000
_CHARGES = ((0.6, 1.0), (0.8, 1.0), (1.0, 1.0))
_MIN_HEIGHT_M = 3.0
_ALTITUDE_M, _ABOVE_ROOF_M = 14.0, 8.0
_BELOW_CEILING_M = 3.0
_DIRECTIONS, _FARTHEST_MOVE_M = 16, 30.0


@dataclass(frozen=True)
class Size:
    """How large a mission is; the counts are drawn.

    Attributes:
        n_uas: Least and most UAS.
        n_waypoints: Least and most waypoints.
        vehicles: Vehicles to draw from.
    """

    n_uas: Between = (2, 4)
    n_waypoints: Between = (20, 40)
    vehicles: tuple[str, ...] = ("s500_v2",)

    def draw(self, rng: Rng) -> tuple[int, int]:
        """A number of UAS and one of waypoints."""
        return int(rng.integers(self.n_uas[0], self.n_uas[1] + 1)), int(
            rng.integers(self.n_waypoints[0], self.n_waypoints[1] + 1)
        )


@dataclass(frozen=True)
class Wanted:
    """A waypoint that is wanted at a place; where something stands there, it is moved.

    Attributes:
        place_m: North and east.
        altitude_m: Above the ground; over a roof that is lower than the ceiling it is lifted.
        kind: Its label.
        weight: Its weight.
        radius_m: Its radius.
    """

    place_m: Place_m
    altitude_m: float = _ALTITUDE_M
    kind: str = "field"
    weight: float = 1.0
    radius_m: float = 15.0


def _anywhere(north_m: float, east_m: float) -> bool:
    return True


def strip_m(n_uas: int, north_m: float, beside_m: float = 16.0) -> float:
    """Width of the strip in the west that the starts of a fleet take; nothing stands there."""
    return BETWEEN_STARTS_M * math.ceil(n_uas / _start_rows(n_uas, north_m)) + beside_m


def _start_rows(n_uas: int, north_m: float) -> int:
    return min(n_uas, max(1, int((north_m - 2.0 * BETWEEN_STARTS_M) // BETWEEN_STARTS_M)))


def fleet(
    vehicles: Sequence[str],
    charges: Sequence[float],
    north_m: float,
    west_m: float,
    middle_m: float | None = None,
) -> tuple[Uas, ...]:
    """UAS on the ground in the strip, column by column.

    Args:
        vehicles: Of each UAS.
        charges: Likewise.
        north_m: Extent of the area to the north.
        west_m: East of the first column.
        middle_m: North of the middle of each column; None: that of the area.
    """
    if middle_m is None:
        middle_m = 0.5 * north_m
    rows = _start_rows(len(vehicles), north_m)
    made = []
    for i, vehicle in enumerate(vehicles):
        column, row = divmod(i, rows)
        start_north_m = round(middle_m + BETWEEN_STARTS_M * (row - 0.5 * (rows - 1)), 1)
        made.append(
            Uas(
                name=f"uas_{i + 1}",
                vehicle=vehicle,
                start_m=(start_north_m, west_m + BETWEEN_STARTS_M * column, -1.0),
                soc_0=charges[i],
                radius_m=_RADIUS_M.get(vehicle, max(_RADIUS_M.values())),
                dod_max=DOD_MAX,
            )
        )
    return tuple(made)


def fence_around(vertices_m: Vertices_m) -> Geofence:
    """A fence."""
    return Geofence(margin_m=_FENCE_MARGIN_M, vertices_m=vertices_m)


def mission(**fields: Any) -> Scenario:
    """A scenario with what all drawn ones have in common.

    Args:
        **fields: Whatever else it has.
    """
    common: dict[str, Any] = {
        "schema": 1,
        "dt_s": 1.0,
        "max_steps": _ENDLESS,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": 5.0,
    }
    return Scenario(**common | fields)


def with_time(draft: Scenario) -> Scenario | None:
    """The mission with steps enough, if a plan back and forth leaves 15 % of each battery."""
    plan = back_and_forth(draft, spare=_SPARE)
    if not plan.complete:
        return None
    # three times what back and forth takes, for planners that turn back early
    steps = 100 + math.ceil(3.0 * plan.makespan_s / draft.dt_s)
    return draft.model_copy(update={"max_steps": steps})


class Square(NamedTuple):
    """A square area of `side_m`, and in its west a strip of `west_m` for the starts."""

    side_m: float
    west_m: float

    @classmethod
    def of(cls, n_uas: int, side_m: float) -> "Square":
        """That of a fleet."""
        return cls(side_m, strip_m(n_uas, side_m))

    @classmethod
    def at_pitch(cls, n_uas: int, n_waypoints: int, pitch_m: float) -> "Square":
        """One with room for so many waypoints at a pitch."""
        return cls.of(n_uas, pitch_m * math.sqrt(n_waypoints) + 2.0 * MARGIN_M)

    def site(self, obstacles: Sequence[Obstacle] = (), **more: Any) -> "Site":
        """The site; arguments as for `Site`, but for the corners."""
        corners_m = outline((0.0, self.side_m), (0.0, self.west_m + self.side_m))
        return Site(corners_m, obstacles, **more)

    def spread_places(self, rng: Rng, count: int, inside: Inside = _anywhere) -> list[Place_m]:
        """`spread_places` over the square but for its margin."""
        least, most = MARGIN_M, self.side_m - MARGIN_M
        return spread_places(
            rng, (least, most), (self.west_m + least, self.west_m + most), count, inside
        )


def tag(rng: Rng) -> str:
    """What tells the names of two draws apart."""
    return f"{int(rng.integers(16**6)):06x}"


def outline(north_m: tuple[float, float], east_m: tuple[float, float]) -> list[Place_m]:
    """The corners of a rectangle."""
    return [(north_m[i], east_m[j]) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]


def prism(
    name: str,
    kind: str,
    corners_m: Sequence[Place_m],
    height_m: float,
    base_m: float = 0.0,
    safe_distance_m: float = _SAFE_DISTANCE_M,
) -> Obstacle:
    """Something upright with a convex outline."""
    return Obstacle(
        name=name,
        kind=kind,
        safe_distance_m=safe_distance_m,
        vertices_m=upright(corners_m, base_m, height_m),
    )


def upright(corners_m: Sequence[Place_m], base_m: float, height_m: float) -> Vertices_m:
    """Vertices of something upright: those at its base, then those at its top."""
    return tuple(
        (round(float(north), 1), round(float(east), 1), -round(float(z), 1))
        for z in (base_m, height_m)
        for north, east in corners_m
    )


def spread_places(
    rng: Rng,
    north_m: tuple[float, float],
    east_m: tuple[float, float],
    count: int,
    inside: Inside = _anywhere,
    jitter: float = 0.15,
) -> list[Place_m]:
    """So many places, about evenly spread over that part of a rectangle which is inside.

    Args:
        rng: Draws by how much they are off the grid, and which are left out.
        north_m: Of the rectangle.
        east_m: Likewise.
        count: How many.
        inside: Which places are wanted.
        jitter: Largest shift, as a share of the pitch.
    """
    size_m = np.array([north_m[1] - north_m[0], east_m[1] - east_m[0]])
    pitch_m = math.sqrt(float(size_m.prod()) / count)
    while True:
        shape = np.maximum(1, np.round(size_m / pitch_m).astype(int))
        shift = 0.5 + rng.uniform(-jitter, jitter, size=(*shape, 2))
        places = [
            (float(north_m[0] + size_m[0] * (i + shift[i, j, 0]) / shape[0]),
             float(east_m[0] + size_m[1] * (j + shift[i, j, 1]) / shape[1]))
            for i in range(shape[0])
            for j in range(shape[1])
        ]  # fmt: skip
        places = [place for place in places if inside(*place)]
        if len(places) >= count:
            kept = np.sort(rng.choice(len(places), size=count, replace=False))
            return [places[k] for k in kept]
        pitch_m *= 0.95


@dataclass(frozen=True)
class Site:
    """An area with what stands and moves on it.

    Attributes:
        corners_m: Corners of the convex fence, north and east.
        obstacles: What stands.
        moving: What moves.
        decorations: What is drawn only.
        starts_north_m: Where the fleet begins, around this line [m].
    """

    corners_m: Sequence[Place_m]
    obstacles: Sequence[Obstacle] = ()
    moving: Sequence[MovingObstacle] = ()
    decorations: Sequence[Decoration] = ()
    starts_north_m: float | None = None

    def clearance_m(self, point_m: Sequence[float]) -> float:
        """The least distance of a point from what stands and from the fence, less what is kept."""
        normals, offsets_m, firsts, kept_m = self._faces
        faces_m = normals @ np.asarray(point_m) + offsets_m
        return float((np.maximum.reduceat(faces_m, firsts) - kept_m).min())

    @cached_property
    def _faces(self) -> tuple[NDArray[Any], ...]:
        """Faces of all bodies, the fence turned inside out: normals, offsets, firsts, distances."""
        fence = self._fence.hull
        normals, offsets_m, kept_m = [], [], []
        for normal, offset_m in zip(fence.normals, fence.offsets_m, strict=True):
            normals.append(-normal[None])
            offsets_m.append(np.array([-offset_m]))
            kept_m.append(_FENCE_MARGIN_M)
        for obstacle in self.obstacles:
            normals.append(obstacle.hull.normals)
            offsets_m.append(obstacle.hull.offsets_m)
            kept_m.append(CLEARANCE_M)
        firsts = np.cumsum([0, *map(len, offsets_m[:-1])])
        return np.concatenate(normals), np.concatenate(offsets_m), firsts, np.array(kept_m)

    def scenario(
        self, rng: Rng, name: str, n_uas: int, wanted: Sequence[Wanted], size: Size
    ) -> Scenario:
        """The mission.

        Args:
            rng: Draws charges and vehicles.
            name: Of the scenario.
            n_uas: UAS of the fleet.
            wanted: Waypoints, moved where something stands.
            size: Which vehicles there are.

        Raises:
            ValueError: Not even full batteries suffice.
        """
        waypoints = tuple(self._placed(waypoint) for waypoint in wanted)
        vehicles = rng.choice(np.array(size.vehicles), size=n_uas).tolist()
        fullness = rng.uniform(0.0, 1.0, size=n_uas)
        corners = np.array(self.corners_m)
        north_m, west_m = float(np.ptp(corners[:, 0])), float(corners[:, 1].min()) + 8.0
        middle_m = self.starts_north_m
        if middle_m is None:
            middle_m = float(0.5 * (corners[:, 0].min() + corners[:, 0].max()))
        for least, most in _CHARGES:
            charges = [round(float(charge), 2) for charge in least + (most - least) * fullness]
            draft = mission(
                name=name,
                geofence=self._fence,
                min_height_m=_MIN_HEIGHT_M,
                obstacles=tuple(self.obstacles),
                moving_obstacles=tuple(self.moving),
                uas=fleet(vehicles, charges, north_m, west_m, middle_m),
                waypoints=waypoints,
                decorations=tuple(self.decorations),
            )
            if (flown := with_time(draft)) is not None:
                return flown
        raise ValueError(
            f"{len(waypoints)} waypoints are more than the batteries of {n_uas} UAS can cover; "
            f"take more UAS or fewer waypoints"
        )

    @cached_property
    def _fence(self) -> Geofence:
        return fence_around(upright(self.corners_m, 0.0, CEILING_M))

    def _placed(self, wanted: Wanted) -> Waypoint:
        """A waypoint at the place, over the roof there, or as near beside it as can be.

        Raises:
            ValueError: There is no place for it.
        """
        north_m, east_m = wanted.place_m
        for away_m in np.arange(0.0, _FARTHEST_MOVE_M + 1e-9, 1.5):
            for k in range(_DIRECTIONS if away_m else 1):
                turn = 2.0 * math.pi * k / _DIRECTIONS
                place_m = north_m + away_m * math.cos(turn), east_m + away_m * math.sin(turn)
                altitude_m = self._altitude_m(place_m, wanted.altitude_m)
                if altitude_m is not None:
                    return Waypoint(
                        kind=wanted.kind,
                        position_m=(
                            round(place_m[0], 1), round(place_m[1], 1), -round(altitude_m, 1)
                        ),
                        radius_m=wanted.radius_m,
                        weight=wanted.weight,
                    )  # fmt: skip
        raise ValueError(f"there is no room for a waypoint near {wanted.place_m}")

    def _altitude_m(self, place_m: Place_m, altitude_m: float) -> float | None:
        """At which altitude a waypoint at a place is free; None: at none."""
        if self.clearance_m((*place_m, -altitude_m)) >= 1.0:
            return altitude_m
        top_m = 0.0
        for obstacle in self.obstacles:
            if float(obstacle.hull.signed_distance(np.array([[*place_m, 0.0]]))[0]) < CLEARANCE_M:
                top_m = max(top_m, -float(obstacle.hull.vertices_m[:, 2].min()))
        lifted_m = max(altitude_m, top_m + _ABOVE_ROOF_M)
        if lifted_m > CEILING_M - _FENCE_MARGIN_M - _BELOW_CEILING_M:
            return None
        return lifted_m if self.clearance_m((*place_m, -lifted_m)) >= 1.0 else None
