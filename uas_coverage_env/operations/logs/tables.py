"""What is read of logs, and what is done with what is odd in them: tables for the docs."""

from uas_coverage_env.operations.logs import flights
from uas_coverage_env.operations.logs import flown_path as way
from uas_coverage_env.operations.logs.read_log import FORMATS
from uas_coverage_env.operations.tables import Table


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
        (
            "another place, a clock that goes back, no position, an empty file",
            "refused in a line",
        ),
    ]
    return ("in the log", "what is done"), rows
