"""The vehicle's limits, judged anew from the rows of a flight (independent check)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.independent_check.record import FlightRecord, Track

FloatArray = NDArray[np.float64]

# docs/flight_directory.md: share of a limit by which it may be exceeded
_TOLERANCE = {"lpv": 0.01, "nonlinear": 0.15}
_TOLERANCE_DISTURBED = 0.15
_ROUNDING = 1e-9


def limits_exceeded(record: FlightRecord) -> Iterator[tuple[float, str, str, str]]:
    """Limits exceeded by more than the tolerance: (first time [s], UAS, `limit`, its name)."""
    tolerance = _TOLERANCE[record.dynamics]
    if record.disturbed:
        tolerance = max(tolerance, _TOLERANCE_DISTURBED)
    for track in record.tracks:
        # tilts of a UAS that looks where it flies are on axes that do not turn
        looks_ahead = track.entry.get("heading") == "course"
        flown = _shares(track, record.dynamics == "nonlinear" and not looks_ahead)
        for name, share in flown.items():
            beyond = np.flatnonzero(share > 1.0 + tolerance + _ROUNDING)
            if len(beyond):
                yield (int(beyond[0]) + 1) * record.dt_s, track.name, "limit", name


def inputs_beyond(track: Track) -> str | None:
    """The first input of a UAS that is beyond its limits, in words; None where none is."""
    limits, inertia = track.vehicle["limits"], track.vehicle["airframe"]["inertia_kgm2"]
    sideways = limits["angular_acceleration_xy_max_radps2"]
    largest = [sideways, sideways, limits["angular_acceleration_z_max_radps2"]]
    bounds = {"lift_N": (limits["lift_min_N"], limits["lift_max_N"])}
    for axis, name in enumerate(("tau_x_Nm", "tau_y_Nm", "tau_z_Nm")):
        most = inertia[axis] * largest[axis]
        bounds[name] = (-most, most)
    for name, (low, high) in bounds.items():
        values = track.columns[name]
        beyond = np.flatnonzero((values < low - _ROUNDING) | (values > high + _ROUNDING))
        if len(beyond):
            return (
                f"has {name} = {values[beyond[0]]:.4g}, beyond its limits {low:.4g} to {high:.4g}"
            )
    return None


def dod_landed(scenario: dict[str, Any], track: Track) -> float:
    """Depth of discharge with which a UAS lands at the latest, by the scenario's reserve."""
    reserve, most = scenario.get("reserve", {}), track.entry["dod_max"]
    if "minutes" not in reserve:
        return min(1.0 - reserve.get("share", 0.0), most)
    battery, hover_W = track.vehicle["battery"], track.vehicle["power"]["hover_W"]
    open_V = np.interp(most, battery["ocv_dod"], battery["ocv_V"])
    pairs = [battery["resistance_th_ohm"], *(p["resistance_ohm"] for p in battery.get("rc", ()))]
    resistance_ohm = battery["resistance_0_ohm"] + sum(pairs)
    root_V = np.sqrt(open_V**2 - 4.0 * resistance_ohm * hover_W)
    current_A = (open_V - root_V) / (2.0 * resistance_ohm)
    return float(most - reserve["minutes"] * current_A / (60.0 * battery["capacity_Ah"]))


def _shares(track: Track, body_rates: bool) -> dict[str, FloatArray]:
    """Limit -> (steps,) the share of it that is used at the end of each step."""
    limits, battery, column = track.vehicle["limits"], track.vehicle["battery"], track.columns
    after = {name: values[1:] for name, values in column.items()}
    level = np.hypot(after["vx_mps"], after["vy_mps"])
    phi, theta = after["phi_rad"], after["theta_rad"]
    turning = after["wz_radps"]
    if body_rates:  # the rate of the heading, from the body's rates
        turning = np.sin(phi) * after["wy_radps"] + np.cos(phi) * after["wz_radps"]
        turning = turning / np.cos(theta)
    # of a battery: how far below the least voltage, the same share above it where it is fine
    voltage = 2.0 - column["voltage_V"][:-1] / battery["voltage_min_V"]
    return {
        "speed": level / limits["v_xy_max_mps"],
        "climb": -after["vz_mps"] / limits["v_up_max_mps"],
        "descent": after["vz_mps"] / limits["v_down_max_mps"],
        "tilt": np.hypot(phi, theta) / limits["tilt_max_rad"],
        "tilt_rate": np.hypot(after["wx_radps"], after["wy_radps"]) / limits["rate_max_radps"],
        "yaw_rate": np.abs(turning) / limits["yaw_rate_max_radps"],
        "current": column["current_A"][:-1] / battery["current_max_A"],
        "voltage": voltage,
    }
