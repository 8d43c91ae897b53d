"""How late may one UAS be before two come too close? Files of waypoints carry no time.

In a flight, time keeps UAS apart. An autopilot that flies a file is where it is when it gets there,
so for every pair the delay is computed at which they would come closer than they must.
"""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from uas_coverage_env.mission.leg_model import Followed
from uas_coverage_env.scenario import Scenario

_FLYING_M = 0.5


@dataclass(frozen=True, eq=False)
class Pair:
    """Two UAS.

    Attributes:
        names: Of the two.
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


def pairs_of(scenario: Scenario, flown: Sequence[tuple[int, Followed]]) -> list[Pair]:
    """Every pair of UAS that fly.

    Args:
        scenario: The mission.
        flown: Index of a UAS, and how its file is flown; all are started at the same time.
    """
    return [_pair(scenario, one, other) for one, other in itertools.combinations(flown, 2)]


def _pair(scenario: Scenario, one: tuple[int, Followed], other: tuple[int, Followed]) -> Pair:
    (i, a), (j, b) = one, other
    distance_m = kept_m(scenario, i, j)
    found = encounters(a, b, distance_m)
    slack_s, place_m = None, None
    if len(found):
        t, s = a.times_s[found[:, 0]], b.times_s[found[:, 1]]
        late_s = np.abs(t - s)
        # one that has landed stays where it is: no delay of the other one leads past it
        late_s[(found[:, 1] == len(b.times_s) - 1) & (t > s)] = 0.0
        late_s[(found[:, 0] == len(a.times_s) - 1) & (s > t)] = 0.0
        worst = int(late_s.argmin())
        slack_s = float(late_s[worst])
        ends = a.places_m[found[worst, 0]], b.places_m[found[worst, 1]]
        place_m = 0.5 * (ends[0] + ends[1])
    names = scenario.uas[i].name, scenario.uas[j].name
    return Pair(names, distance_m, _least_m(a, b), slack_s, place_m)


def kept_m(scenario: Scenario, i: int, j: int) -> float:
    """Distance that two UAS have to keep, horizontally or vertically [m]."""
    return scenario.uas[i].radius_m + scenario.uas[j].radius_m + scenario.uas_safe_distance_m


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
            away = a.places_m[n] - b.places_m[m]
            apart_m = np.maximum(np.hypot(away[:, 0], away[:, 1]), np.abs(away[:, 2]))
            close = apart_m < distance_m + half_a[n] + half_b[m]
            flying = (-b.places_m[m, 2] > _FLYING_M) | (-a.places_m[n, 2] > _FLYING_M)
            m = m[close & flying]
            found.append(np.column_stack([np.full(len(m), n), m]))
    return np.concatenate(found) if found else np.empty((0, 2), np.intp)


def _half_steps(flown: Followed) -> NDArray[np.float64]:
    steps = np.linalg.norm(np.diff(flown.places_m, axis=0), axis=1)
    return 0.5 * np.maximum(np.append(steps, 0.0), np.append(0.0, steps))


def _least_m(a: Followed, b: Followed) -> float:
    n = max(len(a.times_s), len(b.times_s))
    padded = [
        np.concatenate([f.places_m, np.repeat(f.places_m[-1:], n - len(f.places_m), axis=0)])
        for f in (a, b)
    ]
    away = padded[0] - padded[1]
    return float(np.maximum(np.hypot(away[:, 0], away[:, 1]), np.abs(away[:, 2])).min())
