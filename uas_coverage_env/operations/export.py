"""Files for autopilots and maps from a flight, checked before any of them is written."""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.record import LANDED, LIMIT
from uas_coverage_env.mission.lateness import Pair, pairs_of
from uas_coverage_env.mission.leg_model import Followed
from uas_coverage_env.mission.separation import Waits, separate
from uas_coverage_env.operations.asked import stopping
from uas_coverage_env.operations.exported import Exported, exported, followed, waiting
from uas_coverage_env.operations.formats import FORMATS
from uas_coverage_env.operations.formats.qgc import FIRMWARE
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.layers import Apart, in_layers
from uas_coverage_env.operations.report import report
from uas_coverage_env.operations.report_page import report_page
from uas_coverage_env.operations.tracks import LIFT_M, Tolerances, Track, make_track
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
        autopilot: Whose plans `qgc` writes, key of `FIRMWARE`.
        place: Where on the Earth it is, for a scenario that does not say.
    """

    kind: str
    min_slack_s: float | None = None
    path_m: float | None = None
    corner_m: float | None = None
    autopilot: str = "ardupilot"
    place: Place | None = None


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


def make_export(flight: Flight, options: ExportOptions) -> Export:
    """The files of a flight.

    Args:
        flight: In which all UAS have landed, without a contact.
        options: How.

    Raises:
        InputError: The flight cannot be exported, or two UAS would come too close if one of them
            were late by less than asked, wherever they wait for each other.
    """
    settled = _settled(flight, options)
    _check(options, settled)
    frame = LocalFrame(place_of_flight(flight, options.place))
    check_flight(flight)
    tracks, grounded = [], []
    for i, uas in enumerate(flight.scenario.uas):
        track = make_track(flight, i, settled.tolerances)
        if track is None:
            grounded.append(uas.name)
        else:
            tracks.append(_as_asked(flight, track, settled.tolerances))
    if not tracks:
        raise InputError("no UAS flies in this flight; there is nothing to export")
    exports, pairs = _kept_apart(flight, tracks, frame, settled)
    data = report(flight, exports, pairs, frame, settled.tolerances)
    files = {
        f"{one.track.name}{ending}": text
        for one in exports
        for ending, text in FORMATS[options.kind](
            flight.scenario, one, settled.tolerances, options.autopilot
        ).items()
    }
    files["report.json"] = json.dumps(data, indent=1, allow_nan=False) + "\n"
    files["report.html"] = report_page(flight.scenario, exports, data)
    return Export(files, data, tuple(grounded), tuple(_notes(flight, exports)))


class _Settled(NamedTuple):
    """What options and scenario say together."""

    tolerances: Tolerances
    min_slack_s: float


def _settled(flight: Flight, options: ExportOptions) -> _Settled:
    said = flight.scenario.execution
    usual = Tolerances.path_m, Tolerances.corner_m, MIN_SLACK_S
    if said is not None:
        usual = said.tolerance_m, said.corner_m, said.min_slack_s
    given = options.path_m, options.corner_m, options.min_slack_s
    path_m, corner_m, slack_s = (
        value if one is None else one for one, value in zip(given, usual, strict=True)
    )
    return _Settled(Tolerances(path_m, corner_m), slack_s)


def _check(options: ExportOptions, settled: _Settled) -> None:
    for name, value, known in (
        ("--format", options.kind, FORMATS),
        ("--autopilot", options.autopilot, FIRMWARE),
    ):
        if value not in known:
            raise InputError(f"{name} {value[:40]!r}: take {', '.join(known)}")
    for name, value in (
        ("--tolerance", settled.tolerances.path_m),
        ("--corner", settled.tolerances.corner_m),
    ):
        if not 0.1 <= value <= MOST_TOLERANCE_M:
            raise InputError(f"{name} {value:g}: should be between 0.1 and {MOST_TOLERANCE_M:g}")
    if not 0.0 <= settled.min_slack_s <= 3_600.0:
        raise InputError(f"--min-slack {settled.min_slack_s:g}: should be between 0 and 3600")


def _as_asked(flight: Flight, track: Track, tolerances: Tolerances) -> Track:
    def fly(one: Track) -> Followed:
        return followed(one, flight.scenario, tolerances, Waits())

    return stopping(flight.scenario, track, tolerances.corner_m, fly)


def place_of_flight(flight: Flight, given: Place | None) -> Place:
    """Where on the Earth the origin of a flight is.

    Args:
        flight: The flight.
        given: For a scenario that does not say.

    Raises:
        InputError: Neither says where, or both do.
    """
    place, name = flight.scenario.place, flight.scenario.name
    if place is not None and given is not None:
        raise InputError(f"--place: scenario {name!r} has a [place] already; leave it out")
    found = place or given
    if found is None:
        raise InputError(f"scenario {name!r} has no [place] on the Earth; give --place LAT,LON")
    return found


def check_flight(flight: Flight) -> None:
    """Refuse a flight that is not home, or not without harm.

    Raises:
        InputError: It is.
    """
    for name, mode in zip(flight.names, flight.mode[-1], strict=True):
        if mode != LANDED:
            state = MODES[mode]
            state = "lost" if state == "lost" else "still in the air"
            raise InputError(f"{name} is {state} at the end of the flight; export one that is home")
    for i, name in enumerate(flight.names):
        drawn = np.flatnonzero(flight.current_A[:, i] > 0.0)
        if len(drawn) and len(drawn) <= drawn[-1] - drawn[0]:
            raise InputError(
                f"{name} lands and takes off again; export a flight without that, each sortie of "
                f"`run --sorties` for one ([sorties] with together = true)"
            )
    contacts = [violation for violation in flight.violations if violation.kind != LIMIT]
    if contacts:
        raise InputError(f"the flight has a contact ({contacts[0]}); export one without")


def _kept_apart(
    flight: Flight, tracks: Sequence[Track], frame: LocalFrame, settled: _Settled
) -> tuple[list[Exported], list[Pair]]:
    """The UAS with the waits that they need, and how late they may be then."""
    scenario, tolerances = flight.scenario, settled.tolerances
    exports = [exported(flight, track, frame, tolerances) for track in tracks]
    if scenario.execution is not None:  # waits are part of the plan then
        waits = [_flown_wait(flight, one) for one in exports]
        flown = [
            exported(flight, t, frame, tolerances, w) for t, w in zip(tracks, waits, strict=True)
        ]
        pairs = pairs_of(scenario, [(one.track.uas, one.followed) for one in flown])
        if not _short(pairs, settled.min_slack_s):
            return flown, pairs
    pairs = pairs_of(scenario, [(one.track.uas, one.followed) for one in exports])
    if not _short(pairs, settled.min_slack_s):
        return exports, pairs
    settle = partial(_apart, flight, settled)
    apart = in_layers(flight, settle(tracks), tolerances, settle)
    if apart.waits is not None:
        exports = [
            exported(flight, track, frame, tolerances, one)
            for track, one in zip(apart.tracks, apart.waits, strict=True)
        ]
        pairs = pairs_of(scenario, [(one.track.uas, one.followed) for one in exports])
    _check_slack(pairs, frame, settled.min_slack_s)
    return exports, pairs


def _flown_wait(flight: Flight, one: Exported) -> Waits:
    """How long a UAS waited in the flight before it took off."""
    first = int(np.flatnonzero(-one.track.flown_m[:, 2] >= LIFT_M)[0])
    began_s = float(one.followed.corner_s[0])
    return Waits(max(math.floor(first * flight.scenario.dt_s - began_s), 0))


def _apart(flight: Flight, settled: _Settled, tracks: Sequence[Track]) -> Apart:
    """Tracks with waits."""
    scenario = flight.scenario
    fleet = [
        (
            track.uas,
            partial(followed, track, scenario, settled.tolerances),
        )
        for track in tracks
    ]
    waits = separate(scenario, fleet, settled.min_slack_s)
    home_s = math.inf
    if waits is not None:
        home_s = max(fly(one).duration_s for (_, fly), one in zip(fleet, waits, strict=True))
    return Apart(list(tracks), waits, home_s)


def _short(pairs: Sequence[Pair], min_slack_s: float) -> list[Pair]:
    """The pairs in which one may be late by less than is asked."""
    return [p for p in pairs if p.slack_s is not None and p.slack_s < min_slack_s]


def _check_slack(pairs: Sequence[Pair], frame: LocalFrame, min_slack_s: float) -> None:
    short = _short(pairs, min_slack_s)
    if not short:
        return
    worst = min(short, key=lambda pair: pair.slack_s or 0.0)
    assert worst.place_m is not None
    latitude, longitude, height = frame.to_geodetic(worst.place_m).tolist()
    more = f" (+{len(short) - 1} more pairs)" if len(short) > 1 else ""
    raise InputError(
        f"{worst.names[0]} and {worst.names[1]} come closer than {worst.kept_m:.1f} m at "
        f"{latitude:.6f}, {longitude:.6f}, {height:.0f} m high, if one is {worst.slack_s:.1f} s "
        f"late, less than --min-slack {min_slack_s:g}{more}, and no wait on the ground or at a "
        f"corner, and no height layer, changes that; plan them further apart, or accept it with a "
        f"smaller --min-slack"
    )


def _unkept(flight: Flight, one: Exported) -> list[str]:
    """A time that was not planned as the scenario's `[execution]` asks."""
    planned_s = float(flight.last_sample[one.track.uas]) * flight.scenario.dt_s
    file_s = one.followed.duration_s
    if abs(file_s - planned_s) <= PROMISE * planned_s:
        return []
    return [
        f"{one.track.name}: the file takes {file_s:.0f} s, the flight {planned_s:.0f}; "
        f"plan for the autopilot with tour, trajectory or lawnmower"
    ]


def _notes(flight: Flight, exports: Sequence[Exported]) -> list[str]:
    scenario = flight.scenario
    notes = []
    if scenario.moving_obstacles:
        notes.append("files of legs carry no time: moving obstacles are not avoided")
    if scenario.wind is not None or scenario.uncertainty is not None or scenario.disturbances:
        notes.append("the report holds for still air, and for the vehicles as their files say")
    if scenario.execution is not None:
        notes += [line for one in exports for line in _unkept(flight, one)]
    for one in exports:
        notes += [f"{one.track.name} {line}" for line in waiting(one)]
        lost = one.point_of_no_return
        if lost is not None:
            notes.append(
                f"{one.track.name}: as an autopilot flies it, the charge does not suffice to come "
                f"home for sure after leg {lost + 1}, {one.charges[lost].time_s:.0f} s after "
                f"take-off"
            )
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
