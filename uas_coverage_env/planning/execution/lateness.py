"""How late may one UAS be before two come too close? Files of waypoints carry no time.

In a flight, time keeps UAS apart. An autopilot that flies a file is where it is when it gets there,
so for every pair the delay is computed at which they would come closer than they must.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.geometry.round_shapes import outside_upright_m
from uas_coverage_env.planning.execution.leg_model import DT_S, Followed
from uas_coverage_env.scenario import Scenario

_FLYING_M = 0.5


class Timed(NamedTuple):
    """A file on the clock that all UAS share.

    Attributes:
        uas: Index of the UAS.
        name: Of the file.
        followed: How it is flown.
        begins_s: When it is started [s].
        since_s: Since when the UAS has been on the ground where it takes off [s].
        until_s: Until when it stays on the ground where it lands [s].
    """

    uas: int
    name: str
    followed: Followed
    begins_s: float = 0.0
    since_s: float = 0.0
    until_s: float = math.inf

    @property
    def lands_s(self) -> float:
        """When it has landed [s]."""
        return self.begins_s + self.followed.duration_s

    def at_s(self, samples: NDArray[np.intp]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """From when and until when it is where it is at samples [s]."""
        last = len(self.followed.times_s) - 1
        times_s = self.begins_s + self.followed.times_s[samples]
        from_s = np.where(samples == 0, self.since_s, times_s)
        return from_s, np.where(samples == last, self.until_s, times_s)


@dataclass(frozen=True, eq=False)
class Pair:
    """Two UAS, each with one of its files.

    Attributes:
        names: Of the two files.
        kept_m: Distance that they have to keep, horizontally or vertically [m].
        least_m: The smallest if both are in time [m].
        slack_s: The least delay of one of them that brings them closer; None: none does [s].
        place_m: (3,) where that would be [m]; None where it is nowhere.
    """

    names: tuple[str, str]
    kept_m: float
    least_m: float
    slack_s: float | None
    place_m: NDArray[np.float64] | None


def pairs_of(scenario: Scenario, flown: Sequence[Timed]) -> list[Pair]:
    """Every pair of files of different UAS.

    Args:
        scenario: The mission.
        flown: The files.
    """
    pairs = itertools.combinations(flown, 2)
    return [_pair(scenario, one, other) for one, other in pairs if one.uas != other.uas]


def _pair(scenario: Scenario, one: Timed, other: Timed) -> Pair:
    a, b = one.followed, other.followed
    distance_m = kept_m(scenario, one.uas, other.uas)
    found = encounters(a, b, distance_m)
    slack_s, place_m = None, None
    if len(found):
        (a_from_s, a_until_s), (b_from_s, b_until_s) = (
            one.at_s(found[:, 0]),
            other.at_s(found[:, 1]),
        )
        # one on the ground is there all the time: then no delay is needed to be close
        late_s = np.maximum(np.maximum(b_from_s - a_until_s, a_from_s - b_until_s), 0.0)
        worst = int(late_s.argmin())
        slack_s = float(late_s[worst])
        ends = a.places_m[found[worst, 0]], b.places_m[found[worst, 1]]
        place_m = 0.5 * (ends[0] + ends[1])
    return Pair((one.name, other.name), distance_m, _least_m(one, other), slack_s, place_m)


def kept_m(scenario: Scenario, i: int, j: int) -> float:
    """Distance that two UAS have to keep, horizontally or vertically [m]."""
    return scenario.uas[i].radius_m + scenario.uas[j].radius_m + scenario.uas_safe_distance_m


def apart_m(one_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> NDArray[np.float64]:
    """(...) distance of places, level or upright, whichever is larger [m].

    Args:
        one_m: (..., 3) [m].
        other_m: (..., 3) [m].
    """
    return outside_upright_m(one_m - other_m)


def encounters(a: Followed, b: Followed, distance_m: float) -> NDArray[np.intp]:
    """(N, 2) samples of the two, one of them flying, that may be closer than must be kept.

    Args:
        a: One of them.
        b: The other.
        distance_m: To be kept, horizontally or vertically [m].
    """
    # between two samples each may have been half a step nearer
    half_a, half_b = _half_steps(a), _half_steps(b)
    reach_m = distance_m + half_a.max() + half_b.max()
    near = KDTree(a.places_m[:, :2]).query_ball_tree(KDTree(b.places_m[:, :2]), reach_m)
    found = []
    for n, others in enumerate(near):
        if others:
            m = np.array(others)
            close = apart_m(a.places_m[n], b.places_m[m]) < distance_m + half_a[n] + half_b[m]
            flying = (-b.places_m[m, 2] > _FLYING_M) | (-a.places_m[n, 2] > _FLYING_M)
            m = m[close & flying]
            found.append(np.column_stack([np.full(len(m), n), m]))
    return np.concatenate(found) if found else np.empty((0, 2), np.intp)


def _half_steps(flown: Followed) -> NDArray[np.float64]:
    steps = np.linalg.norm(np.diff(flown.places_m, axis=0), axis=1)
    return 0.5 * np.maximum(np.append(steps, 0.0), np.append(0.0, steps))


def _least_m(one: Timed, other: Timed) -> float:
    """The smallest distance while either flies, and neither is on its way in another file."""
    from_s = max(min(one.begins_s, other.begins_s), one.since_s, other.since_s)
    to_s = min(max(one.lands_s, other.lands_s), one.until_s, other.until_s)
    clock_s = np.arange(from_s, to_s + 0.5 * DT_S, DT_S)
    if not len(clock_s):
        return math.inf
    places = []
    for timed in (one, other):
        samples = np.rint((clock_s - timed.begins_s) / DT_S).astype(np.intp)
        last = len(timed.followed.places_m) - 1
        places.append(timed.followed.places_m[np.clip(samples, 0, last)])
    return float(apart_m(*places).min())
