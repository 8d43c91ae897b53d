"""The reward of a flight in the world: what an environment would have paid, step by step."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.episode.memory import FIRST_TERM, LEARNERS, SCRATCH
from uas_coverage_env.env.episode.pay import compute_rewards, paying_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.start import learners_sizes, tables_of
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.rewards import REWARD, RewardTerm
from uas_coverage_env.simulation import World
from uas_coverage_env.world.arena import ARENA


@kernel
def _pay(arena, state, tables, learners, scratch, paying):
    compute_rewards(arena, state, tables, learners, scratch, paying, None)


class RewardMeter:
    """The terms of a reward, for whatever flies in a world.

    Args:
        world: What is flown.
        reward: The terms.
        reward_weights: Mapping from term to weight; the other terms keep theirs.

    Attributes:
        names: (R,) of the terms.

    Raises:
        ValueError: A term or a weight is none.
    """

    def __init__(
        self,
        world: World,
        reward: Sequence[RewardTerm] = REWARD,
        reward_weights: Mapping[str, float] | None = None,
    ) -> None:
        settings = MissionSettings(reward=tuple(reward), reward_weights=reward_weights)
        self.names = settings.term_names
        self._settings = settings
        self._world = world
        self._paying = paying_of(settings.reward, settings.weights)
        self._revision = -1

    def terms(self, commands: NDArray[np.void], outcome: NDArray[np.void]) -> NDArray[np.float64]:
        """The weighted terms of the step just flown.

        Args:
            commands: (U,) of COMMAND_DTYPE, what was asked.
            outcome: (U,) of OUTCOME_DTYPE, what came of it.

        Returns:
            (U, R); zero for UAS that did not fly. The reward is their sum.
        """
        world = self._world
        if world.revisions != self._revision:
            self._prepare()
        self._scratch.commands[:] = commands
        self._scratch.outcome[:] = outcome
        _pay(world.arena, world.state, self._tables, self._learners, self._scratch, self._paying)
        return self._learners.amounts[:, FIRST_TERM:].copy()

    def _prepare(self) -> None:
        """Make the arrays; again where an event has changed the scene."""
        world = self._world
        actions = actions_of(self._settings.action, world.known)
        sizes = ARENA.sizes_of(world.arena, learners_sizes(self._settings, actions.size))
        self._tables = tables_of(world.known, actions.ranges)
        self._learners = LEARNERS.zeros(sizes)
        self._learners.targets[:] = NO_TARGET
        self._learners.candidates[:] = -1
        self._scratch = SCRATCH.zeros(sizes)
        self._revision = world.revisions
