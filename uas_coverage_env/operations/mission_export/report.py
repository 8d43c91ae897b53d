"""What an export promises: charge per leg, point of no return, room, and how late a UAS may be."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from uas_coverage_env.flight import Flight
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.battery_use import BatteryUse
from uas_coverage_env.operations.mission_export.failure_responses import (
    failures_of,
    low_charge,
    not_safe,
)
from uas_coverage_env.operations.mission_export.formats.geofence import ZONES
from uas_coverage_env.operations.mission_export.mission_file import (
    ExportSettings,
    MissionFile,
    waiting,
    waypoint_margins,
)
from uas_coverage_env.operations.mission_export.scheduling import FlightFiles
from uas_coverage_env.planning.execution.lateness import Pair


def report(
    parts: Sequence[FlightFiles], frame: LocalFrame, settings: ExportSettings
) -> dict[str, Any]:
    """The report as plain data; times, charges and delays are those of the leg model.

    Args:
        parts: The flights of the mission, with their files.
        frame: Where on the Earth.
        settings: How it was exported.
    """
    flight, tolerances = parts[0].flight, settings.tolerances
    zones = [obstacle.kind in ZONES for obstacle in flight.scenario.obstacles]
    passed = [{w for one in part.exports for w in one.track.waypoints} for part in parts]
    return {
        "scenario": flight.scenario.name,
        "planner": flight.planner,
        "place": frame.place.model_dump(),
        "path_tolerance_m": tolerances.path_m,
        "corner_tolerance_m": tolerances.corner_m,
        "waypoints": len(flight.scenario.waypoints),
        "waypoints_passed": sum(map(len, passed)),
        "duration_s": round(max(part.lands_s for part in parts), 1),
        "zones": sum(zones),
        "obstacles_not_told": len(zones) - sum(zones),
        "uas": [_file(part, one, settings) for part, one in _in_order(parts)],
        "turnarounds": _turnarounds(parts),
        "pairs": [_pair(pair, frame) for part in parts for pair in part.pairs],
    }


def _in_order(parts: Sequence[FlightFiles]) -> list[tuple[FlightFiles, MissionFile]]:
    """The files, those of a UAS one after the other."""
    names = parts[0].flight.names
    return [(part, one) for name in names for part in parts for one in part.of(name)]


def _turnarounds(parts: Sequence[FlightFiles]) -> list[dict[str, Any]]:
    """What is to be done between the sorties of each UAS, in order of time."""
    found = []
    for (part, one), (next_part, after) in pairwise(_in_order(parts)):
        name = part.flight.names[one.track.uas]
        if next_part.flight.names[after.track.uas] == name:
            fresh = after.track.sortie.fresh
            found.append(
                {
                    "uas": name,
                    "landed": one.track.name,
                    "lands_s": round(one.lands_s, 1),
                    "soc_landed": round(one.still.soc_landed, 4),
                    "fresh_pack": fresh,
                    "next": after.track.name,
                    "soc_next": round(after.soc_0, 4),
                    "starts_s": after.begins_s,
                    "on_ground_s": round(after.begins_s - one.lands_s, 1),
                }
            )
    return sorted(found, key=lambda entry: entry["lands_s"])


def _file(part: FlightFiles, one: MissionFile, settings: ExportSettings) -> dict[str, Any]:
    flight: Flight = part.flight
    track, room = one.track, one.track.room
    sortie, dt_s = track.sortie, flight.scenario.dt_s
    margins = waypoint_margins(flight.scenario, one)
    return {
        "name": track.name,
        "uas": flight.names[track.uas],
        "sortie": track.number,
        "begins_s": one.begins_s,
        "lands_s": round(one.lands_s, 1),
        "planned_begins_s": part.flown_from_s + sortie.first * dt_s,
        "duration_s": round(one.followed.duration_s, 1),
        "planned_s": (sortie.landed - sortie.first) * dt_s,
        "soc_start": round(one.soc_0, 4),
        "soc_landed": round(one.still.soc_landed, 4),
        "planned_soc_landed": round(float(flight.soc[sortie.landed, track.uas]), 4),
        "soc_reserve": round(1.0 - flight.scenario.dod_landed[track.uas], 4),
        "off_path_m": round(track.off_m, 3),
        "spare_room_m": round(room.spare_m, 3),
        "room_to_contact_m": round(room.contact_m, 3),
        "stops": sum(hold_s > 0.0 for hold_s in one.holds_s),
        "start_delay_s": one.waits.start_s,
        "waits": waiting(one),
        "waypoints_passed": len(track.waypoints),
        "waypoints_not_as_asked": len(one.not_as_asked),
        "picture_each_m": min(filter(None, one.triggers_m), default=None),
        "waypoint_margin_m": round(min(margins), 3) if margins else None,
        "return_height_m": one.home.height_m,
        "low_charge": low_charge(one),
        "not_safe": list(not_safe(one)),
        "failures": dict(failures_of(one, px4=settings.px4)),
        **_charge(one, one.still),
        "in_wind": None if one.in_wind is None else _in_wind(one, one.in_wind),
        "legs": [_leg(one, n) for n in range(len(track.legs))],
    }


def _charge(one: MissionFile, battery_use: BatteryUse) -> dict[str, Any]:
    lost = battery_use.point_of_no_return
    return {
        "point_of_no_return": None if lost is None else _moment(one, battery_use, lost),
        "least_spare": _moment(one, battery_use, battery_use.tightest),
    }


def _in_wind(one: MissionFile, battery_use: BatteryUse) -> dict[str, Any]:
    return {
        "headwind_mps": round(battery_use.headwind_mps, 2),
        "soc_landed": round(battery_use.soc_landed, 4),
        **_charge(one, battery_use),
    }


def _moment(one: MissionFile, battery_use: BatteryUse, n: int) -> dict[str, Any]:
    charge = battery_use.legs[n]
    return {
        "leg": n + 1,
        "time_s": round(charge.time_s, 1),
        "spare": round(charge.spare, 4),
        "spare_s": round(charge.spare_s, 1),
        **_place(one.frame, one.track.legs[n].end_m),
    }


def _leg(one: MissionFile, n: int) -> dict[str, Any]:
    leg, charge = one.track.legs[n], one.still.legs[n]
    in_wind = None if one.in_wind is None else one.in_wind.legs[n]
    return {
        **_place(one.frame, leg.end_m),
        "speed_mps": one.speeds_mps[n],
        "stop": one.holds_s[n] > 0.0,
        "hold_s": one.holds_s[n],
        "time_s": round(charge.time_s, 1),
        "planned_s": charge.planned_s,
        "soc": round(charge.soc, 4),
        "planned_soc": round(charge.planned_soc, 4),
        "home": round(charge.home, 4),
        "spare": round(charge.spare, 4),
        "spare_s": round(charge.spare_s, 1),
        "spare_in_wind": None if in_wind is None else round(in_wind.spare, 4),
        "spare_room_m": round(leg.room.spare_m, 2),
    }


def _pair(pair: Pair, frame: LocalFrame) -> dict[str, Any]:
    return {
        "uas": list(pair.names),
        "kept_m": round(pair.kept_m, 2),
        "least_distance_m": round(pair.least_m, 2),
        "slack_s": None if pair.slack_s is None else round(pair.slack_s, 1),
        "place": None if pair.place_m is None else _place(frame, pair.place_m),
    }


def _place(frame: LocalFrame, place_m: Any) -> dict[str, float]:
    latitude, longitude, height = frame.to_geodetic(place_m).tolist()
    return {
        "latitude_deg": round(latitude, 8),
        "longitude_deg": round(longitude, 8),
        "height_m": round(height, 3),
    }
