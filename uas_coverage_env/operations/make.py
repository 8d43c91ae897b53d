"""A scenario from what was drawn: fence, obstacles, waypoints and fleet in local metres."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import shapely
from shapely.geometry import Point, Polygon

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.operations.cameras import Camera, named_camera
from uas_coverage_env.operations.convex import polygons_of, without_holes
from uas_coverage_env.operations.drawing import Drawn
from uas_coverage_env.operations.fleet import fleet_tables, parse_fleet
from uas_coverage_env.operations.layout import MOST_WAYPOINTS, lay_waypoints
from uas_coverage_env.operations.site import (
    FENCE_MARGIN_M,
    LARGEST_UAS_M,
    Site,
    Wall,
    building_walls,
    make_site,
)
from uas_coverage_env.operations.town import Town, read_town
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.endurance import back_and_forth

UAS_SAFE_DISTANCE_M = 5.0
_SPARE_M = 1.0
"""Between a waypoint and the nearest place that a UAS may take."""

_MOST_STEPS = 100_000
_OUTLINE_DETAIL_M = 0.5


@dataclass(frozen=True)
class ImportOptions:
    """How an area is flown.

    Attributes:
        fleet: `VEHICLE:COUNT,...`.
        camera: Name of a shipped camera, or a file.
        height_m: Of the waypoints above the ground [m].
        radius_m: Of a waypoint's sphere [m].
        overlap: Share of a cell that the next picture shows again [-].
        asks: Whether waypoints ask for the camera; with a speed they do in any case.
        max_speed_mps: At which a waypoint is covered, as the exposure allows; None: at any [m/s].
        ceiling_m: Top of the fence above the ground [m].
        homes: Latitude and longitude of take-off places, in place of the drawn ones [degrees].
        town: GeoJSON of buildings.
    """

    fleet: str = "s500_v2:2"
    camera: str = "sony-a6000"
    height_m: float = 40.0
    radius_m: float = 6.0
    overlap: float = 0.1
    asks: bool = False
    max_speed_mps: float | None = None
    ceiling_m: float = 70.0
    homes: tuple[tuple[float, float], ...] = ()
    town: Path | None = None


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
    fleet = parse_fleet(options.fleet)
    camera_name, camera = named_camera(options.camera)
    pitch_m = camera.pitch_m(options.height_m, options.radius_m, options.overlap)
    site = make_site(things, options.homes, options.ceiling_m)
    town = read_town(options.town, site.frame, site.fence) if options.town else Town()
    walls = [*site.no_fly, *building_walls(town.buildings, site.fence)]
    waypoints, left_out_m2 = _waypoints(site, walls, pitch_m, options)
    tables = {
        "schema": 1,
        "name": name,
        "dt_s": 1.0,
        "max_steps": _MOST_STEPS,
        "landing_distance_m": 2.0,
        "landing_speed_mps": 0.5,
        "uas_safe_distance_m": UAS_SAFE_DISTANCE_M,
        "geofence": {
            "margin_m": FENCE_MARGIN_M,
            "vertices_m": _prism(site.fence, options.ceiling_m),
        },
        "obstacles": [
            {
                "name": f"{wall.kind}_{n + 1}",
                "kind": wall.kind,
                "safe_distance_m": wall.safe_distance_m,
                "vertices_m": _prism(wall.footprint, wall.top_m),
            }
            for n, wall in enumerate(walls)
        ],
        "uas": [
            uas | {"sensors": [_sensor(camera_name, camera)]}
            for uas in fleet_tables(fleet, site.homes_m, UAS_SAFE_DISTANCE_M)
        ],
        "waypoints": [waypoint | _asked(camera_name, options) for waypoint in waypoints],
        "decorations": _decorations(site),
        "place": site.frame.place.model_dump(),
    }
    scenario = _finite(parse(tables, Scenario, name))
    hectares = sum(area.area for _, area in site.areas) / 1e4
    notes = [
        f"{hectares:.1f} ha in {len(waypoints)} waypoints, at most {pitch_m[0]:.1f} m apart from "
        f"west to east and {pitch_m[1]:.1f} m from south to north; "
        f"{100.0 * camera.ground_sample_m(options.height_m):.1f} cm per pixel",
        f"fence of {site.fence.area / 1e4:.1f} ha, {options.ceiling_m:g} m high; "
        f"{len(walls)} obstacles",
        *_town_notes(town),
        *_raised_notes(waypoints, camera, options),
    ]
    if left_out_m2 >= 0.5:
        notes.append(f"left out: {left_out_m2:.0f} m² that are seen from no place a UAS may take")
    return Imported(scenario, tuple(notes), town.credit if town.buildings else "")


def _sensor(name: str, camera: Camera) -> dict[str, Any]:
    """The table of a camera on a UAS."""
    return {"name": name, "field_of_view_deg": list(camera.field_of_view_deg())}


def _asked(name: str, options: ImportOptions) -> dict[str, Any]:
    """What waypoints ask for."""
    if options.max_speed_mps is not None:
        return {"sensor": name, "max_speed_mps": options.max_speed_mps}
    return {"sensor": name} if options.asks else {}


def _raised_notes(
    waypoints: Sequence[dict[str, Any]], camera: Camera, options: ImportOptions
) -> list[str]:
    """What waypoints over roofs show less sharply."""
    heights_m = [-waypoint["position_m"][2] for waypoint in waypoints]
    raised = sum(height > options.height_m + 1e-3 for height in heights_m)
    if not raised:
        return []
    worst_cm = 100.0 * camera.ground_sample_m(max(heights_m))
    return [f"{raised} waypoints lie higher, over roofs: up to {worst_cm:.1f} cm per pixel there"]


def _check(options: ImportOptions) -> None:
    allowed = {
        "--height": (options.height_m, 1.0, 1_000.0),
        "--radius": (options.radius_m, 0.5, 1_000.0),
        "--overlap": (options.overlap, 0.0, 0.9),
        "--ceiling": (options.ceiling_m, options.height_m + options.radius_m, 2_000.0),
    }
    if options.max_speed_mps is not None:
        allowed["--max-speed"] = (options.max_speed_mps, 0.5, 100.0)
    for name, (value, least, most) in allowed.items():
        if not least <= value <= most:
            raise InputError(f"{name} {value:g}: should be between {least:g} and {most:g}")


def _waypoints(
    site: Site, walls: Sequence[Wall], pitch_m: tuple[float, float], options: ImportOptions
) -> tuple[list[dict[str, Any]], float]:
    """The tables `[[waypoints]]`, and the area that is left out [m²]."""
    keep_m = LARGEST_UAS_M + _SPARE_M
    low, high = [], []
    for wall in walls:
        fits = wall.top_m + wall.safe_distance_m + keep_m <= options.ceiling_m - FENCE_MARGIN_M
        (low if fits else high).append(wall)
    allowed = site.fence.buffer(-(FENCE_MARGIN_M + keep_m)).difference(
        shapely.union_all([wall.footprint.buffer(wall.safe_distance_m + keep_m) for wall in high])
    )
    if allowed.is_empty:
        raise InputError("no waypoint has room in the fence; enlarge the fence")
    roofs = shapely.STRtree([w.footprint.buffer(w.safe_distance_m + keep_m) for w in low])
    tables: list[dict[str, Any]] = []
    left_out_m2 = 0.0
    for number, (weight, area) in enumerate(site.areas):
        layout = lay_waypoints(area, pitch_m, allowed, f"area {number + 1}")
        left_out_m2 += layout.left_out_m2
        for east_m, north_m in layout.places_m:
            under = roofs.query(Point(east_m, north_m), "intersects")
            tops = [low[k].top_m + low[k].safe_distance_m + keep_m for k in under]
            position_m = (north_m, east_m, -max(options.height_m, *tops, 0.0))
            tables.append(
                {
                    "kind": "search",
                    "position_m": [round(value, 3) for value in position_m],
                    "radius_m": options.radius_m,
                    "weight": weight,
                }
            )
    if len(tables) > MOST_WAYPOINTS:
        raise InputError(
            f"the areas need {len(tables)} waypoints, more than {MOST_WAYPOINTS}; fly higher "
            f"(--height), or divide them into missions"
        )
    if not tables:
        raise InputError("nothing of the areas is seen from any place that a UAS may take")
    return tables, left_out_m2


def _finite(scenario: Scenario) -> Scenario:
    """The scenario with as many steps as it should need, twice over."""
    seconds = back_and_forth(scenario).makespan_s
    steps = math.ceil(2.0 * seconds / scenario.dt_s) + 300
    return scenario.model_copy(update={"max_steps": min(steps, _MOST_STEPS)})


def _prism(footprint: Polygon, top_m: float) -> list[list[float]]:
    """North, east, down of the corners of an upright prism [m]."""
    corners = [(round(north, 3), round(east, 3)) for east, north in footprint.exterior.coords[:-1]]
    return [[*corner, down] for down in (0.0, -round(top_m, 3)) for corner in corners]


def _decorations(site: Site) -> list[dict[str, Any]]:
    """Outlines of the searched areas, to be drawn."""
    parts = [
        outline
        for _, area in site.areas
        for part in polygons_of(area)
        for whole in polygons_of(part.simplify(_OUTLINE_DETAIL_M))
        for outline in without_holes(whole)
    ]
    return [
        {
            "name": f"area_{n + 1}",
            "kind": "search_area",
            "polygon_m": [
                [round(north, 2), round(east, 2)] for east, north in part.exterior.coords[:-1]
            ],
        }
        for n, part in enumerate(parts)
    ]


def _town_notes(town: Town) -> list[str]:
    if not town.buildings:
        return []
    notes = [
        f"{len(town.buildings)} buildings, the heights of {town.guessed} of them guessed from "
        f"their kind"
    ]
    if town.unread:
        tag, _ = town.unread.most_common(1)[0]
        notes.append(f"{town.unread.total()} tags of heights cannot be read, such as {tag!r}")
    return notes
