"""The parameters of a vehicle, read from a file and checked."""

import math
from functools import cached_property
from importlib import resources
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from uas_coverage_env.strict_toml import InputError, StrictModel, read_toml

_FILES = resources.files("uas_coverage_env.vehicle")


def _within(low: float, high: float) -> Any:
    """Bounds that no multicopter goes beyond; within them nothing that is computed overflows."""
    return Field(ge=low, le=high)


Force_N = Annotated[float, _within(1e-6, 1e6)]
Inertia_kgm2 = Annotated[float, _within(1e-8, 1e5)]
Length_m = Annotated[float, _within(1e-3, 100.0)]
Speed_mps = Annotated[float, _within(0.01, 1000.0)]
Rate = Annotated[float, _within(1e-3, 1000.0)]
Resistance_ohm = Annotated[float, _within(1e-6, 100.0)]
Voltage_V = Annotated[float, _within(0.1, 10_000.0)]
Current_A = Annotated[float, _within(1e-3, 100_000.0)]
Slope = Annotated[float, _within(0.0, 1000.0)]
DodPoint = Annotated[float, _within(0.0, 1.0)]
Fraction = Annotated[float, Field(gt=0.0, lt=1.0)]


class Airframe(StrictModel):
    """Rigid body and rotor arrangement (the paper's Assumption 1: rotors equally spaced).

    Neighbouring rotors turn against each other. Three rotors cannot balance their yaw torque that
    way: of a tricopter, one rotor is taken to be tilted for it.
    """

    n_motors: Annotated[int, Field(ge=3, le=32)]
    mass_kg: Annotated[float, _within(1e-3, 10_000.0)]
    gravity_mps2: Annotated[float, _within(0.1, 100.0)]
    arm_m: Length_m
    first_arm_angle_rad: Annotated[float, _within(-10.0, 10.0)]
    inertia_kgm2: tuple[Inertia_kgm2, Inertia_kgm2, Inertia_kgm2]
    drag_kgps: Slope
    drag_vertical_kgps: Slope


class Rotor(StrictModel):
    """One rotor with its propeller."""

    thrust_N_per_radps2: Annotated[float, _within(1e-12, 1.0)]
    torque_Nm_per_radps2: Annotated[float, _within(1e-14, 1.0)]
    propeller_radius_m: Length_m
    induced_power_factor: Annotated[float, _within(1.0, 10.0)]
    profile_power_advance_factor: Slope
    air_density_kgpm3: Annotated[float, _within(1e-3, 100.0)]
    speed_max_radps: Annotated[float, _within(1.0, 100_000.0)]


class Motor(StrictModel):
    """One brushless motor, its speed controller's resistance included."""

    back_emf_Vs_per_rad: Annotated[float, _within(1e-6, 10.0)]
    resistance_ohm: Resistance_ohm
    no_load_current_A: Annotated[float, _within(0.0, 1000.0)]


class Esc(StrictModel):
    """One electronic speed controller."""

    constant_loss_W: Annotated[float, _within(0.0, 1e5)]
    efficiency: Annotated[float, Field(gt=0.0, le=1.0)]


class Power(StrictModel):
    """Battery power around hover."""

    auxiliary_W: Annotated[float, _within(0.0, 1e5)]
    hover_W: Annotated[float, _within(1e-3, 1e6)]
    slope_W_per_N: Annotated[float, _within(1e-3, 1e4)]


