"""What a step of flight costs at least: a linear minorant of the LPV model's power.

See docs/bound.md, "The price of a step".
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from itertools import pairwise, product
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog

from uas_coverage_env.vehicle import VehicleParams, compile_vehicle
from uas_coverage_env.vehicle.battery import (
    BatterySegment,
    battery_segments,
    pair_decays,
)
from uas_coverage_env.vehicle.limits import LPV_TOLERANCE
from uas_coverage_env.vehicle.record import PHYSICAL_SIDES

WITHIN = 1.0 + LPV_TOLERANCE
"""Share of a limit up to which a flight counts as keeping it."""

INSCRIBED = math.cos(math.pi / PHYSICAL_SIDES)
"""Least ratio of the polygons of the thrust correction to the norms they stand for."""


_SLAB = 0.02
"""Widest range of the depth of discharge that one minorant holds for."""

_BASE, _HORIZONTAL, _PAIRS = range(3)
"""Variables of a minorant; from _PAIRS on one for each RC pair, then one for each slab."""

_LIKELY = 2.5
"""What speed and tilt mostly add to the thrust, over what full speed adds."""


class Ends(NamedTuple):
    """What a mission says of flights and how they end.

    Attributes:
        dt_s: Length of a step [s].
        landing_distance_m: A UAS lands this close to its start [m].
        landing_speed_mps: ... at this speed at most [m/s].
        height_m: Of the volume that it flies in [m].
    """

    dt_s: float
    landing_distance_m: float
    landing_speed_mps: float
    height_m: float


class Prices(NamedTuple):
    """A flight of N steps costs at least N step + sum(mps |v| + rad |tilt beyond trim|) - once.

    Costs are in joules (or steps) per step of `dt_s`, v in m/s, tilts in radians.
    """

    step: float
    mps: float
    rad: float
    once: float


class _Ranges(NamedTuple):
    """Of what the power of a step depends on, the depth of discharge apart."""

    vertical_N: tuple[float, float]
    """Lift and what climbing and sinking add."""
    horizontal_N: tuple[float, float]
    """What speed and tilt add."""
    likely_N: float
    """What speed and tilt mostly add: there the minorant should be close."""


class _Minorant(NamedTuple):
    """Power >= base_W + vertical_W_per_N vertical_N + horizontal_W_per_N horizontal_N.

    Less pairs_A times what the polarisation of each RC pair is going to rise by. The price of the
    vertical part is another for each slab of the depth of discharge.
    """

    base_W: float
    vertical_W_per_N: list[float]
    horizontal_W_per_N: float
    pairs_A: list[float]
    """Prices of a rise of the polarisation, of each RC pair."""


STEPS = Prices(step=1.0, mps=0.0, rad=0.0, once=0.0)
"""Where a step costs a step."""


def cheapest(prices: Sequence[Prices]) -> Prices:
    """What holds for every vehicle of a fleet."""
    step, mps, rad, once = zip(*prices, strict=True)
    return Prices(min(step), min(mps), min(rad), max(once))


def energy_prices(vehicle: VehicleParams, ends: Ends, dod_max: float) -> Prices:
    """The least energy of a step, linear in speed and tilt, with whatever charge [J].

    Args:
        vehicle: Parameters.
        ends: Of the mission.
        dod_max: Depth of discharge at which a flight ends at the latest.

    Raises:
        ValueError: The model has no such minorant: its battery gives less power at more current.
    """
    limits, correction = vehicle.limits, vehicle.thrust_correction
    speed_mps = WITHIN * limits.v_xy_max_mps
    tilt_rad = WITHIN * limits.tilt_max_rad + vehicle.trim_tilt_rad_per_mps * speed_mps
    slopes = sorted((correction.climb_N_per_mps, correction.descent_N_per_mps))
    ranges = _Ranges(
        (
            limits.lift_min_N - slopes[0] * WITHIN * limits.v_down_max_mps,
            limits.lift_max_N + slopes[1] * WITHIN * limits.v_up_max_mps,
        ),
        (0.0, correction.speed_N_per_mps * speed_mps + correction.tilt_N_per_rad * tilt_rad),
        _LIKELY * correction.speed_N_per_mps * speed_mps,
    )
    minorant = _minorant(vehicle, ranges, dod_max)
    dt_s = ends.dt_s
    return Prices(
        step=minorant.base_W * dt_s,
        mps=minorant.horizontal_W_per_N * dt_s * correction.speed_N_per_mps * INSCRIBED,
        rad=minorant.horizontal_W_per_N * dt_s * correction.tilt_N_per_rad * INSCRIBED,
        once=dt_s
        * (
            _vertical_W(vehicle, ends, slopes[0], minorant.vertical_W_per_N)
            + _polarisation_W(vehicle, ends.dt_s, minorant.pairs_A)
        ),
    )


def _polarisation_W(vehicle: VehicleParams, dt_s: float, prices_A: Sequence[float]) -> float:
    """What the polarisation makes a flight cheaper by than its settled value, over dt, at most."""
    total_W, decays = 0.0, pair_decays(vehicle, dt_s)
    for pair, largest_V, decay, price_A in zip(
        vehicle.battery.pairs, _largest_V(vehicle), decays, prices_A, strict=True
    ):
        rise_W = (price_A + 0.5 * largest_V / pair.resistance_ohm) * largest_V
        total_W += rise_W / (1.0 - decay)
    return total_W


def _largest_V(vehicle: VehicleParams) -> list[float]:
    """The polarisation of each RC pair under the largest current."""
    most_A = WITHIN * vehicle.battery.current_max_A
    return [pair.resistance_ohm * most_A for pair in vehicle.battery.pairs]


def _vertical_W(
    vehicle: VehicleParams, ends: Ends, slope: float, W_per_N: Sequence[float]
) -> float:
    """What the vertical parts of all steps together come to at least, as a saving.

    lift(k) - slope v_z(k) = a (z(k+1) - z(k)) + b (v_z(k+1) - v_z(k)): what they add to the thrust
    sums up to what height and climb rate end with, and to little more where its price changes.
    """
    record = compile_vehicle(vehicle, ends.dt_s)[()]
    A, B = record["vertical_A"], record["vertical_B"]
    system = np.array([[B[0], B[1]], [A[0, 1], A[1, 1] - 1.0]])
    a, b = np.abs(np.linalg.solve(system, np.array([1.0, -slope]))).tolist()
    fastest_mps = WITHIN * max(vehicle.limits.v_up_max_mps, vehicle.limits.v_down_max_mps)
    last_N = a * ends.landing_distance_m + b * ends.landing_speed_mps
    largest_N = a * ends.height_m + b * fastest_mps
    changes = sum(abs(x - y) for x, y in pairwise(W_per_N))
    return max(W_per_N) * last_N + changes * largest_N


def _minorant(vehicle: VehicleParams, ranges: _Ranges, dod_max: float) -> _Minorant:
    """The minorant that is greatest where flights mostly are.

    What bounds the power from below is concave in each variable alone, hence above a linear
    function wherever it is so at all corners.
    """
    pairs_V = list(product(*((0.0, most_V) for most_V in _largest_V(vehicle))))
    vertical_from = _PAIRS + len(vehicle.battery.pairs)
    slabs = list(_slabs(vehicle, dod_max))
    rows, powers_W = [], []
    for n, (segment, dod) in enumerate(slabs):
        for vertical, horizontal in product(ranges.vertical_N, ranges.horizontal_N):
            for depth, volts in product(dod, pairs_V):
                power_W, rises_V = _settled(vehicle, segment, depth, volts, vertical + horizontal)
                row = np.zeros(vertical_from + len(slabs))
                row[:vertical_from] = 1.0, horizontal, *(-rise_V for rise_V in rises_V)
                row[vertical_from + n] = vertical
                rows.append(row)
                powers_W.append(power_W)
    cost = np.zeros(vertical_from + len(slabs))
    cost[_BASE], cost[_HORIZONTAL] = -1.0, -ranges.likely_N
    positive = (0.0, None)
    found: Any = linprog(
        cost, np.array(rows), powers_W, bounds=[(None, None)] + [positive] * (len(cost) - 1)
    )
    if not found.success or found.x[_BASE] <= 0.0:
        raise ValueError(f"the power of {vehicle.name!r} has no linear minorant")
    return _Minorant(
        base_W=float(found.x[_BASE]),
        vertical_W_per_N=found.x[vertical_from:].tolist(),
        horizontal_W_per_N=float(found.x[_HORIZONTAL]),
        pairs_A=found.x[_PAIRS:vertical_from].tolist(),
    )


def _slabs(
    vehicle: VehicleParams, dod_max: float
) -> Iterator[tuple[BatterySegment, tuple[float, float]]]:
    """Ranges of the depth of discharge, in order, each on one straight piece of its curve."""
    begin = 0.0
    for segment in battery_segments(vehicle):
        end = min(segment.dod_end, dod_max)
        if begin < end:
            edges = np.linspace(begin, end, 2 + int((end - begin) / _SLAB)).tolist()
            yield from ((segment, slab) for slab in pairwise(edges))
        begin = segment.dod_end


def _settled(
    vehicle: VehicleParams,
    segment: BatterySegment,
    dod: float,
    pairs_V: Sequence[float],
    thrust_N: float,
) -> tuple[float, list[float]]:
    """The power behind all resistances, and by how much each polarisation is going to rise."""
    battery = vehicle.battery
    drop_V = segment.ocv_slope_V * dod + sum(pairs_V) - segment.drop_V
    current_A = segment.current_A + segment.current_A_per_V * drop_V
    current_A += segment.current_A_per_N * thrust_N
    open_V = segment.ocv_V - segment.ocv_slope_V * dod
    if not 0.0 < current_A < 0.5 * open_V / battery.resistance_ohm:
        raise ValueError(f"{vehicle.name!r} may draw {current_A:.3g} A, which has no bound here")
    power_W = (open_V - battery.resistance_ohm * current_A) * current_A
    rises_V = (
        pair.resistance_ohm * current_A - volt
        for pair, volt in zip(battery.pairs, pairs_V, strict=True)
    )
    return power_W, list(rises_V)
