"""A complete vehicle from a data sheet.

The hover time says which power a hover takes, momentum theory which part of it reaches the air;
motors and speed controllers lose the rest. What a data sheet does not say is assumed, after the
identified S500 (`s500_v2.toml`) where it is a matter of proportion.
"""

import math
import tomllib
from typing import NamedTuple

from scipy.optimize import brentq

from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.vehicle.battery import mean_voltage_V, steady_current_A
from uas_coverage_env.vehicle.data_sheet import (
    DataSheet,
    Sections,
    Value,
    assumed,
    computed,
    file_text,
    given,
)
from uas_coverage_env.vehicle.flight_time import flight_time_s, linearised_hover_time_s
from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.parts import Battery
from uas_coverage_env.vehicle.record import compile_vehicle

HOVER_TOLERANCE = 0.03
"""So far may the hover time of a made vehicle be from the one asked for, in either dynamics."""

_INCH_M = 0.0254
_GRAVITY_MPS2 = 9.81
_AIR_KGPM3 = 1.225
_FIGURE_OF_MERIT = 0.65
_EFFICIENCIES = (0.3, 0.92)  # of motors and speed controllers in hover
_S500 = "as the S500"
_S500_ARM_M = 0.23

# proportions of the S500, from its bench table and its identified battery
_THRUST_COEFFICIENT_BY_PITCH = 0.185
_COPPER_SHARE = 0.22
_ARM_OF_RADIUS = 1.28
_GYRATION_OF_ARM = (0.444, 0.444, 0.574)
_TRIM_SHARE = 0.7
_AUXILIARY_SHARE = 0.02
_CRUISE_SHARE = 5.0 / 6.0
_CELL_OCV_DOD = (0.0, 0.297, 0.9, 1.0)
_CELL_OCV_V = (4.2, 3.938, 3.653, 3.3)
_CELL_RESISTANCE_OHM_AH = 0.056
_RESISTANCE_0_SHARE = 0.661
_TIME_CONSTANT_S = 1.76
_RETURN_SHARE = 0.131


class MadeVehicle(NamedTuple):
    """A vehicle made from a data sheet."""

    sections: Sections
    vehicle: VehicleParams
    """The file read back: completed and checked."""
    hover_minutes: tuple[float, float]
    """How long it hovers in the nonlinear plant and in the LPV model."""

    def file_text(self) -> str:
        """The vehicle file."""
        return file_text(self.vehicle.name, self.sections)


def make_vehicle(sheet: DataSheet) -> MadeVehicle:
    """A vehicle that hovers as long as its data sheet says.

    Raises:
        InputError: the data sheet contradicts itself or physics; one line.
    """
    battery = _battery(sheet)
    hover_W = _hover_W(sheet, battery)
    sections: Sections = {
        "airframe": _airframe(sheet),
        **_drive(sheet, battery, hover_W),
        "battery": _battery_section(sheet, battery, hover_W),
        "limits": _limits(sheet),
        "return_rule": {
            "distance_over_speed_s": assumed(
                60.0 * _RETURN_SHARE * sheet.hover_minutes, f"13.1 % of hover_minutes, {_S500}"
            )
        },
    }
    data = tomllib.loads(file_text(sheet.name, sections))
    try:
        vehicle = parse(data, VehicleParams, "a vehicle of these values")
        compile_vehicle(vehicle, 1.0)
    except ValueError as error:
        fix = "correct hover_minutes, top_speed_mps, tilt_deg, capacity_Ah or resistance_mohm"
        raise InputError(f"{error}; {fix}") from None
    dod_end = 1.0 - sheet.charge_left
    minutes = (
        flight_time_s(vehicle, vehicle.power.hover_W, dod_end) / 60.0,
        linearised_hover_time_s(vehicle, dod_end) / 60.0,
    )
    for flown in minutes:
        if abs(flown / sheet.hover_minutes - 1.0) > HOVER_TOLERANCE:
            raise InputError(
                f"hover_minutes {sheet.hover_minutes:g}: the vehicle made would hover for "
                f"{flown:.4g}, its battery being close to its limit; correct cells, capacity_Ah "
                "or resistance_mohm"
            )
    return MadeVehicle(sections, vehicle, minutes)


