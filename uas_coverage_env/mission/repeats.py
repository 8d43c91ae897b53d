"""Waypoints that are asked for again, for planners that think of them before they are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.scenario import Waypoint
from uas_coverage_env.world import Command, GoTo, SwarmState

FloatArray = NDArray[np.float64]
BoolArray = NDArray[np.bool_]

_SOON_S = 30.0  # about as long as a flight home and out again takes
_LONGEST_S = 60.0  # a UAS that had to wait longer lands

_ROUNDING = 1e-6


class Repeats:
    """The places of a mission whose waypoints are asked for again, and which to plan for now.

    A waypoint and what it is asked for again as, the last of all each time, are one place here,
    which is open or is going to be. So the mission stays the same when a place opens again.

    What is planned for is all that is open, and all that opens soon after it or soon after each
    other: sooner than a UAS comes home and out again. It becomes more only when a place opens that
    was not planned for, or a UAS is on its way home, and then by all that belongs to it, since a
    plan is made anew for it.

    Args:
        brief: The mission.

    Attributes:
        brief: The same with each place once; in what follows P is the number of places.
        asked_in_s: (P,) from the last sample until each place to plan for can be covered [s]; 0 for
            all others, and for what can be covered at once.
        has_grown: Whether there was more to plan for at the last sample than at the one before.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._rows, self.brief = _with_places(brief)
        n_places = len(self.brief.waypoints)
        self._open = np.zeros(n_places, np.bool_)
        self._wanted, self.has_grown = self._open.copy(), False
        alone = brief.sorties is not None and not brief.sorties.together
        swap_s = brief.sorties.swap_s if brief.sorties is not None and alone else 0.0
        self._soon_s = min(_SOON_S + swap_s, _LONGEST_S)
        self.asked_in_s = np.zeros(n_places)

    @classmethod
    def of(cls, brief: MissionBrief) -> Repeats | None:
        """None where nothing is asked for again."""
        return cls(brief) if any(w.again_after_s for w in brief.waypoints) else None

    def goes_on(self, brief: MissionBrief) -> bool:
        """Whether a mission is this one, with at most places that have opened again since.

        Args:
            brief: The mission as it is now.
        """
        rows, places = _with_places(brief)
        if places != self.brief:
            return False
        self._rows = rows
        return True

    def seen(self, swarm: SwarmState, is_idle: bool) -> SwarmState:
        """What is seen, `uncovered` being the (P,) places to plan for; once per sample.

        Args:
            swarm: As the world shows it.
            is_idle: Whether a UAS flies that has nothing more to visit.
        """
        n_places = len(self._open)
        open_now = np.bincount(self._rows, swarm.uncovered, n_places) > 0
        again_s = np.full(n_places, np.inf)
        np.minimum.at(again_s, self._rows, swarm.again_s)
        # what was covered is open no more, nor what is dropped going to be
        self._wanted &= open_now | (np.isfinite(again_s) & ~self._open)
        before = self._wanted.sum()
        if is_idle or (open_now & ~self._wanted).any():
            left_s = self.brief.dt_s * (self.brief.max_steps - swarm.step)
            soon = np.sort(again_s[again_s < left_s])
            gaps = np.diff(soon, prepend=0.0) > self._soon_s
            n_soon = int(gaps.argmax()) if gaps.any() else len(soon)
            self._wanted |= open_now | (again_s <= np.append(-np.inf, soon)[n_soon])
        self._open, self.has_grown = open_now, bool(self._wanted.sum() > before)
        # at the sample at which a place opens it cannot be covered yet
        self.asked_in_s = np.where(self._wanted & ~open_now, again_s + self.brief.dt_s, 0.0)
        return replace(swarm, uncovered=self._wanted.copy())

    @property
    def steps_until_open(self) -> NDArray[np.int64]:
        """(P,) the same in steps, rounded up."""
        return np.ceil(self.asked_in_s / self.brief.dt_s - _ROUNDING).astype(np.int64)

    def open_now(self, swarm: SwarmState) -> SwarmState:
        """What is seen, without the places that open later; for planners that do not wait.

        Args:
            swarm: As `seen` returned it.
        """
        return replace(swarm, uncovered=swarm.uncovered & self._open)

    def addressed(self, commands: Mapping[str, Command]) -> dict[str, Command]:
        """Commands to fly to the waypoints that places are now: the last they were asked for as.

        Args:
            commands: Those that send UAS to places.
        """
        return {name: self._addressed(command) for name, command in commands.items()}

    def _addressed(self, command: Command) -> Command:
        if not isinstance(command, GoTo) or command.waypoint is None:
            return command
        rows = np.flatnonzero(self._rows == command.waypoint)
        return replace(command, waypoint=int(rows[-1]))


def _with_places(brief: MissionBrief) -> tuple[NDArray[np.int64], MissionBrief]:
    """(W,) the place of each waypoint, and a brief with the first waypoint of each place only."""
    places: list[int] = []
    first: list[Waypoint] = []
    comes: defaultdict[Waypoint, list[int]] = defaultdict(list)
    for waypoint in brief.waypoints:
        if comes[waypoint]:
            places.append(comes[waypoint].pop(0))
        else:
            places.append(len(first))
            first.append(waypoint)
        if waypoint.again_after_s:
            comes[waypoint.again()].append(places[-1])
    known: dict[str, Any] = {name: getattr(brief, name) for name in type(brief).model_fields}
    known["waypoints"] = (*first,)
    return np.array(places, np.int64), type(brief)(**known)
