"""A scenario from what was drawn: fence, obstacles, waypoints and fleet in local metres."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from shapely.geometry import Point, Polygon

from uas_coverage_env.draw.signs import in_words
from uas_coverage_env.files.errors import InputError, check_within
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.flight.seen import SEARCH_AREA
from uas_coverage_env.operations.area_import.area_options import NO_OPTIONS
from uas_coverage_env.operations.area_import.camera_geometry import (
    CameraView,
    view_by,
    view_of,
    view_with,
)
from uas_coverage_env.operations.area_import.cameras import named_camera
from uas_coverage_env.operations.area_import.drawn_areas import Drawn, DrawnPolygon
from uas_coverage_env.operations.area_import.fleet import SPARE_M, Member, fleet_tables, parse_fleet
from uas_coverage_env.operations.area_import.import_notes import (
    drawn_notes,
    standing_notes,
    view_notes,
)
from uas_coverage_env.operations.area_import.prisms import Standing
from uas_coverage_env.operations.area_import.relief import Relief, relief_of
from uas_coverage_env.operations.area_import.site import (
    FENCE_MARGIN_M,
    Area,
    MissionSite,
    Wall,
    make_site,
    town_walls,
    zone_walls,
)
from uas_coverage_env.operations.area_import.town_map import Town, read_town
from uas_coverage_env.operations.area_import.waypoints import (
    Requirements,
    Waypoints,
    make_waypoints,
)
from uas_coverage_env.operations.convex import polygons_of, without_holes
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.feasibility import back_and_forth

FLOWN_BY = ("autopilot",)
UAS_SAFE_DISTANCE_M = 5.0
_FILES_OFF_M = 3.0
"""How much wider UAS that share a take-off place stand where files fly them."""

_ABOVE_WAYPOINTS_M = 30.0
"""Top of the fence above the waypoints, unless it is given."""

_LOWEST_ROOF_M = 0.5
"""Above the take-off places: in a valley, roofs may be below."""

_MOST_STEPS = 100_000
_OUTLINE_DETAIL_M = 0.5


@dataclass(frozen=True)
class ImportOptions:
    """How an area is flown.

    Attributes:
        fleet: `VEHICLE:COUNT,...`, or `VEHICLE+CAMERA:COUNT` for another camera.
        camera: The usual one: name of a shipped camera, or a file.
        height_m: Of the waypoints above the ground [m].
        resolution_cm: Instead: the most that a pixel may show; waypoints then ask for the camera,
            as they do where there are several [cm].
        radius_m: Of a waypoint's sphere [m].
        overlap: Share of a cell that the next picture shows again [-].
        max_speed_mps: At which a waypoint is covered, as the exposure allows; it then asks for the
            camera, too; None: at any [m/s].
        ceiling_m: Top of the fence above the ground; None: 30 m above the waypoints [m].
        homes: Latitude and longitude of take-off places, in place of the drawn ones [degrees].
        town: What stands there, from OpenStreetMap (.osm, .osm.pbf, .geojson).
        terrain: Grid of heights; None: the ground is flat.
        min_height_m: Least height of UAS above ground and roofs, but for take-off and landing [m].
        flown_by: What flies it in the end, `autopilot`; None: the world alone.
        speed_mps: The level speed that it is set to; None: the vehicle's largest [m/s].
        again_after_s: Times after which waypoints are asked for again, each from the time before,
            where an area does not say [s].
    """

    fleet: str = "s500_v2:2"
    camera: str = "sony-a6000"
    height_m: float = 40.0
    resolution_cm: float | None = None
    radius_m: float = 6.0
    overlap: float = 0.1
    max_speed_mps: float | None = None
    ceiling_m: float | None = None
    homes: tuple[tuple[float, float], ...] = ()
    town: Path | None = None
    terrain: Path | None = None
    min_height_m: float = 0.0
    flown_by: str | None = None
    speed_mps: float | None = None
    again_after_s: tuple[float, ...] = ()


@dataclass(frozen=True)
class Imported:
    """A scenario and what is to be said about it.

    Attributes:
        scenario: The mission.
        notes: Lines for the user.
        credit: Attribution of the data in it; empty where none is due.
    """

    scenario: Scenario
    notes: tuple[str, ...]
    credit: str


def make_scenario(things: Sequence[Drawn], name: str, options: ImportOptions) -> Imported:
    """A scenario in which all that was drawn to be searched is seen.

    Args:
        things: What was drawn.
        name: Of the scenario.
        options: How it is flown.

    Raises:
        InputError: Something in it cannot be flown.
    """
    _check(options)
    mission = _mission(things, options)
    scenario = _finite(parse({"name": name, **mission.tables()}, Scenario, name))
    town = mission.town
    credit = town.credit if town.standing or town.streets or town.no_fly else ""
    return Imported(scenario, tuple(mission.notes(things, scenario)), credit)


@dataclass(frozen=True, eq=False)
class _Mission:
    """All that a scenario is made of; attributes as the functions that make them say."""

    options: ImportOptions
    site: MissionSite
    relief: Relief
    town: Town
    walls: list[Wall]
    ceiling_m: float
    uas: list[dict[str, Any]]
    seen: list[tuple[Area, CameraView]]
    waypoints: Waypoints
    n_cameras: int

    def tables(self) -> dict[str, Any]:
        """The tables of the scenario."""
        waypoints, options = self.waypoints.all(), self.options
        again = any("again_after_s" in table for table in waypoints)
        speed = {} if options.speed_mps is None else {"speed_mps": options.speed_mps}
        execution = {"execution": {"flown_by": options.flown_by, **speed}}
        return {
            "schema": 1,
            "dt_s": 1.0,
            "max_steps": _MOST_STEPS,
            "landing_distance_m": 2.0,
            "landing_speed_mps": 0.5,
            "uas_safe_distance_m": UAS_SAFE_DISTANCE_M,
            "geofence": {
                "margin_m": FENCE_MARGIN_M,
                "vertices_m": _prism(self.site.fence, self.ceiling_m),
            },
            "obstacles": [
                {
                    "name": f"{wall.kind}_{n + 1}",
                    "kind": wall.kind,
                    "safe_distance_m": wall.safe_distance_m,
                    "vertices_m": _prism(wall.footprint, wall.top_m),
                }
                for n, wall in enumerate(self.walls)
            ],
            "uas": self.uas,
            "waypoints": waypoints,
            "decorations": [
                *_decorations(self.seen, several=self.n_cameras > 1),
                *_streets(self.town),
            ],
            "place": self.site.frame.place.model_dump(),
            **({"relaunch": True} if again else {}),
            **({"min_height_m": options.min_height_m} if options.min_height_m else {}),
            **(execution if options.flown_by else {}),
        }

    def notes(self, things: Sequence[Drawn], scenario: Scenario) -> Iterator[str]:
        """Lines for the user."""
        site, walls, waypoints = self.site, self.walls, self.waypoints
        uneven = self.relief.ground is not None
        yield from view_notes(self.seen, waypoints.above_m, uneven=uneven)
        yield (
            f"fence of {site.fence.area / 1e4:.1f} ha, {self.ceiling_m:g} m high; {len(walls)} "
            f"obstacle{'' if len(walls) == 1 else 's'}"
        )
        if uneven:
            yield self.relief.note(site)
        yield from standing_notes([*site.standing, *self.town.standing], self.town)
        yield from drawn_notes(things, site, [table["name"] for table in self.uas], self.town)
        if scenario.relaunch:
            visits = sum(waypoint.visits for waypoint in scenario.waypoints)
            yield (
                f"{len(scenario.waypoints)} waypoints, to be covered {visits} times in all: UAS "
                f"take off again (relaunch = true) on what their charge leaves; [sorties] gives "
                f"them packs"
            )
        if waypoints.too_high:
            yield (
                f"{waypoints.too_high} waypoints lie higher above the ground than asked: it is "
                f"below the take-off places, and no UAS flies below them"
            )
        if waypoints.left_out_m2 >= 0.5:
            out_m2 = waypoints.left_out_m2
            yield f"left out: {out_m2:.0f} m² that are seen from no place a UAS may take"


def _mission(things: Sequence[Drawn], options: ImportOptions) -> _Mission:
    """What the scenario is made of."""
    fleet = parse_fleet(options.fleet)
    views = _views(fleet, options)
    highest_m = _highest_m(things, views, options)
    site, relief = make_site(things, options.homes), Relief()
    uas = _fleet_tables(fleet, views, site, SPARE_M + (_FILES_OFF_M if options.flown_by else 0.0))
    if options.terrain is not None:
        starts_m = np.array([table["start_m"][1::-1] for table in uas])
        relief = relief_of(options.terrain, site, starts_m)
        site = replace(site, frame=site.frame.at_height(round(relief.start_m or 0.0, 3)))
    rise_m = relief.highest_m([area.shape for area in site.areas])
    ceiling_m = _ceiling_m(highest_m + rise_m, options)
    town = read_town(options.town, site.frame, site.fence) if options.town else Town()
    standing = [_raised(thing, relief) for thing in (*site.standing, *town.standing)]
    higher = [thing for thing in standing if thing.height_m >= _LOWEST_ROOF_M]
    walls = [
        *zone_walls(site, town.no_fly, ceiling_m),
        *relief.walls,
        *town_walls(higher, site.fence),
    ]
    _check_starts(uas, walls, site)
    seen = [(area, _view(views, area, options)) for area in site.areas]
    asks = len({view.name for _, view in seen}) > 1 or options.resolution_cm is not None
    speed_mps, again_after_s = options.max_speed_mps, options.again_after_s
    asked = Requirements(options.radius_m, speed_mps, options.min_height_m, asks, again_after_s)
    waypoints = make_waypoints(site, relief, walls, seen, ceiling_m, asked)
    return _Mission(options, site, relief, town, walls, ceiling_m, uas, seen, waypoints, len(views))


def _views(fleet: Sequence[Member], options: ImportOptions) -> tuple[CameraView, ...]:
    """How each camera of the fleet looks at the ground, the usual one first where it is carried."""
    how = options.height_m, options.resolution_cm, options.radius_m, options.overlap
    carried = dict.fromkeys(member.camera or options.camera for member in fleet)
    names = sorted(carried, key=lambda name: name != options.camera)
    return tuple(view_of(name, *how) for name in names)


def _raised(thing: Standing, relief: Relief) -> Standing:
    """Something on the highest ground under it."""
    ground_m = relief.range_m(*thing.footprint.bounds)[1]
    return replace(thing, height_m=thing.height_m + ground_m) if ground_m else thing


def _view(
    views: Sequence[CameraView], drawn: DrawnPolygon | Area, options: ImportOptions
) -> CameraView:
    """How an area is looked at."""
    view = view_by(views, drawn.camera, drawn.source)
    if drawn.options[:-1] == NO_OPTIONS[:-1]:
        return view
    try:
        return view_with(view, drawn.options, options.radius_m, options.overlap)
    except InputError as error:
        raise InputError(f"{drawn.source}: {error}") from error


def _highest_m(
    things: Sequence[Drawn], views: Sequence[CameraView], options: ImportOptions
) -> float:
    """Of the waypoints above the ground, roofs apart [m]."""
    areas = [t for t in things if isinstance(t, DrawnPolygon) and t.role == "search"]
    return max(view.height_m for view in (*views, *(_view(views, t, options) for t in areas)))


def _ceiling_m(highest_m: float, options: ImportOptions) -> float:
    if options.ceiling_m is None:
        return highest_m + _ABOVE_WAYPOINTS_M
    check_within("--ceiling", options.ceiling_m, highest_m + options.radius_m, 2_000.0)
    return options.ceiling_m


def _fleet_tables(
    fleet: Sequence[Member], views: Sequence[CameraView], site: MissionSite, spare_m: float
) -> list[dict[str, Any]]:
    """The tables `[[uas]]`, each with its camera."""
    tables = fleet_tables(
        [one.vehicle for one in fleet], site.homes_m, UAS_SAFE_DISTANCE_M, spare_m
    )
    for table, member in zip(tables, fleet, strict=True):
        name = named_camera(member.camera)[0] if member.camera else None
        table["sensors"] = [view_by(views, name, "--fleet").sensor()]
    return tables


def _check_starts(uas: Sequence[dict[str, Any]], walls: Sequence[Wall], site: MissionSite) -> None:
    for table in uas:
        north_m, east_m, _ = table["start_m"]
        place = Point(east_m, north_m)
        for wall in walls:
            if wall.footprint.distance(place) < table["radius_m"]:
                latitude, longitude, _ = site.frame.to_geodetic(table["start_m"])
                raise InputError(
                    f"{table['name']} would take off at {latitude:.6f},{longitude:.6f}, inside an "
                    f"obstacle ({in_words(wall.kind)}); draw its take-off place elsewhere, or give "
                    f"another --home"
                )


def _check(options: ImportOptions) -> None:
    if options.flown_by is not None:
        check_choice("--flown-by", options.flown_by, FLOWN_BY)
    if options.speed_mps is not None:
        if options.flown_by is None:
            raise InputError("--speed is an autopilot's; add --flown-by autopilot")
        check_within("--speed", options.speed_mps, 0.5, 100.0)
    check_within("--height", options.height_m, 1.0, 1_000.0)
    check_within("--radius", options.radius_m, 0.5, 1_000.0)
    check_within("--min-height", options.min_height_m, 0.0, 100.0)
    check_within("--overlap", options.overlap, 0.0, 0.9)
    if options.max_speed_mps is not None:
        check_within("--max-speed", options.max_speed_mps, 0.5, 100.0)


def _finite(scenario: Scenario) -> Scenario:
    """The scenario with as many steps as it should need, twice over."""
    rounds = max(waypoint.visits for waypoint in scenario.waypoints)
    waits_s = max(sum(waypoint.again_after_s) for waypoint in scenario.waypoints)
    seconds = rounds * back_and_forth(scenario).makespan_s + waits_s
    steps = math.ceil(2.0 * seconds / scenario.dt_s) + 300
    return scenario.model_copy(update={"max_steps": min(steps, _MOST_STEPS)})


def _prism(footprint: Polygon, top_m: float) -> list[list[float]]:
    """North, east, down of the corners of an upright prism [m]."""
    corners = [(round(north, 3), round(east, 3)) for east, north in footprint.exterior.coords[:-1]]
    return [[*corner, down] for down in (0.0, -round(top_m, 3)) for corner in corners]


def _decorations(seen: Sequence[tuple[Area, CameraView]], *, several: bool) -> list[dict[str, Any]]:
    """Outlines of the searched areas, to be drawn; where there are several cameras, of each."""
    parts = [
        (f"{SEARCH_AREA}_{view.name}" if several else SEARCH_AREA, outline)
        for area, view in seen
        for part in polygons_of(area.shape)
        for whole in polygons_of(part.simplify(_OUTLINE_DETAIL_M))
        for outline in without_holes(whole)
    ]
    return [_decoration(f"area_{n + 1}", kind, part) for n, (kind, part) in enumerate(parts)]


def _streets(town: Town) -> list[dict[str, Any]]:
    return [_decoration(f"street_{n + 1}", "street", part) for n, part in enumerate(town.streets)]


def _decoration(name: str, kind: str, shape: Polygon) -> dict[str, Any]:
    corners = [[round(north, 2), round(east, 2)] for east, north in shape.exterior.coords[:-1]]
    return {"name": name, "kind": kind, "polygon_m": corners}
