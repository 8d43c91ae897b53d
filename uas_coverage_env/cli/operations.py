"""`uas-coverage import` and `export`: from a drawn area to a mission, from a flight to files."""

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from uas_coverage_env.cli.output import console, one_line
from uas_coverage_env.cli.sorties import load_flights
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.scenario import Place, warnings

_HEIGHT_M = 40.0
_LIBRARIES = {"pyproj", "shapely", "shapefile", "defusedxml", "pymavlink", "rasterio", "osmium"}


@contextmanager
def extra() -> Iterator[None]:
    """Say which extra is missing, where it is."""
    try:
        yield
    except ModuleNotFoundError as error:
        name = (error.name or "").partition(".")[0]
        if name not in _LIBRARIES:
            raise
        raise InputError(
            f'places on the Earth and logs need {name}: pip install "uas-coverage-env[ops]"'
        ) from error


def import_area(
    areas: Annotated[
        list[Path],
        typer.Argument(
            metavar="AREA...",
            help="What was drawn: .geojson, .kml, .kmz, .shp or a QGroundControl .plan; or a "
            "shipped example, `karhula` or `zones`.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Scenario file to write.")],
    town: Annotated[
        Path | None,
        typer.Option(
            help="OpenStreetMap's buildings, trees, power lines and streets: .osm, .osm.pbf or "
            ".geojson; or `karhula`."
        ),
    ] = None,
    terrain: Annotated[
        Path | None,
        typer.Option(help="Heights of the ground, a GeoTIFF or .asc; default: it is flat."),
    ] = None,
    fleet: Annotated[
        str,
        typer.Option(
            metavar="VEHICLE:COUNT,...",
            help="Shipped vehicles or vehicle files; VEHICLE+CAMERA:COUNT for another camera.",
        ),
    ] = "s500_v2:2",
    camera: Annotated[
        str, typer.Option(help="Name of a camera (see the docs), or a .toml file with one.")
    ] = "sony-a6000",
    height: Annotated[
        float | None,
        typer.Option(help="Of the waypoints above the ground, m; default: 40.", show_default=False),
    ] = None,
    resolution: Annotated[
        float | None,
        typer.Option(
            help="Instead of --height: the most that a pixel may show, cm; waypoints then ask "
            "for the camera."
        ),
    ] = None,
    max_speed: Annotated[
        float | None,
        typer.Option(
            help="At which a waypoint is covered, as the exposure allows, m/s; waypoints then "
            "ask for the camera."
        ),
    ] = None,
    radius: Annotated[float, typer.Option(help="Of a waypoint's sphere, m.")] = 6.0,
    overlap: Annotated[
        float, typer.Option(help="Share of a picture that the next one shows again.")
    ] = 0.1,
    ceiling: Annotated[
        float | None,
        typer.Option(
            help="Top of the fence, m; default: 30 m above the waypoints.", show_default=False
        ),
    ] = None,
    min_height: Annotated[
        float,
        typer.Option(help="Of UAS above ground and roofs, but for take-off and landing, m."),
    ] = 0.0,
    flown_by: Annotated[
        str | None,
        typer.Option(
            help="`autopilot`: planners lay long straight legs, as an autopilot flies them from a "
            "file, so that the file takes as long as the flight."
        ),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            help="With --flown-by: the level speed that the autopilot is set to (WPNAV_SPEED), m/s "
            "(default: the vehicle's largest)."
        ),
    ] = None,
    again: Annotated[
        str | None,
        typer.Option(
            metavar="MIN,...",
            help="Minutes after which waypoints are to be covered again, once for each number, "
            "such as 10,10; for areas that do not say (`again_min`).",
        ),
    ] = None,
    home: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAT,LON", help="Take-off place, instead of those drawn; may be repeated."
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace the file where it exists.")
    ] = False,
) -> None:
    """Make a scenario from drawn areas, no-fly zones and take-off places (extra `ops`)."""
    with extra():
        from uas_coverage_env.operations import (
            ImportOptions,
            make_scenario,
            read_drawings,
        )
        from uas_coverage_env.operations.area_import.area_options import minutes_of
    if out.suffix != ".toml":
        raise InputError(f"--out {out}: should end in .toml")
    if out.exists() and not overwrite:
        raise InputError(f"{out}: exists; give another --out or add --overwrite")
    if resolution is not None and height is not None:
        raise InputError("--resolution says how high waypoints lie: leave out --height")
    options = ImportOptions(
        fleet=fleet,
        camera=camera,
        height_m=_HEIGHT_M if height is None else height,
        resolution_cm=resolution,
        radius_m=radius,
        overlap=overlap,
        max_speed_mps=max_speed,
        ceiling_m=ceiling,
        homes=tuple(place_of("--home", text) for text in home or ()),
        town=town,
        terrain=terrain,
        min_height_m=min_height,
        flown_by=flown_by,
        speed_mps=speed,
        again_after_s=() if again is None else minutes_of("--again", again),
    )
    name = re.sub(r"[^A-Za-z0-9_-]+", "_", out.stem)[:64] or "area"
    made = make_scenario(read_drawings(areas), name, options)
    text = f"# Map data: {made.credit}\n" if made.credit else ""
    write_atomically(out, (text + made.scenario.file_text()).encode())
    screen = console()
    for line in (*made.notes, f"scenario in {out}"):
        screen.print(line, markup=False)
    for warning in warnings(made.scenario):
        sys.stderr.write(f"warning: {one_line(warning)}\n")


