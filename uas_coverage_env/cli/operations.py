"""`uas-coverage import` and `export`: from a drawn area to a mission, from a flight to files."""

from collections.abc import Mapping
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from uas_coverage_env.cli.options import (
    PlaceOption,
    ReplaceFileOption,
    check_file,
    declared,
    scenario_name,
    taken,
)
from uas_coverage_env.cli.output import console, extra, warn
from uas_coverage_env.cli.sorties import keep_planned, load_flights
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.scenario import Place, warnings

if TYPE_CHECKING:
    from uas_coverage_env.operations import Export, ImportOptions

_LIBRARIES = {"pyproj", "shapely", "shapefile", "defusedxml", "pymavlink", "rasterio", "osmium"}


def ops() -> AbstractContextManager[None]:
    """Say that the extra is missing, where it is."""
    return extra("ops", "places on the Earth and logs need", _LIBRARIES)


@dataclass(frozen=True, kw_only=True)
class AskedImport:
    """What is asked of `import`; named as in `ImportOptions` where it is one of these."""

    areas: Annotated[
        list[Path],
        typer.Argument(
            metavar="AREA...",
            help="What was drawn: .geojson, .kml, .kmz, .shp or a QGroundControl .plan; or a "
            "shipped example, `karhula` or `zones`.",
        ),
    ]
    out: Annotated[Path, typer.Option(help="Scenario file to write.")]
    town: Annotated[
        Path | None,
        typer.Option(
            help="OpenStreetMap's buildings, trees, power lines and streets: .osm, .osm.pbf or "
            ".geojson; or `karhula`."
        ),
    ] = None
    terrain: Annotated[
        Path | None,
        typer.Option(help="Heights of the ground, a GeoTIFF or .asc; default: it is flat."),
    ] = None
    fleet: Annotated[
        str,
        typer.Option(
            metavar="VEHICLE:COUNT,...",
            help="Shipped vehicles or vehicle files; VEHICLE+CAMERA:COUNT for another camera.",
        ),
    ] = "s500_v2:2"
    camera: Annotated[
        str, typer.Option(help="Name of a camera (see the docs), or a .toml file with one.")
    ] = "sony-a6000"
    height_m: Annotated[
        float | None,
        typer.Option("--height", help="Of the waypoints above the ground, m; default: 40."),
    ] = None
    resolution_cm: Annotated[
        float | None,
        typer.Option(
            "--resolution",
            help="Instead of --height: the most that a pixel may show, cm; waypoints then ask "
            "for the camera.",
        ),
    ] = None
    max_speed_mps: Annotated[
        float | None,
        typer.Option(
            "--max-speed",
            help="At which a waypoint is covered, as the exposure allows, m/s; waypoints then "
            "ask for the camera.",
        ),
    ] = None
    radius_m: Annotated[float, typer.Option("--radius", help="Of a waypoint's sphere, m.")] = 6.0
    overlap: Annotated[
        float, typer.Option(help="Share of a picture that the next one shows again.")
    ] = 0.1
    ceiling_m: Annotated[
        float | None,
        typer.Option("--ceiling", help="Top of the fence, m; default: 30 m above the waypoints."),
    ] = None
    min_height_m: Annotated[
        float,
        typer.Option(
            "--min-height", help="Of UAS above ground and roofs, but for take-off and landing, m."
        ),
    ] = 0.0
    flown_by: Annotated[
        str | None,
        typer.Option(
            help="`autopilot`: planners lay long straight legs, as an autopilot flies them from a "
            "file, so that the file takes as long as the flight."
        ),
    ] = None
    speed_mps: Annotated[
        float | None,
        typer.Option(
            "--speed",
            help="With --flown-by: the level speed that the autopilot is set to (WPNAV_SPEED), m/s "
            "(default: the vehicle's largest).",
        ),
    ] = None
    again: Annotated[
        str | None,
        typer.Option(
            metavar="MIN,...",
            help="Minutes after which waypoints are to be covered again, once for each number, "
            "such as 10,10; for areas that do not say (`again_min`).",
        ),
    ] = None
    home: Annotated[
        list[str] | None,
        typer.Option(
            metavar="LAT,LON", help="Take-off place, instead of those drawn; may be repeated."
        ),
    ] = None
    overwrite: ReplaceFileOption = False

    def options(self) -> "ImportOptions":
        """How the area is flown."""
        from uas_coverage_env.operations import ImportOptions
        from uas_coverage_env.operations.area_import.area_options import minutes_of

        return taken(
            ImportOptions,
            self,
            homes=tuple(place_of("--home", text) for text in self.home or ()),
            again_after_s=() if self.again is None else minutes_of("--again", self.again),
        )


