"""The true vehicle: a second record, whose parameters are p = (1 + perturbation) · p_nominal.

A vehicle file is what planners, autopilot and records believe. Where a disturbance says that the
vehicle that flies is another, its record is written here from the nominal one, and flown by the
same models. The inputs are asked of the nominal vehicle: it turns its motors at the speeds that
would give its weight plus lift, and the true one makes of these speeds another thrust, out of
another power.
"""

import math

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel, stack_array
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.discharge import write_true_battery

PERTURBATIONS = ("mass", "thrust", "drag", "power", "capacity", "resistance")
"""Parameters in which the true vehicle may differ from the nominal one; the place of each is its
index in the `perturbation` of a record. Thrust and power are those at the same speed of the motors,
avionics included; drag is horizontal and vertical; resistance that of the whole battery."""

N_PERTURBATIONS = len(PERTURBATIONS)
MASS, THRUST, DRAG, POWER, CAPACITY, RESISTANCE = range(N_PERTURBATIONS)

_ORDER = 4  # of the series in dt, as `governor.ORDER`
_TERMS = _ORDER + 1


@rare_kernel
def write_true_vehicle(nominal, true):
    """Write all of a record that follows from its perturbation.

    The LPV model is that of the true vehicle's own file, linearised where it hovers: a tilt
    accelerates it as it does any other. What its motors ask of the battery is counted from the
    hover of the nominal vehicle. An attitude loop beneath it gives the torques as asked for.

    Args:
        nominal: Record of VEHICLE_DTYPE, of the vehicle file.
        true: The same record but for its `perturbation` (N_PERTURBATIONS,) and what is written.

    Raises:
        ValueError: A perturbation is -1 or less, or not finite.
    """
    change = true.perturbation
    total = 0.0
    for k in range(N_PERTURBATIONS):
        total += abs(change[k])
        if change[k] <= -1.0:
            raise ValueError(
                "disturbances leave a UAS without mass, thrust, drag, power or battery: a "
                "perturbation is -1 or less; correct their kernels"
            )
    if not math.isfinite(total):
        raise ValueError("what disturbances do to a vehicle is not finite; correct their kernels")
    more_mass, more_drag = 1.0 + change[MASS], 1.0 + change[DRAG]
    true.mass_kg = nominal.mass_kg * more_mass
    true.drag_kgps = nominal.drag_kgps * more_drag
    true.drag_vertical_kgps = nominal.drag_vertical_kgps * more_drag
    true.trim_rad_per_mps = nominal.trim_rad_per_mps * more_drag / more_mass
    true.thrust_factor = nominal.thrust_factor * (1.0 + change[THRUST])
    true.lift_surplus_N = nominal.weight_N * (change[THRUST] - change[MASS])
    true.power_factor = nominal.power_factor * (1.0 + change[POWER])
    _write_motion(true)
    write_true_battery(
        nominal, true, 1.0 + change[POWER], 1.0 + change[CAPACITY], 1.0 + change[RESISTANCE]
    )


@inlined_kernel
def _write_motion(true):
    """The one-step maps of the axes, of the record's mass and drag."""
    g, mass = true.gravity_mps2, true.mass_kg
    series = stack_array(_TERMS)
    write_series(true.dt_s, true.drag_kgps / mass, series)
    A, B = true.axis_A, true.axis_B
    for row in (S.POSITION, S.SPEED):
        # from tilt to position there is one more integration than to speed
        k = 1 - row
        A[row, S.SPEED], A[row, S.TILT] = series[k], g * series[k + 1]
        A[row, S.RATE], B[row] = g * series[k + 2], g * series[k + 3]
    true.horizontal_force_B[S.POSITION] = series[2] / mass
    true.horizontal_force_B[S.SPEED] = series[1] / mass
    write_series(true.dt_s, true.drag_vertical_kgps / mass, series)
    true.vertical_A[S.POSITION, S.SPEED], true.vertical_A[S.SPEED, S.SPEED] = series[1], series[0]
    true.vertical_B[S.POSITION], true.vertical_B[S.SPEED] = -series[2] / mass, -series[1] / mass


@inlined_kernel
def write_series(dt_s, rate_per_s, series):
    """Write what a chain of integrators makes of linear drag: sum of (-r)^(k-j) dt^k / k! at j.

    The sums of k from j to 4: j = 0 is what is left of a velocity after the step, 1 what a constant
    acceleration adds to it and a velocity to the position, and so on.

    Args:
        dt_s: [s].
        rate_per_s: Drag over mass.
        series: (5,) written.
    """
    for j in range(_TERMS):
        term = 1.0
        for k in range(1, j + 1):
            term *= dt_s / k
        series[j] = term
        for k in range(j + 1, _ORDER + 1):
            term *= -rate_per_s * dt_s / k
            series[j] += term
