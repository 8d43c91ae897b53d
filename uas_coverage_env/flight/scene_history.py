"""What there was in a mission, and when: events add to the scene and take waypoints away."""

import heapq
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LANDED, LOST, EventRecord, FlightRecord
from uas_coverage_env.scenario import NoFlyZone, Scenario
from uas_coverage_env.scenario.scene_events import WaypointDropped
from uas_coverage_env.vehicle.layout import VZ
from uas_coverage_env.world.coverage import covering_samples
from uas_coverage_env.world.events import steps_until

IntArray = NDArray[np.int64]

# what events add to, at the end of each
_GROWING = ("obstacles", "moving_obstacles", "waypoints")


@dataclass(frozen=True, eq=False)
class SceneHistory:
    """The scene of a flight over time, samples being those of the flight (T of them).

    Attributes:
        scenario: With all that events have added by the end, homes where they are at the end.
            Nothing is missing in it; the first of each are those that the flight began with.
        obstacle_from: (O,) sample from which each obstacle stands.
        moving_from: (M,) sample from which each moving obstacle is there.
        waypoint_from: (W,) sample from which each waypoint is to be covered.
        waypoint_until: (W,) sample in which it was dropped before it was covered; T: never.
        covered_at: (W,) sample in which it was covered; T: never.
        moving_position_m: (T, M, 3) [m] centres of the moving obstacles.
        home_m: (T, U, 3) [m] where each UAS is to land.
        asked_later: (W,) which waypoints were covered and going to be asked for again.
        changes: Sample and scenario from then on, in order of time; the first is of sample 0.
    """

    scenario: Scenario
    obstacle_from: IntArray
    moving_from: IntArray
    waypoint_from: IntArray
    waypoint_until: IntArray
    covered_at: IntArray
    moving_position_m: NDArray[np.float64]
    home_m: NDArray[np.float64]
    asked_later: NDArray[np.bool_]
    changes: tuple[tuple[int, Scenario], ...]
    _fewer: dict[tuple[int, int], Scenario] = field(default_factory=dict, init=False)

    @classmethod
    def of(cls, flight: FlightRecord) -> Self:
        """The scenes of a flight, as its events made them."""
        story = _Story(flight)
        known, dropped = story.known, story.dropped
        obstacle_from, moving_from, waypoint_from = (
            np.array(story.since[key], int) for key in _GROWING
        )
        covered_at = np.array(story.covered_at, int)
        until = np.full(len(known.waypoints), len(flight.x))
        for w, sample in dropped.items():
            until[w] = sample
        centres_m = np.array([waypoint.position_m for waypoint in known.waypoints])
        for o, (obstacle, hull) in enumerate(zip(known.obstacles, known.hulls, strict=True)):
            if isinstance(obstacle, NoFlyZone):  # what lies in it is not asked for any more
                inside = hull.signed_distance(centres_m) < 0.0
                closed = np.maximum(obstacle_from[o], waypoint_from)
                until[inside] = np.minimum(until, closed)[inside]
        until[covered_at <= until] = len(flight.x)
        return cls(
            scenario=known,
            obstacle_from=obstacle_from,
            moving_from=moving_from,
            waypoint_from=waypoint_from,
            waypoint_until=until,
            covered_at=covered_at,
            moving_position_m=_moving_m(flight, known),
            home_m=_homes_m(story.changes, len(flight.x)),
            asked_later=np.array(story.asked_later),
            changes=tuple(story.changes),
        )

    @property
    def open_at_end(self) -> NDArray[np.bool_]:
        """(W,) which waypoints were left to cover."""
        never = len(self.moving_position_m)
        return (self.covered_at == never) & (self.waypoint_until == never)

    def moving_m(self, sample: int) -> NDArray[np.float64]:
        """(sample + 1, M', 3) [m] where the moving obstacles of a sample have been until then."""
        there = int((self.moving_from <= sample).sum())
        return self.moving_position_m[: sample + 1, :there]

    def scene_at(self, sample: int) -> tuple[Scenario, IntArray]:
        """The scenario as it is at a sample, without the waypoints that have been dropped.

        Returns:
            It, the same object as long as nothing changes, and the numbers of its waypoints among
            those of `scenario`.
        """
        since, known = next(change for change in reversed(self.changes) if change[0] <= sample)
        n_known = len(known.waypoints)
        there = np.flatnonzero(sample < self.waypoint_until[:n_known])
        if len(there) == n_known:
            return known, there
        key = (since, len(there))  # waypoints are dropped for good
        if key in self._fewer:
            return self._fewer[key], there
        self._fewer[key] = known.with_waypoints(there.tolist())
        return self._fewer[key], there


