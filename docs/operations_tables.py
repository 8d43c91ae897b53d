"""Tables of pages on what operations read, write and do, each made from what decides it."""

from collections.abc import Mapping, Sequence

from uas_coverage_env.operations.area_import.feature_roles import ROLES, SOLID_WORDS, UNSAID
from uas_coverage_env.operations.area_import.osm_tags import (
    BUILDING,
    GUESSED_M,
    GUESSED_OTHER_M,
    LOW,
    MET_TALL,
    STANDING,
)
from uas_coverage_env.operations.area_import.readers.qgc_plan import ITEMS
from uas_coverage_env.operations.logs import flights
from uas_coverage_env.operations.logs import flown_path as way
from uas_coverage_env.operations.logs.read_log import FORMATS
from uas_coverage_env.operations.mission_export.failure_responses import FAILURES
from uas_coverage_env.operations.mission_export.formats import ENDINGS
from uas_coverage_env.operations.mission_export.formats.firmware import FIRMWARES, Named
from uas_coverage_env.operations.mission_export.formats.parameters import PARAMETERS
from uas_coverage_env.operations.mission_export.return_paths import RETRACE, RETURN
from uas_coverage_env.operations.stream import StreamOptions
from uas_coverage_env.operations.stream.autopilots import AUTOPILOTS
from uas_coverage_env.operations.stream.failsafes import SETTINGS
from uas_coverage_env.operations.stream.giving_up import REACTIONS
from uas_coverage_env.operations.stream.slowdowns import TROUBLES

Table = tuple[tuple[str, ...], Sequence[tuple[str, ...]]]
"""Head and rows."""


def area_roles() -> Table:
    """What a drawing may say of a thing, and what becomes of it by its shape."""
    rows = []
    for role, row in (*ROLES.items(), ("", UNSAID)):
        spellings = ", ".join(f"`{one}`" for one in row.spellings)
        rows.append(
            (
                f"`{role}`" if role else "nothing says it",
                (row.meaning if role else "")
                + (f". Also written {spellings}" if spellings else ""),
                row.polygon,
                "left out" if not role else row.polygon,
                row.line,
                row.point,
            )
        )
    head = ("`role`", "meaning", "polygon", "closed line", "open line", "point")
    return (head, rows)


def area_words() -> Table:
    """The words in names and folders that say a role."""
    rows = [(f"`{role}`", ", ".join(row.words)) for role, row in ROLES.items() if row.words]
    rows.insert(2, ("`obstacle`", ", ".join(SOLID_WORDS)))
    return (("role", "words"), rows)


def plan_items() -> Table:
    """What becomes of what a QGroundControl plan holds."""
    rows = [(f"`{kind}`", item.becomes) for kind, item in ITEMS.items()]
    return (("item of the mission", "becomes"), rows)


def town_kinds() -> Table:
    """What is an obstacle of a town, how high and how wide where no tag says it."""
    found: dict[tuple[str, float, float, bool], list[str]] = {}
    for (key, value), what in STANDING.items():
        tag = f"`{key}={value}`" if value != "*" else f"any other `{key}`"
        found.setdefault(tuple(what), []).append(tag)
    rows = [
        (
            ", ".join(tags),
            f"`{kind}`",
            f"{height_m:g}",
            f"{half_m:g}" if half_m else "its outline alone",
            "along its line" if along else "",
        )
        for (kind, half_m, height_m, along), tags in found.items()
    ]
    for height_m in sorted(set(GUESSED_M.values())):
        tags = (f"`building={value}`" for value, high in GUESSED_M.items() if high == height_m)
        rows.append((", ".join(tags), f"`{BUILDING}`", f"{height_m:g}", "10", ""))
    rows.append(
        ("any other `building`, `building:part`", f"`{BUILDING}`", f"{GUESSED_OTHER_M:g}", "10", "")
    )
    head = ("tag", "obstacle", "height, m", "half the width of a line, radius of a point, m", "")
    return (head, rows)


def town_not_read() -> Table:
    """Tall kinds that are named and not read, and low values of keys that are mostly tall."""
    met = ", ".join(f"`{key}={value}` ({high})" for (key, value), high in MET_TALL.items())
    rows = [
        ("tall, named, and no obstacles unless a height is tagged", met),
        ("the same", f"values of {', '.join(f'`{key}`' for key in LOW)} that no table lists"),
    ]
    for key, values in LOW.items():
        rows.append((f"`{key}`, taken to be low", ", ".join(f"`{value}`" for value in values)))
    return ("what is not read", "tags"), rows


def exported_files() -> Table:
    """What an export writes, and what reads it."""
    rows = [
        (f"`{ending}`", ", ".join(f"`{kind}`" for kind in formats.split(", ")), reader, holds)
        for ending, (formats, reader, holds) in ENDINGS.items()
    ]
    return ("file", "`--format`", "for", "holds"), rows


