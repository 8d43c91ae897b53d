"""The report of an export as a page: one file, without anything from a network."""

from collections.abc import Sequence
from html import escape
from typing import Any

from uas_coverage_env.draw.colours import page_style
from uas_coverage_env.operations.mission_export.failure_responses import FAILURES
from uas_coverage_env.operations.mission_export.report_map import key_of, map_of
from uas_coverage_env.operations.mission_export.scheduling import FlightFiles

_STYLE = (
    page_style()
    + """body{font:15px system-ui,sans-serif;max-width:80rem;margin:2rem auto;padding:0 1rem;
color:var(--ink);background:var(--paper)}
table{border-collapse:collapse;margin:1rem 0}
th,td{padding:.2rem .7rem;text-align:right;border-bottom:1px solid var(--edge)}
th:first-child,td:first-child{text-align:left}
td{white-space:nowrap}
svg{width:100%;max-width:48rem;max-height:80vh;background:var(--outside)}
svg text{font-weight:600;paint-order:stroke;stroke:var(--panel);fill:var(--ink)}
.wide{overflow-x:auto}
.key span{display:inline-block;margin-right:1rem}
.key i{display:inline-block;width:.8em;height:.8em;margin-right:.3em}
.bad{color:var(--discharged);font-weight:600}
summary{cursor:pointer}
"""
)
_NOTE = (
    "Times, charges and delays are those of a model of how ArduCopter flies the files, in still "
    "air unless the page says otherwise; they differ from the planned flight. Charge is counted as "
    "in level flight at full speed."
)
_COLUMNS = (
    "Spare: charge, and time to fly, beyond the way home with a margin and the reserve; the least "
    "of all legs. Room: least distance from obstacles and fence beyond the safe distances, of "
    "which legs may use up 1 m. Return: the height at which a UAS can climb and fly straight home "
    "from anywhere on its path; where there is none, only the way that it came is known to be "
    "clear. Low charge: at what the vehicle comes home on its own, that way."
)
_EVENTS = {failure.event: n for n, failure in enumerate(FAILURES)}


def report_page(parts: Sequence[FlightFiles], data: dict[str, Any], notes: Sequence[str]) -> str:
    """The page.

    Args:
        parts: The flights of the mission, with their files.
        data: What `report` says of them.
        notes: What the files cannot keep.
    """
    title = f"{escape(data['scenario'])}, flown by {escape(data['planner'])}"
    blocks = [
        f"<h1>{title}</h1>",
        _summary(data, notes),
        map_of(parts),
        key_of(parts),
        _order(data),
        _failing(data),
        _fleet(data["uas"]),
        _pairs(data),
        "<h2>Legs</h2>",
        *(_legs(uas) for uas in data["uas"]),
        f"<p>Files are within {data['path_tolerance_m']:g} m of the flight. {_NOTE}</p>",
    ]
    head = f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{title}</title>'
    head += '<meta name="viewport" content="width=device-width,initial-scale=1">'
    return f"{head}<style>{_STYLE}</style><body>{''.join(blocks)}</body></html>\n"


def _summary(data: dict[str, Any], notes: Sequence[str]) -> str:
    """What one has to know before the first take-off, in a few lines."""
    fleet, pairs = data["uas"], data["pairs"]
    flying = len({uas["uas"] for uas in fleet})
    first = fleet[0]["legs"][-1]
    passed, all_of_them = data["waypoints_passed"], data["waypoints"]
    waits = [f"{uas['name']} {line}" for uas in fleet for line in uas["waits"]]
    unsafe = [f"{uas['name']} {line}" for uas in fleet for line in uas["not_safe"]]
    lines = [_marked(f"{escape(line)}.", True) for line in unsafe]
    lines += [
        f"{_count(flying, 'UAS', 'UAS')} with {_count(len(fleet), 'file', 'files')}, "
        f"{_clock(data['duration_s'])} min from the first start to the last landing, near "
        f"{_degrees(first)}.",
        _marked(f"{passed} of {all_of_them} waypoints are passed.", passed < all_of_them),
        *_spare(fleet, "still air", fleet),
    ]
    in_wind = [uas["in_wind"] for uas in fleet if uas["in_wind"]]
    if in_wind:
        worst_mps = max(one["headwind_mps"] for one in in_wind)
        lines += _spare(fleet, f"a headwind of {worst_mps:.1f} m/s on all legs", in_wind)
    if pairs:
        slack_s = min((p["slack_s"] for p in pairs if p["slack_s"] is not None), default=None)
        late = "any delay" if slack_s is None else f"{slack_s:.0f} s"
        how = "as the order below says" if data["turnarounds"] else "at the same time"
        lines.append(f"Start the files {how}. Any UAS may be late by {late}.")
        timed = sum(p["slack_s"] is not None for p in pairs)
        lines.append(
            f"Of {_count(len(pairs), 'pair', 'pairs')}, {timed} {'is' if timed == 1 else 'are'} "
            f"kept apart by timing (see Delays), the others whatever the delay."
        )
    lines += [f"To keep apart, {escape(line)}." for line in waits]
    lines += [f"Note: {escape(note)}." for note in notes if note not in (*waits, *unsafe)]
    return f"<ul>{''.join(f'<li>{line}</li>' for line in lines)}</ul>"


