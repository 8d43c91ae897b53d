"""What an environment adds to a mission, for whatever flies it outside of the environments."""

from collections.abc import Mapping
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.commands import ACCELERATION, GO_TO, HOME, VELOCITY, WRENCH, Mode
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.episode.act import (
    Kinds,
    acting_of,
    is_own,
    refuse_what_it_wrote,
    write_command_with,
)
from uas_coverage_env.env.episode.arrays import arrays_of
from uas_coverage_env.env.episode.memory import FIRST_OBSERVATION
from uas_coverage_env.env.episode.observe import observe_with, observing_of
from uas_coverage_env.env.episode.pay import Terms, compute_rewards_with, paying_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.nearest import write_around
from uas_coverage_env.env.report import FIRST_TERM
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Acceleration, Command, GoTo, SwarmState, Velocity, Wrench


@cache
def _commands_with(own: Kinds) -> Any:
    write_command = write_command_with(own)

    @kernel
    def commands(arena, state, tables, learners, scratch, acting):
        for i in range(scratch.commands.shape[0]):
            write_command(arena, state, tables, learners, scratch, acting, i)

    return commands


@cache
def _rewards_with(own: Terms) -> Any:
    compute_rewards = compute_rewards_with(own)

    @kernel
    def rewards(arena, state, tables, learners, scratch, paying):
        compute_rewards(arena, state, tables, learners, scratch, paying)

    return rewards


class MissionInterface:
    """The observations, actions and rewards of an environment: the same kernels, to the bit.

    For a planner that flies a policy (`MissionInterface(brief, settings)`), and for a record of the
    rewards that an environment would have paid (`MissionInterface(world, settings)`).

    Args:
        mission: What a planner is told of it; or the world in which it is flown.
        settings: Of the environment; None: as it is by default.

    Attributes:
        settings: As given.
        actions: The kind of action, scaled to the fleet.

    Raises:
        ValueError: A block, a term or a kind cannot be compiled.
    """

    _revisions = 0

    def __init__(
        self, mission: MissionBrief | World, settings: MissionSettings | None = None
    ) -> None:
        self.settings = settings = settings or MissionSettings()
        self._world = mission if isinstance(mission, World) else None
        self._view = None if isinstance(mission, World) else WorldView(mission)
        self._scenario = mission.known if isinstance(mission, World) else mission.as_scenario()
        self._names = [uas.name for uas in self._scenario.uas]
        self.actions = actions_of(settings.kind, self._scenario)
        version = settings.version
        self._acting = acting_of(self.actions.kind, version.actions)
        self._observe = observe_with(version.observation)
        self._write = _commands_with(version.actions)
        self._pay = _rewards_with(version.reward)
        self._observing = observing_of(settings.observation, version.observation)
        self._paying = paying_of(settings.reward, settings.weights, version.reward)
        self._flew = np.ones(len(self._names), np.bool_)
        self._lay_out()

    def _lay_out(self) -> None:
        """Make the arrays; in a world again where an event has changed the scene."""
        if self._world is not None:
            self._scenario, self._revisions = self._world.known, self._world.revisions
        sizes, self._tables, self._learners, self._scratch = arrays_of(
            self._flown.arena, self._scenario, self.settings, self.actions
        )
        self._observation = FIRST_OBSERVATION.zeros(sizes).observation

    @property
    def _flown(self) -> World | WorldView:
        flown = self._world or self._view
        assert flown is not None
        return flown

    @property
    def candidates(self) -> NDArray[np.int64]:
        """(U, K_WAYPOINTS) open waypoints in the order of the latest observation; -1: no more."""
        return self._learners.candidates

    def observe(self, swarm: SwarmState) -> NDArray[np.float32]:
        """What the UAS observe; to be called in every step.

        Args:
            swarm: At this sample.

        Returns:
            (U, V), an array of its own; the row of a UAS that has ended is what it saw last.
        """
        view = self._view
        assert view is not None  # what a planner is told is not told of a world
        view.update(swarm)
        arena, state, learners = view.arena, view.state, self._learners
        write_around(state.uncovered, self._tables.neighbours, learners.around)
        self._observe(
            arena, state, self._tables, learners, self._observing, self._flew, self._observation
        )
        self._flew = state.uas["status"] == FLYING
        return self._observation.copy()

    def action_masks(self) -> NDArray[np.int8]:
        """(U, choices) 1 where a choice exists now.

        Raises:
            ValueError: The action is no choice.
        """
        if not self.settings.chooses:
            raise ValueError("only actions that are choices have masks; this one is continuous")
        return self.actions.kind.masks(self._learners.candidates).astype(np.int8)

    def commands(self, actions: Mapping[str, Any]) -> dict[str, Command]:
        """The commands that actions are, after `observe`.

        Args:
            actions: Of each UAS that flies.

        Raises:
            ValueError: An action is not of the action space, or is nothing that can be flown.
        """
        asked, names = self._learners.asked, self._names
        asked[:] = 0.0
        for name, action in actions.items():
            row = asked[names.index(name)]
            self.actions.accept(name, action, row)
            if not np.isfinite(row).all():
                raise ValueError(f"action of {name} is {row.tolist()}; give finite numbers")
        self._write(
            self._flown.arena, self._flown.state, self._tables, self._learners, self._scratch,
            self._acting,
        )  # fmt: skip
        if is_own(self._acting):
            refuse_what_it_wrote(self.actions.kind, asked, names)
        return {name: _command(self._scratch.commands[names.index(name)]) for name in actions}

    def reward_terms(
        self, commands: NDArray[np.void], outcome: NDArray[np.void]
    ) -> NDArray[np.float64]:
        """The weighted terms of the step just flown in the world.

        Args:
            commands: (U,) of COMMAND_DTYPE, what was asked.
            outcome: (U,) of OUTCOME_DTYPE, what came of it.

        Returns:
            (U, R) in the order of `settings.reward`; zero for UAS that did not fly. The reward is
            their sum.
        """
        if self._world is not None and self._world.revisions != self._revisions:
            before = self._learners.potentials
            self._lay_out()
            self._learners.potentials[:] = before
        self._scratch.commands[:] = commands
        self._scratch.outcome[:] = outcome
        self._pay(
            self._flown.arena, self._flown.state, self._tables, self._learners, self._scratch,
            self._paying,
        )  # fmt: skip
        return self._learners.amounts[:, FIRST_TERM:].copy()


def _command(row: np.void) -> Command:
    """A row of commands as a planner gives it."""
    kind, values = int(row["kind"]), row["values"].tolist()
    mode: Mode = "return" if row["returning"] else "covering"
    if kind == VELOCITY:
        return Velocity(*values[:3], mode=mode)
    if kind == ACCELERATION:
        return Acceleration(*values[:3], mode=mode)
    if kind == WRENCH:
        return Wrench(*values, mode=mode)
    if kind == GO_TO:
        return GoTo(None if values[0] == HOME else int(values[0]), mode, values[1])
    raise ValueError("the kind of action writes CLIMB, which no planner can command")
