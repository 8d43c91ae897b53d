"""One file of an export: its legs, how they are flown, and what that takes of the battery."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import Flight
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.battery_use import (
    BatteryUse,
    FailsafeLevels,
    battery_use,
    levels,
    worst_wind_mps,
)
from uas_coverage_env.operations.mission_export.return_paths import Other, ReturnPath, return_path
from uas_coverage_env.operations.mission_export.tracks import STOP_S, Tolerances, Track
from uas_coverage_env.operations.mission_export.waypoint_requirements import (
    most_mps,
    not_as_asked,
    triggers_m,
)
from uas_coverage_env.planning.execution.leg_model import Autopilot, Followed, follow, landing_s
from uas_coverage_env.planning.execution.separation import Waits
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams

_SLOWEST_MPS = 0.5
_SAME_SPEED_MPS, _SAME_SHARE = 0.5, 0.1
_LANDING = 1.1
"""Of the time that landing is expected to take, what is allowed for it."""


class ExportSettings(NamedTuple):
    """What options and scenario say together.

    Attributes:
        tolerances: How far an autopilot may be from the flight.
        min_slack_s: How late any UAS has to be able to be [s].
        wind_mps: The worst wind that charges are counted in; None: that of the scenario [m/s].
        px4: Whether PX4 flies the files; else, ArduPilot.
    """

    tolerances: Tolerances
    min_slack_s: float
    wind_mps: float | None = None
    px4: bool = False


class FileStart(NamedTuple):
    """How a file begins.

    Attributes:
        at_s: When it is started, on the clock of the mission [s].
        delay_s: How much later that is than the UAS could be started [s].
        soc: State of charge [-].
        soc_in_wind: The same, where all before was flown in the worst wind [-].
        others: Who is in the air at the same time.
    """

    at_s: float
    delay_s: float
    soc: float
    soc_in_wind: float
    others: tuple[Other, ...] = ()


@dataclass(frozen=True, eq=False)
class MissionFile:
    """One file of an export: a UAS from a take-off to the landing after it.

    Attributes:
        track: Its legs.
        begins_s: When it is started, on the clock of the mission [s].
        delay_s: How much later that is than the UAS could be started, for others [s].
        soc_0: State of charge at the start [-].
        speeds_mps: (legs,) as the file sets them [m/s].
        holds_s: (legs,) how long it stops at the end of each; 0: it flies on [s].
        waits: Where it waits for others.
        followed: How an autopilot flies them.
        still: What that takes of the battery, in still air.
        in_wind: The same in the worst wind; None: there is none.
        home: The way home when something fails.
        levels: At what charge it is flown.
        vehicle: Its vehicle.
        frame: Where it is on the Earth.
        looks_ahead: Whether it looks where it flies; else, north.
        not_as_asked: Waypoints not passed within the radius, speed and heights they ask for.
        triggers_m: (legs,) how far apart pictures are taken; 0: none are [m].
    """

    track: Track
    begins_s: float
    delay_s: float
    soc_0: float
    speeds_mps: tuple[float, ...]
    holds_s: tuple[float, ...]
    waits: Waits
    followed: Followed
    still: BatteryUse
    in_wind: BatteryUse | None
    home: ReturnPath
    levels: FailsafeLevels
    vehicle: VehicleParams
    frame: LocalFrame
    looks_ahead: bool
    not_as_asked: tuple[int, ...]
    triggers_m: tuple[float, ...]

    @property
    def lands_s(self) -> float:
        """When it has landed, on the clock of the mission [s]."""
        return self.begins_s + self.followed.duration_s

    def geodetic(self, places_m: Any) -> NDArray[np.float64]:
        """(..., 3) latitude, longitude [degrees], altitude above the ground of home [m]."""
        return self.frame.to_geodetic(places_m)


def followed(track: Track, scenario: Scenario, tolerances: Tolerances, waits: Waits) -> Followed:
    """How an autopilot flies the file of a track: it waits for others when it has taken off.

    Args:
        track: The track.
        scenario: Whose vehicles have the autopilot's limits, and whose waypoints ask for speeds.
        tolerances: How far from a corner it may pass.
        waits: Where it waits for others.
    """
    return follow(
        track.corners_m,
        file_speeds(track, scenario),
        file_holds(track, waits),
        Autopilot.of(scenario.vehicles[track.uas], tolerances.corner_m),
        hover_s=waits.start_s,
    )


def mission_file(
    flight: Flight,
    track: Track,
    frame: LocalFrame,
    settings: ExportSettings,
    waits: Waits,
    start: FileStart,
) -> MissionFile:
    """What there is to say about a track.

    Args:
        flight: What was flown.
        track: A sortie of it.
        frame: Where on the Earth.
        settings: How it is exported.
        waits: Where it waits for others.
        start: When it is started, and how much is in its battery.
    """
    scenario, uas = flight.scenario, flight.scenario.uas[track.uas]
    vehicle, corner_m = scenario.vehicles[track.uas], settings.tolerances.corner_m
    flown = followed(track, scenario, settings.tolerances, waits)
    speeds_mps, holds_s = file_speeds(track, scenario), file_holds(track, waits)
    by, wind_mps = Autopilot.of(vehicle, corner_m), settings.wind_mps
    wind_mps = worst_wind_mps(scenario, track) if wind_mps is None else wind_mps
    home = return_path(
        *(scenario, track, flown, by),
        holds_s=holds_s,
        begins_s=start.at_s,
        others=start.others,
        nearer_end=settings.px4,
    )
    take = partial(battery_use, flight, track, flown, speeds_mps, home)
    still = take(start.soc)
    in_wind = take(start.soc_in_wind, wind_mps) if wind_mps else None
    highest_m = max(-float(flown.places_m[:, 2].min()), home.height_m or 0.0)
    lands_s = _LANDING * landing_s(highest_m, by)
    limits = {
        "dod_max": scenario.dod_landed[track.uas],
        "soc_start": start.soc,
        "soc_fresh": uas.soc_0,
    }
    return MissionFile(
        track=track,
        begins_s=start.at_s,
        delay_s=start.delay_s,
        soc_0=start.soc,
        speeds_mps=speeds_mps,
        holds_s=holds_s,
        waits=waits,
        followed=flown,
        still=still,
        in_wind=in_wind,
        home=home,
        levels=levels(vehicle, in_wind or still, lands_s, **limits),
        vehicle=vehicle,
        frame=frame,
        looks_ahead=uas.heading == "course",
        not_as_asked=tuple(not_as_asked(scenario, track, flown)),
        triggers_m=triggers_m(scenario, track, corner_m),
    )


def file_speeds(track: Track, scenario: Scenario) -> tuple[float, ...]:
    """Speed of each leg [m/s]: changed only where it matters, each change is an item of its own.

    Never above what waypoints on a leg ask for (`asked.most_mps`).
    """
    speeds: list[float] = []
    for leg, most in zip(track.legs, most_mps(scenario, track), strict=True):
        wanted = min(round(max(leg.speed_mps, _SLOWEST_MPS), 1), most)
        last = speeds[-1] if speeds else math.inf
        same = abs(wanted - last) <= min(_SAME_SPEED_MPS, _SAME_SHARE * wanted)
        speeds.append(last if same and last <= most else wanted)
    return tuple(speeds)


def file_holds(track: Track, waits: Waits) -> tuple[float, ...]:
    """How long the UAS stops at the end of each leg [s]."""
    holds_s = [STOP_S * leg.stop for leg in track.legs]
    if waits.leg is not None:
        holds_s[waits.leg] = STOP_S + waits.hold_s
    return tuple(holds_s)


def waiting(one: MissionFile) -> list[str]:
    """What a UAS does for others to be out of its way, as phrases that follow its name."""
    lines, waits = [], one.waits
    if one.track.layer:
        lines.append(one.track.layer)
    if waits.start_s:
        lines.append(f"hovers for {waits.start_s} s where its take-off ends")
    if one.delay_s:
        lines.append(f"is started {one.delay_s:.0f} s later than it could be")
    if waits.leg is not None:
        lines.append(f"waits {waits.hold_s} s longer at the end of leg {waits.leg + 1}")
    return lines


def waypoint_margins(scenario: Scenario, one: MissionFile) -> Sequence[float]:
    """How much closer than its radius the legs pass each waypoint that they cover [m]."""
    radii = [scenario.waypoints[w].radius_m for w in one.track.waypoints]
    return [r - away for r, away in zip(radii, one.track.passed_m.tolist(), strict=True)]