def export(
    directory: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="Flight directory, or that of `run --sorties`."),
    ],
    kind: Annotated[
        str,
        typer.Option("--format", help="qgc (.plan), ardupilot (.waypoints), kml, geojson or csv."),
    ],
    out: Annotated[Path, typer.Option(help="Directory for the files and the report.")],
    min_slack: Annotated[
        float | None,
        typer.Option(
            help="Seconds that any UAS may be late before two come too close; files wait for "
            "each other until they allow it; default: 20, or that of the scenario.",
            show_default=False,
        ),
    ] = None,
    tolerance: Annotated[
        float | None,
        typer.Option(
            help="How far legs may be from the flight, m; default: 2, or that of the scenario.",
            show_default=False,
        ),
    ] = None,
    corner: Annotated[
        float | None,
        typer.Option(
            help="How far from a corner an autopilot may pass, m; default: 2, or that of the "
            "scenario.",
            show_default=False,
        ),
    ] = None,
    firmware: Annotated[
        str | None,
        typer.Option(
            help="Of the vehicles: copter-4.6 (and before), copter-4.7 (and after) or px4; "
            "default: ArduCopter of any version, with the parameters of both.",
            show_default=False,
        ),
    ] = None,
    place: Annotated[
        str | None,
        typer.Option(
            metavar="LAT,LON",
            help="Of the origin, for a scenario without [place].",
        ),
    ] = None,
    wind: Annotated[
        float | None,
        typer.Option(
            help="Wind that the report counts with, from ahead on every leg, m/s; default: the "
            "worst of the scenario.",
            show_default=False,
        ),
    ] = None,
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Write into a directory that is not empty.")
    ] = False,
) -> None:
    """Write a file for each sortie, few straight checked legs, and a report (extra `ops`)."""
    with extra():
        from uas_coverage_env.operations import ExportOptions, make_export
        from uas_coverage_env.operations.mission_export.formats import ENDINGS
    if out.is_dir() and any(out.iterdir()) and not overwrite:
        raise InputError(f"--out {out}: is not empty; give another or add --overwrite")
    options = ExportOptions(
        kind=kind,
        min_slack_s=min_slack,
        path_m=tolerance,
        corner_m=corner,
        firmware=firmware,
        place=asked_place(place),
        wind_mps=wind,
    )
    made = make_export(load_flights(directory), options)
    left = {name for name in prepare_folder(out) if Path(name).suffix in ENDINGS} - set(made.files)
    if left:
        raise InputError(f"--out {out}: holds {min(left)} of another export; give another --out")
    write_files(out, {name: text.encode() for name, text in made.files.items()})
    screen = console()
    table = Table(
        "UAS", "starts, s", "legs", "flight, s", "planned, s", "charge landed", "spare", box=None
    )
    if any(uas["in_wind"] for uas in made.data["uas"]):
        table.add_column("in wind")
    for uas in made.data["uas"]:
        table.add_row(
            uas["name"],
            f"{uas['begins_s']:.0f}",
            str(len(uas["legs"])),
            f"{uas['duration_s']:.0f}",
            f"{uas['planned_s']:.0f}",
            f"{uas['soc_landed']:.1%}",
            f"{uas['least_spare']['spare']:.1%}"
            + (
                f" ({uas['in_wind']['least_spare']['spare']:.1%} in wind)" if uas["in_wind"] else ""
            ),
        )
    screen.print(table)
    for name in made.grounded:
        screen.print(f"{name} stays on the ground and has no file", markup=False)
    for one in made.data["turnarounds"]:
        what = "swap its pack" if one["fresh_pack"] else "same pack"
        screen.print(
            f"{one['uas']} lands at {one['lands_s']:.0f} s: {what}, start {one['next']} at "
            f"{one['starts_s']:.0f} s",
            markup=False,
        )
    screen.print(f"{len(made.files)} files in {out}, see report.html", markup=False)
    for note in made.notes:
        sys.stderr.write(f"warning: {one_line(note)}\n")


def place_of(option: str, text: str) -> tuple[float, float]:
    """Latitude and longitude as an option gives them."""
    try:
        latitude, longitude = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"{option} {text[:60]!r}: should be LAT,LON, as in 60.52,26.94") from None
    if not (abs(latitude) <= 90.0 and abs(longitude) <= 180.0):
        raise InputError(f"{option} {text[:60]!r}: is no latitude and longitude in degrees")
    return latitude, longitude


def asked_place(text: str | None) -> Place | None:
    """What `--place` says; None where it is not given."""
    if text is None:
        return None
    latitude, longitude = place_of("--place", text)
    return Place(latitude_deg=latitude, longitude_deg=longitude)
