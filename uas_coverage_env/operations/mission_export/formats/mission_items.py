"""Mission items of MAVLink: what files for autopilots are made of."""

import math
from dataclasses import dataclass

from uas_coverage_env.operations.mission_export.mission_file import MissionFile

WAYPOINT, LAND, TAKE_OFF, YAW, CHANGE_SPEED, TRIGGER_DISTANCE = 16, 21, 22, 115, 178, 206
"""MAV_CMD."""

MISSION_FRAME, RELATIVE_FRAME = 2, 3
"""MAV_FRAME: no place; altitude relative to home."""

LATITUDE, LONGITUDE, ALTITUDE = 4, 5, 6
"""Places in the seven parameters of an item with a place."""

_NORTH_DEG = 0.0
"""Heading, as the world flies: cameras keep their wide side from west to east. Without one, an
autopilot turns as it is set to, which is towards where it flies. PX4 takes it from each waypoint.
ArduCopter drops it there: it turns once, by an item, and keeps it where `WP_YAW_BEHAVIOR` is 0."""


@dataclass(frozen=True)
class Item:
    """One mission item.

    Attributes:
        command: MAV_CMD.
        frame: MAV_FRAME.
        params: Seven; NaN: as it is. The last three are of a place, see `LATITUDE`.
    """

    command: int
    frame: int
    params: tuple[float, ...]


def items_of(one: MissionFile, corner_m: float, *, px4: bool) -> list[Item]:
    """Take-off, the wait for others, legs with their speeds and pictures, and landing.

    A wait is a stay at a waypoint: one on the ground would pass while a vehicle in AUTO is not
    armed yet.

    Args:
        one: The UAS.
        corner_m: How far from a corner it may pass [m].
        px4: Whether PX4 flies it; else, ArduPilot.
    """
    latitude, longitude, height = one.geodetic(one.track.take_off_m)
    ground = float(latitude), float(longitude)
    anyhow = (0.0, 0.0, 0.0, math.nan)
    items = [Item(TAKE_OFF, RELATIVE_FRAME, (*anyhow, *ground, float(height)))]
    turns = not px4 and not one.looks_ahead
    heading_deg = _NORTH_DEG if px4 and not one.looks_ahead else math.nan
    if one.waits.start_s:
        items += [_turn()] * turns
        turns = False
        stay = float(one.waits.start_s), corner_m, 0.0, heading_deg
        items.append(Item(WAYPOINT, RELATIVE_FRAME, (*stay, *ground, float(height))))
    set_mps, apart_m = None, 0.0
    for n, (leg, speed_mps, hold_s) in enumerate(
        zip(one.track.legs, one.speeds_mps, one.holds_s, strict=True)
    ):
        if speed_mps != set_mps:
            items.append(Item(CHANGE_SPEED, MISSION_FRAME, (1.0, speed_mps, -1.0, 0, 0, 0, 0)))
            set_mps = speed_mps
        if one.triggers_m[n] != apart_m:
            apart_m = one.triggers_m[n]
            items.append(_trigger(apart_m))
        if turns:  # after what does not take time: it would keep that from being done
            items.append(_turn())
            turns = False
        place = (float(number) for number in one.geodetic(leg.end_m))
        first = (hold_s, corner_m, 0.0, heading_deg)
        items.append(Item(WAYPOINT, RELATIVE_FRAME, (*first, *place)))
    if apart_m:
        items.append(_trigger(0.0))
    latitude, longitude, _ = one.geodetic(one.track.landing_m)
    items.append(Item(LAND, RELATIVE_FRAME, (*anyhow, float(latitude), float(longitude), 0.0)))
    return items


def _turn() -> Item:
    """North, at the vehicle's own rate, whichever way is shorter."""
    return Item(YAW, MISSION_FRAME, (_NORTH_DEG, 0.0, 0.0, 0.0, 0, 0, 0))


def _trigger(apart_m: float) -> Item:
    """A picture at once and then one each so many metres; 0 ends that."""
    return Item(TRIGGER_DISTANCE, MISSION_FRAME, (apart_m, 0.0, float(apart_m > 0.0), 0, 0, 0, 0))
