"""Files for autopilots and maps from a flight, checked before any of them is written."""

import json
import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError, check_within
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.flight import Flight, covered_at, sorties_summary
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.operations.flight_checks import check_flight, place_of_flight
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.failure_responses import not_safe
from uas_coverage_env.operations.mission_export.formats import AUTOPILOTS, FORMATS
from uas_coverage_env.operations.mission_export.formats.firmware import FIRMWARES, PX4
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.mission_file import (
    ExportSettings,
    MissionFile,
    followed,
    waiting,
)
from uas_coverage_env.operations.mission_export.report import report
from uas_coverage_env.operations.mission_export.report_page import report_page
from uas_coverage_env.operations.mission_export.scheduling import (
    FlightFiles,
    FlightStart,
    scheduled,
)
from uas_coverage_env.operations.mission_export.tracks import Tolerances, Track
from uas_coverage_env.operations.mission_export.waypoint_requirements import stopping
from uas_coverage_env.planning.execution.leg_model import Followed
from uas_coverage_env.planning.execution.separation import Waits, ready_s
from uas_coverage_env.scenario import Place

MOST_TOLERANCE_M = 50.0
MIN_SLACK_S = 20.0
PROMISE = 0.15
"""So far a file's time may be from that of a flight that was planned for it."""


@dataclass(frozen=True)
class ExportOptions:
    """How a flight is exported.

    Attributes:
        kind: Key of `FORMATS`.
        min_slack_s: How late any UAS has to be able to be; waits are put in until it is; None: as
            the scenario's `[execution]` says, else 20 [s].
        path_m: How far legs may be from the flight; None: likewise, else 2 [m].
        corner_m: How far from a corner an autopilot may pass; None: likewise, else 2 [m].
        firmware: Whose files `qgc` and `ardupilot` write, key of `FIRMWARES`; None: ArduPilot's of
            any version.
        place: Where on the Earth it is, for a scenario that does not say.
        wind_mps: The worst wind that the report counts charges in; None: that of the scenario.
    """

    kind: str
    min_slack_s: float | None = None
    path_m: float | None = None
    corner_m: float | None = None
    firmware: str | None = None
    place: Place | None = None
    wind_mps: float | None = None


@dataclass(frozen=True, eq=False)
class Export:
    """What an export consists of.

    Attributes:
        files: Name -> text.
        data: The report.
        grounded: UAS that stay on the ground: they get no file.
        notes: What the files cannot keep.
    """

    files: dict[str, str]
    data: dict[str, Any]
    grounded: tuple[str, ...]
    notes: tuple[str, ...]


def make_export(flights: Flight | Sequence[Flight], options: ExportOptions) -> Export:
    """The files of a flight, or of sorties that were flown one after the other.

    Args:
        flights: In which all UAS have landed, without a contact. A UAS that takes off again has a
            file for each of its sorties. Several flights are of one mission, in their order: each
            begins when all have landed from the one before and have been given fresh packs.
        options: How.

    Raises:
        InputError: A flight cannot be exported, or two UAS would come too close if one of them
            were late by less than asked, wherever they wait for each other.
    """
    flights = [flights] if isinstance(flights, Flight) else list(flights)
    settings = _settings(flights[0], options)
    _check(options, settings)
    frame = LocalFrame(place_of_flight(flights[0], options.place))
    for flight in flights:
        check_flight(flight)
    left = [_as_events_left_it(flight) for flight in flights]
    flights = [flight for flight, _ in left]
    laid = [_tracks(flight, covered, settings) for flight, covered in left]
    if not any(laid):
        raise InputError("no UAS flies in this flight; there is nothing to export")
    parts: list[FlightFiles] = []
    flown = sorties_summary(flights)
    for flight, tracks, entry in zip(flights, _named(laid), flown["sorties"], strict=True):
        if tracks:
            at_s = ready_s(parts[-1].lands_s, flown["swap_s"]) if parts else 0.0
            begins = FlightStart(at_s, entry["begins_s"])
            parts.append(scheduled(flight, tracks, frame, settings, begins))
    data = report(parts, frame, settings)
    files = _files(parts, options, settings.tolerances)
    files["report.json"] = json.dumps(data, indent=1, allow_nan=False) + "\n"
    flying = {uas["uas"] for uas in data["uas"]}
    grounded = tuple(name for name in flights[0].names if name not in flying)
    flies = options.kind in AUTOPILOTS
    notes = tuple(dict.fromkeys(note for part in parts for note in _notes(part, flies=flies)))
    files["report.html"] = report_page(parts, data, notes)
    return Export(files, data, grounded, notes)


def _as_events_left_it(flight: Flight) -> tuple[Flight, NDArray[np.int64]]:
    """The flight among all that was there at its end, and when each waypoint was covered.

    Files cannot say when something appears.
    """
    if not flight.events and not flight.scenario.asks_again:
        return flight, covered_at(flight)
    history = SceneHistory.of(flight)
    scenario, numbers = history.scene_at(flight.steps)
    if scenario.asks_again:  # every visit is there as a waypoint of its own
        once = tuple(w.model_copy(update={"again_after_s": ()}) for w in scenario.waypoints)
        scenario = scenario.model_copy(update={"waypoints": once, "events": ()})
    moving_m = history.moving_position_m
    all_there = replace(flight, scenario=scenario, events=(), moving_position_m=moving_m)
    return all_there, history.covered_at[numbers]


def _tracks(flight: Flight, covered: NDArray[np.int64], settings: ExportSettings) -> list[Track]:
    """All sorties of a flight, those of a UAS one after the other."""
    return [
        _as_asked(flight, track, settings.tolerances)
        for i in range(len(flight.names))
        for track in make_tracks(flight, i, settings.tolerances, covered)
    ]