def _battery(sheet: DataSheet) -> Battery:
    """The battery of the sheet but for its largest current."""
    resistance_ohm = sheet.cells * _CELL_RESISTANCE_OHM_AH / sheet.capacity_Ah
    if sheet.resistance_mohm is not None:
        resistance_ohm = 1e-3 * sheet.resistance_mohm
    return Battery(
        capacity_Ah=sheet.capacity_Ah,
        resistance_0_ohm=_RESISTANCE_0_SHARE * resistance_ohm,
        resistance_th_ohm=(1.0 - _RESISTANCE_0_SHARE) * resistance_ohm,
        time_constant_th_s=_TIME_CONSTANT_S,
        ocv_dod=_CELL_OCV_DOD,
        ocv_V=tuple(sheet.cells * volt for volt in _CELL_OCV_V),
        voltage_min_V=3.0 * sheet.cells,
        current_max_A=1.0,
        dod_max=0.75,
        dod_cutoff=0.9,
    )


def _hover_W(sheet: DataSheet, battery: Battery) -> float:
    """The power that takes the battery down to `charge_left` in `hover_minutes`."""
    dod_end, time_h = 1.0 - sheet.charge_left, sheet.hover_minutes / 60.0

    def too_little_W(power_W: float) -> float:
        voltage_V = mean_voltage_V(battery, power_W, dod_end)
        return sheet.capacity_Ah * dod_end * voltage_V / time_h - power_W

    # an empty battery still has to deliver it
    most_W = battery.ocv_V[-1] ** 2 / (4.0 * battery.resistance_ohm)
    if too_little_W(most_W) >= 0.0:
        raise InputError(
            f"hover_minutes {sheet.hover_minutes:g} empties {sheet.capacity_Ah:g} Ah of "
            f"{sheet.cells} cells faster than their resistance of "
            f"{1e3 * battery.resistance_ohm:.3g} mohm lets it; correct hover_minutes, capacity_Ah "
            "or cells, or give resistance_mohm"
        )
    return float(brentq(too_little_W, 0.0, most_W))  # pyrefly: ignore[bad-argument-type]


def _arm_m(sheet: DataSheet) -> float:
    radius_m = 0.5 * _INCH_M * sheet.diameter_in
    return sheet.arm_m or _ARM_OF_RADIUS * radius_m / math.sin(math.pi / sheet.motors)


def _airframe(sheet: DataSheet) -> dict[str, Value]:
    radius_m = 0.5 * _INCH_M * sheet.diameter_in
    half_gap = math.sin(math.pi / sheet.motors)
    arm = computed(
        _arm_m(sheet),
        "neighbouring propellers 0.28 diameters apart, as the S500's",
    )
    if sheet.arm_m is not None:
        arm = given(sheet.arm_m, "arm_m")
        if sheet.arm_m * half_gap < radius_m:
            raise InputError(
                f"arm_m {sheet.arm_m:g} lets {sheet.motors} propellers of {sheet.diameter_in:g} in "
                f"overlap; give {radius_m / half_gap:.3g} or more"
            )
    arm_m = _arm_m(sheet)
    weight_N = sheet.mass_kg * _GRAVITY_MPS2
    return {
        "n_motors": given(sheet.motors, "motors"),
        "mass_kg": given(sheet.mass_kg, "mass_kg"),
        "gravity_mps2": assumed(_GRAVITY_MPS2, "standard"),
        "arm_m": arm,
        "first_arm_angle_rad": assumed(math.pi / sheet.motors, "X configuration"),
        "inertia_kgm2": computed(
            tuple(sheet.mass_kg * (share * arm_m) ** 2 for share in _GYRATION_OF_ARM),
            "radii of gyration in proportion to the arm, as the S500's",
        ),
        "drag_kgps": computed(
            _TRIM_SHARE * _tilt_rad(sheet) * weight_N / sheet.top_speed_mps,
            "top_speed_mps takes 70 % of the largest tilt, as the S500",
        ),
        "drag_vertical_kgps": assumed(0.0, "lift is pure vertical acceleration"),
    }


