"""The report of an export as a page: one file, without anything from a network."""

from collections.abc import Sequence
from html import escape
from typing import Any

import shapely

from uas_coverage_env.draw.labels import short_name
from uas_coverage_env.draw.terrain import scale_step_m
from uas_coverage_env.operations.apart import Part
from uas_coverage_env.operations.convex import hull_of
from uas_coverage_env.operations.formats.qgc import ZONES
from uas_coverage_env.scenario import Obstacle

# custom properties of the style, so that the page can be light or dark
_INK, _AREA, _FENCE, _WAYPOINT = "var(--ink)", "var(--area)", "var(--fence)", "var(--waypoint)"
_OBSTACLE, _NO_FLY, _BAD = "var(--obstacle)", "var(--no-fly)", "var(--bad)"
_FILLS = {_OBSTACLE: "obstacle", _NO_FLY: "no-fly zone"}
_LIGHT = ("#0072b2", "#d55e00", "#aa4b8c", "#009e73", "#e69f00", "#56b4e9", "#26282c")
_DARK = ("#4d9cc9", "#e28e4d", "#c481ae", "#4dbb9d", "#eebc4d", "#89cbf0", "#b2b3b4")


def _of_uas(colours: Sequence[str]) -> str:
    return "".join(f"--uas-{n}:{colour};" for n, colour in enumerate(colours))


_STYLE = f"""
:root{{color-scheme:light dark;--paper:#fff;--ink:#26282c;--edge:#ddd;--outside:#eaebe0;
--area:#fff;--fence:#888;--obstacle:#bbb8b0;--no-fly:#d9a29c;--waypoint:#70be86;--bad:#c81e2d;
{_of_uas(_LIGHT)}}}
@media screen and (prefers-color-scheme:dark){{:root{{--paper:#131618;--ink:#e9e9e4;--edge:#363c3f;
--outside:#181c1d;--area:#262b2b;--fence:#c9ccc8;--obstacle:#5d5f5f;--no-fly:#7d4440;
--waypoint:#70be86;--bad:#ff5a5f;{_of_uas(_DARK)}}}}}
body{{font:15px system-ui,sans-serif;max-width:70rem;margin:2rem auto;padding:0 1rem;
color:var(--ink);background:var(--paper)}}
table{{border-collapse:collapse;margin:1rem 0}}
th,td{{padding:.2rem .7rem;text-align:right;border-bottom:1px solid var(--edge)}}
th:first-child,td:first-child{{text-align:left}}
td{{white-space:nowrap}}
svg{{width:100%;max-width:48rem;max-height:80vh;background:var(--outside)}}
svg text{{font-weight:600;paint-order:stroke;stroke:var(--area);fill:var(--ink)}}
.wide{{overflow-x:auto}}
.key span{{display:inline-block;margin-right:1rem}}
.key i{{display:inline-block;width:.8em;height:.8em;margin-right:.3em}}
.bad{{color:var(--bad);font-weight:600}}
summary{{cursor:pointer}}
"""
_NOTE = (
    "Times, charges and delays are those of a model of how ArduCopter flies the files, in still "
    "air; they differ from the planned flight. Charge is counted as in level flight at full speed."
)


def report_page(parts: Sequence[Part], data: dict[str, Any]) -> str:
    """The page.

    Args:
        parts: The flights of the mission, with their files.
        data: What `report` says of them.
    """
    title = f"{escape(data['scenario'])}, flown by {escape(data['planner'])}"
    blocks = [
        f"<h1>{title}</h1>",
        f"<p>{data['waypoints_passed']} of {data['waypoints']} waypoints are passed; files are "
        f"within {data['path_tolerance_m']:g} m of the flight. {_NOTE}</p>",
        _map(parts),
        _key(parts),
        _order(data),
        _fleet(data["uas"]),
        _waits(data["uas"]),
        _pairs(data),
        *(_legs(uas) for uas in data["uas"]),
    ]
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
    head += '<meta name="viewport" content="width=device-width,initial-scale=1">'
    return f"{head}<style>{_STYLE}</style><body>{''.join(blocks)}</body></html>\n"


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    cells = "".join(f"<th>{name}</th>" for name in head)
    body = "".join(f"<tr>{''.join(f'<td>{cell}</td>' for cell in row)}</tr>" for row in rows)
    return f'<div class="wide"><table><tr>{cells}</tr>{body}</table></div>'


def _order(data: dict[str, Any]) -> str:
    """When each file is started, and what is to be done after its landing."""
    if not data["turnarounds"]:
        return ""
    then = {entry["landed"]: entry for entry in data["turnarounds"]}
    rows = [
        [
            escape(uas["name"]),
            _clock(uas["begins_s"]),
            f"{uas['soc_start']:.0%}",
            _clock(uas["lands_s"]),
            f"{uas['soc_landed']:.0%}",
            _then(then.get(uas["name"])),
        ]
        for uas in sorted(data["uas"], key=lambda one: (one["begins_s"], one["name"]))
    ]
    head = ["file", "start at", "charge", "lands at", "charge", "then"]
    text = (
        "<p>Minutes and seconds from the start of the first files. Start each file by this clock, "
        "also where its UAS has landed or been swapped early.</p>"
    )
    return f"<h2>Order</h2>{text}" + _table(head, rows)


