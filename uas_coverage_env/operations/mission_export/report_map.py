"""The map of an export's report: the mission from above, as SVG."""

from collections.abc import Iterator, Sequence
from html import escape
from typing import Any

from uas_coverage_env.draw.colours import UAS
from uas_coverage_env.draw.labels import short_name
from uas_coverage_env.draw.terrain import scale_step_m
from uas_coverage_env.flight.seen import SEARCH_AREA
from uas_coverage_env.geometry.outline import outline_of
from uas_coverage_env.operations.mission_export.formats.geofence import ZONES
from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.scheduling import FlightFiles
from uas_coverage_env.operations.mission_export.tracks import FloatArray
from uas_coverage_env.scenario import Decoration, Obstacle

# custom properties of the page's style, so that it can be light or dark
_INK, _AREA, _FENCE, _WAYPOINT = "var(--ink)", "var(--panel)", "var(--fence)", "var(--covered)"
_OBSTACLE, _NO_FLY, _BAD = "var(--obstacle)", "var(--no-fly)", "var(--discharged)"
_SEARCH, _STREET = "var(--search)", "var(--street)"
_FILLS = {
    _SEARCH: "area to search",
    _STREET: "street",
    _OBSTACLE: "obstacle",
    _NO_FLY: "no-fly zone",
}


def map_of(parts: Sequence[FlightFiles]) -> str:
    """The mission from above, north up: x is east, y is minus north.

    Args:
        parts: The flights of the mission, with their files.
    """
    scenario = parts[0].flight.scenario
    corners_m = scenario.fence.vertices_m[:, :2]
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    span_m = float((high - low).max())
    pen = span_m / 400.0
    shapes = [_outline(scenario.fence.vertices_m, _drawn(pen, _FENCE, fill=_AREA))]
    shapes += [
        _polygon([(-x, y) for x, y in item.polygon_m], _filled(fill), item.name)
        for item in scenario.decorations
        if (fill := _fill_of(item))
    ]
    shapes += [
        _outline(hull.vertices_m, _filled(_fill_of(obstacle)), obstacle.name)
        for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
    ]
    shapes += [
        f'<circle cx="{w.position_m[1]:.1f}" cy="{-w.position_m[0]:.1f}" r="{w.radius_m:g}" '
        f"{_drawn(pen / 2, _WAYPOINT)}/>"
        for w in scenario.waypoints
    ]
    names = parts[0].flight.names
    files = [(n, one) for n, name in enumerate(names) for part in parts for one in part.of(name)]
    for n, one in files:
        shapes += _file(one, _colour(n), pen)
    homes = {names[n]: (one.track.home_m[1], -one.track.home_m[0]) for n, one in files}
    around = 0.02 * span_m
    for name, (x, y) in homes.items():
        shapes.append(_words(short_name(name), x, y - 6 * pen, pen, anchor="middle"))
    shapes.append(_scale(low[1], -low[0], span_m, pen))
    height, width = high - low + 2.0 * around
    box = f"{low[1] - around:.1f} {-high[0] - around:.1f} {width:.1f} {height:.1f}"
    told = escape(f"Map, north up: fence, obstacles, waypoints, legs of {', '.join(homes)}")
    return f'<svg viewBox="{box}" role="img" aria-label="{told}">{"".join(shapes)}</svg>'


def _file(one: MissionFile, colour: str, pen: float) -> Iterator[str]:
    """The legs of a file, where it begins and ends, and from where it does not come home."""
    name = escape(one.track.name)

    def ring(place_m: FloatArray, radius: float, style: str, title: str = "") -> str:
        x, y, _ = place_m
        text = f"><title>{title}</title></circle>" if title else "/>"
        return f'<circle cx="{y:.1f}" cy="{-x:.1f}" r="{radius * pen}" {style}{text}'

    line = " ".join(f"{y:.1f},{-x:.1f}" for x, y, _ in one.track.corners_m)
    yield f'<polyline points="{line}" {_drawn(1.5 * pen, colour)}><title>{name}</title></polyline>'
    yield ring(one.track.home_m, 4, _filled(colour))
    if one.track.lands_elsewhere:
        yield ring(one.track.landing_m, 4, _drawn(2 * pen, colour), f"{name}: landing")
    lost = one.still.point_of_no_return
    if lost is None and one.in_wind is not None:
        lost = one.in_wind.point_of_no_return
    if lost is not None:
        style = _drawn(2 * pen, _BAD)
        yield ring(one.track.legs[lost].end_m, 6, style, f"{name}: point of no return")


def _words(text: str, x: float, y: float, pen: float, anchor: str = "start") -> str:
    size = f'font-size="{11 * pen:.1f}" stroke-width="{3 * pen:.1f}" text-anchor="{anchor}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {size}>{escape(text)}</text>'


def _scale(west: float, south: float, span_m: float, pen: float) -> str:
    """A bar of a round length at the south-west, and where north is."""
    long_m = scale_step_m(span_m)
    bar = f"M{west + 4 * pen:.1f} {south - 4 * pen:.1f}h{long_m:g}"
    words = _words(f"{long_m:g} m, N \N{UPWARDS ARROW}", west + 4 * pen, south - 8 * pen, pen)
    return f'<path d="{bar}" {_drawn(2 * pen, _INK)}/>{words}'


def key_of(parts: Sequence[FlightFiles]) -> str:
    """What is what on the map.

    Args:
        parts: The flights of the mission, with their files.
    """
    flight = parts[0].flight
    entries = [
        (_colour(n), "50%", name)
        for n, name in enumerate(flight.names)
        if any(part.of(name) for part in parts)
    ]
    drawn = (*flight.scenario.decorations, *flight.scenario.obstacles)
    fills = set(map(_fill_of, drawn))
    entries += [(fill, "0", name) for fill, name in _FILLS.items() if fill in fills]
    marks = "".join(
        f'<span><i style="background:{colour};border-radius:{corner}"></i>{escape(name)}</span>'
        for colour, corner, name in entries
    )
    return f'<p class="key">{marks}<span>green circles: waypoints</span></p>'


def _drawn(width_m: float, colour: str, fill: str = "none") -> str:
    """How a shape is drawn."""
    return f'style="fill:{fill};stroke:{colour}" stroke-width="{width_m:g}"'


def _filled(colour: str) -> str:
    return f'style="fill:{colour}"'


def _colour(n: int) -> str:
    """That of the n-th UAS."""
    return f"var(--uas-{n % len(UAS)})"


def _fill_of(drawn: Decoration | Obstacle) -> str:
    """The colour of something on the map; none where it is not shown."""
    kind = drawn.kind or ""
    if isinstance(drawn, Obstacle):
        return _NO_FLY if kind in ZONES else _OBSTACLE
    return _SEARCH if kind.startswith(SEARCH_AREA) else _STREET if kind == "street" else ""


def _outline(vertices_m: Any, style: str, name: str = "") -> str:
    return _polygon([(-north, east) for north, east in outline_of(vertices_m)], style, name)


def _polygon(corners: Sequence[tuple[float, float]], style: str, name: str) -> str:
    """A polygon of (south, east) corners."""
    points = " ".join(f"{east:.1f},{south:.1f}" for south, east in corners)
    return f'<polygon points="{points}" {style}><title>{escape(name)}</title></polygon>'