def autopilot_parameters() -> Table:
    """Every parameter that exports set, by its name in each firmware."""

    def cell(named: Named | None) -> str:
        unit = f" ({named.unit})" if named and named.unit else ""
        return f"`{named.name}`{unit}" if named else ""

    rows = [
        (parameter.purpose, *(cell(parameter.names.get(key)) for key in FIRMWARES))
        for parameter in PARAMETERS
    ]
    return ("what", *(f"`{key}`" for key in FIRMWARES)), rows


def autopilot_failures() -> Table:
    """What vehicles do when something fails."""

    def cell(says: Mapping[str, str]) -> str:
        texts = [says[a].replace("{height:g} m", "its height") for a in (RETURN, RETRACE)]
        if texts[0] == texts[1]:
            return texts[0]
        return f"{texts[0]}; where no such way is clear: {texts[1]}"

    rows = [
        (failure.event, cell(failure.copter), cell(failure.px4), failure.checked)
        for failure in FAILURES
    ]
    return ("if", "ArduCopter", "PX4", "checked"), rows


def log_formats() -> Table:
    """Every kind of log, and what is read of it."""
    rows = []
    for ending, kind in FORMATS.items():
        read = "; ".join(f"`{name}`: {meaning}" for name, meaning in kind.messages.items())
        rows.append((f"`{ending}`", kind.of, read.replace("`logged texts`", "logged texts")))
    return ("file", "what it is", "what is read"), rows


def log_rules() -> Table:
    """What of a log is taken off, left out or refused."""
    at_home, beside = f"{way.AT_HOME_M:g} m", f"{way.BESIDE_M:g} m"
    rows = [
        ("armed, but never higher than " + f"{flights.RISE_M:g} m above the ground", "no flight"),
        (
            "several flights, or several vehicles on one link",
            "refused, and listed; `--flight 2` or `--flight uas_1=2`, `uas_1=link.tlog:7` choose",
        ),
        (
            "several battery monitors",
            "the first is used, and said; `--battery 2` or `--battery uas_1=2` choose",
        ),
        (
            f"no position for {way.LONGEST_GAP_S:g} s, or {way.GAP_INTERVALS:g} of the usual "
            "intervals",
            "a gap: named; nothing is judged in it",
        ),
        (
            "a GPS glitch that the autopilot tells, until it is cleared",
            "named; it covers by the autopilot's own estimate, contacts are not judged",
        ),
        (
            f"positions that jump (more than {way.JUMP_M:g} m and {way.JUMP_SPEEDS:g} times the "
            "top speed) and come back",
            "taken for a GPS glitch: named; nothing is judged until they are back",
        ),
        ("positions that jump for good", "named, and judged as they are"),
        (
            "a height at take-off that is not between the ground and the start, by more than "
            f"{way.OFFSET_M:g} m",
            "an offset of the barometer: taken off all heights, and said",
        ),
        (
            f"a take-off more than {at_home}, and up to {beside}, from the start",
            "said; it is taken to stand at its start, and home is where it took off",
        ),
        (
            f"a landing more than {at_home} from home",
            "said: it is not home, and out of the mission while others fly on (`lost`)",
        ),
        (
            "a log that ends in the air",
            "said; the flight of that UAS ends there, in the mode `lost` while others fly on",
        ),
        ("damaged parts of a file", "passed over, and counted or named as a gap"),
        ("another place, a clock that goes back, no position, an empty file", "refused in a line"),
    ]
    return ("in the log", "what is done"), rows


def stream_troubles() -> Table:
    """What slows a stream down, and what comes of it."""
    options = StreamOptions()
    rows = [
        (
            trouble.when.format(silent_s=options.silent_s),
            "all slow down and stand" if trouble.stops else "all slow down as far as needed",
            trouble.then,
        )
        for trouble in TROUBLES.values()
    ]
    return ("a vehicle is", "the stream", "the vehicle"), rows


def stream_failsafes() -> Table:
    """Parameters that a stream sets before vehicles arm."""
    rows = []
    for setting in SETTINGS:
        names = " or ".join(f"`{one.name}`" for one in setting.names)
        values = sorted({setting.value, setting.otherwise})
        rows.append((setting.autopilot, names, " or ".join(f"{v:g}" for v in values), setting.why))
    return ("autopilot", "parameter", "set to", "so that"), rows


def stream_reactions() -> Table:
    """What `--on-abort` may be."""
    rows = [(f"`{name}`", one.words, one.ends) for name, one in REACTIONS.items()]
    return ("`--on-abort`", "each is told to", "how that ends"), rows


def stream_limits() -> Table:
    """Parameters of vehicles that a stream reads."""
    rows = [
        (
            one.name,
            ", ".join(" or ".join(f"`{n.name}`" for n in names) for names in one.limits.values()),
        )
        for one in AUTOPILOTS.values()
    ]
    return ("autopilot", "what is read"), rows
