"""`uas-coverage scenario`: the missions that are shipped, a check of one's own, and a new one."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from PIL import Image, UnidentifiedImageError
from PIL.PngImagePlugin import PngInfo
from rich.table import Table

from uas_coverage_env.cli.options import (
    ReplaceFileOption,
    ScenarioArgument,
    check_file,
    scenario_name,
)
from uas_coverage_env.cli.output import console, loaded, warn
from uas_coverage_env.draw import picture
from uas_coverage_env.draw.signs import legend
from uas_coverage_env.files.plain_files import write_atomically, written_by
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.left_open import too_long
from uas_coverage_env.flight.record import LANDED, LOST
from uas_coverage_env.flight.rest import rest_of
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access
from uas_coverage_env.mission.errands import Errands
from uas_coverage_env.scenario import Scenario, Uas, load_scenario, scenario_names
from uas_coverage_env.scenario.checks import out_of_reach
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.simulation import World
from uas_coverage_env.tasks.levels import LEVELS
from uas_coverage_env.vehicle.tube import tube_of
from uas_coverage_env.world.arena import lookahead_steps
from uas_coverage_env.world.obstacles import route_margin_m
from uas_coverage_env.world.tubes import UNKNOWN

_PICTURE_PX = 1024
_NAMED, _NAMED_IN_WARNINGS = 8, 50
_SLOWLY_S = 3.0
"""In this time a UAS brakes that creeps up to a waypoint."""
# what we write into a picture, so that it may be drawn again; other files are left alone
_MARK = ("Software", "uas-coverage scenario check")


def list_scenarios() -> None:
    """List the shipped scenarios, the families that draw others, and the levels."""
    table = Table("name", "UAS", "waypoints", "obstacles", "moving", "size, m", "steps", box=None)
    for name in scenario_names():
        scenario = load_scenario(name)
        counts = (scenario.uas, scenario.waypoints, scenario.obstacles, scenario.moving_obstacles)
        table.add_row(
            name, *(str(len(items)) for items in counts), _size(scenario), str(scenario.max_steps)
        )
    out = console()
    out.print(table)
    by_seed = ", ".join(f"{family}:SEED" for family in installed_families())
    out.print(f"by a seed: {by_seed}", markup=False)
    for level, task in LEVELS.items():
        out.print(f"level {level}: {task.meaning}", markup=False)


def check(
    scenario: ScenarioArgument,
    picture_file: Annotated[
        Path | None, typer.Option("--picture", help="PNG to draw; default: NAME.png, here.")
    ] = None,
    overwrite: Annotated[
        bool,
        typer.Option("--overwrite", help="Replace a PNG that another program made, too."),
    ] = False,
) -> None:
    """Validate, summarise and draw a scenario.

    A picture that this command has made is drawn anew.
    """
    mission = loaded(scenario)
    access = Access(MissionBrief.of(mission))
    warn(_closed_off(mission, access))
    path = picture_file or Path(f"{mission.name}.png")
    if path.exists() and not overwrite and not _drawn_by_us(path):
        raise InputError(f"{path}: exists; give another --picture or add --overwrite")
    pixels = np.vstack(
        [
            picture(mission, World(mission).swarm_state(), size_px=_PICTURE_PX),
            legend(mission, _signs(mission), _PICTURE_PX),
        ]
    )
    try:
        with written_by(path) as place:
            mark = PngInfo()
            mark.add_text(*_MARK)
            Image.fromarray(pixels).save(place, format="PNG", pnginfo=mark)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error
    out = console()
    out.print(f"[bold]{mission.name}[/] is valid", highlight=False)
    for line in _lines(mission):
        out.print(line, markup=False)
    for line in _far(mission, access):
        out.print(f"charge     {line}", markup=False)
    out.print(f"drawn in {path}", markup=False)


def new(
    scenario: ScenarioArgument,
    out: Annotated[Path, typer.Option(help="Scenario file to write.")],
    overwrite: ReplaceFileOption = False,
) -> None:
    """Write a scenario to a file, to begin one's own with.

    `scenario new town:7 --out mine.toml` has the town that is drawn from the seed 7; its keys are
    in docs/scenario_keys.md, and `scenario check` validates what becomes of it.
    """
    check_file(out, overwrite=overwrite)
    mission = load_scenario(scenario).model_copy(update={"name": scenario_name(out)})
    mission.to_file(out)
    said = f"scenario in {out}; to draw it: uas-coverage scenario check {out}"
    console().print(said, markup=False)


def resume(
    directory: Annotated[
        Path,
        typer.Argument(metavar="DIR", help="Flight directory, of `run` or of `log`."),
    ],
    out: Annotated[Path, typer.Option(help="Scenario file to write.")],
    from_here: Annotated[
        bool,
        typer.Option(
            "--from-here",
            help="UAS go on from where they were, with the charge that they had; default: all "
            "start at home with fresh packs.",
        ),
    ] = False,
    overwrite: ReplaceFileOption = False,
) -> None:
    """Write the scenario of what a flight has left to cover."""
    check_file(out, overwrite=overwrite)
    flight = Flight.load(directory)
    rest = rest_of(flight, from_here=from_here)
    write_atomically(out, rest.file_text().encode())
    screen = console()
    modes = flight.mode[-1]
    for i, name in enumerate(flight.names):
        if modes[i] == LOST:
            screen.print(f"{name} was lost and is left out", markup=False)
        elif from_here and modes[i] != LANDED:
            screen.print(f"{name} goes on with {flight.soc[-1, i]:.1%} of charge", markup=False)
    left = len(rest.waypoints)
    asked = left + int(flight.covered[-1])
    screen.print(f"{left} of {asked} waypoints are left; scenario in {out}", markup=False)


def _closed_off(scenario: Scenario, access: Access) -> Iterator[str]:
    """That waypoints have no way to them, and why; in a line."""
    closed = {}
    for w in _coverable(scenario):
        carriers = np.flatnonzero(scenario.can_cover[:, w])
        if not access.has_way[carriers, w].any():
            closed[w] = access.why_closed(int(carriers[0]), w)
    if closed:
        yield (
            f"{len(closed)} of {len(scenario.waypoints)} waypoints have no way to them: "
            f"{_named(list(closed), _NAMED_IN_WARNINGS)}; {_first(list(closed.values()))}. Routes "
            f"keep {route_margin_m(scenario):.2g} m more than the safe distances: widen the "
            f"gaps, or move or take away what is closed off{_too_narrow(access)}"
        )


def _too_narrow(access: Access) -> str:
    """Which doors and gaps UAS fit through, but routes do not; nothing where there is none."""
    gaps = access.narrow_gaps
    if not gaps:
        return ""
    named = [
        f"{gap.width_m:.3g} m between {gap.between[0]} and {gap.between[1]} of "
        f"{gap.needed_m:.3g} m needed"
        for gap in gaps[:_NAMED]
    ]
    more = f" and {len(gaps) - _NAMED} more" if len(gaps) > _NAMED else ""
    return f". Too narrow: {', '.join(named)}{more}; a smaller route_margin_m needs less"


def _far(scenario: Scenario, access: Access) -> Iterator[str]:
    """That waypoints are beyond every charge; in a line."""
    errands, far = Errands(MissionBrief.of(scenario)), {}
    for w in _coverable(scenario):
        able = np.flatnonzero(scenario.can_cover[:, w] & access.has_way[:, w]).tolist()
        best = max((errands.from_start(u, w) for u in able), key=lambda e: e.spare_s, default=None)
        if best is not None and best.spare_s < 0.0:
            far[w] = too_long(best)
    if far:
        yield (
            f"{len(far)} of {len(scenario.waypoints)} waypoints are out of reach: "
            f"{_named(list(far), _NAMED_IN_WARNINGS)}; {_first(list(far.values()))}"
        )


def _coverable(scenario: Scenario) -> list[int]:
    """Waypoints with room in them that some UAS carries the sensor for; others are warned of."""
    carried = np.flatnonzero(scenario.can_cover.any(axis=0)).tolist()
    return sorted(set(carried) - set(out_of_reach(scenario, 0.0)))


def _named(waypoints: Sequence[int], most: int) -> str:
    """The first waypoints by their index, and how many more there are."""
    names = ", ".join(f"waypoints[{index}]" for index in waypoints[:most])
    return names + (f" and {len(waypoints) - most} more" if len(waypoints) > most else "")


def _first(reasons: Sequence[str]) -> str:
    different = len(set(reasons)) - 1
    return reasons[0] + (f" (the first; +{different} more)" if different else "")


def _signs(scenario: Scenario) -> set[str]:
    """What the picture of a scenario before its flight has on it."""
    heavy = len({point.weight for point in scenario.waypoints}) > 1
    return {
        *("open", "home", "flying"),
        *(["heavy"] if heavy else []),
        *(["moving", "kept_off"] if scenario.moving_obstacles else []),
    }


def _drawn_by_us(path: Path) -> bool:
    try:
        with Image.open(path) as drawn:
            return _MARK in drawn.info.items()
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError):
        return False


def _lines(scenario: Scenario) -> list[str]:
    weight = sum(waypoint.weight for waypoint in scenario.waypoints)
    return [
        f"fence      {_size(scenario)} m, margin {scenario.geofence.margin_m:g} m",
        f"waypoints  {len(scenario.waypoints)}, sum of weights {weight:g}",
        f"obstacles  {len(scenario.obstacles)} fixed, {len(scenario.moving_obstacles)} moving",
        f"time       at most {scenario.max_steps} steps of {scenario.dt_s:g} s",
        *(f"asked      {line}" for line in _asked(scenario)),
        *(f"place      {line}" for line in _place(scenario)),
        *(f"disturbed  {line}" for line in _disturbances(scenario)),
        *(f"tube       {line}" for line in _tubes(scenario)),
        *(
            f"{uas.name:<9}  {uas.vehicle} at {_position(uas.start_m)} m, "
            f"charge {uas.soc_0:.0%}, usable to {1 - uas.dod_max:.0%}{_carried(uas)}"
            for uas in scenario.uas
        ),
    ]


def _carried(uas: Uas) -> str:
    names = ", ".join(sensor.name for sensor in uas.sensors)
    return f", carries {names}" if names else ""


def _asked(scenario: Scenario) -> list[str]:
    """How many waypoints ask for which sensor, and which UAS carry it."""
    wanted = [waypoint.sensor for waypoint in scenario.waypoints]
    lines = []
    for name in dict.fromkeys(one for one in wanted if one is not None):
        carriers = [
            uas.name for uas in scenario.uas if any(one.name == name for one in uas.sensors)
        ]
        lines.append(f"{wanted.count(name)} for {name}: {', '.join(carriers) or 'no UAS'}")
    return lines


def _place(scenario: Scenario) -> list[str]:
    place = scenario.place
    if place is None:
        return []
    return [
        f"{place.latitude_deg:.7f}, {place.longitude_deg:.7f}, {place.height_m:g} m above sea level"
    ]


def _tubes(scenario: Scenario) -> list[str]:
    """What the stated wind asks for: clearances by vehicle, and the waypoints that they close."""
    stated = scenario.conditions
    if scenario.wind is None or stated is None:
        return []
    lines = [
        f"stated: mean wind up to {stated.mean_mps:g} m/s, of which up to "
        f"{stated.unknown_mps:.1f} m/s at a time is not known in flight"
    ]
    steps, unknown_m = lookahead_steps(scenario), UNKNOWN * route_margin_m(scenario)
    slowly_m = unknown_m
    for vehicle in dict.fromkeys(scenario.vehicles):
        tube = tube_of(vehicle, scenario.dt_s, steps, learns=True)
        kept_m = np.maximum(unknown_m, stated.unknown_mps * tube.position)
        at = (1, round(_SLOWLY_S / scenario.dt_s), steps)
        after = ", ".join(f"{kept_m[k]:.1f}" for k in at)
        at_s = ", ".join(f"{k * scenario.dt_s:g}" for k in at)
        lines.append(
            f"{vehicle.name}: {after} m more are kept where it brakes within {at_s} s; off by up "
            f"to {stated.unknown_mps * tube.velocity:.1f} m/s and "
            f"{math.degrees(stated.unknown_mps * tube.tilt):.0f} degrees of tilt"
        )
        slowly_m = max(slowly_m, float(kept_m[at[1]]))
    closed = sorted(set(out_of_reach(scenario, slowly_m)) - set(out_of_reach(scenario, 0.0)))
    if closed:
        lines.append(
            f"out of reach in this wind: {_named(closed, _NAMED)}; there is no room with "
            f"{slowly_m:.1f} m more"
        )
    return lines


def _disturbances(scenario: Scenario) -> list[str]:
    wind = scenario.wind
    lines = [name for name, _ in scenario.disturbances]
    if wind is not None:
        up = f", {wind.up_mps:g} m/s upward" if wind.up_mps else ""
        unsteady = [
            *(["turbulence"] if wind.turbulence and wind.mean_mps else []),
            *(["gusts"] if wind.gusts or wind.random_gusts else []),
        ]
        more = f", with {' and '.join(unsteady)}" if unsteady else ""
        lines.insert(0, f"wind of {wind.mean_mps:g} m/s from {wind.from_deg:g} degrees{up}{more}")
    if scenario.uncertainty is not None:
        bounds = [f"{name} {bound:.0%}" for name, bound in scenario.uncertainty if bound]
        lines.append(f"vehicles other than believed: {', '.join(bounds) or 'by nothing'}")
    if scenario.sensing is not None:
        lines.append("[sensing]: UAS are known with errors")
    for event in scenario.events:
        when = f"at {event.at_s:g} s" if event.rate_per_h is None else f"{event.rate_per_h:g} per h"
        lines.append(f"{event.kind} {when}")
    return lines


def _size(scenario: Scenario) -> str:
    return " x ".join(f"{side_m:g}" for side_m in np.ptp(scenario.fence.vertices_m, axis=0))


def _position(position_m: tuple[float, float, float]) -> str:
    return "({})".format(", ".join(f"{coordinate:g}" for coordinate in position_m))