class _Story:
    """What happened in a flight, told in order of time.

    Attributes:
        known: The scenario at the end.
        since: Field -> the sample from which each of its entries is there.
        dropped: Waypoint -> the sample in which an event dropped it.
        covered_at: Sample in which each waypoint was covered; T: never.
        asked_later: Whether each was going to be asked for again.
        changes: Sample and scenario from then on.
    """

    def __init__(self, flight: FlightRecord) -> None:
        self._flight, self._seen = flight, _seen(flight)
        self.known = flight.scenario
        self.since = {key: [0] * len(getattr(self.known, key)) for key in _GROWING}
        self.dropped: dict[int, int] = {}
        self.covered_at: list[int] = []
        self.asked_later: list[bool] = []
        self.changes = [(0, self.known)]
        # at the same sample, events come first
        self._ahead = [
            (round(record.time_s / self.known.dt_s), 0, n)
            for n, record in enumerate(flight.events)
        ]  # fmt: skip
        heapq.heapify(self._ahead)
        self._look_at_waypoints()
        while self._ahead:
            sample, again, number = heapq.heappop(self._ahead)
            if again:
                self._ask_again(sample, number)
            else:
                self._happen(sample, flight.events[number])

    def _happen(self, sample: int, record: EventRecord) -> None:
        event = self._flight.scenario.events[record.event]
        if isinstance(event, WaypointDropped):
            self.dropped.setdefault(event.waypoint, sample)
        if event.changes_scene:
            names = self._flight.names
            uas = names.index(record.uas) if record.uas in names else 0
            self._change(sample, self.known.after(event, record.time_s, uas))

    def _ask_again(self, sample: int, w: int) -> None:
        self.asked_later[w] = False
        if w not in self.dropped and not self._was_closed(w):
            self._change(sample, self.known.asked_again(w))

    def _was_closed(self, w: int) -> bool:
        """Whether a waypoint lay in a no-fly zone before a UAS came near it."""
        centre_m = np.array([self.known.waypoints[w].position_m])
        return any(
            isinstance(obstacle, NoFlyZone)
            and 0 < since <= self.covered_at[w]
            and bool(obstacle.hull.signed_distance(centre_m)[0] < 0.0)
            for obstacle, since in zip(self.known.obstacles, self.since["obstacles"], strict=True)
        )

    def _change(self, sample: int, known: Scenario) -> None:
        self.known = known
        self.changes.append((sample, known))
        for key, samples in self.since.items():
            samples += [sample] * (len(getattr(known, key)) - len(samples))
        self._look_at_waypoints()

    def _look_at_waypoints(self) -> None:
        """When the new ones were covered, and whether they are asked for again."""
        end = len(self._flight.x)
        for w in range(len(self.covered_at), len(self.known.waypoints)):
            since = self.since["waypoints"][w]
            covered_at = _covered_at(self._seen, self.known, w, since)
            self.covered_at.append(covered_at)
            gaps_s = self.known.waypoints[w].again_after_s
            asked_later = bool(gaps_s) and covered_at < end
            self.asked_later.append(asked_later)
            if asked_later:
                due = covered_at + steps_until(gaps_s[0], self.known.dt_s)
                if due < end:
                    heapq.heappush(self._ahead, (due, 1, w))


def covered_since(flight: FlightRecord, known: Scenario, since: IntArray) -> IntArray:
    """(W,) the sample in which each waypoint was covered, not before `since`; T: never."""
    seen = _seen(flight)
    each = [_covered_at(seen, known, w, k) for w, k in enumerate(since.tolist())]
    return np.array(each, int)


class _Seen(NamedTuple):
    """The states that may cover something, N in order of time: as a rule those of the samples."""

    x: NDArray[np.float64]  # (N, U, 14)
    flying: NDArray[np.bool_]  # (N, U)
    sample: IntArray  # (N,) in which each counts
    end: int  # T


def _seen(flight: FlightRecord) -> _Seen:
    end = len(flight.x)
    if flight.of_log is None:
        return _Seen(flight.x, _flying(flight), np.arange(end), end)
    # a log is judged more often than at samples, and says what covered something
    x, sample = flight.of_log.passing(flight.names, flight.x.shape[2], flight.scenario.dt_s)
    return _Seen(x, np.ones(x.shape[:2], np.bool_), sample, end)


def _covered_at(seen: _Seen, known: Scenario, w: int, since: int) -> int:
    """The sample in which a waypoint was covered that is there since a sample; T: never."""
    # what comes at a sample comes after that sample was judged
    first = int(np.searchsorted(seen.sample, since + 1 if since else 0))
    covers = covering_samples(known, w, seen.x[first:]) & seen.flying[first:]
    found = covers.any(axis=1)
    return int(seen.sample[first + found.argmax()]) if found.any() else seen.end


def _flying(flight: FlightRecord) -> NDArray[np.bool_]:
    """(T, U) which UAS have flown the step to each sample and are not lost."""
    flying = flight.mode < LOST
    moves = (flight.x[1:, :, : VZ + 1] != flight.x[:-1, :, : VZ + 1]).any(axis=2)
    # one that takes off again is on its return while it rests
    rests = ~moves & (flight.current_A[:-1] == 0.0)
    flying[1:] &= (flight.mode[:-1] < LANDED) & ~rests
    return flying


def _homes_m(changes: Sequence[tuple[int, Scenario]], samples: int) -> NDArray[np.float64]:
    homes_m = np.empty((samples, len(changes[0][1].uas), 3))
    for since, scenario in changes:
        homes_m[since:] = [uas.home_m for uas in scenario.uas]
    return homes_m


def _moving_m(flight: FlightRecord, known: Scenario) -> NDArray[np.float64]:
    """Those that the flight began with are in its record; the others keep to their schedule."""
    recorded_m = flight.moving_position_m
    n_recorded = recorded_m.shape[1]
    if len(known.moving_obstacles) == n_recorded:
        return recorded_m
    later_m = [known.moving_positions(time_s)[n_recorded:] for time_s in flight.time_s.tolist()]
    return np.concatenate([recorded_m, np.array(later_m)], axis=1)
