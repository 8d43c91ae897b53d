"""Many missions of one scenario on a GPU: the kernels of the world compiled for CUDA.

Numba compiles the same functions for a GPU that it compiles for the processor; one thread of the
GPU flies one mission. What cannot run there is what makes arrays: guidance (the waypoint action),
return mode and safety filter. For all else the step is that of `CoverageParallelEnv`, in double
precision; the GPU's own roots and exponentials may differ in the last digit.

Without a GPU, numba's simulator runs it: `NUMBA_ENABLE_CUDASIM=1`, for tests.
"""

from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numba import config, cuda
from numpy.typing import NDArray

from uas_coverage_env.env.actions import first_not_finite, write_commands
from uas_coverage_env.env.episode import Episode
from uas_coverage_env.env.kernel import ACCEPTED, CONTACT_WITH, COVERED, REWARD, STATUS, settle
from uas_coverage_env.env.nearest import NO_TARGET
from uas_coverage_env.kernels import kernel
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world import FLYING, Arena, WorldState
from uas_coverage_env.world.step import begin_step, carry_out

THREADS_PER_BLOCK = 64


class Missions(NamedTuple):
    """All missions of N lanes; the first axis is the lane."""

    x: NDArray[np.float64]
    """(N, U, 14) see `WorldState`, also the next six."""
    reference: NDArray[np.float64]
    status: NDArray[np.int64]
    departed: NDArray[np.bool_]
    returning: NDArray[np.bool_]
    uncovered: NDArray[np.bool_]
    step: NDArray[np.int64]
    asked: NDArray[np.float64]
    """(N, U, size) see `step_learners`, also the next six."""
    targets: NDArray[np.int64]
    candidates: NDArray[np.int64]
    company: NDArray[np.float32]
    commands: NDArray[np.void]
    outcome: NDArray[np.void]
    report: NDArray[np.float64]
    observation: NDArray[np.float32]
    """(N, U, OBSERVATION_SIZE)."""
    rewards: NDArray[np.float64]
    """(N, U) of each UAS for the latest step."""
    ended: NDArray[np.bool_]
    """(N,) the mission is over; its next step begins a new one and flies nothing."""
    refused: NDArray[np.bool_]
    """(N,) an action was not finite, and so nothing was flown."""
    acted: NDArray[np.int64]
    """(N,) agent-steps flown since the beginning."""


class Tables(NamedTuple):
    """What is the same in all lanes."""

    ranges: NDArray[np.void]
    scales: NDArray[np.void]
    neighbours: NDArray[np.void]
    weights: NDArray[np.float64]


class Start(NamedTuple):
    """What changes in a mission and is not zero at its start."""

    x: NDArray[np.float64]
    uncovered: NDArray[np.bool_]
    candidates: NDArray[np.int64]
    company: NDArray[np.float32]
    observation: NDArray[np.float32]


@kernel
def _begin_mission(start, missions, lane):
    n_covered = 0
    for w in range(start.uncovered.shape[0]):
        missions.uncovered[lane, w] = start.uncovered[w]
        n_covered += not start.uncovered[w]
        for k in range(2):
            missions.company[lane, w, k] = start.company[w, k]
    missions.step[lane, 0] = 0
    for i in range(start.x.shape[0]):
        for k in range(start.x.shape[1]):
            missions.x[lane, i, k] = start.x[i, k]
        missions.reference[lane, i, 0] = 0.0
        missions.reference[lane, i, 1] = 0.0
        missions.status[lane, i] = FLYING
        missions.departed[lane, i] = False
        missions.returning[lane, i] = False
        missions.targets[lane, i] = NO_TARGET
        missions.rewards[lane, i] = 0.0
        for k in range(start.candidates.shape[1]):
            missions.candidates[lane, i, k] = start.candidates[i, k]
        for k in range(start.observation.shape[1]):
            missions.observation[lane, i, k] = start.observation[i, k]
        for k in range(missions.report.shape[2]):
            missions.report[lane, i, k] = 0.0
        missions.report[lane, i, CONTACT_WITH] = -1.0
        missions.report[lane, i, COVERED] = n_covered


