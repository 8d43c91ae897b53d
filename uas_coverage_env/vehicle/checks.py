"""A vehicle whose parts fit together: what follows from them is computed, or must agree.

Each function completes one part, or refuses a vehicle that contradicts itself with one line that
names field, value, the value that the other parts give, and what to do.
"""

import math
from collections.abc import Mapping
from typing import Any, TypeVar

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.vehicle import derived
from uas_coverage_env.vehicle.battery import (
    around_hover,
    segments_of,
    steady_current_A,
    steady_voltage_V,
)
from uas_coverage_env.vehicle.parts import (
    Battery,
    Parts,
    Power,
    Rotor,
    ThrustCorrection,
    is_absent,
)
from uas_coverage_env.vehicle.thrust_correction import MOST_BEYOND_TRIM_RAD, fit_thrust_correction

Section = TypeVar("Section", bound=StrictModel)

TOLERANCE = 0.05
"""So far may a given value be from the one that follows; the shipped vehicles keep within 0.015."""

_FIT_SAMPLES = 12  # of the thrust correction, within 1 % of the finest


def completed_power(vehicle: Parts) -> Power:
    """Hover power and its slope, from mass, rotors, motors and speed controllers."""
    computed = derived.hover_power(vehicle)
    for name, source in (
        ("hover_W", "its mass, rotors and motors take {:.4g} W to hover"),
        ("slope_W_per_N", "its rotors and motors take {:.4g} W more for each newton at hover"),
    ):
        _agree(vehicle.power, computed, "power", name, source)
    return _filled(vehicle.power, computed)


def completed_battery(vehicle: Parts) -> Battery:
    """Nominal voltage and linearisation points, from discharge curve and hover power."""
    battery, hover_W = vehicle.battery, vehicle.power.hover_W
    # the current of a constant power is real where E² > 4 R_0 P; squares would hide E < 0
    weakest_V = 2.0 * math.sqrt(battery.resistance_0_ohm * hover_W)
    if battery.ocv_V[-1] <= weakest_V:
        raise ValueError(
            f"battery.resistance_0_ohm {battery.resistance_0_ohm} is too high to hover on "
            f"{battery.ocv_V[-1]} V; lower it"
        )
    computed = around_hover(battery, hover_W)
    _agree(
        battery,
        computed,
        "battery",
        "voltage_nominal_V",
        "discharge curve and resistances give {:.4g} V on average over a hover",
    )
    linearised = not (
        is_absent(battery.polarisation_linearised_V) or is_absent(battery.ocv_dod_linearised)
    )
    battery = _filled(battery, computed)
    if min(battery.voltages_linearised_V) <= weakest_V:
        raise ValueError(
            f"at battery.ocv_dod_linearised and battery.polarisation_linearised_V "
            f"{battery.polarisation_linearised_V} there are only "
            f"{min(battery.voltages_linearised_V):.4g} V, too few to hover; correct them"
        )
    error = _linearisation_error(vehicle, battery)
    if linearised and error > TOLERANCE:
        raise ValueError(
            f"battery.ocv_dod_linearised {list(battery.ocv_dod_linearised)} and "
            f"battery.polarisation_linearised_V {battery.polarisation_linearised_V} put the "
            f"linearised current of a hover off by {error:.0%}; leave both out: they are computed"
        )
    return battery


