"""One file of an export: its legs, how they are flown, and what that takes of the battery."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight import Flight
from uas_coverage_env.mission.leg_model import Autopilot, Followed, follow
from uas_coverage_env.mission.separation import Waits
from uas_coverage_env.operations.asked import most_mps, not_as_asked, triggers_m
from uas_coverage_env.operations.charge import Charged, charged, worst_wind_mps
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.room import Surroundings
from uas_coverage_env.operations.tracks import LIFT_M, STOP_S, Tolerances, Track
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams

_SLOWEST_MPS = 0.5
_SAME_SPEED_MPS, _SAME_SHARE = 0.5, 0.1
_LEAST_RETURN_M = 15.0
_ABOVE_ROOFS_M = 1.0
_EVERY = 5


class Start(NamedTuple):
    """How a file begins.

    Attributes:
        at_s: When it is started, on the clock of the mission [s].
        delay_s: How much later that is than the UAS could be started [s].
        soc: State of charge [-].
        soc_in_wind: The same, where all before was flown in the worst wind [-].
    """

    at_s: float
    delay_s: float
    soc: float
    soc_in_wind: float


@dataclass(frozen=True, eq=False)
class Exported:
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
        return_m: Height at which flying straight home is clear from everywhere on the path [m];
            None where there is none below the fence's top.
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
    still: Charged
    in_wind: Charged | None
    return_m: float | None
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
    """How an autopilot flies the file of a track.

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
        waits.start_s,
    )


def exported(
    flight: Flight,
    track: Track,
    frame: LocalFrame,
    tolerances: Tolerances,
    waits: Waits = Waits(),  # noqa: B008 (immutable)
    start: Start | None = None,
    wind_mps: float | None = None,
) -> Exported:
    """What there is to say about a track.

    Args:
        flight: What was flown.
        track: A sortie of it.
        frame: Where on the Earth.
        tolerances: Those of the export.
        waits: Where it waits for others.
        start: When it is started, and how much is in its battery; None: first of all, as planned.
        wind_mps: The worst wind; None: that of the scenario [m/s].
    """
    scenario, vehicle = flight.scenario, flight.scenario.vehicles[track.uas]
    soc_0 = scenario.uas[track.uas].soc_0
    begins = start or Start(0.0, 0.0, soc_0, soc_0)
    flown, speeds_mps = followed(track, scenario, tolerances, waits), file_speeds(track, scenario)
    wind_mps = worst_wind_mps(scenario, track) if wind_mps is None else wind_mps
    take = partial(charged, flight, track, flown, speeds_mps, waits.start_s)
    return Exported(
        track=track,
        begins_s=begins.at_s,
        delay_s=begins.delay_s,
        soc_0=begins.soc,
        speeds_mps=speeds_mps,
        holds_s=file_holds(track, waits),
        waits=waits,
        followed=flown,
        still=take(begins.soc),
        in_wind=take(begins.soc_in_wind, wind_mps) if wind_mps else None,
        return_m=return_height_m(scenario, track),
        vehicle=vehicle,
        frame=frame,
        looks_ahead=scenario.uas[track.uas].heading == "course",
        not_as_asked=tuple(not_as_asked(scenario, track, flown)),
        triggers_m=triggers_m(scenario, track, tolerances.corner_m),
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


def return_height_m(scenario: Scenario, track: Track) -> float | None:
    """A height at which climbing and flying straight home is clear from everywhere on a path.

    "Return to launch" of an autopilot flies like this. Where no height is clear, the way back that
    is known to be is the way there.
    """
    around = Surroundings(scenario, track.uas)
    top_m = -float(scenario.fence.vertices_m[:, 2].min()) - scenario.geofence.margin_m
    roofs_m = {
        -float(hull.vertices_m[:, 2].min()) + obstacle.safe_distance_m + _ABOVE_ROOFS_M
        for hull, obstacle in zip(scenario.hulls, scenario.obstacles, strict=True)
    }
    places = track.flown_m[-track.flown_m[:, 2] >= LIFT_M][::_EVERY]
    for height_m in sorted({_LEAST_RETURN_M, *roofs_m}):
        if _LEAST_RETURN_M <= height_m <= top_m and all(
            _returns(around, place, track.landing_m, height_m) for place in places
        ):
            return height_m
    return None


def _returns(
    around: Surroundings,
    place: NDArray[np.float64],
    landing_m: NDArray[np.float64],
    height_m: float,
) -> bool:
    up = np.array([*place[:2], min(float(place[2]), -height_m)])
    above = np.array([*landing_m[:2], up[2]])
    ways = ((place, up), (up, above), (above, landing_m - (0.0, 0.0, LIFT_M)))
    return all(around.room(a, b, 1.0).contact_m > 0.0 for a, b in ways)


def waiting(one: Exported) -> list[str]:
    """What a UAS does for others to be out of its way, as phrases that follow its name."""
    lines, waits = [], one.waits
    if one.track.layer:
        lines.append(one.track.layer)
    if waits.start_s:
        lines.append(f"takes off {waits.start_s} s after the start of its mission")
    if one.delay_s:
        lines.append(f"is started {one.delay_s:.0f} s later than it could be")
    if waits.leg is not None:
        lines.append(f"waits {waits.hold_s} s longer at the end of leg {waits.leg + 1}")
    return lines


def waypoint_margins(scenario: Scenario, one: Exported) -> Sequence[float]:
    """How much closer than its radius the legs pass each waypoint that they cover [m]."""
    radii = [scenario.waypoints[w].radius_m for w in one.track.waypoints]
    return [r - away for r, away in zip(radii, one.track.passed_m.tolist(), strict=True)]
