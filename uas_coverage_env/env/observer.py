"""The learner's view for players: the observation of the environments from a `SwarmState`."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NO_TARGET, count_company, neighbours_of
from uas_coverage_env.env.observation import observe, scales_of
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import FLYING, SwarmState, build_arena, initial_state


class Observer:
    """Computes what the environments show, number for number, with their own kernel.

    For a planner that flies a trained policy: one observer per mission, asked once per sample.
    What a UAS sees once return mode has taken it over is its former view: it decides nothing.

    Args:
        scenario: The mission.

    Attributes:
        candidates: (U, K_WAYPOINTS) the open waypoints in the order of the latest observation; -1
            where there is none.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._arena = build_arena(scenario)
        self._state = initial_state(scenario)
        self._landing_distance_m = scenario.landing_distance_m
        self._scales = scales_of(scenario)
        self._neighbours = neighbours_of(scenario)
        self._no_targets = np.full(len(scenario.uas), NO_TARGET)
        self._company = np.zeros((len(scenario.waypoints), 2), np.float32)
        self._max_steps = scenario.max_steps
        self._observation = np.zeros((len(scenario.uas), OBSERVATION_SIZE), np.float32)
        self.candidates = np.full((len(scenario.uas), K_WAYPOINTS), -1)

    def observe(
        self, swarm: SwarmState, targets: NDArray[np.int64] | None = None
    ) -> NDArray[np.float32]:
        """What the UAS see now.

        Args:
            swarm: At this sample; every sample of a mission has to be shown, in order.
            targets: (U,) waypoints that they fly to, see `nearest`; None: none.

        Returns:
            (U, OBSERVATION_SIZE), an array of its own; rows of UAS that do not fly stay.
        """
        state = self._state
        state.x[:] = swarm.x
        state.status[:] = swarm.status
        state.reference[:] = swarm.reference_mps
        state.uncovered[:] = swarm.uncovered
        state.step[0] = swarm.step
        away_m = np.linalg.norm(swarm.x[:, :3] - swarm.home_m, axis=1)
        state.departed[:] |= away_m > self._landing_distance_m
        count_company(state.uncovered, self._neighbours, self._company)
        observe(
            self._arena,
            state,
            self._scales,
            self._company,
            state.status == FLYING,
            self._no_targets if targets is None else targets,
            self._max_steps,
            self.candidates,
            self._observation,
        )
        return self._observation.copy()
