"""A world for flights that were flown elsewhere: told where the UAS are, it judges by its rules."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.outcome import FAULT, NONE, OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING, LOST
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.step import MISSION, begin_step
from uas_coverage_env.simulation.world import World
from uas_coverage_env.vehicle.layout import N_STATES
from uas_coverage_env.world.contacts import (
    check_fence_and_battery,
    check_obstacles,
    check_separation,
    count_breaches,
)
from uas_coverage_env.world.coverage import cover, land

_views = MISSION.views
_UNSEEN = LOST + 100
"""Instead of FLYING, for what is not judged at a moment."""


@kernel
def _hide(state, shown):
    """Take those that are not shown out of what is judged."""
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and not shown[i]:
            state.uas[i].status = _UNSEEN


@kernel
def _show(state):
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == _UNSEEN:
            state.uas[i].status = FLYING


@kernel
def judge_moment(at, commands, x, resting, known, measured, last, outcome):
    """Put the UAS that fly where they were at the next moment, and judge what happened on the way.

    Args:
        at: Addresses of arena and state, see `MISSION`.
        commands: (U,) of COMMAND_DTYPE; not flown.
        x: (U, 14) states at the next moment.
        resting: (U,) whether each stands at home for good, and has landed.
        known: (U,) 2: the way there is known, and contacts are judged; 1: only where it is then;
            0: neither.
        measured: (U,) whether where it is was measured, so that it may cover something.
        last: Whether the moment is the next sample of the flight.
        outcome: (U,) of OUTCOME_DTYPE; written.
    """
    arena, state = _views(at)
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and known[i] == 1:
            for k in range(N_STATES):
                state.x[i, k] = x[i, k]
    begin_step(state, commands, outcome)
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING:
            for k in range(N_STATES):
                state.x[i, k] = x[i, k]
            outcome[i].returning = resting[i]
            state.uas[i].departed = False  # a log says when a UAS has landed
    _hide(state, known)
    check_obstacles(arena, state, outcome)
    check_separation(arena, state, outcome)
    check_fence_and_battery(arena, state, outcome)
    count_breaches(arena, state, outcome)
    _show(state)
    _hide(state, measured)
    cover(arena, state, state.step[0] + 1, outcome)
    _show(state)
    land(arena, state, outcome)
    for i in range(state.uas.shape[0]):
        if state.uas[i].status == FLYING and outcome[i].contact != NONE:
            state.uas[i].status = LOST
    if last:
        state.step[0] += 1


@dataclass(frozen=True, eq=False)
class Moments:
    """The moments of a step, M of them in order of time; the last is the next sample.

    Attributes:
        x: (M, U, 14) states.
        known: (M, U) 2: the way there from the moment before is known; 1: only where it is; 0:
            neither.
        measured: (M, U) whether where it is was measured then.
    """

    x: NDArray[np.float64]
    known: NDArray[np.int8]
    measured: NDArray[np.bool_]


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

    def follow(
        self, moments: Moments, resting: NDArray[np.bool_], gone: NDArray[np.bool_]
    ) -> tuple[NDArray[np.void], list[tuple[int, int]]]:
        """Judge one step.

        Args:
            moments: Of the step.
            resting: (U,) whether each stands at home for good at its end.
            gone: (U,) whether nothing is known of each after its end: it is out of the mission.

        Returns:
            (U,) of OUTCOME_DTYPE, an array of its own; and moment and UAS of each covering.
        """
        whole, passes = np.zeros(len(self.names), dtype=OUTCOME_DTYPE), []
        at = np.array(MISSION.addresses_of(self.arena, self.state))
        no_one, n = np.zeros_like(resting), len(moments.x)
        for m in range(n):
            last = m == n - 1
            outcome = np.zeros(len(self.names), dtype=OUTCOME_DTYPE)
            judge_moment(
                at, self._commands, moments.x[m], resting if last else no_one,
                moments.known[m], moments.measured[m], last, outcome
            )  # fmt: skip
            passes += [(m, int(i)) for i in np.flatnonzero(outcome["newly_covered"])]
            whole = outcome if m == 0 else _both(whole, outcome)
        out = gone & (self.state.uas["status"] == FLYING)
        self.state.uas["status"][out], whole["contact"][out] = LOST, FAULT
        self.change_scene()
        return whole, passes


def _both(one: NDArray[np.void], other: NDArray[np.void]) -> NDArray[np.void]:
    """What happened in two parts of a step: a breach in both is one."""
    for name in ("newly_covered", "newly_covered_weight"):
        one[name] += other[name]
    for name in ("breaches", "too_low", "below_reserve", "landed", "returning"):
        one[name] = np.maximum(one[name], other[name])
    flying = other["flew"]
    for name in ("obstacle_clearance_m", "separation_m", "fence_clearance_m"):
        one[name][flying] = np.minimum(one[name], other[name])[flying]
    first = flying & (one["contact"] == NONE)
    one["contact"][first] = other["contact"][first]
    one["contact_with"][first] = other["contact_with"][first]
    return one