def _named(laid: Sequence[list[Track]]) -> list[list[Track]]:
    """Tracks that say which of its sorties each UAS flies, where any flies several."""
    counts = Counter(track.name for tracks in laid for track in tracks)
    most = max(counts.values())
    if most == 1:
        return list(laid)
    flown: Counter[str] = Counter()
    result = []
    for tracks in laid:
        named = []
        for track in tracks:
            flown[track.name] += 1
            number = f"{flown[track.name]:0{len(str(most))}d}"  # names sort
            name = f"{track.name}-sortie-{number}"
            named.append(replace(track, name=name, number=flown[track.name]))
        result.append(named)
    return result


def _files(
    parts: Sequence[FlightFiles], options: ExportOptions, tolerances: Tolerances
) -> dict[str, str]:
    files: dict[str, str] = {}
    for name in parts[0].flight.names:
        flown = [(part, one) for part in parts for one in part.of(name)]
        if flown:
            files |= FORMATS[options.kind](name, flown, tolerances, options.firmware)
    return files


def _settings(flight: Flight, options: ExportOptions) -> ExportSettings:
    said = flight.scenario.execution
    usual = Tolerances.path_m, Tolerances.corner_m, MIN_SLACK_S
    if said is not None:
        usual = said.tolerance_m, said.corner_m, said.min_slack_s
    given = options.path_m, options.corner_m, options.min_slack_s
    path_m, corner_m, slack_s = (
        value if one is None else one for one, value in zip(given, usual, strict=True)
    )
    tolerances = Tolerances(path_m, corner_m)
    return ExportSettings(tolerances, slack_s, options.wind_mps, options.firmware == PX4)


def _check(options: ExportOptions, settings: ExportSettings) -> None:
    check_choice("--format", options.kind, FORMATS)
    if options.firmware is not None:
        check_choice("--firmware", options.firmware, FIRMWARES)
        if options.firmware == PX4 and options.kind == "ardupilot":
            raise InputError("--firmware px4: --format ardupilot is of ArduPilot; take qgc")
    check_within("--tolerance", settings.tolerances.path_m, 0.1, MOST_TOLERANCE_M)
    check_within("--corner", settings.tolerances.corner_m, 0.1, MOST_TOLERANCE_M)
    check_within("--min-slack", settings.min_slack_s, 0.0, 3_600.0)
    if settings.wind_mps is not None:
        check_within("--wind", settings.wind_mps, 0.0, 60.0)


def _as_asked(flight: Flight, track: Track, tolerances: Tolerances) -> Track:
    def fly(one: Track) -> Followed:
        return followed(one, flight.scenario, tolerances, Waits())

    return stopping(flight.scenario, track, tolerances.corner_m, fly)


def _unkept(flight: Flight, one: MissionFile) -> list[str]:
    """A time that was not planned as the scenario's `[execution]` asks."""
    sortie = one.track.sortie
    planned_s = (sortie.landed - sortie.first) * flight.scenario.dt_s
    file_s = one.followed.duration_s
    if abs(file_s - planned_s) <= PROMISE * planned_s:
        return []
    waited_s = one.waits.start_s + one.waits.hold_s
    why = "plan for the autopilot with tour, trajectory or lawnmower"
    if abs(file_s - waited_s - planned_s) <= PROMISE * planned_s:
        why = f"{waited_s:.0f} s of it are waits for others"
    return [f"{one.track.name}: the file takes {file_s:.0f} s, the flight {planned_s:.0f}; {why}"]


def _notes(part: FlightFiles, *, flies: bool) -> list[str]:
    """What cannot be promised, first of all where something fails."""
    flight, exports = part.flight, part.exports
    scenario = flight.scenario
    notes = [f"{one.track.name} {line}" for one in exports for line in not_safe(one) if flies]
    if scenario.moving_obstacles:
        notes.append("files of legs carry no time: moving obstacles are not avoided")
    if scenario.wind is not None or scenario.uncertainty is not None or scenario.disturbances:
        notes.append(
            "times and paths of the report hold for still air, and for the vehicles as "
            "their files say"
        )
    if scenario.execution is not None:
        notes += [line for one in exports for line in _unkept(flight, one)]
    for one in exports:
        if one.track.lands_elsewhere:
            away_m = math.dist(one.track.home_m, one.track.landing_m)
            notes.append(
                f"{one.track.name} lands {away_m:.0f} m from where it takes off: there is its "
                f"rally point, which only --format qgc holds"
            )
        notes += [f"{one.track.name} {line}" for line in waiting(one)]
        notes += _no_return(one)
        at_risk = (
            one.track.passed_m > [scenario.waypoints[w].radius_m for w in one.track.waypoints]
        ).sum()
        if at_risk:
            notes.append(f"{one.track.name}: {at_risk} waypoints may be missed")
        if one.not_as_asked:
            notes.append(
                f"{one.track.name}: {len(one.not_as_asked)} waypoints are not passed within the "
                f"radius, speed and heights that they ask for"
            )
    return notes


def _no_return(one: MissionFile) -> list[str]:
    """From where a UAS does not come home for sure."""
    for use in filter(None, (one.still, one.in_wind)):
        lost, wind_mps = use.point_of_no_return, use.headwind_mps
        if lost is not None:
            air = f"in a headwind of {wind_mps:.1f} m/s, " if wind_mps else ""
            return [
                f"{one.track.name}: {air}as an autopilot flies it, the charge does not suffice to "
                f"come home for sure after leg {lost + 1}, {use.legs[lost].time_s:.0f} s after "
                f"take-off"
            ]
    return []