def _then(turnaround: dict[str, Any] | None) -> str:
    if turnaround is None:
        return "stays on the ground"
    what = "swap its pack" if turnaround["fresh_pack"] else "it flies on with the same pack"
    return (
        f"{what}; load {escape(turnaround['next'])} within {turnaround['on_ground_s']:.0f} s, "
        f"start it at {_clock(turnaround['starts_s'])}"
    )


def _clock(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def _fleet(fleet: Sequence[dict[str, Any]]) -> str:
    rows = []
    for uas in fleet:
        lost, least = uas["point_of_no_return"], uas["least_spare"]
        comes_home = (
            f"{least['spare']:.1%} at {least['time_s']:.0f} s, {least['spare_s']:.0f} s of flight"
            if lost is None
            else f'<span class="bad">point of no return before leg {lost["leg"]} ends, at '
            f"{lost['time_s']:.0f} s</span>"
        )
        height = uas["return_height_m"]
        rows.append(
            [
                escape(uas["name"]),
                f"{uas['duration_s']:.0f} ({uas['planned_s']:.0f})",
                f"{uas['soc_landed']:.1%} ({uas['planned_soc_landed']:.1%})",
                f"{uas['soc_reserve']:.0%}",
                comes_home,
                f"{uas['off_path_m']:.1f}",
                f"{uas['spare_room_m']:.1f}",
                "none is clear" if height is None else f"{height:g}",
            ]
        )
    head = [
        *("UAS", "flight (planned), s", "charge landed (planned)", "reserve"),
        *("least spare on the way", "off the path, m", "spare room, m", "return height, m"),
    ]
    return "<h2>Fleet</h2>" + _table(head, rows)


def _waits(fleet: Sequence[dict[str, Any]]) -> str:
    """What was put in for the UAS to keep apart."""
    lines = [
        f"<li>{escape(uas['name'])} {escape(line)}</li>" for uas in fleet for line in uas["waits"]
    ]
    return f"<p>To keep apart:</p><ul>{''.join(lines)}</ul>" if lines else ""


def _pairs(data: dict[str, Any]) -> str:
    pairs = data["pairs"]
    if not pairs:
        return ""
    rows = [
        [
            escape(" and ".join(pair["uas"])),
            f"{pair['least_distance_m']:.1f}",
            f"{pair['kept_m']:.1f}",
            "any delay" if pair["slack_s"] is None else f"{pair['slack_s']:.0f} s",
            "" if pair["place"] is None else _degrees(pair["place"]),
        ]
        for pair in pairs
    ]
    head = ["pair", "least distance, m", "to be kept, m", "either may be late by", "else close at"]
    text = "<p>All missions are started at the same time.</p>"
    if data["turnarounds"]:
        text = "<p>Files that are in the air at the same time, each started as the order says.</p>"
    return f"<h2>Delays</h2>{text}" + _table(head, rows)


def _legs(uas: dict[str, Any]) -> str:
    rows = [
        [
            f"{n} (stop of {leg['hold_s']:g} s)" if leg["stop"] else str(n),
            _degrees(leg),
            f"{leg['height_m']:.1f}",
            f"{leg['speed_mps']:g}",
            f"{leg['time_s']:.0f}",
            f"{leg['soc']:.1%}",
            f"{leg['home']:.1%}",
            f'<span class="bad">{leg["spare"]:.1%}</span>'
            if leg["spare"] < 0.0
            else f"{leg['spare']:.1%}",
        ]
        for n, leg in enumerate(uas["legs"], 1)
    ]
    head = [
        *("leg", "to", "height, m", "m/s", "at, s"),
        *("charge", "way home takes", "spare"),
    ]
    summary = f"<summary>{escape(uas['name'])}, {len(rows)} legs</summary>"
    return f"<details>{summary}{_table(head, rows)}</details>"


def _degrees(place: dict[str, float]) -> str:
    return f"{place['latitude_deg']:.6f}, {place['longitude_deg']:.6f}"


def _map(parts: Sequence[Part]) -> str:
    """The mission from above, north up: x is east, y is minus north."""
    scenario = parts[0].flight.scenario
    corners_m = scenario.fence.vertices_m[:, :2]
    low, high = corners_m.min(axis=0), corners_m.max(axis=0)
    span_m = float((high - low).max())
    pen = span_m / 400.0
    shapes = [_outline(scenario.fence.vertices_m, _drawn(pen, _FENCE, fill=_AREA))]
    shapes += [
        _outline(hull.vertices_m, f'style="fill:{_fill_of(obstacle)}"', obstacle.name)
        for obstacle, hull in zip(scenario.obstacles, scenario.hulls, strict=True)
    ]
    shapes += [
        f'<circle cx="{w.position_m[1]:.1f}" cy="{-w.position_m[0]:.1f}" r="{w.radius_m:g}" '
        f"{_drawn(pen / 2, _WAYPOINT)}/>"
        for w in scenario.waypoints
    ]
    homes: dict[str, tuple[float, float]] = {}
    names = parts[0].flight.names
    files = [(n, one) for n, name in enumerate(names) for part in parts for one in part.of(name)]
    for n, one in files:
        colour = _colour(n)
        line = " ".join(f"{y:.1f},{-x:.1f}" for x, y, _ in one.track.corners_m)
        shapes.append(
            f'<polyline points="{line}" {_drawn(1.5 * pen, colour)}>'
            f"<title>{escape(one.track.name)}</title></polyline>"
        )
        x, y, _ = one.track.home_m
        shapes.append(f'<circle cx="{y:.1f}" cy="{-x:.1f}" r="{4 * pen}" style="fill:{colour}"/>')
        homes[names[n]] = (y, -x)
        if one.track.lands_elsewhere:
            x, y, _ = one.track.landing_m
            shapes.append(
                f'<circle cx="{y:.1f}" cy="{-x:.1f}" r="{4 * pen}" {_drawn(2 * pen, colour)}>'
                f"<title>{escape(one.track.name)}: landing</title></circle>"
            )
        lost = one.point_of_no_return
        if lost is not None:
            x, y, _ = one.track.legs[lost].end_m
            shapes.append(
                f'<circle cx="{y:.1f}" cy="{-x:.1f}" r="{6 * pen}" {_drawn(2 * pen, _BAD)}>'
                f"<title>{escape(one.track.name)}: point of no return</title></circle>"
            )
    around = 0.02 * span_m
    for name, (x, y) in homes.items():
        shapes.append(_words(short_name(name), x, y - 6 * pen, pen, anchor="middle"))
    shapes.append(_scale(low[1], -low[0], span_m, pen))
    height, width = high - low + 2.0 * around
    box = f"{low[1] - around:.1f} {-high[0] - around:.1f} {width:.1f} {height:.1f}"
    told = escape(f"Map, north up: fence, obstacles, waypoints, legs of {', '.join(homes)}")
    return f'<svg viewBox="{box}" role="img" aria-label="{told}">{"".join(shapes)}</svg>'


def _words(text: str, x: float, y: float, pen: float, anchor: str = "start") -> str:
    size = f'font-size="{11 * pen:.1f}" stroke-width="{3 * pen:.1f}" text-anchor="{anchor}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" {size}>{escape(text)}</text>'


def _scale(west: float, south: float, span_m: float, pen: float) -> str:
    """A bar of a round length at the south-west, and where north is."""
    long_m = scale_step_m(span_m)
    bar = f"M{west + 4 * pen:.1f} {south - 4 * pen:.1f}h{long_m:g}"
    words = _words(f"{long_m:g} m, N \N{UPWARDS ARROW}", west + 4 * pen, south - 8 * pen, pen)
    return f'<path d="{bar}" {_drawn(2 * pen, _INK)}/>{words}'


def _key(parts: Sequence[Part]) -> str:
    """What is what on the map."""
    flight = parts[0].flight
    entries = [
        (_colour(n), "50%", name)
        for n, name in enumerate(flight.names)
        if any(part.of(name) for part in parts)
    ]
    fills = {_fill_of(obstacle) for obstacle in flight.scenario.obstacles}
    entries += [(fill, "0", name) for fill, name in _FILLS.items() if fill in fills]
    marks = "".join(
        f'<span><i style="background:{colour};border-radius:{corner}"></i>{escape(name)}</span>'
        for colour, corner, name in entries
    )
    return f'<p class="key">{marks}<span>green circles: waypoints</span></p>'


def _drawn(width_m: float, colour: str, fill: str = "none") -> str:
    """How a shape is drawn."""
    return f'style="fill:{fill};stroke:{colour}" stroke-width="{width_m:g}"'


def _colour(n: int) -> str:
    """That of the n-th UAS."""
    return f"var(--uas-{n % len(_LIGHT)})"


def _fill_of(obstacle: Obstacle) -> str:
    return _NO_FLY if obstacle.kind in ZONES else _OBSTACLE


def _outline(vertices_m: Any, style: str, name: str = "") -> str:
    ring = hull_of(shapely.MultiPoint(vertices_m[:, :2])).exterior.coords[:-1]
    points = " ".join(f"{east:.1f},{-north:.1f}" for north, east in ring)
    return f'<polygon points="{points}" {style}><title>{escape(name)}</title></polygon>'
