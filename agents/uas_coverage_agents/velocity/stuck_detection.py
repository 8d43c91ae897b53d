"""Detects UAS that are stuck: hides for a while a waypoint that cannot be covered now."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env import observation_columns
from uas_coverage_env.env.observation.scales import NEARBY_M

STUCK_AFTER_S = 20.0
"""For how long a waypoint may be the next one near by; covering one takes less than ten [s]."""

HIDDEN_FOR_S = 60.0
"""[s]"""

HARD_AFTER_S = 10.0
"""For how long a waypoint that was hidden before may be the next one near by once more [s]."""

_NEAR_M = 60.0
_NEAR = 1.0 / (1.0 + _NEAR_M / NEARBY_M)

_THERE = observation_columns("waypoints", "valid")[:, 0]
_CLOSENESS = int(observation_columns("waypoints", "closeness")[0, 0])
_FIRST = int(_THERE[0])
_FEATURES = int(_THERE[1] - _THERE[0])
_END = _FIRST + len(_THERE) * _FEATURES


class StuckDetection:
    """Hides from each UAS the waypoints that it has tried for too long.

    A policy without memory that waits for a moving obstacle to leave a waypoint, or flies circles
    round one, would do so until the battery is empty. A waypoint that was for `STUCK_AFTER_S` the
    nearest that is shown, and near, is hidden for `HIDDEN_FOR_S`, unless there is no other. Once it
    is the nearest again, for `HARD_AFTER_S`, it is among the `hard_ones`: the policy cannot get it.

    Args:
        n_uas: Size of the swarm.
        n_waypoints: Of the scenario.
        dt_s: Time between two samples [s].

    Attributes:
        hard_ones: (U,) the waypoint before each UAS that it has tried twice in vain; -1: none.
    """

    def __init__(self, n_uas: int, n_waypoints: int, dt_s: float) -> None:
        self._tried_s = np.zeros((n_uas, n_waypoints))
        self._hidden_s = np.zeros((n_uas, n_waypoints))
        self._was_hidden = np.zeros((n_uas, n_waypoints), np.bool_)
        self._again_s = np.zeros((n_uas, n_waypoints))
        self.hard_ones = np.full(n_uas, -1)
        self._dt_s = dt_s

    def filter(
        self, view: NDArray[np.float32], candidates: NDArray[np.integer]
    ) -> NDArray[np.float32]:
        """What is left of a view; to be asked once per sample.

        Args:
            view: (U, OBSERVATION_SIZE).
            candidates: (U, K) the waypoints in it, -1 where there is none.

        Returns:
            The same, the waypoints that are hidden taken out and the others moved up.
        """
        seen = view.copy()
        self.hard_ones[:] = -1
        self._hidden_s = np.maximum(self._hidden_s - self._dt_s, 0.0)
        for i, offered in enumerate(candidates):
            offered = offered[offered >= 0]
            shown = np.flatnonzero(self._hidden_s[i, offered] == 0.0)
            if len(shown) == 0:
                if len(offered) and view[i, _CLOSENESS] > _NEAR:
                    self._try_again(i, offered[0])
                continue
            if len(shown) < len(offered):
                rows = view[i, _FIRST:_END].reshape(-1, _FEATURES)
                kept = np.zeros_like(rows)
                kept[: len(shown)] = rows[shown]
                seen[i, _FIRST:_END] = kept.reshape(-1)
            if seen[i, _CLOSENESS] > _NEAR:
                w = offered[shown[0]]
                if self._was_hidden[i, w]:
                    self._try_again(i, w)
                self._tried_s[i, w] += self._dt_s
                if self._tried_s[i, w] >= STUCK_AFTER_S:
                    self._tried_s[i, w] = 0.0
                    self._hidden_s[i, w] = HIDDEN_FOR_S
                    self._was_hidden[i, w] = True
        return seen

    def _try_again(self, i: int, w: int) -> None:
        self._again_s[i, w] += self._dt_s
        if self._again_s[i, w] >= HARD_AFTER_S:
            self.hard_ones[i] = w
