"""The vehicle: parameters, energy-aware LPV model, inner loop and nonlinear plant (Sec. II)."""

from uas_coverage_env.vehicle.battery import open_circuit_voltage, simulate_battery
from uas_coverage_env.vehicle.data_sheet import DataSheet
from uas_coverage_env.vehicle.flight_time import Endurance, endurance
from uas_coverage_env.vehicle.linear import LinearModel, linear_model
from uas_coverage_env.vehicle.lpv import delta_thrust, lpv_step
from uas_coverage_env.vehicle.params import VehicleParams, load_vehicle, vehicle_names
from uas_coverage_env.vehicle.plant import plant_step
from uas_coverage_env.vehicle.record import compile_vehicle
from uas_coverage_env.vehicle.sizing import MadeVehicle, make_vehicle
from uas_coverage_env.vehicle.thrust_correction import exact_delta_thrust

__all__ = [
    "DataSheet",
    "Endurance",
    "LinearModel",
    "MadeVehicle",
    "VehicleParams",
    "compile_vehicle",
    "delta_thrust",
    "endurance",
    "exact_delta_thrust",
    "linear_model",
    "load_vehicle",
    "lpv_step",
    "make_vehicle",
    "open_circuit_voltage",
    "plant_step",
    "simulate_battery",
    "vehicle_names",
]
