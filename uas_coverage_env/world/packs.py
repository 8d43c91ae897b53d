"""Fresh battery packs for UAS that have landed at home, while the others fly on."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.entities.state import (
    FLYING,
    LANDED,
    LOST,
    NEVER,
    SWAPPING,
)
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.features.of_scenario import features_of
from uas_coverage_env.geometry.segments import cylinder_clearance, outside_cylinder
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.ground_phases import landing, take_off
from uas_coverage_env.vehicle.layout import DOD, U_TH, VX, VY, VZ, X, Y, Z
from uas_coverage_env.vehicle.parts import MAX_FURTHER_PAIRS
from uas_coverage_env.world.contacts import obstacle_breaches
from uas_coverage_env.world.coverage import can_cover
from uas_coverage_env.world.events import steps_until

AHEAD_S = 5.0
"""No UAS takes off where another one, flying on as it does, would come too near within this [s]."""

NOTHING, NOW, LATER = 0, 1, 2
"""When there is something to do; now and later add up."""

PACKS_DTYPE = record_dtype(
    [
        # how many packs it has, and the steps from a landing to its next take-off
        ("number", "i8"),
        ("swap_steps", "i8"),
        # a fresh one at the start
        ("dod", "f8"),
        ("u_th_V", "f8"),
        ("further_V", "f8", (MAX_FURTHER_PAIRS,)),
    ]
)


def swaps_alone(scenario: Scenario) -> bool:
    """Whether each UAS swaps packs on its own while the others fly on."""
    return scenario.sorties is not None and not scenario.sorties.together


def pack_records(scenario: Scenario) -> NDArray[np.void]:
    """(B,) of PACKS_DTYPE: one for each UAS, or none where none swaps while the others fly."""
    sorties = scenario.sorties
    if sorties is None or sorties.together:
        return np.zeros(0, dtype=PACKS_DTYPE)
    records = np.zeros(len(scenario.uas), dtype=PACKS_DTYPE)
    for i, (record, uas) in enumerate(zip(records, scenario.uas, strict=True)):
        seconds, record["dod"] = sorties.swap_s, 1.0 - uas.soc_0
        if scenario.from_ground:
            up = take_off(scenario, i, uas.home_m)
            down = landing(scenario, i, uas.home_m, uas.dod_max, 0.0)
            seconds += down.time_s + up.time_s
            record["dod"], (record["u_th_V"], *further_V) = up.battery
            record["further_V"][: len(further_V)] = further_V
        record["number"] = sorties.packs
        record["swap_steps"] = steps_until(seconds, scenario.dt_s)
    return records


def packs_left(arena, state) -> NDArray[np.int64]:
    """Fresh packs that each UAS may still swap for, as the rule below has it.

    Args:
        arena: The arena.
        state: Its state.

    Returns:
        (U,), empty where none swaps while the others fly on.
    """
    if not len(arena.packs):
        return np.zeros(0, np.int64)
    out = np.isin(state.uas["status"], (LANDED, LOST)).sum()
    waits = ~state.packs["covered"] & (state.packs["out"] >= out)
    flies_again = (state.uas["status"] == FLYING) | ((state.uas["status"] == SWAPPING) & ~waits)
    return np.where(flies_again, arena.packs["number"] - 1 - state.packs["number"], 0)


def swap_steps_left(arena, state) -> NDArray[np.int64]:
    """Steps until each UAS that swaps is ready; arguments as for `packs_left`.

    Returns:
        (U,), 0 for UAS that do not swap; empty where none swaps while the others fly on.
    """
    if not len(arena.packs):
        return np.zeros(0, np.int64)
    left = np.maximum(state.packs["ready_step"] - state.step[0], 0)
    return np.where(state.uas["status"] == SWAPPING, left, 0)


@rare_kernel
def is_clear(arena, moving_m, x, uas, i, ahead_s):
    """Whether UAS i keeps all safe distances where it stands.

    Args:
        arena: The arena.
        moving_m: (M, 3) [m] where the moving obstacles are.
        x: (U, 14) states.
        uas: (U,) records with their `status`.
        i: Which.
        ahead_s: For how long those that fly are taken to fly straight on [s].
    """
    here = x[i]
    if obstacle_breaches(arena, moving_m, i, here[X], here[Y], here[Z]) > 0:
        return False
    for j in range(uas.shape[0]):
        if j == i or uas[j].status != FLYING:
            continue
        kept_m = arena.uas[i].radius_m + arena.uas[j].radius_m + arena.rules[0].uas_safe_distance_m
        dx = here[X] - x[j, X]
        dy = here[Y] - x[j, Y]
        dz = here[Z] - x[j, Z]
        apart_m = outside_cylinder(0.0, 0.0, dx, dy, dz)
        if ahead_s > 0.0:
            apart_m = min(
                apart_m,
                cylinder_clearance(
                    0.0, 0.0, dx, dy, dz,
                    dx - ahead_s * x[j, VX], dy - ahead_s * x[j, VY], dz - ahead_s * x[j, VZ],
                ),
            )  # fmt: skip
        if apart_m < kept_m:
            return False
    return True


@inlined_kernel
def _to_do(arena, state, i):
    """Whether a waypoint is open that UAS i can cover, and time left to fly there and back.

    Straight and at full speed: what is too late so, is too late by any route.

    Returns:
        NOTHING, or the sum of NOW and LATER: such a waypoint is going to be asked for again.
    """
    rules = arena.rules[0]
    uas = arena.uas[i]
    step = state.step[0]
    found = NOTHING
    for w in range(state.uncovered.shape[0]):
        opens = step
        if not state.uncovered[w]:
            # at this sample it is asked for, but not yet among the waypoints
            if state.due_step.shape[0] == 0 or state.due_step[w] < step:
                continue
            opens = state.due_step[w]
        if not can_cover(arena, i, w):
            continue
        begins = max(opens, state.packs[i].ready_step)
        reach_m = 0.5 * uas.speed_mps * rules.dt_s * (rules.max_steps - begins)
        waypoint = arena.waypoints[w]
        north_m = waypoint.position_m[0] - state.x[i, X]
        east_m = waypoint.position_m[1] - state.x[i, Y]
        if math.sqrt(north_m * north_m + east_m * east_m) - waypoint.radius_m < reach_m:
            found |= NOW if state.uncovered[w] else LATER
    return found


@inlined_kernel
def _take_off(arena, state, i, out):
    """Let UAS i fly with its next pack, at rest where it has landed."""
    pack = arena.packs[i]
    state.uas[i].status = FLYING
    state.uas[i].departed = False
    state.uas[i].returning = False
    state.x[i, DOD] = pack.dod
    state.x[i, U_TH] = pack.u_th_V
    if state.true_vehicles.shape[0] > 0:
        for p in range(MAX_FURTHER_PAIRS):
            state.true_vehicles[i].further_V[p] = pack.further_V[p]
    kept = state.packs[i]
    kept.number += 1
    kept.covered = False
    kept.out = out


@inlined_kernel
def _end(state, i, outcome):
    """UAS i has landed for good."""
    state.uas[i].status = LANDED
    outcome[i].landed = True


@rare_kernel
def _swap_packs(arena, state, outcome, f):
    """Let UAS that have landed swap packs, and fly again when they have a fresh one.

    One that lands with a pack left swaps. It has landed for good where no waypoint is open any
    more that it can cover in time, nor is going to be, or where it will hear no command again. It
    takes off as soon as one is open, its pack is in, it takes commands and `is_clear`; but where
    its last sortie has covered nothing, only once another UAS was lost or has landed for good
    since: what it left to the others may be its own then. Where none flies or is going to, all have
    landed for good.

    Args:
        arena: The arena.
        state: The state at the new sample, judged; written.
        outcome: (U,) of OUTCOME_DTYPE; landed is written: whether it has landed for good.
        f: Number of the feature.
    """
    n_uas = state.uas.shape[0]
    step = state.step[0]
    over = step >= arena.rules[0].max_steps
    for i in range(n_uas):
        kept = state.packs[i]
        if outcome[i].newly_covered > 0:
            kept.covered = True
        if outcome[i].landed and kept.number + 1 < arena.packs[i].number:
            state.uas[i].status = SWAPPING
            outcome[i].landed = False
            kept.ready_step = step + arena.packs[i].swap_steps
    out = 0
    works = False
    for i in range(n_uas):
        if state.uas[i].status == SWAPPING and (
            over or _to_do(arena, state, i) == NOTHING or state.uas[i].responds_from_step >= NEVER
        ):
            _end(state, i, outcome)
        out += state.uas[i].status == LANDED or state.uas[i].status == LOST
        works |= state.uas[i].status == FLYING
    moving_m = arena.moving_path_m[min(step, arena.moving_path_m.shape[0] - 1)]
    for i in range(n_uas):
        kept = state.packs[i]
        if state.uas[i].status != SWAPPING:
            continue
        waits = not kept.covered and out <= kept.out
        to_do = _to_do(arena, state, i)
        works |= not waits or to_do & LATER > 0
        if (
            to_do & NOW > 0
            and not waits
            and step >= kept.ready_step
            and state.uas[i].responds_from_step <= step
            and is_clear(arena, moving_m, state.x, state.uas, i, AHEAD_S)
        ):
            _take_off(arena, state, i, out)
    if not works:
        for i in range(n_uas):
            if state.uas[i].status == SWAPPING:
                _end(state, i, outcome)


PACKS = MissionFeature("packs", {Point.JUDGED: _swap_packs})
"""Swaps of each UAS on its own."""


def mission_features(
    scenario: Scenario, disturbances: Sequence[MissionFeature] | None = None
) -> tuple[MissionFeature, ...]:
    """What a mission has of what few missions have.

    Args:
        scenario: Of the mission.
        disturbances: In place of what the scenario's tables say that acts on how UAS fly; None:
            these.

    Raises:
        ValueError: See `features_of`.
    """
    packs = [PACKS] if swaps_alone(scenario) else []
    return (*features_of(scenario, disturbances), *packs)
