"""What there was in a mission, and when: events add to the scene and take waypoints away."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.record import LOST, FlightRecord
from uas_coverage_env.scenario import NoFlyZone, Scenario
from uas_coverage_env.world.coverage import covering_samples

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
    changes: tuple[tuple[int, Scenario], ...]
    _fewer: dict[tuple[int, int], Scenario] = field(default_factory=dict, init=False)

    @classmethod
    def of(cls, flight: FlightRecord) -> Self:
        """The scenes of a flight, as its events made them."""
        known = flight.scenario
        since = {key: [0] * len(getattr(known, key)) for key in _GROWING}
        dropped: dict[int, int] = {}
        changes = [(0, known)]
        for record in sorted(flight.events, key=lambda record: record.time_s):
            event = flight.scenario.events[record.event]
            sample = round(record.time_s / known.dt_s)
            effect = event.effect()
            if effect.name == "drop":
                dropped.setdefault(int(effect.values[0]), sample)
            if event.changes_scene:
                uas = flight.names.index(record.uas) if record.uas in flight.names else 0
                known = known.after(event, record.time_s, uas)
                changes.append((sample, known))
                for key, samples in since.items():
                    samples += [sample] * (len(getattr(known, key)) - len(samples))
        obstacle_from, moving_from, waypoint_from = (np.array(since[key], int) for key in _GROWING)
        covered_at = covered_since(flight, known, waypoint_from)
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
            home_m=_homes_m(changes, len(flight.x)),
            changes=tuple(changes),
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


def covered_since(flight: FlightRecord, known: Scenario, since: IntArray) -> IntArray:
    """(W,) the sample in which each waypoint was covered, not before `since`; T: never."""
    alive = flight.mode < LOST
    samples = np.full(len(known.waypoints), len(flight.x))
    for w, first in enumerate(since):
        covers = (covering_samples(known, w, flight.x[first:]) & alive[first:]).any(axis=1)
        if covers.any():
            samples[w] = first + covers.argmax()
    return samples


def _homes_m(changes: Sequence[tuple[int, Scenario]], samples: int) -> NDArray[np.float64]:
    homes_m = np.empty((samples, len(changes[0][1].uas), 3))
    for since, scenario in changes:
        homes_m[since:] = [uas.start_m for uas in scenario.uas]
    return homes_m


def _moving_m(flight: FlightRecord, known: Scenario) -> NDArray[np.float64]:
    """Those that the flight began with are in its record; the others keep to their schedule."""
    recorded_m = flight.moving_position_m
    n_recorded = recorded_m.shape[1]
    if len(known.moving_obstacles) == n_recorded:
        return recorded_m
    later_m = [known.moving_positions(time_s)[n_recorded:] for time_s in flight.time_s.tolist()]
    return np.concatenate([recorded_m, np.array(later_m)], axis=1)
