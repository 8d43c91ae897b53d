"""Operation modes and target distance dynamics: Algorithms 2 and 3 (Sec. III-C.6).

The modes are the planner's memory; the world does not know them. Landing itself is the world's
word: a UAS that the world calls landed is no longer among the active ones.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.problem import Target, Weights

FloatArray = NDArray[np.float64]
_NEAR_M = 5.0  # at scale 1: distances below this no longer raise the normalised target cost
_NOTHING_LEFT = 4.0  # times the plain return weight, where nothing is left to cover


class Mode(IntEnum):
    """The paper's op."""

    COVERING = 0
    TRANSIT = 1
    RETURN = 2
    LANDED = 3

    @property
    def label(self) -> Literal["covering", "transit", "return"]:
        """The mode's name in a command and in the flight record."""
        return ("covering", "transit", "return")[min(self.value, 2)]


@dataclass(frozen=True)
class ModeMemory:
    """What a UAS remembers between decisions.

    Attributes:
        mode: operation mode.
        waypoint: the transit target's index in the scenario; None outside transit mode.
    """

    mode: Mode = Mode.COVERING
    waypoint: int | None = None


@dataclass(frozen=True)
class Situation:
    """What decides the next mode of one UAS.

    Attributes:
        position_m: (3,).
        velocity_mps: (3,).
        dod: depth of discharge.
        dod_return: DoD_r.
        uncovered: (K,) over the scenario's waypoints.
        plans_coverage: whether its last plan covers any waypoint.
        beyond: waypoints from which its charge would not bring it home.
    """

    position_m: FloatArray
    velocity_mps: FloatArray
    dod: float
    dod_return: float
    uncovered: NDArray[np.bool_]
    plans_coverage: bool
    beyond: frozenset[int] = frozenset()


def next_mode(memory: ModeMemory, now: Situation) -> Mode:
    """Algorithm 2; landing is observed, not decided."""
    if memory.mode in (Mode.LANDED, Mode.RETURN):
        return memory.mode
    if not now.uncovered.any() or now.dod >= now.dod_return:
        return Mode.RETURN
    if memory.mode is Mode.TRANSIT:
        still_open = memory.waypoint is not None and bool(now.uncovered[memory.waypoint])
        return Mode.TRANSIT if still_open else Mode.COVERING
    return Mode.COVERING if now.plans_coverage else Mode.TRANSIT


@dataclass(frozen=True)
class TargetChoice:
    """Weights of the transit target's cost factor; the paper names the three terms only.

    Attributes:
        horizontal: per `distance_scale_m` of horizontal distance.
        vertical: per `height_scale_m` of vertical distance.
        heading: for a turn by 180 degrees.
        among_candidates: whether each term is normalised by its largest value among the
            candidates, and not by the two scales.
    """

    horizontal: float = 1.0
    vertical: float = 0.3
    heading: float = 0.3
    distance_scale_m: float = 100.0
    height_scale_m: float = 40.0
    among_candidates: bool = False


def best_fitting_waypoint(
    now: Situation,
    waypoints_m: FloatArray,
    infeasible: Collection[int],
    choice: TargetChoice,
) -> int | None:
    """The open waypoint with the lowest sum of distance, height and heading cost.

    Args:
        now: the UAS's situation.
        waypoints_m: (K, 3) all waypoints of the scenario.
        infeasible: waypoints that will be covered within the horizon, are another UAS's target
            or lie wholly inside a moving obstacle's keep-out.
        choice: weights.

    Returns:
        Index of the waypoint, None where there is none.
    """
    candidates = [w for w in np.flatnonzero(now.uncovered) if w not in infeasible]
    if not candidates:
        return None
    away = waypoints_m[candidates] - now.position_m
    distance = np.hypot(away[:, 0], away[:, 1])
    speed = float(np.hypot(*now.velocity_mps[:2]))
    cosine = away[:, :2] @ now.velocity_mps[:2] / np.maximum(distance * speed, 1e-9)
    turn = 0.5 * (1.0 - cosine) if speed > 0.5 else np.zeros(len(candidates))
    height = np.abs(away[:, 2])
    scales = choice.distance_scale_m, choice.height_scale_m, 1.0
    if choice.among_candidates:
        scales = tuple(max(float(term.max()), 1e-9) for term in (distance, height, turn))
    cost = (
        choice.horizontal * distance / scales[0]
        + choice.vertical * height / scales[1]
        + choice.heading * turn / scales[2]
    )
    return int(candidates[int(np.argmin(cost))])