def completed_rotor(vehicle: Parts) -> Rotor:
    """Speed at full throttle, from motor and battery."""
    rotor, battery = vehicle.rotor, vehicle.battery
    merit = derived.figure_of_merit(vehicle)
    if merit * rotor.induced_power_factor > 1.0:
        raise ValueError(
            f"rotor.torque_Nm_per_radps2 {rotor.torque_Nm_per_radps2} turns the propeller with "
            f"less power than the air takes (figure of merit {merit:.3g}, at most "
            f"1 / induced_power_factor = {1.0 / rotor.induced_power_factor:.3g}); correct it, "
            "rotor.thrust_N_per_radps2 or rotor.propeller_radius_m"
        )
    nominal_radps, full_radps = (
        derived.full_throttle_radps(vehicle, voltage_V)
        for voltage_V in (battery.voltage_nominal_V, battery.ocv_V[0])
    )
    if rotor.speed_max_radps > (1.0 + TOLERANCE) * full_radps:
        raise ValueError(
            f"rotor.speed_max_radps is {rotor.speed_max_radps:.4g}, but the motor reaches "
            f"{full_radps:.4g} rad/s on the full battery's {battery.ocv_V[0]:.4g} V; correct what "
            "is wrong, or leave speed_max_radps out: it is computed"
        )
    return _filled(rotor, {"speed_max_radps": nominal_radps})


def completed_thrust_correction(vehicle: Parts) -> ThrustCorrection:
    """Slopes of the thrust correction, from rotors and limits.

    A slope is judged by the power that it adds at its limit, as a share of hover power.
    """
    _check_trim(vehicle)
    given, limits, power = vehicle.thrust_correction, vehicle.limits, vehicle.power
    computed = fit_thrust_correction(vehicle, _FIT_SAMPLES).model_dump()
    for name, reach, at in (
        ("speed_N_per_mps", limits.v_xy_max_mps, "limits.v_xy_max_mps {:g}"),
        ("climb_N_per_mps", limits.v_up_max_mps, "limits.v_up_max_mps {:g}"),
        ("descent_N_per_mps", limits.v_down_max_mps, "limits.v_down_max_mps {:g}"),
        ("tilt_N_per_rad", min(MOST_BEYOND_TRIM_RAD, limits.tilt_max_rad), "{:g} rad beyond trim"),
    ):
        value, expected = getattr(given, name), computed[name]
        if abs(value - expected) * reach * power.slope_W_per_N > TOLERANCE * power.hover_W:
            raise ValueError(
                f"thrust_correction.{name} is {value:g}, but its rotors need {expected:.4g} at "
                f"{at.format(reach)}; correct what is wrong, or leave {name} out: it is computed"
            )
    return _filled(given, computed)


def check_limits(vehicle: Parts) -> None:
    """Limits within what rotors, motors and battery can give."""
    limits, weight_N = vehicle.limits, vehicle.weight_N
    for name in ("delta_thrust_min_N", "lift_min_N"):
        if -getattr(limits, name) >= weight_N:
            raise ValueError(
                f"limits.{name} {getattr(limits, name)} takes away more than the weight, "
                f"{weight_N:.4g} N; raise it"
            )
    if limits.lift_max_N > limits.delta_thrust_max_N:
        raise ValueError(
            f"limits.lift_max_N {limits.lift_max_N} takes more thrust than "
            f"limits.delta_thrust_max_N {limits.delta_thrust_max_N}; lower it"
        )
    upright = math.cos(limits.tilt_max_rad)
    for name, needed_N in (
        ("lift_max_N", (weight_N + limits.lift_max_N) / upright),
        ("delta_thrust_max_N", weight_N + limits.delta_thrust_max_N),
    ):
        if vehicle.thrust_max_N < needed_N:
            raise ValueError(
                f"the rotors lift {vehicle.thrust_max_N:.4g} N at rotor.speed_max_radps "
                f"{vehicle.rotor.speed_max_radps:.4g}; limits.{name} {getattr(limits, name)} takes "
                f"{needed_N:.4g} N, lower it"
            )
    _check_torques(vehicle)
    _check_supply(vehicle)


def _check_trim(vehicle: Parts) -> None:
    """The tilt of the highest speed, without which no thrust correction can be fitted."""
    limits = vehicle.limits
    trim_rad = vehicle.trim_tilt_rad_per_mps * limits.v_xy_max_mps
    if trim_rad >= limits.tilt_max_rad:
        raise ValueError(
            f"limits.tilt_max_rad {limits.tilt_max_rad} does not hold v_xy_max_mps, "
            f"which needs {trim_rad:.4g} rad; raise it"
        )


