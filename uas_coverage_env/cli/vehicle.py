"""`uas-coverage vehicle`: the vehicles that are shipped, a check of one's own, and a new one."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from uas_coverage_env.cli.options import ReplaceFileOption, check_file, declared
from uas_coverage_env.cli.output import console
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.vehicle import (
    DataSheet,
    VehicleParams,
    endurance,
    load_vehicle,
    make_vehicle,
    vehicle_names,
)

_PROPELLER = re.compile(r"(\d+(?:\.\d+)?)(?:\s*[xX]\s*(\d+(?:\.\d+)?))?")
_USUAL_PITCH = 0.45  # of the diameter


def list_vehicles() -> None:
    """List the shipped vehicles."""
    table = Table(
        "name", "motors", "mass, kg", "battery, Ah", "hover, W", "hover, min", "range, km", box=None
    )
    for name in vehicle_names():
        params = load_vehicle(name)
        flown = endurance(params)
        table.add_row(
            name,
            str(params.airframe.n_motors),
            f"{params.airframe.mass_kg:g}",
            f"{params.battery.capacity_Ah:g}",
            f"{params.power.hover_W:.4g}",
            f"{flown.hover_min:.1f}",
            f"{flown.cruise_lpv.range_km:.1f}",
        )
    console().print(table)


def check(
    file: Annotated[
        str, typer.Argument(metavar="FILE", help="Vehicle file, or the name of a shipped one.")
    ],
) -> None:
    """Validate a vehicle and print the quantities derived from its parts."""
    params = load_vehicle(file)
    out = console()
    out.print(f"{params.name} is valid", style="bold", markup=False)
    for line in _lines(params):
        out.print(line, markup=False)


@dataclass(frozen=True, kw_only=True)
class Asked:
    """What is asked of `vehicle new`; named as in `DataSheet` but for the propeller."""

    mass_kg: Annotated[float, typer.Option(help="Ready to fly, battery included.")]
    motors: Annotated[int, typer.Option(help="How many, equally spaced.")]
    propeller_in: Annotated[
        str,
        typer.Option(metavar="DIAMETERxPITCH", help="Inches, as 10x4.5; or the diameter."),
    ]
    cells: Annotated[int, typer.Option(help="LiPo cells in series.")]
    capacity_Ah: Annotated[float, typer.Option("--capacity-Ah", help="Of the whole battery.")]
    hover_minutes: Annotated[float, typer.Option(help="From full until --charge-left is left.")]
    top_speed_mps: Annotated[float, typer.Option(help="In still air.")]
    out: Annotated[Path, typer.Option(help="Vehicle file to write.")]
    charge_left: Annotated[
        float, typer.Option(help="Share of the charge left after that hover.")
    ] = 0.0
    arm_m: Annotated[float | None, typer.Option(help="Centre to rotor axis.")] = None
    tilt_deg: Annotated[float | None, typer.Option(help="Largest tilt.")] = None
    thrust_to_weight: Annotated[float | None, typer.Option(help="At full throttle.")] = None
    auxiliary_W: Annotated[
        float | None, typer.Option("--auxiliary-W", help="Avionics and payload.")
    ] = None
    resistance_mohm: Annotated[float | None, typer.Option(help="Of the battery.")] = None
    climb_mps: Annotated[float | None, typer.Option(help="Fastest climb.")] = None
    descent_mps: Annotated[float | None, typer.Option(help="Fastest descent.")] = None
    speed_limit_mps: Annotated[
        float | None, typer.Option(help="Flown at the most; default: the top speed.")
    ] = None
    name: Annotated[str | None, typer.Option(help="Of the vehicle; default: the file's.")] = None
    overwrite: ReplaceFileOption = False


@declared
def new(asked: Asked) -> None:
    """Make a vehicle file from data-sheet figures and print the assumptions."""
    check_file(asked.out, overwrite=asked.overwrite)
    diameter_in, pitch_in = _propeller(asked.propeller_in)
    known = {name: value for name, value in vars(asked).items() if name in DataSheet.model_fields}
    known |= {
        "name": asked.name or asked.out.stem,
        "diameter_in": diameter_in,
        "pitch_in": pitch_in,
    }
    made = make_vehicle(parse(known, DataSheet, "vehicle new"))
    write_atomically(asked.out, made.file_text().encode())
    screen = console()
    for origin in ("given", "computed", "assumed"):
        screen.print(origin, style="bold")
        for section, values in made.sections.items():
            for key, value in values.items():
                if value.origin == origin:
                    text = f"{section}.{key} = {value.text()}"
                    screen.print(f"  {text:<46} {value.source}", markup=False)
    screen.print("as it flies", style="bold")
    for line in _lines(made.vehicle):
        screen.print(line, markup=False)
    exact, linear = made.hover_minutes
    screen.print(
        f"asked for  {asked.hover_minutes:g} min of hover down to {asked.charge_left:.0%} charge: "
        f"{exact:.1f} nonlinear, {linear:.1f} lpv",
        markup=False,
    )
    screen.print(f"vehicle in {asked.out}", markup=False)


def _propeller(text: str) -> tuple[float, float]:
    """Diameter and pitch in inches."""
    match = _PROPELLER.fullmatch(text.strip())
    if match is None:
        raise InputError(f"--propeller-in {text!r}: should be DIAMETERxPITCH, as in 10x4.5")
    diameter_in = float(match[1])
    return diameter_in, float(match[2]) if match[2] else _USUAL_PITCH * diameter_in


def _lines(params: VehicleParams) -> list[str]:
    """What follows from the parts of a vehicle."""
    battery, power = params.battery, params.power
    flown = endurance(params)
    left = f"{1 - battery.dod_max:.0%}"
    pairs = ", ".join(
        f"{1e3 * pair.resistance_ohm:.3g} mohm of {pair.time_constant_s:.3g} s"
        for pair in battery.pairs
    )
    lines = [
        f"weight     {params.weight_N:.4g} N, full throttle lifts {flown.thrust_to_weight:.2f} "
        "times as much",
        f"battery    {battery.capacity_Ah:g} Ah at {battery.voltage_nominal_V:.4g} V; hover takes "
        f"{flown.hover_current_A:.3g} of {battery.current_max_A:.3g} A at {left} charge",
        f"RC pairs   {pairs}",
        f"hover      {power.hover_W:.4g} W, {flown.hover_min:.1f} min to empty, "
        f"{flown.hover_usable_min:.1f} min to {left}",
    ]
    for dynamics, cruise in (("lpv", flown.cruise_lpv), ("nonlinear", flown.cruise_nonlinear)):
        lines.append(
            f"cruise     {params.limits.v_cruise_mps:.3g} m/s, {dynamics}: {cruise.power_W:.4g} W, "
            f"{cruise.time_min:.1f} min and {cruise.range_km:.1f} km to {left}"
        )
    hover_W, cruise = power.hover_W, flown.cruise_nonlinear
    longest, farthest = flown.longest, flown.farthest
    per_m = cruise.power_W / params.limits.v_cruise_mps
    lines += [
        f"longest    {longest.speed_mps:.3g} m/s, nonlinear: {longest.power_W:.4g} W, "
        f"{1.0 - longest.power_W / hover_W:.1%} less than a hover",
        f"farthest   {farthest.speed_mps:.3g} m/s, nonlinear: "
        f"{farthest.power_W / farthest.speed_mps:.4g} J/m, "
        f"{1.0 - farthest.power_W / farthest.speed_mps / per_m:.1%} less than cruising",
    ]
    return lines
