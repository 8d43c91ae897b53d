"""What people know of a vehicle, and the commented vehicle file that is made of it (`sizing`)."""

import json
from collections.abc import Mapping
from typing import Annotated, Any, Literal, NamedTuple, Self

from pydantic import Field, model_validator

from uas_coverage_env.files.strict_toml import StrictModel


def _within(low: float, high: float) -> Any:
    return Field(ge=low, le=high)


class DataSheet(StrictModel):
    """What is known of a vehicle; fields carry their units, None is assumed.

    Attributes:
        name: Of the vehicle.
        mass_kg: Ready to fly, battery and payload included.
        motors: How many, equally spaced, one propeller each.
        diameter_in: Of a propeller.
        pitch_in: Of a propeller.
        cells: LiPo cells in series.
        capacity_Ah: Of the whole battery.
        hover_minutes: From a full battery until `charge_left` is left.
        top_speed_mps: Horizontal, in still air: what drag lets it reach.
        charge_left: State of charge at the end of `hover_minutes`.
        arm_m: Centre to rotor axis.
        tilt_deg: Largest tilt in flight.
        thrust_to_weight: Full throttle over weight.
        auxiliary_W: Avionics and payload.
        resistance_mohm: Internal resistance of the battery.
        climb_mps: Largest rate of climb.
        descent_mps: Largest rate of descent.
        speed_limit_mps: What it is flown at the most; None: its top speed.
    """

    name: Annotated[str, Field(min_length=1, max_length=100)]
    mass_kg: Annotated[float, _within(0.01, 5000.0)]
    motors: Annotated[int, _within(3, 32)]
    diameter_in: Annotated[float, _within(0.5, 120.0)]
    pitch_in: Annotated[float, _within(0.1, 144.0)]
    cells: Annotated[int, _within(1, 300)]
    capacity_Ah: Annotated[float, _within(0.01, 5000.0)]
    hover_minutes: Annotated[float, _within(1.0, 300.0)]
    top_speed_mps: Annotated[float, _within(0.5, 100.0)]
    charge_left: Annotated[float, _within(0.0, 0.5)] = 0.0
    arm_m: Annotated[float, _within(0.01, 30.0)] | None = None
    tilt_deg: Annotated[float, _within(10.0, 45.0)] | None = None
    thrust_to_weight: Annotated[float, _within(1.3, 20.0)] | None = None
    auxiliary_W: Annotated[float, _within(0.0, 1e5)] | None = None
    resistance_mohm: Annotated[float, _within(0.01, 1e5)] | None = None
    climb_mps: Annotated[float, _within(0.1, 30.0)] | None = None
    descent_mps: Annotated[float, _within(0.1, 30.0)] | None = None
    speed_limit_mps: Annotated[float, _within(0.5, 100.0)] | None = None

    @model_validator(mode="after")
    def _limit_below_top_speed(self) -> Self:
        if self.speed_limit_mps is not None and self.speed_limit_mps > self.top_speed_mps:
            raise ValueError(
                f"speed_limit_mps {self.speed_limit_mps:g} is more than top_speed_mps "
                f"{self.top_speed_mps:g}, which drag does not let it exceed; lower the limit"
            )
        return self

    @model_validator(mode="after")
    def _pitch_below_diameter(self) -> Self:
        if not 0.2 <= self.pitch_in / self.diameter_in <= 1.2:
            raise ValueError(
                f"a propeller of {self.diameter_in:g}x{self.pitch_in:g} in has a pitch of "
                f"{self.pitch_in / self.diameter_in:.2g} diameters; give diameter x pitch"
            )
        return self


class Value(NamedTuple):
    """A value of a vehicle file, and where it comes from."""

    value: float | int | tuple[float, ...]
    origin: Literal["given", "computed", "assumed"]
    source: str

    def text(self) -> str:
        """The value as TOML, numbers with five digits."""
        return _toml_value(self.value)


Sections = Mapping[str, Mapping[str, Value]]
"""The values of a vehicle file, by section and key."""


def given(value: float | int, field: str) -> Value:
    """A value of the data sheet; the option of the command is named as the field."""
    return Value(value, "given", f"--{field.replace('_', '-')}")


def computed(value: float | tuple[float, ...], source: str) -> Value:
    """A value that follows from the data sheet."""
    return Value(value, "computed", source)


def assumed(value: float | tuple[float, ...], source: str) -> Value:
    """A value of which the data sheet says nothing."""
    return Value(value, "assumed", source)


_HEAD = """\
# Made by `uas-coverage vehicle new`. Where each value comes from:
#   [given]    on the command line, in the option named
#   [computed] from what was given, by the relation named
#   [assumed]  neither: correct it where you know better
# Hover power and its slope, nominal voltage, linearisation points, full throttle and the thrust
# correction are left out: they are computed from these when the file is read.
"""


def file_text(name: str, sections: Sections) -> str:
    """A vehicle file: every value with a comment that says where it comes from."""
    lines = [f"{_HEAD}name = {json.dumps(name, ensure_ascii=False)}"]
    for section, values in sections.items():
        lines += ["", f"[{section}]"]
        lines += [
            f"{f'{key} = {value.text()}':<36} # [{value.origin}] {value.source}"
            for key, value in values.items()
        ]
    return "\n".join(lines) + "\n"


def _toml_value(value: float | int | tuple[float, ...]) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_toml_value(item) for item in value)}]"
    return str(value) if isinstance(value, int) else f"{value:.5g}"
