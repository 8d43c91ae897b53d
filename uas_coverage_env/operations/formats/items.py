"""Mission items of MAVLink: what files for autopilots are made of."""

import math
from dataclasses import dataclass

from uas_coverage_env.operations.exported import Exported

WAYPOINT, LAND, TAKE_OFF, DELAY, CHANGE_SPEED, TRIGGER_DISTANCE = 16, 21, 22, 93, 178, 206
"""MAV_CMD."""

MISSION_FRAME, RELATIVE_FRAME = 2, 3
"""MAV_FRAME: no place; altitude relative to home."""

LATITUDE, LONGITUDE, ALTITUDE = 4, 5, 6
"""Places in the seven parameters of an item with a place."""

_NORTH_DEG = 0.0
"""Heading at waypoints, as the world flies: cameras keep their wide side from west to east. Without
one (NaN), an autopilot turns as it is set to, which is towards where it flies."""


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


def items_of(one: Exported, corner_m: float) -> list[Item]:
    """What is waited for, take-off, legs with their speeds and pictures, and landing.

    Args:
        one: The UAS.
        corner_m: How far from a corner it may pass [m].
    """
    latitude, longitude, height = one.geodetic(one.track.take_off_m)
    ground = float(latitude), float(longitude)
    anyhow = (0.0, 0.0, 0.0, math.nan)
    items = []
    if one.waits.start_s:  # the time of day is not what it waits for
        items.append(Item(DELAY, MISSION_FRAME, (one.waits.start_s, -1.0, -1.0, -1.0, 0, 0, 0)))
    items.append(Item(TAKE_OFF, RELATIVE_FRAME, (*anyhow, *ground, float(height))))
    set_mps, apart_m = None, 0.0
    heading_deg = math.nan if one.looks_ahead else _NORTH_DEG
    for n, (leg, speed_mps, hold_s) in enumerate(
        zip(one.track.legs, one.speeds_mps, one.holds_s, strict=True)
    ):
        if speed_mps != set_mps:
            items.append(Item(CHANGE_SPEED, MISSION_FRAME, (1.0, speed_mps, -1.0, 0, 0, 0, 0)))
            set_mps = speed_mps
        if one.triggers_m[n] != apart_m:
            apart_m = one.triggers_m[n]
            items.append(_trigger(apart_m))
        place = (float(number) for number in one.geodetic(leg.end_m))
        first = (hold_s, corner_m, 0.0, heading_deg)
        items.append(Item(WAYPOINT, RELATIVE_FRAME, (*first, *place)))
    if apart_m:
        items.append(_trigger(0.0))
    latitude, longitude, _ = one.geodetic(one.track.landing_m)
    items.append(Item(LAND, RELATIVE_FRAME, (*anyhow, float(latitude), float(longitude), 0.0)))
    return items


def _trigger(apart_m: float) -> Item:
    """A picture at once and then one each so many metres; 0 ends that."""
    return Item(TRIGGER_DISTANCE, MISSION_FRAME, (apart_m, 0.0, float(apart_m > 0.0), 0, 0, 0, 0))