def _spare(
    fleet: Sequence[dict[str, Any]], air: str, charges: Sequence[dict[str, Any]]
) -> list[str]:
    """The lowest charge at a landing, and whether all can always come home."""
    named = list(zip(fleet, charges, strict=True))
    lands, lowest = min(named, key=lambda pair: pair[1]["soc_landed"] - pair[0]["soc_reserve"])
    uas, tightest = min(named, key=lambda pair: pair[1]["least_spare"]["spare"])
    least = tightest["least_spare"]
    lost = tightest["point_of_no_return"]
    home = (
        f"the way home can begin at any time: the least is {least['spare']:.0%} to spare "
        f"({escape(uas['name'])} at {_clock(least['time_s'])})."
        if lost is None
        else f"{escape(uas['name'])} has a point of no return at {_clock(lost['time_s'])}."
    )
    landing = (
        f"In {air}, the lowest charge at a landing is {_share(lowest['soc_landed'])} "
        f"({escape(lands['name'])}; reserve {lands['soc_reserve']:.0%})"
    )
    return [_marked(f"{landing}; {home}", lost is not None)]


def _marked(text: str, bad: bool) -> str:
    return f'<span class="bad">{text}</span>' if bad else text


def _count(number: int, one: str, many: str) -> str:
    return f"{number} {one if number == 1 else many}"


def _share(soc: float) -> str:
    return "none" if soc <= 0.0 else f"{soc:.1%}"


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
    windy = any(uas["in_wind"] for uas in fleet)
    rows = []
    for uas in fleet:
        height = uas["return_height_m"]
        in_wind = uas["in_wind"]
        rows.append(
            [
                escape(uas["name"]),
                f"{uas['duration_s']:.0f} ({uas['planned_s']:.0f})",
                f"{uas['soc_landed']:.1%} ({uas['planned_soc_landed']:.1%})",
                f"{uas['soc_reserve']:.0%}",
                _comes_home(uas),
                *([_share(in_wind["soc_landed"]), _comes_home(in_wind)] if in_wind else []),
                f"{uas['off_path_m']:.1f}",
                f"{uas['spare_room_m']:.1f}",
                "the way it came" if height is None else f"at {height:g} m",
                f"{uas['low_charge']['soc']:.0%} or {uas['low_charge']['voltage_V']:g} V",
            ]
        )
    head = [
        *("UAS", "flight (planned), s", "charge landed (planned)", "reserve", "spare"),
        *(("charge landed in wind", "spare in wind") if windy else ()),
        *("off the path, m", "room, m", "return", "low charge"),
    ]
    return f"<h2>Fleet</h2>{_table(head, rows)}<p>{_COLUMNS}</p>"


def _comes_home(charge: dict[str, Any]) -> str:
    lost, least = charge["point_of_no_return"], charge["least_spare"]
    if lost is None:
        return (
            f"{least['spare']:.1%} at {least['time_s']:.0f} s, {least['spare_s']:.0f} s of flight"
        )
    return _marked(f"no return before leg {lost['leg']} ends, at {lost['time_s']:.0f} s", True)


def _failing(data: dict[str, Any]) -> str:
    """What vehicles do when something fails, and what they do not know."""
    names: dict[tuple[str, str], list[str]] = {}
    for uas in data["uas"]:
        for failed in uas["failures"].items():
            names.setdefault(failed, []).append(uas["name"])
    rows = [
        [escape(event), escape(", ".join(whose)), escape(then)]
        for (event, then), whose in sorted(names.items(), key=lambda entry: _EVENTS[entry[0][0]])
    ]
    zones, obstacles = data["zones"], data["obstacles_not_told"]
    text = (
        f"<p>With their parameters loaded, too. The vehicles know the fence, its ceiling and "
        f"{_count(zones, 'no-fly zone', 'no-fly zones')}, where the fence is uploaded with the "
        f"mission; they do not know {_count(obstacles, 'obstacle', 'obstacles')}, each other, and "
        f"what moves.</p>"
    )
    return f"<h2>If something fails</h2>{text}" + _table(["if", "UAS", "then"], rows)


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
            *(_marked(f"{spare:.1%}", spare < 0.0) for spare in _spares(leg)),
        ]
        for n, leg in enumerate(uas["legs"], 1)
    ]
    head = [
        *("leg", "to", "height, m", "m/s", "at, s"),
        *("charge", "way home takes", "spare", "spare in wind")[: 3 + bool(uas["in_wind"])],
    ]
    summary = f"<summary>{escape(uas['name'])}, {len(rows)} legs</summary>"
    return f"<details>{summary}{_table(head, rows)}</details>"


def _spares(leg: dict[str, Any]) -> list[float]:
    return [spare for spare in (leg["spare"], leg["spare_in_wind"]) if spare is not None]


def _degrees(place: dict[str, float]) -> str:
    return f"{place['latitude_deg']:.6f}, {place['longitude_deg']:.6f}"
