"""Vehicles and flights that several of these tests use."""

from functools import cache

import numpy as np
from hypothesis import strategies as st

from uas_coverage_env.vehicle import compile_vehicle, load_vehicle
from uas_coverage_env.vehicle.inner_loop import velocity_wrench
from uas_coverage_env.vehicle.layout import (
    DOD,
    LIFT,
    N_INPUTS,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    TAU_Z,
    THETA,
    U_TH,
    VX,
    VY,
    VZ,
    WX,
    WY,
    WZ,
    X,
    Z,
)

NAMES = ("s500_v2", "hexacopter")
STEPS_S = (0.5, 1.0, 2.0)

names = st.sampled_from(NAMES)
steps_s = st.sampled_from(STEPS_S)
shares = st.lists(st.floats(-1.0, 1.0), min_size=16, max_size=16)
"""Numbers that `state_within_limits` and `wrench_within_limits` stretch to a vehicle."""

load = cache(load_vehicle)


@cache
def record_of(name, dt_s=1.0):
    """The kernels' record of a shipped vehicle."""
    return compile_vehicle(load(name), dt_s)[()]


def state_within_limits(vehicle, shares, dod=0.3, u_th_V=0.1):
    """(14,) a state inside the vehicle's limits."""
    limits = vehicle.limits
    x = np.zeros(N_STATES)
    x[X : Z + 1] = 100.0 * np.array(shares[:3])
    x[VX : VY + 1] = 0.7 * limits.v_xy_max_mps * np.array(shares[3:5])
    x[VZ] = shares[5] * min(limits.v_down_max_mps, limits.v_up_max_mps)
    x[PHI : THETA + 1] = 0.7 * limits.tilt_max_rad * np.array(shares[6:8])
    x[PSI] = limits.yaw_max_rad * shares[8]
    x[WX : WY + 1] = 0.7 * limits.rate_max_radps * np.array(shares[9:11])
    x[WZ] = limits.yaw_rate_max_radps * shares[11]
    x[DOD], x[U_TH] = dod, u_th_V
    return x


def wrench_within_limits(vehicle, shares):
    """(5,) a wrench inside the vehicle's limits."""
    u = np.zeros(N_INPUTS)
    lift = shares[12]
    u[LIFT] = lift * (vehicle.limits.lift_max_N if lift > 0.0 else -vehicle.limits.lift_min_N)
    u[TAU_X : TAU_Z + 1] = np.array(vehicle.torque_max_Nm) * shares[13:16]
    return u


def mirrored(x):
    """North and east exchanged: the state of a flight seen in a mirror that faces north-east."""
    m = x.copy()
    for north, east in ((X, X + 1), (VX, VY)):
        m[north], m[east] = x[east], x[north]
    for roll, pitch in ((PHI, THETA), (WX, WY)):
        m[roll], m[pitch] = -x[pitch], -x[roll]
    m[PSI], m[WZ] = -x[PSI], -x[WZ]
    return m


def fly(vehicle, step, commands, x):
    """Fly velocity commands (north_mps, east_mps, altitude_m), one per step, from x.

    Returns:
        states (T+1, 14), wrenches (T, 5), voltage_V (T,) and current_A (T,).
    """
    reference, u = np.zeros(2), np.zeros(N_INPUTS)
    states, wrenches, electrical = [x.copy()], [], []
    for north_mps, east_mps, altitude_m in commands:
        velocity_wrench(vehicle, x, reference, north_mps, east_mps, altitude_m, u)
        after = np.zeros(N_STATES)
        electrical.append(step(vehicle, x, u, after))
        states.append(after)
        wrenches.append(u.copy())
        x = after
    voltage, current = np.array(electrical).T
    return np.array(states), np.array(wrenches), voltage, current