def update_modes(
    memories: Sequence[ModeMemory],
    situations: Sequence[Situation],
    waypoints_m: FloatArray,
    planned: Collection[int],
    blocked: Collection[int],
    choice: TargetChoice,
) -> list[ModeMemory]:
    """Algorithm 3 without the rows, which follow from the memories (`target_of`).

    Args:
        memories: (U) of the active UAS.
        situations: (U).
        waypoints_m: (K, 3).
        planned: waypoints covered within the last plan's horizon.
        blocked: waypoints that cannot be covered now.
        choice: weights of the target choice.
    """
    modes = [next_mode(m, s) for m, s in zip(memories, situations, strict=True)]
    kept = [
        m.waypoint if mode is Mode.TRANSIT and m.mode is Mode.TRANSIT else None
        for m, mode in zip(memories, modes, strict=True)
    ]
    result = []
    for row, (mode, situation) in enumerate(zip(modes, situations, strict=True)):
        waypoint, never = kept[row], {*blocked, *situation.beyond}
        if mode is Mode.TRANSIT and (waypoint is None or waypoint in never):
            taken = {w for other, w in enumerate(kept) if w is not None and other != row}
            waypoint = best_fitting_waypoint(
                situation, waypoints_m, {*planned, *never, *taken}, choice
            )
            kept[row] = waypoint
        if mode is Mode.TRANSIT and waypoint is None:
            mode = Mode.COVERING
        result.append(ModeMemory(mode, waypoint if mode is Mode.TRANSIT else None))
    return result


def target_of(
    memory: ModeMemory,
    now: Situation,
    home_m: FloatArray,
    waypoints_m: FloatArray,
    seconds_left: float,
    seconds_home: float,
    alike_m: float,
    weights: Weights,
    farthest_m: float = np.inf,
    scale: float = 1.0,
) -> Target | None:
    """The target distance dynamics of one UAS (eq. (OCP_7)), None in covering mode.

    The target's waypoint is the scenario's index.

    The weights are normalised by the distance now, so that they do not outweigh coverage far
    out. The return weight grows from little, while the way home takes a small part of the time the
    battery still gives, beyond all else, once it takes most of it; with nothing left to cover it
    is large at once.

    Args:
        memory: mode and transit target.
        now: situation.
        home_m: (3,) initial position.
        waypoints_m: (K, 3).
        seconds_left: flight time until DoD_max.
        seconds_home: flight time home.
        alike_m: distances from home up to this one count alike while a UAS covers on its way.
        weights: cost coefficients.
        farthest_m: distances from this one on no longer lower the cost of a metre: were it less,
            a UAS would save the energy, and stay.
        scale: of lengths, see `vehicle.scale`: in a tenth of the space, a metre costs as much as
            ten.
    """
    near_m = scale * _NEAR_M
    if memory.mode is Mode.TRANSIT and memory.waypoint is not None:
        position = waypoints_m[memory.waypoint]
        distance = max(float(np.linalg.norm(position - now.position_m)), near_m)
        return Target(position, weights.transit / min(distance, farthest_m), memory.waypoint)
    if memory.mode is Mode.RETURN:
        nearest = max(alike_m, near_m) if now.plans_coverage and now.uncovered.any() else near_m
        distance = max(float(np.linalg.norm(home_m - now.position_m)), nearest)
        urgency = min(seconds_home / max(seconds_left, 1e-9), 0.98)
        growth = urgency / (1.0 - urgency)
        if not now.uncovered.any():
            growth = _NOTHING_LEFT
        elif now.beyond.issuperset(np.flatnonzero(now.uncovered).tolist()):
            growth = max(growth, _NOTHING_LEFT)
        weight = weights.return_home * growth / min(distance, max(farthest_m, nearest))
        weight = min(weight, weights.home_per_m_max / scale)
        return Target(home_m, weight)
    return None