@declared
def import_area(asked: AskedImport) -> None:
    """Make a scenario from drawn areas, no-fly zones and take-off places (extra `ops`)."""
    with ops():
        from uas_coverage_env.operations import make_scenario, read_drawings
    check_file(asked.out, overwrite=asked.overwrite)
    if asked.resolution_cm is not None and asked.height_m is not None:
        raise InputError("--resolution says how high waypoints lie: leave out --height")
    options = asked.options()
    made = make_scenario(read_drawings(asked.areas), scenario_name(asked.out), options)
    text = f"# Map data: {made.credit}\n" if made.credit else ""
    write_atomically(asked.out, (text + made.scenario.file_text()).encode())
    screen = console()
    for line in (*made.notes, f"scenario in {asked.out}"):
        screen.print(line, markup=False)
    warn(warnings(made.scenario))


@dataclass(frozen=True, kw_only=True)
class AskedExport:
    """What is asked of `export`; named as in `ExportOptions` where it is one of these."""

    directory: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="Flight directory, or that of `run --sorties`."),
    ]
    kind: Annotated[
        str,
        typer.Option("--format", help="qgc (.plan), ardupilot (.waypoints), kml, geojson or csv."),
    ]
    out: Annotated[Path, typer.Option(help="Directory for the files and the report.")]
    min_slack_s: Annotated[
        float | None,
        typer.Option(
            "--min-slack",
            help="Seconds that any UAS may be late before two come too close; files wait for "
            "each other until they allow it; default: 20, or that of the scenario.",
        ),
    ] = None
    path_m: Annotated[
        float | None,
        typer.Option(
            "--tolerance",
            help="How far legs may be from the flight, m; default: 2, or that of the scenario.",
        ),
    ] = None
    corner_m: Annotated[
        float | None,
        typer.Option(
            "--corner",
            help="How far from a corner an autopilot may pass, m; default: 2, or that of the "
            "scenario.",
        ),
    ] = None
    firmware: Annotated[
        str | None,
        typer.Option(
            help="Of the vehicles: copter-4.6 (and before), copter-4.7 (and after) or px4; "
            "default: ArduCopter of any version, with the parameters of both.",
        ),
    ] = None
    place: PlaceOption = None
    wind_mps: Annotated[
        float | None,
        typer.Option(
            "--wind",
            help="Wind that the report counts with, from ahead on every leg, m/s; default: the "
            "worst of the scenario.",
        ),
    ] = None
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Write into a directory that is not empty.")
    ] = False


@declared
def export(asked: AskedExport) -> None:
    """Write a file for each sortie, few straight checked legs, and a report (extra `ops`)."""
    with ops():
        from uas_coverage_env.operations import ExportOptions, make_export
        from uas_coverage_env.operations.mission_export.formats import ENDINGS
    out = asked.out
    if out.is_dir() and any(out.iterdir()) and not asked.overwrite:
        raise InputError(f"--out {out}: is not empty; give another or add --overwrite")
    options = taken(ExportOptions, asked, place=asked_place(asked.place))
    flights = load_flights(asked.directory)
    made = make_export(flights, options)
    left = {name for name in prepare_folder(out) if Path(name).suffix in ENDINGS} - set(made.files)
    if left:
        raise InputError(f"--out {out}: holds {min(left)} of another export; give another --out")
    write_files(out, {name: text.encode() for name, text in made.files.items()})
    keep_planned(flights, out, options.place)
    _report_export(console(), made, out)
    warn(made.notes)


def _spare(of: Mapping[str, Any] | None) -> str:
    """What is left at the least; a UAS may meet no wind where another does."""
    return "" if of is None else f"{of['least_spare']['spare']:.1%}"


def _report_export(screen: Console, made: "Export", out: Path) -> None:
    """What each UAS flies, with what charge, and what is to be done between its sorties."""
    table = Table(
        "UAS", "starts, s", "legs", "flight, s", "planned, s", "charge landed", "spare", box=None
    )
    windy = any(uas["in_wind"] for uas in made.data["uas"])
    if windy:
        table.add_column("spare in wind")
    for uas in made.data["uas"]:
        table.add_row(
            uas["name"],
            f"{uas['begins_s']:.0f}",
            str(len(uas["legs"])),
            f"{uas['duration_s']:.0f}",
            f"{uas['planned_s']:.0f}",
            f"{uas['soc_landed']:.1%}",
            _spare(uas),
            *([_spare(uas["in_wind"])] if windy else []),
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
