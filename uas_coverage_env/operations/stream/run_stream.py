"""A flight directory's plan, streamed to the vehicles that are connected."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import ExitStack, closing

from uas_coverage_env.files.errors import InputError, check_within
from uas_coverage_env.files.suggestions import check_choice
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.take_offs import sorties_of
from uas_coverage_env.operations.flight_checks import check_flight
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.stream.clock import Clock
from uas_coverage_env.operations.stream.companion import Companion, Ended, StreamOptions
from uas_coverage_env.operations.stream.fleet import Fleet
from uas_coverage_env.operations.stream.giving_up import REACTIONS
from uas_coverage_env.operations.stream.link import VehicleLink, check_address
from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings
from uas_coverage_env.operations.stream.time_scaling import SHARE, Pace
from uas_coverage_env.operations.stream.timeline import Timeline, timeline_of
from uas_coverage_env.operations.stream.vehicle_limits import Limits
from uas_coverage_env.scenario import Place, Scenario

_SETS_OFF_S = 5.0
"""That many seconds are always allowed: a short flight takes longer by setting off."""


def stream_flight(
    flight: Flight,
    place: Place,
    connections: Mapping[str, str],
    options: StreamOptions,
    clock: Clock,
    tell: Callable[[str], None],
) -> tuple[Ended, str]:
    """Fly a plan by position targets in time.

    Args:
        flight: In which all UAS have landed, without a contact.
        place: Where its origin is on the Earth.
        connections: Address of each UAS that flies.
        options: How.
        clock: What tells the time.
        tell: Called with lines for the user.

    Returns:
        How it has ended, and what was flown as a table that `log` reads.

    Raises:
        InputError: The flight, a connection or an option is wrong, or the plan needs more than the
            vehicles can do.
    """
    _check(options)
    for name, address in connections.items():
        check_address(name, address)
    check_flight(flight)
    plans = _plans(flight)
    unknown = [name for name in connections if name not in plans]
    if unknown:
        raise InputError(
            f"--connect {unknown[0][:40]}: does not fly in this flight; take {', '.join(plans)}"
        )
    missing = [name for name in plans if name not in connections]
    if missing:
        raise InputError(f"{missing[0]} has no vehicle; add --connect {missing[0]}=udp:HOST:PORT")
    frame = LocalFrame(place)
    with ExitStack() as stack:
        links = {
            name: stack.enter_context(closing(VehicleLink(name, connections[name], frame)))
            for name in plans
        }
        fleet = Fleet(links, clock, tell)
        companion = Companion(
            plans,
            fleet,
            SwarmSurroundings(flight.scenario, list(plans)),
            options,
            _may_hurry(flight.scenario),
            lambda pace, limits: _check_pace(plans, pace, limits, options.late),
        )
        ended = companion.fly()
    return ended, _table(fleet, frame)


def _plans(flight: Flight) -> dict[str, Timeline]:
    plans = {}
    for u, name in enumerate(flight.names):
        if len(sorties_of(flight, u)) > 1:
            raise InputError(
                f"{name} lands and takes off again, which stream cannot wait for; stream each "
                f"sortie of `run --sorties` ([sorties] with together = true), or export files"
            )
        plan = timeline_of(flight, u)
        if plan is not None:
            plans[name] = plan
    if not plans:
        raise InputError("no UAS flies in this flight; there is nothing to stream")
    return plans


def _may_hurry(scenario: Scenario) -> bool:
    """Whether plan time may pass faster than time: waypoints ask for no speed, nothing moves."""
    asks = any(waypoint.max_speed_mps is not None for waypoint in scenario.waypoints)
    return not asks and not scenario.moving_obstacles


def _check_pace(
    plans: Mapping[str, Timeline], pace: Pace, limits: Mapping[str, Limits], late: float
) -> None:
    """Refuse a plan that the vehicles cannot fly in about its time."""
    planned_s = max(plan.last_s for plan in plans.values()) - pace.first_s
    late_s = pace.late_s()
    if late_s <= max(late * planned_s, _SETS_OFF_S):
        return
    slowest = min(limit.speed_mps for limit in limits.values())
    fastest = max(plan.fastest_mps for plan in plans.values())
    speed = f" and {slowest:g} m/s" if fastest > slowest + 0.1 else ""
    weakest = min(limit.acceleration_mps2 for limit in limits.values())
    load = f", or load the .param files of `uas-coverage export`, which allow {fastest:.3g} m/s"
    share = 100.0 * late_s / planned_s
    raise InputError(
        f"the plan needs more than the vehicles are set to ({weakest:g} m/s²{speed}): it would "
        f"take {late_s:.0f} s ({share:.0f} %) longer; plan it for them: uas-coverage import ... "
        f"--flown-by autopilot --speed {SHARE * slowest:.3g}{load if speed else ''}; or allow it: "
        f"--late {math.ceil(share)}"
    )


def _check(options: StreamOptions) -> None:
    check_within("--lag", options.lag_m, 1.0, 100.0)
    check_within("--patience", options.patience_s, 1.0, 3_600.0)
    check_within("--late", 100.0 * options.late, 0.0, 1_000.0)
    check_choice("--on-abort", options.reaction, tuple(REACTIONS))


def _table(fleet: Fleet, frame: LocalFrame) -> str:
    lines = ["t_s,uas,latitude_deg,longitude_deg,height_m"]
    for time_s, name, *place_m in fleet.rows:
        latitude, longitude, height = frame.to_geodetic(place_m).tolist()
        at_s = time_s - fleet.rows[0][0]
        lines.append(f"{at_s:.2f},{name},{latitude:.8f},{longitude:.8f},{height:.3f}")
    return "\n".join(lines) + "\n"
