"""What turning costs at least: small linear programs on the LPV model, by steps and angles.

See docs/bound.md, "The price of a turn".
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from uas_coverage_env.bound.prices import WITHIN, Prices
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.governor import horizontal_axis

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

LONGEST = 4
"""Steps before, and after a visit that a turn is counted in at most."""

LONGEST_START = 6
"""Steps that setting off is counted in at most."""

_N_STATES = 3  # of an axis, see `Motion`; both axes come first among the variables
_REACHED_STEPS = 16
_SIDES = 24
_ANGLES = 25  # from straight on to back, half the change of heading in steps of 3.75 degrees
_HALF_ANGLES: list[float] = np.linspace(0.0, 0.5 * math.pi, _ANGLES).tolist()


class Motion(NamedTuple):
    """Velocity, tilt and tilt rate of one horizontal axis, and what they must keep to."""

    A: FloatArray
    """(3, 3)"""
    B: FloatArray
    """(3,)"""
    position: FloatArray
    """(3,) how far a step goes at a velocity, tilt and rate."""
    input_m: float
    """... and at an angular acceleration."""
    potential: FloatArray
    """(3,) g with: a step goes dt v + g x(k+1) - g x(k)."""
    largest: FloatArray
    """(3,) norms of velocity, tilt and rate."""
    largest_input: float
    """Norm of the angular accelerations about both axes [rad/s²]."""
    trim: float
    """Tilt that holds a speed [rad per m/s]."""


class Turns:
    """Least costs of turns of a vehicle, each found when it is first asked for.

    Args:
        window: Finds them.
        loss: (LONGEST + 1, LONGEST + 1) subtracted, by steps before and after the visit.
    """

    def __init__(self, window: _Window, loss: FloatArray) -> None:
        self._window, self._loss = window, loss
        self._known = np.full((*loss.shape, _ANGLES), np.nan)

    def at(self, before: IntArray, after: IntArray, place: IntArray) -> FloatArray:
        """By steps before and after the visit, and the number of the angle, of one shape."""
        asked = np.zeros(self._known.shape, dtype=bool)
        asked[before, after, place] = True
        for n, m, angle in np.argwhere(asked & np.isnan(self._known)).tolist():
            cost = self._window.turn(n, m, _HALF_ANGLES[angle])
            self._known[n, m, angle] = cost - self._loss[n, m]
        return self._known[before, after, place]


class Turning(NamedTuple):
    """Least costs around a visit, beyond those of flying straight at full speed.

    Attributes:
        per_m: Cost of a metre, straight at full speed.
        reach_m: (n+1,) how far a UAS gets in so many steps, at most.
        reach_from_rest_m: (n+1,) the same from rest.
        turns: Costs of turns, of each kind of vehicle.
        start: (LONGEST_START + 1,) of setting off from rest, by steps.
        landing: (LONGEST + 1,) of coming to rest, by steps, one at least.
    """

    per_m: float
    reach_m: FloatArray
    reach_from_rest_m: FloatArray
    turns: tuple[Turns, ...]
    start: FloatArray
    landing: FloatArray

    def turn_cost(
        self, before: IntArray, after: IntArray, half_angle_rad: FloatArray
    ) -> FloatArray:
        """By steps before and after a visit, and half the change of heading, of one shape.

        Interpolated so that it stays a bound.
        """
        spacing = 0.5 * math.pi / (_ANGLES - 1)
        place = np.clip((half_angle_rad / spacing).astype(np.int64), 0, _ANGLES - 2)
        beyond = np.clip(half_angle_rad - spacing * place, 0.0, spacing)
        low, high = (
            np.min([turns.at(before, after, end) for turns in self.turns], axis=0)
            for end in (place, place + 1)
        )
        return (low * np.sin(spacing - beyond) + high * np.sin(beyond)) / math.sin(spacing)


def turning_of_fleet(
    vehicles: Iterable[VehicleParams], dt_s: float, prices: Prices, landing_mps: float
) -> Turning:
    """What holds for every vehicle: the least of their costs, the farthest of their reaches.

    Args:
        vehicles: At least one.
        dt_s: Length of a step [s].
        prices: Of a step, for every vehicle.
        landing_mps: Speed at which they land, at most [m/s].
    """
    distinct = set(vehicles)
    speed_mps = WITHIN * max(vehicle.limits.v_xy_max_mps for vehicle in distinct)
    per_step = prices._replace(once=0.0)
    found = [turning_of(vehicle, dt_s, per_step, speed_mps, landing_mps) for vehicle in distinct]
    return Turning(
        per_m=found[0].per_m,
        reach_m=np.max([one.reach_m for one in found], axis=0),
        reach_from_rest_m=np.max([one.reach_from_rest_m for one in found], axis=0),
        turns=tuple(turns for one in found for turns in one.turns),
        start=np.min([one.start for one in found], axis=0),
        landing=np.min([one.landing for one in found], axis=0),
    )


@lru_cache(maxsize=16)
def turning_of(
    vehicle: VehicleParams, dt_s: float, prices: Prices, speed_mps: float, landing_mps: float
) -> Turning:
    """The table of a vehicle.

    Args:
        vehicle: Parameters.
        dt_s: Length of a step [s].
        prices: Of a step.
        speed_mps: Full speed, at least that of the vehicle [m/s].
        landing_mps: Speed at which it lands, at most [m/s].
    """
    motion = motion_of(vehicle, dt_s)
    per_m = (prices.step / speed_mps + prices.mps) / dt_s
    window = _Window(motion, prices, speed_mps, per_m)
    return Turning(
        per_m=per_m,
        reach_m=_reach_m(motion),
        reach_from_rest_m=_reach_m(motion, at_rest=True),
        turns=(Turns(window, _chord_loss(prices, motion, per_m)),),
        start=np.array([window.start(n) for n in range(LONGEST_START + 1)]),
        landing=np.array(
            [-math.inf, *(window.landing(n, landing_mps) for n in range(1, LONGEST + 1))]
        ),
    )


def _chord_loss(prices: Prices, motion: Motion, per_m: float) -> FloatArray:
    """(LONGEST + 1, LONGEST + 1) what the interpolation may overestimate, see docs/bound.md."""
    stretch = 1.0 / math.cos(0.25 * math.pi / (_ANGLES - 1)) - 1.0
    steps = np.add.outer(np.arange(LONGEST + 1), np.arange(LONGEST + 1))
    potential_m = float(np.abs(motion.potential) @ motion.largest)
    return stretch * ((2.0 + stretch) * steps * prices.step + 4.0 * per_m * potential_m)


def motion_of(vehicle: VehicleParams, dt_s: float) -> Motion:
    """The horizontal motion of a vehicle in steps of `dt_s`, with the limits of the bound."""
    A, B = horizontal_axis(vehicle, dt_s)
    inner, forced = A[1:, 1:], B[1:]
    ahead = A[0, 1:] - np.array([dt_s, 0.0, 0.0])
    equations = np.vstack([(inner - np.eye(3)).T, forced[None]])
    potential = np.linalg.lstsq(equations, np.append(ahead, B[0]), rcond=None)[0].astype(np.float64)
    limits, body = vehicle.limits, vehicle.airframe
    inputs = np.divide(vehicle.torque_max_Nm[:2], body.inertia_kgm2[:2])
    return Motion(
        A=inner,
        B=forced,
        position=A[0, 1:],
        input_m=float(B[0]),
        potential=potential,
        largest=WITHIN
        * np.array([limits.v_xy_max_mps, limits.tilt_max_rad, limits.rate_max_radps]),
        largest_input=float(np.hypot(*inputs)),
        trim=vehicle.trim_tilt_rad_per_mps,
    )


def _reach_m(motion: Motion, at_rest: bool = False) -> FloatArray:
    """How far so many steps lead at most: a linear program in one axis for each number."""
    reach = [0.0]
    for n in range(1, _REACHED_STEPS + 1):
        states = _states(motion, n, 1)
        gained = np.sum([motion.position @ x for x in states[:-1]], axis=0)
        gained[_N_STATES:] += motion.input_m
        rows = [sign * x for x in states[:-1] for sign in (1.0, -1.0)]
        rows += [states[-1][:1], -states[-1][:1]]
        bounds = np.concatenate([np.tile(motion.largest, 2 * n), np.tile(motion.largest[:1], 2)])
        allowed = [(0.0, 0.0) if at_rest else (None, None)] * _N_STATES + [
            (-motion.largest_input, motion.largest_input)
        ] * n
        found: Any = linprog(-gained, np.vstack(rows), bounds, bounds=allowed)
        reach.append(-float(found.fun))
    return np.array(reach)


def _states(motion: Motion, n: int, extra: int) -> list[FloatArray]:
    """States 0..n of one axis, (3, 3 + n) each, linear in the first state and the inputs."""
    states = [np.hstack([np.eye(_N_STATES), np.zeros((_N_STATES, n * extra))])]
    for k in range(n):
        following = motion.A @ states[-1]
        following[:, _N_STATES + k] += motion.B
        states.append(following)
    return states


class _Window:
    """Flights of a few steps around a visit.

    Variables of the linear programs: the first state of both axes, the inputs of both, and for
    each step a bound of the tilt beyond trim. Norms are replaced by polygons around them, which
    touch them in the directions of flight.
    """

    def __init__(self, motion: Motion, prices: Prices, speed_mps: float, per_m: float) -> None:
        self._motion, self._prices = motion, prices
        self._speed_mps, self._per_m = speed_mps, per_m
        angles = 2.0 * math.pi * np.arange(_SIDES) / _SIDES
        self._sides = np.stack([np.cos(angles), np.sin(angles)], axis=1)

    def turn(self, before: int, after: int, half_angle_rad: float) -> float:
        """Around a visit, at which the direction changes by twice the half angle."""
        into = np.array([math.cos(half_angle_rad), math.sin(half_angle_rad)])
        out = into * (1.0, -1.0)
        directions = [into] * before + [out] * after
        return self._least(directions, [(before, into - out)])

    def start(self, n: int) -> float:
        """The first steps, from rest."""
        east = np.array([1.0, 0.0])
        return self._least([east] * n, [], at_rest=True)

    def landing(self, n: int, landing_mps: float) -> float:
        """The last steps; where it has landed neither tilt nor rate is limited."""
        east = np.array([1.0, 0.0])
        return self._least([east] * n, [(n, east)], last_mps=landing_mps)

    def _least(
        self,
        directions: list[FloatArray],
        potentials: list[tuple[int, FloatArray]],
        at_rest: bool = False,
        last_mps: float | None = None,
    ) -> float:
        """Least of the cost of all steps, less that of the way they go ahead at full speed."""
        n, motion, prices = len(directions), self._motion, self._prices
        inputs_from = 2 * _N_STATES
        tilts_from = inputs_from + 2 * n
        size = tilts_from + n
        states = self._both_axes(n)
        cost = np.zeros(size)
        cost[tilts_from:] = prices.rad
        rows, bounds = [], []
        sides = np.vstack([self._sides, *directions])
        for k, x in enumerate(states):
            largest = motion.largest
            if last_mps is not None and k == n:
                largest = [last_mps, math.inf, math.inf]
            for which, most in enumerate(largest):
                if math.isfinite(most):
                    rows.append(sides @ x[:, which])
                    bounds.append(np.full(len(sides), most))
            if k < n:
                cost -= prices.step / self._speed_mps * (directions[k] @ x[:, 0])
                beyond = sides @ (x[:, 1] - motion.trim * x[:, 0])
                beyond[:, tilts_from + k] -= 1.0
                rows.append(beyond)
                bounds.append(np.zeros(len(sides)))
                inputs = np.zeros((len(sides), size))
                inputs[:, inputs_from + 2 * k : inputs_from + 2 * k + 2] = sides
                rows.append(inputs)
                bounds.append(np.full(len(sides), motion.largest_input))
        for k, direction in potentials:
            cost -= self._per_m * (direction @ np.einsum("i,aix->ax", motion.potential, states[k]))
        allowed = [(0.0, 0.0) if at_rest else (None, None)] * inputs_from
        allowed += [(None, None)] * (2 * n) + [(0.0, None)] * n
        found: Any = linprog(cost, np.vstack(rows), np.concatenate(bounds), bounds=allowed)
        if not found.success:
            raise ValueError(f"no bound of a turn was found ({found.message})")
        return prices.step * n + float(found.fun)

    def _both_axes(self, n: int) -> list[FloatArray]:
        """States 0..n, (2, 3, size) each: axis, state, variable."""
        motion, size = self._motion, 2 * _N_STATES + 3 * n
        first = np.eye(2 * _N_STATES, size).reshape(2, _N_STATES, size)
        states = [first]
        for k in range(n):
            following = np.einsum("ij,ajx->aix", motion.A, states[-1])
            for axis in range(2):
                following[axis, :, 2 * (_N_STATES + k) + axis] += motion.B
            states.append(following)
        return states
