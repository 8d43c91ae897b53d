"""The environments' observation from a `SwarmState`, for planners that fly a trained policy."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.episode.memory import FIRST_OBSERVATION, LEARNERS
from uas_coverage_env.env.episode.observe import observe, observing_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.start import learners_sizes, tables_of
from uas_coverage_env.env.observation import OBSERVATION, ObservationBlock
from uas_coverage_env.env.observation.nearest import NO_TARGET, write_around
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.world import FLYING, SwarmState
from uas_coverage_env.world.arena import ARENA


class Observer:
    """Computes what the environments show, number for number, with their own kernel.

    For a planner that flies a trained policy: one observer per mission.

    Args:
        brief: The mission.
        observation: The blocks of the observation.

    Attributes:
        candidates: (U, K_WAYPOINTS) the open waypoints in the order of the latest observation; -1
            where there is none.
    """

    def __init__(
        self, brief: MissionBrief, observation: tuple[ObservationBlock, ...] = OBSERVATION
    ) -> None:
        settings = MissionSettings(observation=observation)
        scenario = brief.as_scenario()
        self._view = WorldView(brief)
        actions = actions_of(settings.action, scenario)
        self._tables = tables_of(scenario, actions.ranges)
        sizes = ARENA.sizes_of(self._view.arena, learners_sizes(settings, actions.size))
        self._learners = LEARNERS.zeros(sizes)
        self._learners.targets[:] = NO_TARGET
        self._learners.candidates[:] = -1
        self._observing = observing_of(settings.observation)
        self._observation = FIRST_OBSERVATION.zeros(sizes).observation
        self.candidates = self._learners.candidates

    def observe(
        self, swarm: SwarmState, targets: NDArray[np.int64] | None = None
    ) -> NDArray[np.float32]:
        """What the UAS observe now.

        Args:
            swarm: At this sample.
            targets: (U,) waypoints that they fly to, see `nearest`; None: none.

        Returns:
            (U, V), an array of its own; rows of UAS that do not fly stay.
        """
        self._view.update(swarm)
        state = self._view.state
        write_around(state.uncovered, self._tables.neighbours, self._learners.around)
        self._learners.targets[:] = NO_TARGET if targets is None else targets
        flying = state.uas["status"] == FLYING
        observe(
            self._view.arena, state, self._tables, self._learners, self._observing, flying,
            self._observation,
        )  # fmt: skip
        return self._observation.copy()
