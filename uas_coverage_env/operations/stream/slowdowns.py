"""What slows a stream down: the table that decides, and that `docs/streaming.md` shows."""

from __future__ import annotations

from typing import NamedTuple


class Trouble(NamedTuple):
    """One thing that can be wrong with a vehicle.

    Attributes:
        when: What is wrong, for the documentation.
        says: What the user reads; {name} is the vehicle, {more} what is known beyond.
        stops: Whether all slow down until they stand; otherwise, they slow down as far as needed.
        then: What the vehicle does meanwhile, and how it comes back.
    """

    when: str
    says: str
    stops: bool
    then: str


_BACK = (
    "Heard again and still in its mode of targets, it hovers until all stand, then flies back to "
    "its place at 4 m/s at most, on the straight line, or else along its path, if that is clear of "
    "zones, obstacles, fence and other UAS; if not, it waits for a pilot"
)
TROUBLES = {
    "silent": Trouble(
        "not heard for {silent_s:g} s (link cut, or the autopilot has failed)",
        "{name} is not heard from: all slow down and hold",
        True,
        "it does what its failsafe says (below). " + _BACK,
    ),
    "left": Trouble(
        "no longer in `GUIDED` or `OFFBOARD`, or disarmed (a pilot has taken it over, or a "
        "failsafe of its own acts)",
        "{name} does not take targets ({more}): all slow down and hold",
        True,
        "it is left alone. " + _BACK,
    ),
    "away": Trouble(
        "back from one of these, and not yet at its place",
        "{name} is {more} from its place: all hold while it flies back",
        True,
        "it flies back as said above",
    ),
    "blocked": Trouble(
        "likewise, and neither way to its place is clear",
        "{name} is {more} from its place and the way there is not clear: fly it nearer by hand; "
        "all hold",
        True,
        "it hovers in its mode of targets. A pilot may take it, fly it nearer and give it back",
    ),
    "unclear": Trouble(
        "where it would stop if its link were cut now is not clear of zones, obstacles or fence",
        "{name} would not stop clear of what stands there: all slow down",
        True,
        "it flies on along its path, more slowly, until it would",
    ),
    "behind": Trouble(
        "behind its place along its path, or off its path (wind, a slow vehicle)",
        "{name} is behind: time passes more slowly for all",
        False,
        "it catches up; at `--lag` all stand",
    ),
}
"""The first that holds of any vehicle is told."""
