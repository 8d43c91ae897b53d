"""The battery of a record, compiled: its current, and what a current does to it (`battery`)."""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, kernel, rare_kernel
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.battery import battery_current_A

_current = kernel(battery_current_A)


@inlined_kernel
def segment_of(vehicle, dod):
    """Index of the piece of the discharge curve that holds at a depth of discharge."""
    for j in range(vehicle.n_segments - 1):
        if dod < vehicle.dod_end[j]:
            return j
    return vehicle.n_segments - 1


@kernel
def open_circuit_V(vehicle, dod):
    """Open-circuit voltage at a depth of discharge [V]; the curve stays flat beyond its ends."""
    dod = min(max(dod, 0.0), 1.0)
    j = segment_of(vehicle, dod)
    return vehicle.ocv_V[j] - vehicle.ocv_slope_V[j] * dod


@inlined_kernel
def polarisation_V(vehicle, further_V, x):
    """What all RC pairs take from the voltage [V]; further_V: those of the further pairs."""
    total = x[S.U_TH]
    for p in range(vehicle.n_further):
        total += further_V[p]
    return total


@inlined_kernel
def linearised_point(vehicle, x, delta_thrust_N):
    """Voltage and current of the LPV model at a state, under a corrected thrust deviation."""
    j = segment_of(vehicle, x[S.DOD])
    u_V = polarisation_V(vehicle, vehicle.further_V, x)
    drop = vehicle.ocv_slope_V[j] * x[S.DOD] + u_V - vehicle.drop_V[j]
    current = vehicle.current_A[j] + vehicle.current_A_per_V[j] * drop
    current += vehicle.current_A_per_N[j] * delta_thrust_N
    # nothing flows back, however little thrust a vehicle's limits allow
    current = max(current, 0.0)
    open_circuit = vehicle.ocv_V[j] - vehicle.ocv_slope_V[j] * x[S.DOD]
    return open_circuit - u_V - vehicle.resistance_0_ohm * current, current


@kernel
def operating_point(vehicle, further_V, x, power_W):
    """Voltage and current at which the battery of a state delivers a power.

    Where the battery has less power than is asked for, the product of the two is what it has.
    """
    E = open_circuit_V(vehicle, x[S.DOD]) - polarisation_V(vehicle, further_V, x)
    current = _current(E, vehicle.resistance_0_ohm, power_W)
    return E - vehicle.resistance_0_ohm * current, current


@inlined_kernel
def discharge(vehicle, x, current_A, dt_s, decay):
    """Draw a current for a time; decay: what this leaves of the state U_TH. `x` is written."""
    x[S.DOD] += current_A * dt_s / vehicle.capacity_As
    x[S.U_TH] = decay * x[S.U_TH] + (1.0 - decay) * vehicle.resistance_th_ohm * current_A


@rare_kernel
def discharge_further(vehicle, further_V, current_A, dt_s):
    """Likewise of the further RC pairs; further_V (MAX_FURTHER_PAIRS,) is written."""
    for p in range(vehicle.n_further):
        left = math.exp(-dt_s / vehicle.further_time_constant_s[p])
        settled_V = vehicle.further_resistance_ohm[p] * current_A
        further_V[p] = left * further_V[p] + (1.0 - left) * settled_V


@inlined_kernel
def write_true_battery(nominal, true, more_power, more_capacity, more_resistance):
    """Write the record's battery with so many times the nominal capacity and resistances.

    The current is linearised anew, for so many times the hover power: see `battery.segments_of`.
    """
    true.capacity_As = more_capacity * nominal.capacity_As
    true.resistance_0_ohm = more_resistance * nominal.resistance_0_ohm
    true.resistance_th_ohm = more_resistance * nominal.resistance_th_ohm
    for p in range(nominal.n_further):
        true.further_resistance_ohm[p] = more_resistance * nominal.further_resistance_ohm[p]
    true.hover_W = more_power * nominal.hover_W
    for j in range(nominal.n_segments):
        behind = nominal.ocv_V[j] - nominal.drop_V[j]
        hover = _current(behind, true.resistance_0_ohm, true.hover_W)
        stiffness = behind - 2.0 * true.resistance_0_ohm * hover
        stiffness_nominal = behind - 2.0 * nominal.resistance_0_ohm * nominal.current_A[j]
        true.current_A[j] = hover
        true.current_A_per_V[j] = hover / stiffness
        slope_W_per_N = more_power * stiffness_nominal * nominal.current_A_per_N[j]
        true.current_A_per_N[j] = slope_W_per_N / stiffness