def _drive(sheet: DataSheet, battery: Battery, hover_W: float) -> dict[str, dict[str, Value]]:
    """Rotors, motors and speed controllers that take the hover power at the weight."""
    n, weight_N = sheet.motors, sheet.mass_kg * _GRAVITY_MPS2
    diameter_m = _INCH_M * sheet.diameter_in
    area_m2 = n * math.pi * (0.5 * diameter_m) ** 2
    shaft_W = weight_N * math.sqrt(weight_N / (2.0 * _AIR_KGPM3 * area_m2)) / _FIGURE_OF_MERIT
    auxiliary_W, auxiliary = _AUXILIARY_SHARE * hover_W, "2 % of hover power, as the S500"
    if sheet.auxiliary_W is not None:
        auxiliary_W, auxiliary = sheet.auxiliary_W, None
    motors_W = hover_W - auxiliary_W
    least, most = _EFFICIENCIES
    if not least * motors_W <= shaft_W <= most * motors_W:
        raise InputError(
            f"hover_minutes {sheet.hover_minutes:g} leaves {motors_W:.4g} W for the motors; by "
            f"momentum theory (figure of merit {_FIGURE_OF_MERIT:g}) mass_kg {sheet.mass_kg:g} on "
            f"{n} propellers of {sheet.diameter_in:g} in takes {shaft_W:.4g} W at the shafts, so "
            f"give {_minutes(sheet, battery, shaft_W, least):.3g} to "
            f"{_minutes(sheet, battery, shaft_W, most):.3g} minutes, or correct mass, propeller, "
            "cells or capacity"
        )
    coefficient = _THRUST_COEFFICIENT_BY_PITCH * sheet.pitch_in / sheet.diameter_in
    k_T = coefficient * _AIR_KGPM3 * diameter_m**4 / (2.0 * math.pi) ** 2
    hover_radps = math.sqrt(weight_N / n / k_T)
    loss_W = motors_W - shaft_W
    copper_W = _COPPER_SHARE * loss_W
    # full throttle at the nominal voltage: U = K_e Ω_max + R i_max, the current growing with Ω²
    ratio = _thrust_to_weight(sheet)
    voltage_V = mean_voltage_V(battery, hover_W)
    current_A = (shaft_W * math.sqrt(ratio) + copper_W * ratio) / n / voltage_V
    known = "given" if sheet.thrust_to_weight else "assumed"
    return {
        "rotor": {
            "thrust_N_per_radps2": computed(
                k_T, f"thrust coefficient {coefficient:.3g}, by pitch as the S500's propeller"
            ),
            "torque_Nm_per_radps2": computed(
                shaft_W / n / hover_radps**3,
                f"momentum theory, figure of merit {_FIGURE_OF_MERIT:g} (assumed)",
            ),
            "propeller_radius_m": given(0.5 * diameter_m, "propeller_in"),
            "induced_power_factor": assumed(1.15, "helicopter theory"),
            "profile_power_advance_factor": assumed(4.65, "helicopter theory"),
            "air_density_kgpm3": assumed(_AIR_KGPM3, "standard atmosphere"),
        },
        "motor": {
            "back_emf_Vs_per_rad": computed(
                shaft_W / n / (current_A * hover_radps),
                f"full throttle lifts {ratio:g} times the weight ({known})",
            ),
            "resistance_ohm": computed(
                copper_W / n / current_A**2, "22 % of the losses in hover, as on the S500's bench"
            ),
            "no_load_current_A": assumed(0.0, "contained in esc.constant_loss_W"),
        },
        "esc": {
            "constant_loss_W": computed(
                (loss_W - copper_W) / n,
                f"the rest of the losses: hover_minutes leaves an efficiency of "
                f"{shaft_W / motors_W:.2f}",
            ),
            "efficiency": assumed(1.0, "contained in the loss and the resistance"),
        },
        "power": {
            "auxiliary_W": assumed(auxiliary_W, auxiliary)
            if auxiliary
            else given(auxiliary_W, "auxiliary_W")
        },
    }


def _minutes(sheet: DataSheet, battery: Battery, shaft_W: float, efficiency: float) -> float:
    """Hover time at an efficiency of the motors."""
    auxiliary_W = sheet.auxiliary_W or 0.0
    share = _AUXILIARY_SHARE if sheet.auxiliary_W is None else 0.0
    power_W = (shaft_W / efficiency + auxiliary_W) / (1.0 - share)
    dod_end = 1.0 - sheet.charge_left
    voltage_V = mean_voltage_V(battery, power_W, dod_end)
    return 60.0 * sheet.capacity_Ah * dod_end * voltage_V / power_W


