"""The fleet of an imported mission: which vehicles, and where each takes off."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.vehicle import VehicleParams, load_vehicle, vehicle_names

MOST_UAS = 50
START_HEIGHT_M = 1.0
"""Of a start above the ground, as in the shipped scenarios [m]."""

SPARE_M = 1.0
"""Between two UAS that share a take-off place, beyond what they keep from each other."""


class Member(NamedTuple):
    """One UAS of a fleet.

    Attributes:
        vehicle: A shipped vehicle, or a file.
        camera: A camera, or a file; None: the usual one.
    """

    vehicle: str
    camera: str | None = None


def parse_fleet(text: str) -> list[Member]:
    """`s500_v2:2,mine.toml+mavic3e:1` as one entry per UAS; vehicle files as absolute paths.

    Raises:
        InputError: It is no fleet, or a vehicle is wrong.
    """
    fleet: list[Member] = []
    for part in text.split(","):
        carrier, _, count = part.strip().partition(":")
        name, plus, camera = carrier.partition("+")
        wrong = not name or (plus and not camera)
        if wrong or (count and not count.isdecimal()) or (count and int(count[:4]) < 1):
            raise InputError(
                f"--fleet {text[:80]!r}: should be VEHICLE:COUNT,... as in s500_v2:2, or "
                f"VEHICLE+CAMERA:COUNT"
            )
        if name not in vehicle_names() and name.endswith(".toml"):
            name = str(Path(name).resolve())
        load_vehicle(name)
        fleet += [Member(name, camera or None)] * int(count[:4] or 1)
    if len(fleet) > MOST_UAS:
        raise InputError(f"--fleet {text[:80]!r}: more than {MOST_UAS} UAS; take fewer")
    return fleet


def radius_m(vehicle: VehicleParams) -> float:
    """Of the sphere that holds a machine: arm and propeller, rounded up to 1 cm [m]."""
    reach_m = vehicle.airframe.arm_m + vehicle.rotor.propeller_radius_m
    return math.ceil(100.0 * reach_m - 1e-9) / 100.0


def fleet_tables(
    fleet: Sequence[str],
    places_m: Sequence[tuple[float, float]],
    safe_distance_m: float,
    spare_m: float = SPARE_M,
) -> list[dict[str, Any]]:
    """The tables `[[uas]]`; UAS that share a place stand in a row to the east of it.

    Args:
        fleet: Vehicle of each.
        places_m: East and north of the take-off places [m]; at least one.
        safe_distance_m: Kept between two UAS in addition to their radii [m].
        spare_m: Between two that share a place, beyond that [m].
    """
    vehicles = [load_vehicle(name) for name in fleet]
    step_m = 2.0 * max(map(radius_m, vehicles)) + safe_distance_m + spare_m
    tables = []
    for n, (name, vehicle) in enumerate(zip(fleet, vehicles, strict=True)):
        row, place = divmod(n, len(places_m))
        east_m, north_m = places_m[place]
        start_m = (north_m, east_m + row * step_m, -START_HEIGHT_M)
        tables.append(
            {
                "name": f"uas_{n + 1}",
                "vehicle": name,
                "start_m": [round(value, 3) for value in start_m],
                "soc_0": 1.0,
                "radius_m": radius_m(vehicle),
                "dod_max": vehicle.battery.dod_max,
            }
        )
    return tables
