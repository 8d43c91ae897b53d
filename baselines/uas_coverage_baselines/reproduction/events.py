"""What the paper's text tells of its flight, asked of ours: yes or no, and when."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import MODES, Flight, covered_at
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.vehicle.layout import DOD, Y
from uas_coverage_env.vehicle.params import return_threshold

_FRESH, _TIRED = 0, 1
_SNAPSHOT, _LATER = 70, 165
_NEVER = -1


@dataclass(frozen=True)
class Event:
    """Whether something happened in a flight.

    Attributes:
        happened: As told.
        time_s: When; None: it has no time, or did not happen.
        detail: The figures behind it, in a few words.
    """

    happened: bool
    time_s: float | None
    detail: str


class Story:
    """A flight with what its events ask for.

    Args:
        flight: Of two UAS, of which the second begins with less charge.
    """

    def __init__(self, flight: Flight) -> None:
        self.flight = flight
        self.dt_s = flight.scenario.dt_s

    @cached_property
    def covered(self) -> NDArray[np.int64]:
        """(W,) the sample in which each waypoint was covered; one past the last where never."""
        return covered_at(self.flight)

    @cached_property
    def covered_by(self) -> NDArray[np.int64]:
        """(W,) the UAS that did it; the first of several; -1 where none did."""
        flight, result = self.flight, np.full(len(self.covered), _NEVER)
        for w, (sample, waypoint) in enumerate(
            zip(self.covered, flight.scenario.waypoints, strict=True)
        ):
            if sample <= flight.steps:
                away_m = np.linalg.norm(flight.x[sample, :, :3] - waypoint.position_m, axis=1)
                result[w] = int(away_m.argmin())
        return result

    @cached_property
    def all_covered(self) -> bool:
        """Whether no waypoint was left."""
        return bool((self.covered <= self.flight.steps).all())

    @cached_property
    def threshold(self) -> float:
        """DoD_r of the tired UAS, by its vehicle's file."""
        scenario = self.flight.scenario
        return return_threshold(scenario.vehicles[_TIRED], scenario.uas[_TIRED].dod_max)

    @cached_property
    def return_begins(self) -> int:
        """The sample from which on the tired UAS is in return mode; -1: never."""
        returning = self.flight.mode[:, _TIRED] == MODES.index("return")
        return int(returning.argmax()) if returning.any() else _NEVER

    def seconds(self, sample: int) -> float:
        """The time of a sample [s]."""
        return float(sample * self.dt_s)


def forests_first(story: Story) -> Event:
    """Waypoints of forests are covered earlier than the others, by their means."""
    kinds = np.array([waypoint.kind for waypoint in story.flight.scenario.waypoints])
    forest = kinds == "forest"
    if not forest.any() or forest.all() or not story.all_covered:
        return Event(False, None, "not everything was covered, or nothing is forest")
    first_s, later_s = (
        float(story.covered[chosen].mean() * story.dt_s) for chosen in (forest, ~forest)
    )
    detail = f"mean of forests {first_s:.0f} s, of the others {later_s:.0f} s"
    return Event(first_s < later_s, first_s, detail)


def tired_past_threshold(story: Story) -> Event:
    """DoD of the tired UAS is beyond DoD_r at the snapshot."""
    dod = story.flight.x[:, _TIRED, DOD]
    past = np.flatnonzero(dod >= story.threshold)
    if not len(past):
        return Event(False, None, f"DoD_r is {story.threshold:.3f}")
    detail = f"DoD_r {story.threshold:.3f}"
    if story.flight.steps >= _SNAPSHOT:
        detail += f", DoD at step {_SNAPSHOT} {dod[_SNAPSHOT]:.3f}"
    return Event(int(past[0]) <= _SNAPSHOT, story.seconds(int(past[0])), detail)


def tired_in_the_east(story: Story) -> Event:
    """It is in the eastern half of the area at the snapshot, in the air."""
    flight = story.flight
    if flight.last_sample[_TIRED] < _SNAPSHOT:
        return Event(False, None, f"not in the air at step {_SNAPSHOT}")
    east_m = flight.scenario.fence.vertices_m[:, 1]
    middle_m = 0.5 * float(east_m.min() + east_m.max())
    here_m = float(flight.x[_SNAPSHOT, _TIRED, Y])
    detail = f"{here_m:.0f} m east, the middle is at {middle_m:.0f} m"
    return Event(here_m > middle_m, story.seconds(_SNAPSHOT), detail)


def tired_covers_on_its_way_home(story: Story) -> Event:
    """It covers waypoints in return mode while there are any left."""
    if story.return_begins == _NEVER:
        return Event(False, None, "never in return mode")
    mine = (story.covered_by == _TIRED) & (story.covered > story.return_begins)
    begins_s = story.seconds(story.return_begins)
    if not mine.any():
        return Event(False, None, f"in return mode from {begins_s:.0f} s on, 0 waypoints")
    last_s = story.seconds(int(story.covered[mine].max()))
    detail = f"in return mode from {begins_s:.0f} s on, {mine.sum()} waypoints until {last_s:.0f} s"
    return Event(True, last_s, detail)


def tired_home_first(story: Story) -> Event:
    """It has landed before the other one, and by the second snapshot."""
    flight = story.flight
    landed = flight.mode[-1] == MODES.index("landed")
    steps = flight.last_sample
    if not landed[_TIRED]:
        return Event(False, None, "did not land")
    first = steps[_TIRED] < steps[_FRESH] or not landed[_FRESH]
    detail = f"{flight.names[_FRESH]} at step {steps[_FRESH]}"
    return Event(bool(first and steps[_TIRED] <= _LATER), story.seconds(int(steps[_TIRED])), detail)


def behind_helicopter_last(story: Story) -> Event:
    """The last waypoint covered is one that could not be covered at the start."""
    blocked = np.flatnonzero(WorldView(MissionBrief.of(story.flight.scenario)).blocked())
    if not len(blocked) or not story.all_covered:
        return Event(False, None, "not everything was covered, or nothing was blocked")
    mine, others = story.covered[blocked].max(), np.delete(story.covered, blocked).max()
    mine_s, others_s = story.seconds(int(mine)), story.seconds(int(others))
    return Event(bool(mine >= others), mine_s, f"the last of the others at {others_s:.0f} s")


EVENTS: Mapping[str, Callable[[Story], Event]] = {
    asked.__name__: asked
    for asked in (
        *(forests_first, tired_past_threshold, tired_in_the_east),
        *(tired_covers_on_its_way_home, tired_home_first, behind_helicopter_last),
    )
}
"""By the names that the paper's file uses."""
