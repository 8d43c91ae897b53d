"""What an export promises: charge per leg, point of no return, room, and how late a UAS may be."""

from collections.abc import Sequence
from typing import Any

from uas_coverage_env.flight import Flight
from uas_coverage_env.mission.lateness import Pair
from uas_coverage_env.operations.exported import Exported, waiting, waypoint_margins
from uas_coverage_env.operations.frame import LocalFrame
from uas_coverage_env.operations.tracks import Tolerances


def report(
    flight: Flight,
    exports: Sequence[Exported],
    pairs: Sequence[Pair],
    frame: LocalFrame,
    tolerances: Tolerances,
) -> dict[str, Any]:
    """The report as plain data; times, charges and delays are those of the leg model.

    Args:
        flight: What was exported.
        exports: The UAS that fly.
        pairs: How late they may be.
        frame: Where on the Earth.
        tolerances: Those of the export.
    """
    scenario = flight.scenario
    passed = {w for one in exports for w in one.track.waypoints}
    return {
        "scenario": scenario.name,
        "planner": flight.planner,
        "place": frame.place.model_dump(),
        "path_tolerance_m": tolerances.path_m,
        "corner_tolerance_m": tolerances.corner_m,
        "waypoints": len(scenario.waypoints),
        "waypoints_passed": len(passed),
        "uas": [_uas(flight, one) for one in exports],
        "pairs": [_pair(pair, frame) for pair in pairs],
    }


def _uas(flight: Flight, one: Exported) -> dict[str, Any]:
    track, room = one.track, one.track.room
    lost = one.point_of_no_return
    tightest = min(range(len(one.charges)), key=lambda n: one.charges[n].spare)
    margins = waypoint_margins(flight.scenario, one)
    return {
        "name": track.name,
        "duration_s": round(one.followed.duration_s, 1),
        "planned_s": float(flight.last_sample[track.uas]) * flight.scenario.dt_s,
        "soc_landed": round(one.soc_landed, 4),
        "planned_soc_landed": round(float(flight.soc[-1, track.uas]), 4),
        "soc_reserve": round(1.0 - flight.scenario.uas[track.uas].dod_max, 4),
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
        "return_height_m": one.return_m,
        "point_of_no_return": None if lost is None else _moment(one, lost),
        "least_spare": _moment(one, tightest),
        "legs": [_leg(one, n) for n in range(len(track.legs))],
    }


def _moment(one: Exported, n: int) -> dict[str, Any]:
    charge = one.charges[n]
    return {
        "leg": n + 1,
        "time_s": round(charge.time_s, 1),
        "spare": round(charge.spare, 4),
        "spare_s": round(charge.spare_s, 1),
        **_place(one.frame, one.track.legs[n].end_m),
    }


def _leg(one: Exported, n: int) -> dict[str, Any]:
    leg, charge = one.track.legs[n], one.charges[n]
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
