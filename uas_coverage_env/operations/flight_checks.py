"""Flights that may be flown again: home without harm, at a place on the Earth."""

import math

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import MODES, Flight
from uas_coverage_env.flight.record import LANDED, LIMIT
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.scenario import Place

_ROUNDING = 1e-6


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
    homes_m = SceneHistory.of(flight).home_m[-1]  # where an event has closed one, it is another
    for i, name in enumerate(flight.names):
        away_m = math.dist(flight.x[-1, i, :2], homes_m[i, :2])
        if away_m > flight.scenario.landing_distance_m + _ROUNDING:
            raise InputError(
                f"{name} lands {away_m:.0f} m from its home; export a flight that ends there"
            )
    contacts = [violation for violation in flight.violations if violation.kind != LIMIT]
    if contacts:
        raise InputError(f"the flight has a contact ({contacts[0]}); export one without")
