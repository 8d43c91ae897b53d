"""Waypoints that are asked for again, for planners that think of them before they are."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.mission import MissionBrief
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
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._rows, self.brief = _with_places(brief)
        n_places = len(self.brief.waypoints)
        self._open = np.zeros(n_places, np.bool_)
        self._wanted = self._open.copy()
        alone = brief.sorties is not None and not brief.sorties.together
        swap_s = brief.sorties.swap_s if brief.sorties is not None and alone else 0.0
        self._soon_s = min(_SOON_S + swap_s, _LONGEST_S)

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

        `again_s` says from when on each place can be covered: 0 where it is open.

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
        if is_idle or (open_now & ~self._wanted).any():
            left_s = self.brief.dt_s * (self.brief.max_steps - swarm.step)
            soon = np.sort(again_s[again_s < left_s])
            gaps = np.diff(soon, prepend=0.0) > self._soon_s
            n_soon = int(gaps.argmax()) if gaps.any() else len(soon)
            self._wanted |= open_now | (again_s <= np.append(-np.inf, soon)[n_soon])
        self._open = open_now
        # at the sample at which a place opens it cannot be covered yet
        again_s = np.where(open_now, 0.0, again_s + self.brief.dt_s)
        return replace(swarm, uncovered=self._wanted.copy(), again_s=again_s)

    def row(self, place: int) -> int:
        """The waypoint that a place is now: the last that it was asked for as."""
        return int(np.flatnonzero(self._rows == place)[-1])

    def addressed(self, commands: Mapping[str, Command]) -> dict[str, Command]:
        """Commands to fly to the waypoints that places are now.

        Args:
            commands: Those that send UAS to places.
        """
        return {name: self._addressed(command) for name, command in commands.items()}

    def _addressed(self, command: Command) -> Command:
        if not isinstance(command, GoTo) or command.waypoint is None:
            return command
        if not 0 <= command.waypoint < len(self._open):
            return command  # the world says what is wrong with it
        return replace(command, waypoint=self.row(command.waypoint))


def asked_in_s(swarm: SwarmState) -> FloatArray:
    """(W,) until each waypoint to plan for can be covered [s]; 0 for what can be at once.

    Args:
        swarm: As a planner is shown it.
    """
    later_s = swarm.again_s if len(swarm.again_s) else np.zeros(len(swarm.uncovered))
    return np.where(swarm.uncovered & np.isfinite(later_s), later_s, 0.0)


def steps_until_open(swarm: SwarmState, dt_s: float) -> NDArray[np.int64]:
    """(W,) the same in steps, rounded up."""
    return np.ceil(asked_in_s(swarm) / dt_s - _ROUNDING).astype(np.int64)


def open_now(swarm: SwarmState) -> SwarmState:
    """What is shown, without the waypoints that open later; for planners that do not wait."""
    return replace(swarm, uncovered=swarm.uncovered & (asked_in_s(swarm) <= 0.0))


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
