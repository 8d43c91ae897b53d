"""How far to stay from what moves, to get out of its way should it set off.

Plans predict a moving obstacle with the velocity it has (Sec. III-C.4). One that changes it gives
notice at a sample, and a UAS takes seconds to turn its tilt into speed: a margin of what the
obstacle moves in one step (`moving_margin_m`) is not enough for a UAS in front of it. A helicopter
that takes up 15 m/s within a second, as the village's does, covers 45 m while a UAS that hovers
gets 7 m aside.

The margin here is found by flying: the obstacle sets off straight at the UAS, as fast as it is
assumed to gain speed and up to its largest; the UAS flees in the best of some directions at full
speed, with the inner loop. It is the least distance beyond the keep-out from which that works,
whether the UAS hovers at the margin or is on its way there and could just stop in front of it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from uas_coverage_baselines.milp_mpc.model.flown import pushed
from uas_coverage_env.vehicle import VehicleParams, compile_vehicle
from uas_coverage_env.vehicle.layout import N_STATES, VX

FloatArray = NDArray[np.float64]
_FLEEING_S = 14.0
_HEADINGS = 12
_APPROACHES = (0.0, 0.5, 1.0)  # shares of the cruise speed at which the UAS may come closer
_STEP_M = 1.0
_FARTHEST_M = 200.0


def getaway_margin_m(
    vehicle: VehicleParams,
    dt_s: float,
    keep_out_m: float,
    acceleration_mps2: float,
    speed_mps: float,
) -> float:
    """What is to be kept beyond a keep-out, to leave in time an obstacle that sets off [m].

    Args:
        vehicle: Of the UAS.
        dt_s: Sampling time [s].
        keep_out_m: From the obstacle's centre [m].
        acceleration_mps2: What the obstacle gains in a second [m/s²]; all at once, at samples.
        speed_mps: Its largest speed [m/s].
    """
    record = compile_vehicle(vehicle, dt_s)[()]
    steps = int(np.ceil(_FLEEING_S / dt_s))
    speeds = np.minimum(acceleration_mps2 * dt_s * np.arange(1, steps + 1), speed_mps)
    towards_m = np.concatenate([[0.0], np.cumsum(speeds * dt_s)])
    return max(
        _least_distance_m(_flights(record, vehicle, share, steps), towards_m, keep_out_m)
        - _braking_way_m(record, vehicle, share, steps)
        for share in _APPROACHES
    )


def _start(vehicle: VehicleParams, share: float) -> FloatArray:
    """Level flight to the north, which is where the obstacle comes from."""
    x = np.zeros(N_STATES)
    x[VX] = share * vehicle.limits.v_xy_max_mps
    return x


def _flights(record, vehicle: VehicleParams, share: float, steps: int) -> FloatArray:
    """(C, steps+1, 2) horizontal positions of the ways to flee; braking is one of them."""
    full = vehicle.limits.v_xy_max_mps
    angles = 2.0 * np.pi * np.arange(_HEADINGS) / _HEADINGS
    ways = [(0.0, 0.0), *((full * np.cos(a), full * np.sin(a)) for a in angles)]
    start = _start(vehicle, share)
    return np.array([pushed(record, start, *way, 0.0, steps, steps)[0][:, :2] for way in ways])


def _braking_way_m(record, vehicle: VehicleParams, share: float, steps: int) -> float:
    return float(pushed(record, _start(vehicle, share), 0.0, 0.0, 0.0, 0, steps)[0][:, 0].max())


def _least_distance_m(flights: FloatArray, towards_m: FloatArray, keep_out_m: float) -> float:
    """Beyond the keep-out, such that one of the flights never enters it, between samples too."""
    for beyond_m in np.arange(0.0, _FARTHEST_M, _STEP_M):
        north_m = keep_out_m + beyond_m - towards_m - flights[:, :, 0]
        away = np.stack([north_m, -flights[:, :, 1]], axis=-1)
        if (_nearest_m(away).min(axis=1) >= keep_out_m).any():
            return float(beyond_m)
    return _FARTHEST_M


def _nearest_m(away: FloatArray) -> FloatArray:
    """(C, steps) least distance from the origin of each segment of paths (C, steps+1, 2)."""
    start, way = away[:, :-1], np.diff(away, axis=1)
    length = np.maximum((way**2).sum(axis=-1), 1e-12)
    share = np.clip(-(start * way).sum(axis=-1) / length, 0.0, 1.0)
    return np.linalg.norm(start + share[..., None] * way, axis=-1)
