"""The parameters of a vehicle: read from a file, completed and checked."""

from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Self

from pydantic import model_validator

from uas_coverage_env.files.strict_toml import InputError, StrictModel, read_toml
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.vehicle import checks
from uas_coverage_env.vehicle.parts import Parts, computed_fields

_FILES = resources.files("uas_coverage_env.vehicle")


class VehicleParams(Parts):
    """Everything the model knows of a vehicle; fields carry their units.

    What follows from other values is computed where it is left out, and refused where it is given
    and contradicts them (`checks`).
    """

    # models of a vehicle are cached by it
    __hash__ = Parts.__hash__

    @model_validator(mode="after")
    def _complete_and_agree(self) -> Self:
        # each sees what those before it have filled in; the record is frozen for everything else
        for section, completed in (
            ("power", checks.completed_power),
            ("battery", checks.completed_battery),
            ("rotor", checks.completed_rotor),
            ("thrust_correction", checks.completed_thrust_correction),
        ):
            object.__setattr__(self, section, completed(self))
        checks.check_limits(self)
        return self

    def with_changes(self, **sections: Mapping[str, Any]) -> Self:
        """A copy with some values changed and what follows from its parts computed anew.

        What a file may leave out (`parts.computed_fields`) is that of the changed vehicle, unless
        it is given here; `model_copy` would keep it and refuse the contradiction.

        Args:
            sections: New values by field, by section: `airframe={"mass_kg": 2.0}`.
        """
        parts = {name: part for name, part in self if isinstance(part, StrictModel)}
        unknown = sorted(set(sections) - set(parts))
        if unknown:
            raise ValueError(f"unknown section {unknown[0]!r}; a vehicle has {', '.join(parts)}")
        changed = {}
        for name, part in parts.items():
            follows = computed_fields(type(part))
            kept = {field: value for field, value in part if field not in follows}
            changed[name] = type(part)(**{**kept, **sections.get(name, {})})
        return self.model_copy(update=changed)


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
        return _shipped(text)
    if isinstance(name_or_path, Path) or text.endswith(".toml") or "/" in text:
        return read_toml(name_or_path, VehicleParams)
    shipped = f"allowed: {', '.join(vehicle_names())}, or a path to a file"
    raise InputError(f"unknown vehicle {text!r}; {did_you_mean(text, vehicle_names(), shipped)}")


@cache
def _shipped(name: str) -> VehicleParams:
    """Read once: a shipped file does not change, and a mission that is drawn reads it twice."""
    with resources.as_file(_FILES / f"{name}.toml") as path:
        return read_toml(path, VehicleParams)


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
