"""The files of a flight on one clock: when each is started, and how late its UAS may be.

Files carry no time. Those with which UAS take off first are started together; one that a UAS flies
afterwards is started when it has been on the ground for as long as in the flight. Waits and height
layers are put in where UAS that are late would come too close.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.take_offs import TAKE_OFF_HEIGHT_M
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.height_layers import Schedule, in_layers
from uas_coverage_env.operations.mission_export.mission_file import (
    ExportSettings,
    FileStart,
    MissionFile,
    followed,
    mission_file,
)
from uas_coverage_env.operations.mission_export.return_paths import Other
from uas_coverage_env.operations.mission_export.tracks import Tolerances, Track
from uas_coverage_env.planning.execution.lateness import Pair, Timed, kept_m, pairs_of
from uas_coverage_env.planning.execution.leg_model import Followed
from uas_coverage_env.planning.execution.separation import Waits, ready_s, separate


@dataclass(frozen=True, eq=False)
class FlightFiles:
    """A flight of a mission, with the files made of it.

    Attributes:
        flight: What was flown; all its UAS begin at the same time.
        exports: The files, those of a UAS one after the other.
        pairs: How late UAS may be, for files that overlap in time.
        flown_from_s: When the flight began, on the clock by which the mission was planned [s].
    """

    flight: Flight
    exports: list[MissionFile]
    pairs: list[Pair]
    flown_from_s: float

    @property
    def lands_s(self) -> float:
        """When all have landed, on the clock of the mission [s]."""
        return max(one.lands_s for one in self.exports)

    def of(self, name: str) -> list[MissionFile]:
        """The files of a UAS, one after the other."""
        return [one for one in self.exports if self.flight.names[one.track.uas] == name]


class FlightStart(NamedTuple):
    """When a flight of a mission begins.

    Attributes:
        at_s: On the clock of the mission, by the files [s].
        flown_s: By which it was planned [s].
    """

    at_s: float = 0.0
    flown_s: float = 0.0


def scheduled(
    flight: Flight,
    tracks: Sequence[Track],
    frame: LocalFrame,
    settings: ExportSettings,
    begins: FlightStart,
) -> FlightFiles:
    """The files of a flight with the waits that they need, and how late UAS may be then.

    Args:
        flight: What was flown.
        tracks: Its sorties, those of a UAS one after the other.
        frame: Where on the Earth.
        settings: How.
        begins: When the flight begins.

    Raises:
        InputError: Two UAS would come too close if one of them were late by less than asked,
            wherever they wait for each other.
    """
    scenario, tolerances = flight.scenario, settings.tolerances

    def laid(tracks: Sequence[Track], waits: Sequence[Waits]) -> FlightFiles:
        exports = _exports(flight, tracks, frame, settings, waits, begins.at_s)
        return FlightFiles(flight, exports, pairs_of(scenario, timed(exports)), begins.flown_s)

    part = laid(tracks, [Waits()] * len(tracks))
    if scenario.execution is not None:  # waits are part of the plan then
        flown = laid(tracks, [_flown_wait(flight, one) for one in part.exports])
        if not _short(flown.pairs, settings.min_slack_s):
            return _reported(flown, settings.min_slack_s)
    if _short(part.pairs, settings.min_slack_s):
        settle = partial(_schedule, flight, settings, begins.at_s)
        apart = in_layers(flight, settle(tracks), tolerances, settle)
        if apart.waits is not None:
            part = laid(apart.tracks, apart.waits)
        check_slack(part.pairs, frame, settings.min_slack_s)
    return _reported(part, settings.min_slack_s)


def timed(exports: Sequence[MissionFile]) -> list[Timed]:
    """Files on the clock of the mission.

    Args:
        exports: Those of a UAS one after the other.
    """
    result = []
    for n, one in enumerate(exports):
        before = next((e for e in exports[:n][::-1] if e.track.uas == one.track.uas), None)
        after = next((e for e in exports[n + 1 :] if e.track.uas == one.track.uas), None)
        result.append(
            Timed(
                uas=one.track.uas,
                name=one.track.name,
                followed=one.followed,
                begins_s=one.begins_s,
                since_s=one.begins_s if before is None else before.lands_s,
                until_s=math.inf if after is None else after.begins_s,
            )
        )
    return result


def _starts(
    tracks: Sequence[Track], flown: Sequence[Followed], waits: Sequence[Waits], begins_s: float
) -> list[tuple[float, Waits]]:
    """When each file is started [s], and what waits are in it."""
    landed_s: dict[int, float] = {}
    result = []
    for track, one, wait in zip(tracks, flown, waits, strict=True):
        at_s = begins_s
        if track.uas in landed_s:  # then it waits before it is started
            at_s = ready_s(landed_s[track.uas], track.sortie.rest_s) + wait.start_s
            wait = replace(wait, start_s=0)
        landed_s[track.uas] = at_s + one.duration_s
        result.append((at_s, wait))
    return result


def _flown(
    flight: Flight, tracks: Sequence[Track], tolerances: Tolerances, waits: Sequence[Waits]
) -> list[Followed]:
    """How the files are flown; a UAS waits in its first one, later ones are started later."""
    seen: set[int] = set()
    result = []
    for track, wait in zip(tracks, waits, strict=True):
        inside = replace(wait, start_s=0) if track.uas in seen else wait
        seen.add(track.uas)
        result.append(followed(track, flight.scenario, tolerances, inside))
    return result


def _exports(
    flight: Flight,
    tracks: Sequence[Track],
    frame: LocalFrame,
    settings: ExportSettings,
    waits: Sequence[Waits],
    begins_s: float,
) -> list[MissionFile]:
    flown = _flown(flight, tracks, settings.tolerances, waits)
    starts = _starts(tracks, flown, waits, begins_s)
    last: dict[int, MissionFile] = {}
    result = []
    for track, (at_s, inside), wait in zip(tracks, starts, waits, strict=True):
        before = last.get(track.uas)
        soc = soc_in_wind = flight.scenario.uas[track.uas].soc_0
        if before is not None and not track.sortie.fresh:
            on_ground = flight.soc[before.track.sortie.landed : track.sortie.first + 1, track.uas]
            used = float(on_ground[0] - on_ground[-1])
            soc = before.still.soc_landed - used
            soc_in_wind = (before.in_wind or before.still).soc_landed - used
        others = tuple(
            Other(o.name, f, o_at_s, kept_m(flight.scenario, track.uas, o.uas))
            for o, f, (o_at_s, _) in zip(tracks, flown, starts, strict=True)
            if o.uas != track.uas
        )
        start = FileStart(at_s, float(wait.start_s - inside.start_s), soc, soc_in_wind, others)
        one = mission_file(flight, track, frame, settings, inside, start)
        last[track.uas] = one
        result.append(one)
    return result


def _flown_wait(flight: Flight, one: MissionFile) -> Waits:
    """How long a UAS waited in the flight before it set out."""
    first = int(np.flatnonzero(-one.track.flown_m[:, 2] >= TAKE_OFF_HEIGHT_M)[0])
    began_s = float(one.followed.corner_s[0])
    return Waits(max(math.floor(first * flight.scenario.dt_s - began_s), 0))


def _schedule(
    flight: Flight, settings: ExportSettings, begins_s: float, tracks: Sequence[Track]
) -> Schedule:
    """Tracks with waits."""
    scenario = flight.scenario
    fleet = [
        (track.uas, partial(followed, track, scenario, settings.tolerances)) for track in tracks
    ]
    pauses_s = [track.sortie.rest_s for track in tracks]
    waits = separate(scenario, fleet, settings.min_slack_s, pauses_s, in_hover=True)
    home_s = math.inf
    if waits is not None:
        flown = _flown(flight, tracks, settings.tolerances, waits)
        starts = _starts(tracks, flown, waits, begins_s)
        home_s = max(at_s + f.duration_s for (at_s, _), f in zip(starts, flown, strict=True))
    return Schedule(list(tracks), waits, home_s)


def _short(pairs: Sequence[Pair], min_slack_s: float) -> list[Pair]:
    """The pairs in which one may be late by less than is asked."""
    return [p for p in pairs if p.slack_s is not None and p.slack_s < min_slack_s]


def _reported(part: FlightFiles, min_slack_s: float) -> FlightFiles:
    """A part without the pairs of files that are never flown at the same time."""
    clock = {one.name: one for one in timed(part.exports)}

    def meet(pair: Pair) -> bool:
        one, other = (clock[name] for name in pair.names)
        gap_s = max(one.begins_s - other.lands_s, other.begins_s - one.lands_s)
        return gap_s <= min_slack_s or (pair.slack_s is not None and pair.slack_s < min_slack_s)

    return replace(part, pairs=[pair for pair in part.pairs if meet(pair)])


def check_slack(pairs: Sequence[Pair], frame: LocalFrame, min_slack_s: float) -> None:
    """Refuse too little slack.

    Raises:
        InputError: In some pair one may be late by less than is asked.
    """
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
        f"late, less than --min-slack {min_slack_s:g}{more}, and no wait after take-off or at a "
        f"corner, and no height layer, changes that; plan them further apart, or accept it with a "
        f"smaller --min-slack"
    )