def _check_torques(vehicle: Parts) -> None:
    """The largest torques, from a hover: each rotor between standstill and full throttle."""
    body, rotor, n = vehicle.airframe, vehicle.rotor, vehicle.airframe.n_motors
    hover_N = vehicle.weight_N / n
    least_N = min(hover_N, vehicle.thrust_max_N / n - hover_N)
    reaction_m = rotor.torque_Nm_per_radps2 / rotor.thrust_N_per_radps2
    # of the pseudo-inverse of the rotor map; a tricopter yaws by tilting a rotor
    share_per_m = (2.0 / body.arm_m, 2.0 / body.arm_m, 1.0 / reaction_m if n > 3 else 0.0)
    for axis, name in enumerate(("xy", "xy", "z")):
        share_N = vehicle.torque_max_Nm[axis] * share_per_m[axis] / n
        if share_N > least_N:
            field = f"angular_acceleration_{name}_max_radps2"
            raise ValueError(
                f"limits.{field} {getattr(vehicle.limits, field)} takes {share_N:.4g} N from or to "
                f"each rotor, which has {least_N:.4g} N to spare in hover; lower it"
            )


def _check_supply(vehicle: Parts) -> None:
    """Hover and level flight at top speed, on the battery at dod_max."""
    battery, limits = vehicle.battery, vehicle.limits
    extra_N = vehicle.thrust_correction.speed_N_per_mps * limits.v_xy_max_mps
    for flight, power_W in (
        ("a hover", vehicle.power.hover_W),
        ("limits.v_xy_max_mps", vehicle.power.hover_W + vehicle.power.slope_W_per_N * extra_N),
    ):
        current_A = steady_current_A(battery, battery.dod_max, power_W)
        voltage_V = float(steady_voltage_V(battery, battery.dod_max, current_A))
        if current_A > battery.current_max_A:
            raise ValueError(
                f"battery.current_max_A {battery.current_max_A} does not feed {flight}, which "
                f"takes {current_A:.4g} A at dod_max {battery.dod_max}; raise it"
            )
        if voltage_V < battery.voltage_min_V:
            raise ValueError(
                f"battery.voltage_min_V {battery.voltage_min_V} leaves no room for {flight}, where "
                f"the battery gives {voltage_V:.4g} V at dod_max {battery.dod_max}; lower it"
            )


def _linearisation_error(vehicle: Parts, battery: Battery) -> float:
    """Largest relative error of the linearised current of a hover, down to dod_cutoff."""
    start, worst = 0.0, 0.0
    polarisation_ohm = sum(pair.resistance_ohm for pair in battery.pairs)
    for segment in segments_of(battery, vehicle.power):
        for dod in (start, min(segment.dod_end, battery.dod_cutoff)):
            if dod >= start:
                exact_A = steady_current_A(battery, dod, vehicle.power.hover_W)
                drop_V = segment.ocv_slope_V * dod + polarisation_ohm * exact_A
                linear_A = segment.current_A + segment.current_A_per_V * (drop_V - segment.drop_V)
                worst = max(worst, abs(linear_A / exact_A - 1.0))
        start = segment.dod_end
    return worst


def _agree(given: Any, computed: Mapping[str, Any], part: str, name: str, source: str) -> None:
    """Refuse a value that is not the computed one; NaN, left out, passes the comparison."""
    value, expected = getattr(given, name), computed[name]
    if abs(value - expected) > TOLERANCE * expected:
        raise ValueError(
            f"{part}.{name} is {value:g}, but {source.format(expected)}; correct what is wrong, or "
            f"leave {name} out: it is computed"
        )


def _filled(section: Section, computed: Mapping[str, Any]) -> Section:
    """The section with what was left out."""
    absent = {name: value for name, value in computed.items() if is_absent(getattr(section, name))}
    return section.model_copy(update=absent) if absent else section