def _battery_section(sheet: DataSheet, battery: Battery, hover_W: float) -> dict[str, Value]:
    # shaft power goes with T^1.5; losses, most of them constant, grow less
    most_W = hover_W * (1.0 + _delta_thrust_share(sheet)) ** 1.5
    current_A = 1.05 * steady_current_A(battery, battery.dod_max, most_W)
    resistance = "56 mohm Ah per cell, as the S500"
    cell = "a cell of the S500"

    def resistor(value: float) -> Value:
        if sheet.resistance_mohm is None:
            return computed(value, resistance)
        return given(value, "resistance_mohm, shared as the S500's")

    return {
        "capacity_Ah": given(sheet.capacity_Ah, "capacity_Ah"),
        "resistance_0_ohm": resistor(battery.resistance_0_ohm),
        "resistance_th_ohm": resistor(battery.resistance_th_ohm),
        "time_constant_th_s": assumed(_TIME_CONSTANT_S, _S500),
        "ocv_dod": assumed(battery.ocv_dod, cell),
        "ocv_V": computed(battery.ocv_V, f"{cell}, {sheet.cells} in series (given)"),
        "voltage_min_V": assumed(battery.voltage_min_V, "3.0 V per cell under load"),
        "current_max_A": computed(
            current_A,
            f"feeds delta_thrust_max_N at dod_max, {current_A / sheet.capacity_Ah:.2g} C",
        ),
        "dod_max": assumed(battery.dod_max, "the paper's"),
        "dod_cutoff": assumed(battery.dod_cutoff, _S500),
    }


def _limits(sheet: DataSheet) -> dict[str, Value]:
    weight_N, tilt_rad = sheet.mass_kg * _GRAVITY_MPS2, _tilt_rad(sheet)
    lift = min(0.40, 0.95 * _thrust_to_weight(sheet) * math.cos(tilt_rad) - 1.0)
    if lift < 0.05:
        raise InputError(
            f"thrust_to_weight {_thrust_to_weight(sheet):g} leaves no lift at a tilt of "
            f"{math.degrees(tilt_rad):.3g} degrees; raise it or lower tilt_deg"
        )

    def known(option: str, default: float) -> Value:
        value = getattr(sheet, option)
        return assumed(default, "autopilot default") if value is None else given(value, option)

    tilt = assumed(tilt_rad, "25 degrees, as the S500")
    limit = given(sheet.top_speed_mps, "top_speed_mps")
    if sheet.speed_limit_mps is not None:
        limit = given(sheet.speed_limit_mps, "speed_limit_mps")
    speed_mps = sheet.speed_limit_mps or sheet.top_speed_mps
    # half as long, twice the angular acceleration (Froude scaling); about x and y the S500's is so
    # far below what motors can do that it serves larger vehicles, too
    per_s2 = _S500_ARM_M / _arm_m(sheet)
    tilting_per_s2, froude = max(per_s2, 1.0), "the S500's, by the arm (Froude scaling)"
    return {
        "v_xy_max_mps": limit,
        "v_cruise_mps": assumed(_CRUISE_SHARE * speed_mps, "5/6 of it, as the S500"),
        "v_up_max_mps": known("climb_mps", min(3.0, speed_mps)),
        "v_down_max_mps": known("descent_mps", min(1.5, 0.5 * speed_mps)),
        "tilt_max_rad": tilt if sheet.tilt_deg is None else given(tilt_rad, "tilt_deg"),
        "yaw_max_rad": assumed(0.35, _S500),
        "rate_max_radps": assumed(0.50 * math.sqrt(tilting_per_s2), froude),
        "yaw_rate_max_radps": assumed(0.35 * math.sqrt(per_s2), froude),
        "angular_acceleration_xy_max_radps2": assumed(0.50 * tilting_per_s2, froude),
        "angular_acceleration_z_max_radps2": assumed(0.35 * per_s2, froude),
        "delta_thrust_min_N": assumed(-0.50 * weight_N, "half the weight"),
        "delta_thrust_max_N": assumed(
            _delta_thrust_share(sheet) * weight_N,
            "three quarters of the weight, or what full throttle gives",
        ),
        "lift_min_N": assumed(-0.30 * weight_N, "0.30 of the weight"),
        "lift_max_N": assumed(
            lift * weight_N, "0.40 of the weight, or what full throttle gives at the largest tilt"
        ),
    }


def _tilt_rad(sheet: DataSheet) -> float:
    return math.radians(25.0 if sheet.tilt_deg is None else sheet.tilt_deg)


def _thrust_to_weight(sheet: DataSheet) -> float:
    return 2.0 if sheet.thrust_to_weight is None else sheet.thrust_to_weight


def _delta_thrust_share(sheet: DataSheet) -> float:
    """Largest thrust beyond the weight, as a share of it."""
    return min(0.75, 0.99 * _thrust_to_weight(sheet) - 1.0)