@kernel
def step_mission(arena, tables, start, missions, kind, nonlinear, lane):
    """Fly one lane for one step; see `Missions`.

    Args:
        arena: The arena.
        tables: `Tables`.
        start: `Start`.
        missions: `Missions`; the lane is written.
        kind: Kind of command that the actions become, not GO_TO.
        nonlinear: Whether the 6-DOF plant is flown.
        lane: Which.
    """
    missions.refused[lane] = first_not_finite(missions.asked[lane]) != ACCEPTED
    if missions.refused[lane]:
        return
    if missions.ended[lane]:
        missions.ended[lane] = False
        _begin_mission(start, missions, lane)
        return
    state = WorldState(
        missions.x[lane],
        missions.reference[lane],
        missions.status[lane],
        missions.departed[lane],
        missions.returning[lane],
        missions.uncovered[lane],
        missions.step[lane],
    )
    commands = missions.commands[lane]
    outcome = missions.outcome[lane]
    targets = missions.targets[lane]
    candidates = missions.candidates[lane]
    report = missions.report[lane]
    max_steps = arena.rules[0].max_steps
    write_commands(state, kind, tables.ranges, missions.asked[lane], candidates, targets, commands)
    begin_step(state, commands, outcome)
    carry_out(arena, state, nonlinear, outcome)
    settle(
        arena, state, tables.scales, tables.neighbours, tables.weights, targets, candidates,
        missions.company[lane], commands, outcome, report, max_steps, missions.observation[lane],
    )  # fmt: skip
    flies = False
    for i in range(report.shape[0]):
        missions.rewards[lane, i] = report[i, REWARD]
        missions.acted[lane] += outcome[i].flew
        flies = flies or report[i, STATUS] == FLYING
    missions.ended[lane] = not flies or state.step[0] >= max_steps


def _on_device(array: NDArray) -> Any:
    # the simulator's own arrays are strange to what is called by its kernels; it takes plain ones
    simulated = config.ENABLE_CUDASIM  # pyright: ignore[reportAttributeAccessIssue]
    return array.copy() if simulated else cuda.to_device(array)


@cuda.jit
def _step_missions(arena, tables, start, missions, kind, nonlinear):
    lane = cuda.grid(1)  # pyright: ignore[reportCallIssue]
    if lane < missions.ended.shape[0]:
        step_mission(arena, tables, start, missions, kind, nonlinear, lane)


class CudaMissions:
    """N missions of one scenario on the GPU.

    A lane whose mission has ended begins the next one in the step after, whatever it is asked.

    Args:
        num_envs: N.
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario.
        action: "velocity", "acceleration" or "wrench".
        dynamics: "lpv" or "nonlinear".
        reward_weights: Reward term -> weight; the others keep their defaults.
        max_cycles: Steps after which missions are cut; None: the scenario's.

    Attributes:
        missions: `Missions` on the device; to be read only, but for `asked`.

    Raises:
        ValueError: An argument is none of what is allowed.
        numba.cuda.CudaSupportError: There is no GPU.
    """

    def __init__(
        self,
        num_envs: int,
        scenario: str | Path | Scenario = "village",
        *,
        action: str = "velocity",
        dynamics: str = "lpv",
        reward_weights: dict[str, float] | None = None,
        max_cycles: int | None = None,
    ) -> None:
        if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
            raise ValueError(f"num_envs is {num_envs!r}; give a whole number from 1 on")
        episode = Episode(
            scenario,
            action=action,
            dynamics=dynamics,
            return_mode=False,
            safety_filter=False,
            reward_weights=reward_weights,
            max_cycles=max_cycles,
        )
        if episode.chooses:
            raise ValueError("the waypoint action needs guidance, which does not run on a GPU")
        episode.reset()
        arena, tables, start, one = episode.arrays()
        nothing = np.zeros((), dtype=np.bool_)
        changing = (*one, np.zeros(len(episode.names)), nothing, nothing, np.zeros((), np.int64))
        self.missions = Missions(
            *(_on_device(np.repeat(array[None], num_envs, axis=0)) for array in changing)
        )
        self._blocks = -(-num_envs // THREADS_PER_BLOCK)
        self._arguments = (
            Arena(*map(_on_device, arena)),
            Tables(*map(_on_device, tables)),
            Start(*map(_on_device, start)),
            self.missions,
            episode.actions.kind,
            dynamics == "nonlinear",
        )

    def step(self, asked: Any = None) -> None:
        """Fly all lanes for one step.

        Args:
            asked: (N, U, size) actions, on the host or on the device; None: what is in
                `missions.asked`. Of a lane with one that is not finite nothing is flown, and
                `missions.refused` is set.
        """
        if asked is not None:
            self.missions.asked[:] = asked
        launched: Any = _step_missions
        launched[self._blocks, THREADS_PER_BLOCK](*self._arguments)