class Battery(StrictModel):
    """Thevenin battery with a piecewise-linear discharge curve."""

    capacity_Ah: Annotated[float, _within(1e-3, 10_000.0)]
    resistance_0_ohm: Resistance_ohm
    resistance_th_ohm: Resistance_ohm
    time_constant_th_s: Annotated[float, _within(0.01, 1e5)]
    polarisation_linearised_V: Annotated[float, _within(0.0, 1000.0)]
    ocv_dod: tuple[DodPoint, ...]
    ocv_V: tuple[Voltage_V, ...]
    ocv_dod_linearised: tuple[DodPoint, ...]
    voltage_nominal_V: Voltage_V
    voltage_min_V: Voltage_V
    current_max_A: Current_A
    dod_max: Fraction
    dod_cutoff: Fraction

    @model_validator(mode="after")
    def _curve_falls(self) -> Self:
        dod, volt = self.ocv_dod, self.ocv_V
        if len(dod) != len(volt) or len(dod) < 2:
            raise ValueError("ocv_dod and ocv_V need the same number of points, two at least")
        if len(dod) > 9:
            raise ValueError(f"ocv_dod has {len(dod)} points; give at most 9 (8 segments)")
        if dod[0] != 0.0 or dod[-1] != 1.0:
            raise ValueError(f"ocv_dod runs from {dod[0]} to {dod[-1]}; it must run from 0 to 1")
        if any(b <= a for a, b in pairwise(dod)):
            raise ValueError(f"ocv_dod is {list(dod)}; it must increase from point to point")
        if any(b >= a for a, b in pairwise(volt)):
            raise ValueError(f"ocv_V is {list(volt)}; it must fall from point to point")
        if len(self.ocv_dod_linearised) != len(dod) - 1:
            raise ValueError(
                f"ocv_dod_linearised has {len(self.ocv_dod_linearised)} values; "
                f"give one for each of the {len(dod) - 1} segments"
            )
        if self.dod_max > self.dod_cutoff:
            raise ValueError(
                f"dod_max {self.dod_max} exceeds dod_cutoff {self.dod_cutoff}; lower it"
            )
        if self.voltage_min_V >= volt[0]:
            raise ValueError(
                f"voltage_min_V {self.voltage_min_V} exceeds the full battery's {volt[0]} V; "
                "lower it"
            )
        return self

    @property
    def voltages_linearised_V(self) -> tuple[float, ...]:
        """Voltage behind R_0 at which the current is linearised, for each piece of the curve [V].

        The piece's straight line, extrapolated where need be, less the polarisation.
        """
        points = list(zip(self.ocv_dod, self.ocv_V, strict=True))
        return tuple(
            volt
            + (volt - volt_end) / (dod_end - dod) * (dod - dod_linearised)
            - self.polarisation_linearised_V
            for (dod, volt), (dod_end, volt_end), dod_linearised in zip(
                points, points[1:], self.ocv_dod_linearised, strict=False
            )
        )


class Limits(StrictModel):
    """Bounds of states and inputs (the paper's sets X and U)."""

    v_xy_max_mps: Speed_mps
    v_cruise_mps: Speed_mps
    v_up_max_mps: Speed_mps
    v_down_max_mps: Speed_mps
    tilt_max_rad: Annotated[float, Field(gt=0.0, lt=1.2)]
    yaw_max_rad: Annotated[float, _within(1e-3, 10.0)]
    rate_max_radps: Rate
    yaw_rate_max_radps: Rate
    angular_acceleration_xy_max_radps2: Rate
    angular_acceleration_z_max_radps2: Rate
    delta_thrust_min_N: Annotated[float, _within(-1e6, -1e-6)]
    delta_thrust_max_N: Force_N
    lift_min_N: Annotated[float, _within(-1e6, -1e-6)]
    lift_max_N: Force_N

    @model_validator(mode="after")
    def _cruise_below_maximum(self) -> Self:
        if self.v_cruise_mps > self.v_xy_max_mps:
            raise ValueError(
                f"v_cruise_mps {self.v_cruise_mps} exceeds v_xy_max_mps {self.v_xy_max_mps}; "
                "lower it"
            )
        return self


class ThrustCorrection(StrictModel):
    """Slopes of the piecewise-linear thrust correction f_T, see `thrust_correction`."""

    speed_N_per_mps: Slope
    climb_N_per_mps: Slope
    descent_N_per_mps: Slope
    tilt_N_per_rad: Annotated[float, _within(0.0, 1e5)]


class ReturnRule(StrictModel):
    """The overestimated way home of the return threshold DoD_r."""

    distance_over_speed_s: Annotated[float, _within(1e-3, 1e6)]


