"""A planner with all that is done round it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.planning.around.by_legs import ByLegs
from uas_coverage_env.planning.around.handover import Handover, without
from uas_coverage_env.planning.around.repeats import Repeats, open_now
from uas_coverage_env.planning.decision import LEGS, Decision
from uas_coverage_env.world import Command, GoTo, SwarmState


class Plans(Protocol):
    """What is put into it."""

    def reset(self, brief: MissionBrief, seed: int, /) -> None:
        """Start a mission."""
        ...

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Decide."""
        ...


@dataclass(frozen=True)
class _Mission:
    """What is kept of the mission that is flown."""

    handover: Handover
    repeats: Repeats | None
    legs: ByLegs | None


class Around:
    """A planner, and round it what a mission asks for beside planning.

    - Waypoints that are asked for again (`Repeats`): each is one place, open or not, and there is
      no `reset` when it opens. A planner with `is_idle(swarm)`, whether a UAS flies that has
      nothing more to visit, is shown in time what opens soon, too (`again_s` says when); others
      what is open.
    - UAS that take no commands (`Handover`): they are shown as landed, and `away` says that they
      still fly; they are sent home.
    - The legs of an autopilot (`[execution]`): a UAS that is sent somewhere by `GoTo` flies there
      by legs (`ByLegs`), along the planner's `routes` where it has them.

    Args:
        planner: It sees and is asked what is left. One for each flight.

    Attributes:
        last_decision: Of the planner, with `LEGS` where they flew.
    """

    def __init__(self, planner: Plans) -> None:
        self._planner = planner
        self._mission: _Mission | None = None
        self.last_decision: Decision | None = None

    def warm_up(self, brief: MissionBrief) -> None:
        """Let the planner compile what it will need."""
        if (warm_up := self._asked("warm_up")) is not None:
            repeats = Repeats.of(brief)
            warm_up(brief if repeats is None else repeats.brief)

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a mission, or go on in another scene."""
        before = self._mission
        if before is not None and before.repeats is not None and before.repeats.goes_on(brief):
            return
        repeats = Repeats.of(brief)
        shown = brief if repeats is None else repeats.brief
        self._planner.reset(shown, seed)
        legs = None if shown.execution is None else ByLegs(shown, self._asked("routes"))
        handover = Handover(brief) if before is None else before.handover
        self._mission = _Mission(handover, repeats, legs)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Let the planner decide about what it is shown; a command for each active UAS."""
        mission = self._mission
        if mission is None:
            raise RuntimeError("act before reset")
        away = (swarm.status == FLYING) & ~mission.handover.workers(swarm)
        shown = without(self._with_places(swarm, mission.repeats), away)
        if mission.legs is not None:
            shown = replace(shown, returning=shown.returning | mission.legs.returns)
        commands = self._planner.act(shown)
        decision: Decision | None = self._asked("last_decision")
        if mission.legs is not None:
            commands = mission.legs.commands(shown, commands, self._asked("routes"))
            decision = decision or Decision()
            decision = replace(decision, flown_by=(*decision.flown_by, LEGS))
        self.last_decision = decision
        if away.any():
            home = {swarm.names[u]: GoTo(None) for u in np.flatnonzero(away)}
            commands = {**commands, **home}
        return commands if mission.repeats is None else mission.repeats.addressed(commands)

    @property
    def given_up(self) -> dict[int, str]:
        """Waypoints that the planner has given up, and why in a few words."""
        said: Mapping[int, str] = self._asked("given_up") or {}
        repeats = None if self._mission is None else self._mission.repeats
        return dict(said) if repeats is None else {repeats.row(w): why for w, why in said.items()}

    def _with_places(self, swarm: SwarmState, repeats: Repeats | None) -> SwarmState:
        if repeats is None:
            return swarm
        is_idle = self._asked("is_idle")
        shown = repeats.seen(swarm, is_idle is not None and is_idle(swarm))
        return open_now(shown) if is_idle is None else shown

    def _asked(self, name: str) -> Any:
        """What a planner need not have."""
        return getattr(self._planner, name, None)
