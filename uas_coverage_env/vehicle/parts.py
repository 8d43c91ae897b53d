"""The parts of a vehicle as a file gives them: each field checked, alone and within its part."""

import math
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Any, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from uas_coverage_env.files.strict_toml import StrictModel

MAX_SEGMENTS = 8
"""Straight pieces of a discharge curve."""

MAX_FURTHER_PAIRS = 3
"""RC pairs of a battery beside the paper's."""

ABSENT = math.nan
"""Stands for a value that a file leaves out and `VehicleParams` computes."""


def _within(low: float, high: float) -> Any:
    """Bounds that no multicopter goes beyond; within them nothing that is computed overflows."""
    return Field(ge=low, le=high)


Force_N = Annotated[float, _within(1e-6, 1e6)]
Inertia_kgm2 = Annotated[float, _within(1e-9, 1e7)]
Length_m = Annotated[float, _within(1e-3, 100.0)]
Speed_mps = Annotated[float, _within(0.01, 1000.0)]
Rate = Annotated[float, _within(1e-3, 1000.0)]
Resistance_ohm = Annotated[float, _within(1e-6, 100.0)]
Voltage_V = Annotated[float, _within(0.1, 10_000.0)]
Current_A = Annotated[float, _within(1e-3, 100_000.0)]
Slope = Annotated[float, _within(0.0, 1000.0)]
DodPoint = Annotated[float, _within(0.0, 1.0)]
Fraction = Annotated[float, Field(gt=0.0, lt=1.0)]


def _computed(low: float, high: float) -> Any:
    """Bounds of a value that may be left out, because it follows from the parts."""
    return Field(ge=low, le=high, validate_default=False)


def computed_fields(section: type[StrictModel]) -> tuple[str, ...]:
    """The fields of a section that a file may leave out, because they follow from the parts."""
    fields = section.model_fields.items()
    return tuple(name for name, field in fields if field.validate_default is False)


def is_absent(value: object) -> bool:
    """Whether a value was left out: ABSENT, or no points of a curve."""
    return value == () or (isinstance(value, float) and math.isnan(value))


class RecordedPart(StrictModel):
    """A part whose numbers the kernels read, each under its name in `_IN_RECORD` or its own."""

    @classmethod
    def record_fields(cls) -> list[tuple[str, str]]:
        """Names and types in the record of a vehicle."""
        kinds = {float: "f8", int: "i8"}
        return [
            (_IN_RECORD.get(name, name), kinds[field.annotation])
            for name, field in cls.model_fields.items()
            if field.annotation in kinds
        ]

    def in_record(self) -> dict[str, float]:
        """Values by their names in the record of a vehicle."""
        numbers = ((name, value) for name, value in self if isinstance(value, float | int))
        return {_IN_RECORD.get(name, name): value for name, value in numbers}


_IN_RECORD = {
    "speed_max_radps": "motor_speed_max_radps",
    "resistance_ohm": "motor_resistance_ohm",
    "constant_loss_W": "esc_loss_W",
    "efficiency": "esc_efficiency",
    "angular_acceleration_xy_max_radps2": "alpha_xy_max_radps2",
    "angular_acceleration_z_max_radps2": "alpha_z_max_radps2",
}


class Airframe(RecordedPart):
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


class Rotor(RecordedPart):
    """One rotor with its propeller; full throttle is computed where it is left out."""

    thrust_N_per_radps2: Annotated[float, _within(1e-12, 1.0)]
    torque_Nm_per_radps2: Annotated[float, _within(1e-14, 1.0)]
    propeller_radius_m: Length_m
    induced_power_factor: Annotated[float, _within(1.0, 10.0)]
    profile_power_advance_factor: Slope
    air_density_kgpm3: Annotated[float, _within(1e-3, 100.0)]
    speed_max_radps: Annotated[float, _computed(1.0, 100_000.0)] = ABSENT


class Motor(RecordedPart):
    """One brushless motor, its speed controller's resistance included."""

    back_emf_Vs_per_rad: Annotated[float, _within(1e-6, 100.0)]
    resistance_ohm: Resistance_ohm
    no_load_current_A: Annotated[float, _within(0.0, 1000.0)]


class Esc(RecordedPart):
    """One electronic speed controller."""

    constant_loss_W: Annotated[float, _within(0.0, 1e6)]
    efficiency: Annotated[float, Field(gt=0.0, le=1.0)]


class Power(StrictModel):
    """Battery power around hover; what the power train gives is computed where it is left out."""

    auxiliary_W: Annotated[float, _within(0.0, 1e5)]
    hover_W: Annotated[float, _computed(1e-3, 1e7)] = ABSENT
    slope_W_per_N: Annotated[float, _computed(1e-3, 1e4)] = ABSENT


def _hash(record: StrictModel) -> int:
    return hash(tuple(record.__dict__[name] for name in type(record).model_fields))


class RcPair(StrictModel):
    """A resistance and a capacity side by side, in series with the others."""

    resistance_ohm: Resistance_ohm
    time_constant_s: Annotated[float, _within(0.01, 1e5)]


