"""The vehicle: parameters, energy-aware LPV model, inner loop and nonlinear plant (Sec. II)."""

from uas_coverage_env.vehicle.air import enter_air, leave_air
from uas_coverage_env.vehicle.battery import (
    battery_current_A,
    battery_segments,
    open_circuit_voltage,
    simulate_battery,
)
from uas_coverage_env.vehicle.compiled import VEHICLE_DTYPE, compile_vehicle
from uas_coverage_env.vehicle.data_sheet import DataSheet
from uas_coverage_env.vehicle.endurance import Endurance, endurance, flight_time_s
from uas_coverage_env.vehicle.inner_loop import (
    acceleration_wrench,
    reseed_reference,
    velocity_climb_wrench,
    velocity_wrench,
)
from uas_coverage_env.vehicle.layout import (
    DELTA_THRUST,
    DOD,
    LIFT,
    N_INPUTS,
    N_STATES,
    PHI,
    PSI,
    TAU_X,
    TAU_Y,
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
    Y,
    Z,
)
from uas_coverage_env.vehicle.limits import (
    LIMIT_NAMES,
    LIMITS,
    N_LIMITS,
    limit_names,
    limits_exceeded,
    write_limited,
)
from uas_coverage_env.vehicle.linear import LinearModel, linear_model
from uas_coverage_env.vehicle.lpv import (
    clip_wrench,
    delta_thrust,
    fly_kinematics,
    lpv_step,
    open_circuit_V,
)
from uas_coverage_env.vehicle.params import (
    VehicleParams,
    load_vehicle,
    return_threshold,
    vehicle_names,
)
from uas_coverage_env.vehicle.plant import plant_step
from uas_coverage_env.vehicle.range import dod_per_s, margin_to_land, seconds_to_land
from uas_coverage_env.vehicle.sizing import MadeVehicle, make_vehicle
from uas_coverage_env.vehicle.thrust_correction import exact_delta_thrust, fit_thrust_correction

__all__ = [
    "DELTA_THRUST",
    "DOD",
    "LIFT",
    "LIMITS",
    "LIMIT_NAMES",
    "N_INPUTS",
    "N_LIMITS",
    "N_STATES",
    "PHI",
    "PSI",
    "TAU_X",
    "TAU_Y",
    "TAU_Z",
    "THETA",
    "U_TH",
    "VEHICLE_DTYPE",
    "VX",
    "VY",
    "VZ",
    "WX",
    "WY",
    "WZ",
    "DataSheet",
    "Endurance",
    "LinearModel",
    "MadeVehicle",
    "VehicleParams",
    "X",
    "Y",
    "Z",
    "acceleration_wrench",
    "battery_current_A",
    "battery_segments",
    "clip_wrench",
    "compile_vehicle",
    "delta_thrust",
    "dod_per_s",
    "endurance",
    "enter_air",
    "exact_delta_thrust",
    "fit_thrust_correction",
    "flight_time_s",
    "fly_kinematics",
    "leave_air",
    "limit_names",
    "limits_exceeded",
    "linear_model",
    "load_vehicle",
    "lpv_step",
    "make_vehicle",
    "margin_to_land",
    "open_circuit_V",
    "open_circuit_voltage",
    "plant_step",
    "reseed_reference",
    "return_threshold",
    "seconds_to_land",
    "simulate_battery",
    "vehicle_names",
    "velocity_climb_wrench",
    "velocity_wrench",
    "write_limited",
]
