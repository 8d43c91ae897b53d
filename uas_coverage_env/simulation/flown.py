"""A world for flights that were flown elsewhere: told where the UAS are, it judges by its rules."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.step import MISSION, begin_step, judge
from uas_coverage_env.simulation.world import World
from uas_coverage_env.vehicle import N_STATES
from uas_coverage_env.world.commands import COMMAND_DTYPE
from uas_coverage_env.world.outcome import OUTCOME_DTYPE
from uas_coverage_env.world.state import FLYING

_views = MISSION.views


@kernel
def judge_track(at, commands, x, resting, outcome):
    """Put the UAS that fly where they were at the next sample, and judge what happened on the way.

    Args:
        at: Addresses of arena and state, see `MISSION`.
        commands: (U,) of COMMAND_DTYPE; not flown.
        x: (U, 14) states at the next sample.
        resting: (U,) whether each stands at home, to be landed even if it never left.
        outcome: (U,) of OUTCOME_DTYPE; written.
    """
    arena, state = _views(at)
    begin_step(state, commands, outcome)
    for i in range(state.status.shape[0]):
        if state.status[i] == FLYING:
            for k in range(N_STATES):
                state.x[i, k] = x[i, k]
            outcome[i].returning = resting[i]
    judge(arena, state, False, outcome)


class FlownWorld(World):
    """A world in which nothing is simulated.

    Limits of the vehicle are not judged: the velocities of a log are no measure of them.

    Args:
        scenario: Without events, which a log does not know.
        x: (U, 14) states at t = 0.
    """

    def __init__(self, scenario: Scenario, x: NDArray[np.float64]) -> None:
        if scenario.events:
            raise ValueError("events cannot be judged from a track; leave them out")
        # packs are swapped when a log says so, not by the rule of the world
        super().__init__(scenario.model_copy(update={"sorties": None}), disturbances=())
        self.state.x[:] = x
        self._commands = np.zeros(len(self.names), dtype=COMMAND_DTYPE)

    def follow(self, x: NDArray[np.float64], resting: NDArray[np.bool_]) -> NDArray[np.void]:
        """Judge one step.

        Args:
            x: (U, 14) states at the next sample.
            resting: (U,) whether each stands at home for good.

        Returns:
            (U,) of OUTCOME_DTYPE, an array of its own.
        """
        outcome = np.zeros(len(self.names), dtype=OUTCOME_DTYPE)
        at = np.array(MISSION.addresses_of(self.arena, self.state))
        x = np.ascontiguousarray(x, dtype=np.float64)
        judge_track(at, self._commands, x, np.ascontiguousarray(resting), outcome)
        outcome["limits_exceeded"] = 0
        self.change_scene()
        return outcome