class Battery(StrictModel):
    """Thevenin battery with a piecewise-linear discharge curve.

    Nominal voltage and linearisation points are computed where they are left out. `rc` are further
    RC pairs, beside the paper's.
    """

    capacity_Ah: Annotated[float, _within(1e-3, 10_000.0)]
    resistance_0_ohm: Resistance_ohm
    resistance_th_ohm: Resistance_ohm
    time_constant_th_s: Annotated[float, _within(0.01, 1e5)]
    polarisation_linearised_V: Annotated[float, _computed(0.0, 1000.0)] = ABSENT
    ocv_dod: tuple[DodPoint, ...]
    ocv_V: tuple[Voltage_V, ...]
    ocv_dod_linearised: Annotated[tuple[DodPoint, ...], Field(validate_default=False)] = ()
    voltage_nominal_V: Annotated[float, _computed(0.1, 10_000.0)] = ABSENT
    voltage_min_V: Voltage_V
    current_max_A: Current_A
    dod_max: Fraction
    dod_cutoff: Fraction
    rc: Annotated[tuple[RcPair, ...], Field(max_length=MAX_FURTHER_PAIRS)] = ()

    # a battery without further pairs is written as it always was
    @model_serializer(mode="wrap")
    def _without_empty(self, as_usual: SerializerFunctionWrapHandler) -> dict[str, Any]:
        data: dict[str, Any] = as_usual(self)
        if not self.rc:
            data.pop("rc", None)
        return data

    # results are cached by it
    def __hash__(self) -> int:
        return _hash(self)

    @model_validator(mode="after")
    def _curve_falls(self) -> Self:
        dod, volt = self.ocv_dod, self.ocv_V
        if len(dod) != len(volt) or len(dod) < 2:
            raise ValueError("ocv_dod and ocv_V need the same number of points, two at least")
        if len(dod) > MAX_SEGMENTS + 1:
            raise ValueError(
                f"ocv_dod has {len(dod)} points; "
                f"give at most {MAX_SEGMENTS + 1} ({MAX_SEGMENTS} segments)"
            )
        if dod[0] != 0.0 or dod[-1] != 1.0:
            raise ValueError(f"ocv_dod runs from {dod[0]} to {dod[-1]}; it must run from 0 to 1")
        if any(b <= a for a, b in pairwise(dod)):
            raise ValueError(f"ocv_dod is {list(dod)}; it must increase from point to point")
        if any(b >= a for a, b in pairwise(volt)):
            raise ValueError(f"ocv_V is {list(volt)}; it must fall from point to point")
        if self.ocv_dod_linearised and len(self.ocv_dod_linearised) != len(dod) - 1:
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
    def pairs(self) -> tuple[RcPair, ...]:
        """All RC pairs, the paper's first."""
        return (
            RcPair.model_construct(
                resistance_ohm=self.resistance_th_ohm, time_constant_s=self.time_constant_th_s
            ),
            *self.rc,
        )

    @property
    def resistance_ohm(self) -> float:
        """Of a current that has flowed for a while: R_0 and those of all RC pairs."""
        return sum((pair.resistance_ohm for pair in self.pairs), self.resistance_0_ohm)

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


class Limits(RecordedPart):
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


class ThrustCorrection(RecordedPart):
    """Slopes of the piecewise-linear thrust correction f_T, see `thrust_correction`.

    Those that are left out are fitted to the exact form.
    """

    speed_N_per_mps: Annotated[float, _computed(0.0, 1e5)] = ABSENT
    climb_N_per_mps: Annotated[float, _computed(0.0, 1e5)] = ABSENT
    descent_N_per_mps: Annotated[float, _computed(0.0, 1e5)] = ABSENT
    tilt_N_per_rad: Annotated[float, _computed(0.0, 1e6)] = ABSENT


class ReturnRule(StrictModel):
    """The overestimated way home of the return threshold DoD_r."""

    distance_over_speed_s: Annotated[float, _within(1e-3, 1e6)]


class Parts(StrictModel):
    """What a vehicle file holds; a value that it leaves out to be computed is `ABSENT`."""

    name: str
    airframe: Airframe
    rotor: Rotor
    motor: Motor
    esc: Esc
    power: Power
    battery: Battery
    limits: Limits
    thrust_correction: ThrustCorrection = ThrustCorrection()
    return_rule: ReturnRule

    def __hash__(self) -> int:
        return _hash(self)

    @property
    def weight_N(self) -> float:
        """M g [N]."""
        return self.airframe.mass_kg * self.airframe.gravity_mps2

    @property
    def trim_tilt_rad_per_mps(self) -> float:
        """Tilt that holds a horizontal speed in the linear model [rad per m/s]."""
        return self.airframe.drag_kgps / self.weight_N

    @property
    def thrust_max_N(self) -> float:
        """Static thrust of all rotors at full throttle [N]."""
        rotor = self.rotor
        return self.airframe.n_motors * rotor.thrust_N_per_radps2 * rotor.speed_max_radps**2

    def kernel_scalars(self) -> dict[str, float]:
        """Body, rotors, motors and speed controllers under the names that the kernels read."""
        sections = (self.airframe, self.rotor, self.motor, self.esc)
        values = {"weight_N": self.weight_N, "auxiliary_W": self.power.auxiliary_W}
        return values | {k: v for section in sections for k, v in section.in_record().items()}

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