class VehicleParams(StrictModel):
    """Everything the model knows of a vehicle; fields carry their units."""

    name: str
    airframe: Airframe
    rotor: Rotor
    motor: Motor
    esc: Esc
    power: Power
    battery: Battery
    limits: Limits
    thrust_correction: ThrustCorrection
    return_rule: ReturnRule

    def __hash__(self) -> int:
        # models of a vehicle are cached by it
        return hash(tuple(self.__dict__[name] for name in type(self).model_fields))

    @model_validator(mode="after")
    def _can_fly(self) -> Self:
        body, limits = self.airframe, self.limits
        for name in ("delta_thrust_min_N", "lift_min_N"):
            if -getattr(limits, name) >= self.weight_N:
                raise ValueError(
                    f"limits.{name} {getattr(limits, name)} takes away more than the weight, "
                    f"{self.weight_N:.4g} N; raise it"
                )
        strongest = body.n_motors * self.rotor.thrust_N_per_radps2 * self.rotor.speed_max_radps**2
        needed = self.weight_N + limits.lift_max_N
        if strongest < needed:
            raise ValueError(
                f"the rotors lift {strongest:.4g} N at rotor.speed_max_radps; "
                f"limits.lift_max_N asks for {needed:.4g} N, lower it"
            )
        battery = self.battery
        # the current of a constant power is real where E² > 4 R_0 P; squares would hide E < 0
        weakest = 2.0 * math.sqrt(battery.resistance_0_ohm * self.power.hover_W)
        if battery.ocv_V[-1] <= weakest:
            raise ValueError(
                f"battery.resistance_0_ohm {battery.resistance_0_ohm} is too high to hover on "
                f"{battery.ocv_V[-1]} V; lower it"
            )
        if min(battery.voltages_linearised_V) <= weakest:
            raise ValueError(
                f"at battery.ocv_dod_linearised and battery.polarisation_linearised_V "
                f"{battery.polarisation_linearised_V} there are only "
                f"{min(battery.voltages_linearised_V):.4g} V, too few to hover; correct them"
            )
        trim = self.trim_tilt_rad_per_mps * limits.v_xy_max_mps
        if trim >= limits.tilt_max_rad:
            raise ValueError(
                f"limits.tilt_max_rad {limits.tilt_max_rad} does not hold v_xy_max_mps, "
                f"which needs {trim:.4g} rad; raise it"
            )
        return self

    @property
    def weight_N(self) -> float:
        """M g [N]."""
        return self.airframe.mass_kg * self.airframe.gravity_mps2

    @property
    def trim_tilt_rad_per_mps(self) -> float:
        """Tilt that holds a horizontal speed in the linear model [rad per m/s]."""
        return self.airframe.drag_kgps / self.weight_N

    @cached_property
    def torque_max_Nm(self) -> tuple[float, float, float]:
        """Largest torques: inertia times largest angular acceleration [N m]."""
        inertia, limits = self.airframe.inertia_kgm2, self.limits
        sideways = limits.angular_acceleration_xy_max_radps2
        return (
            inertia[0] * sideways,
            inertia[1] * sideways,
            inertia[2] * limits.angular_acceleration_z_max_radps2,
        )


def vehicle_names() -> tuple[str, ...]:
    """The names of the shipped vehicles."""
    return tuple(sorted(f.name[:-5] for f in _FILES.iterdir() if f.name.endswith(".toml")))


def load_vehicle(name_or_path: str | Path) -> VehicleParams:
    """Load a shipped vehicle by name or any vehicle by the path of its file.

    Args:
        name_or_path: one of `vehicle_names()`, or a path that ends in .toml.

    Raises:
        InputError: unknown name, or a mistake in the file; one line.
    """
    text = str(name_or_path)
    if text in vehicle_names():
        with resources.as_file(_FILES / f"{text}.toml") as path:
            return read_toml(path, VehicleParams)
    if isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text:
        return read_toml(name_or_path, VehicleParams)
    raise InputError(
        f"unknown vehicle {text!r}; allowed: {', '.join(vehicle_names())}, or a path to a file"
    )


def return_threshold(
    vehicle: VehicleParams, dod_max: float | None = None, way_s: float | None = None
) -> float:
    """DoD_r, from which on the way home is due (Gasche et al., Sec. III-C.6, return mode).

    DoD_r = DoD_max - p_hover (D_r,max / v_cruise) / (Q_b u_nom)

    Args:
        vehicle: parameters.
        dod_max: DoD_max of the UAS; the vehicle's own by default.
        way_s: [s] D_r,max / v_cruise; the vehicle's own by default.
    """
    battery = vehicle.battery
    way = vehicle.return_rule.distance_over_speed_s if way_s is None else way_s
    energy_J = 3600.0 * battery.capacity_Ah * battery.voltage_nominal_V
    taken = vehicle.power.hover_W * way / energy_J
    return (battery.dod_max if dod_max is None else dod_max) - taken
