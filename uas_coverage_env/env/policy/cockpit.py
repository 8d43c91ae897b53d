"""What a policy sees and how its actions become commands, outside of the environments."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.commands import ACCELERATION, GO_TO, HOME, VELOCITY, WRENCH, Mode
from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.episode.act import acting_of, is_own, refuse_what_it_wrote, write_commands
from uas_coverage_env.env.episode.memory import FIRST_OBSERVATION, LEARNERS, SCRATCH
from uas_coverage_env.env.episode.observe import observe, observing_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.start import learners_sizes, tables_of
from uas_coverage_env.env.observation.nearest import NO_TARGET, write_around
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.world import FLYING, Acceleration, Command, GoTo, SwarmState, Velocity, Wrench
from uas_coverage_env.world.arena import ARENA


@kernel
def _write(arena, state, tables, learners, scratch, acting):
    write_commands(arena, state, tables, learners, scratch, acting, None)


class Cockpit:
    """The observations and actions of an environment for a planner: the same kernels, to the bit.

    Args:
        brief: The mission.
        settings: Of the environment that the policy belongs to.

    Attributes:
        actions: The kind of action, scaled to the fleet.
    """

    def __init__(self, brief: MissionBrief, settings: MissionSettings) -> None:
        scenario = brief.as_scenario()
        self._names = [uas.name for uas in brief.uas]
        self._view = WorldView(brief)
        self._settings = settings
        self.actions = actions_of(settings.action, scenario)
        self._tables = tables_of(scenario, self.actions.ranges)
        sizes = ARENA.sizes_of(self._view.arena, learners_sizes(settings, self.actions.size))
        self._learners = LEARNERS.zeros(sizes)
        self._learners.targets[:] = NO_TARGET
        self._learners.candidates[:] = -1
        self._scratch = SCRATCH.zeros(sizes)
        self._acting = acting_of(self.actions.kind)
        self._observing = observing_of(settings.observation)
        self._observation = FIRST_OBSERVATION.zeros(sizes).observation
        self._flew = np.ones(len(self._names), np.bool_)

    def observe(self, swarm: SwarmState) -> NDArray[np.float32]:
        """What the UAS observe; to be called in every step.

        Args:
            swarm: At this sample.

        Returns:
            (U, V), an array of its own; the row of a UAS that has ended is what it saw last.
        """
        self._view.update(swarm)
        state, learners = self._view.state, self._learners
        write_around(state.uncovered, self._tables.neighbours, learners.around)
        observe(
            self._view.arena, state, self._tables, learners, self._observing, self._flew,
            self._observation,
        )  # fmt: skip
        self._flew = state.uas["status"] == FLYING
        return self._observation.copy()

    def action_masks(self) -> NDArray[np.int8]:
        """(U, choices) 1 where a choice exists now.

        Raises:
            ValueError: The action is no choice.
        """
        if not self._settings.chooses:
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
        _write(
            self._view.arena, self._view.state, self._tables, self._learners, self._scratch,
            self._acting,
        )  # fmt: skip
        if is_own(self._acting):
            refuse_what_it_wrote(self.actions.kind, asked, names)
        return {name: _command(self._scratch.commands[names.index(name)]) for name in actions}


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
        return GoTo(None if values[0] == HOME else int(values[0]), mode)
    raise ValueError("the kind of action writes CLIMB, which no planner can command")
