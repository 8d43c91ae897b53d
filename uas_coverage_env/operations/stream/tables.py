"""What a stream does about what goes wrong, and what it sets and reads: tables for the docs."""

from uas_coverage_env.operations.stream import StreamOptions
from uas_coverage_env.operations.stream.autopilots import AUTOPILOTS
from uas_coverage_env.operations.stream.failsafes import SETTINGS
from uas_coverage_env.operations.stream.giving_up import REACTIONS
from uas_coverage_env.operations.stream.slowdowns import TROUBLES
from uas_coverage_env.operations.tables import Table


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
