"""The flights of a log: from arming to disarming, if it left the ground in between.

A table, which does not say when motors turned, is one flight: from where it first rises to where it
last comes down.
"""

from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.logs.logged import Logged, Span

OFF_GROUND_M = 0.5
"""Above where it stood, a UAS has taken off."""

RISE_M = 1.0
"""So high it must rise to have flown: a barometer drifts by less while armed on the ground."""

_DATES_S = 1e9
"""A clock that says more is that of the world."""


@dataclass(frozen=True, eq=False)
class LoggedFlight:
    """One flight of a log.

    Attributes:
        log: Its samples, those of the flight.
        begins_s: When it was armed, or begins to rise; on the clock of the log, as the next.
        take_off_s: When it left the ground.
        ends_s: When it had landed or was disarmed, or its log ends.
        landed: Whether the log says that it had landed, or was disarmed.
        by_arming: Whether the log says when it was armed.
    """

    log: Logged
    begins_s: float
    take_off_s: float
    ends_s: float
    landed: bool
    by_arming: bool

    def since(self, time_s: float) -> str:
        """A time of the log in words."""
        after_s = time_s - self.take_off_s
        return f"{abs(after_s):.1f} s {'after' if after_s >= 0.0 else 'before'} take-off"

    def __str__(self) -> str:
        """When it was, how long it took and how high it went."""
        begins = f"{self.begins_s:.0f} s"
        if self.begins_s > _DATES_S:
            begins = f"{datetime.fromtimestamp(self.begins_s, UTC):%H:%M:%S} UTC"
        high_m = self.log.height_m.max()
        return f"{begins}, {self.ends_s - self.begins_s:.0f} s, up to {high_m:.0f} m"


def flights_of(log: Logged) -> list[LoggedFlight]:
    """All flights of a log, in order of time."""
    if log.armed is None:
        found = [_flight_of_table(log)]
    else:
        found = [_armed_flight(log, span) for span in log.armed]
    return [flight for flight in found if flight is not None]


def chosen_flight(log: Logged, number: int | None) -> LoggedFlight:
    """The flight that is asked for, or the only one.

    Args:
        log: The log.
        number: From 1 on; None: the only one.

    Raises:
        InputError: It is of no flight, of several, or has no such flight.
    """
    of = log.source or f"the log of {log.uas}"
    flights = flights_of(log)
    listed = ", ".join(f"{n} ({flight})" for n, flight in enumerate(flights, 1))
    if not flights:
        raise InputError(
            f"{of}: never rises higher than {RISE_M:g} m: it is of no flight; leave it out"
        )
    if number is None and len(flights) > 1:
        raise InputError(f"{of}: holds {len(flights)} flights: {listed}; choose with --flight N")
    if number is not None and not 1 <= number <= len(flights):
        raise InputError(f"{of}: has no flight {number}; it holds {listed}")
    return flights[(number or 1) - 1]


def _flight_of_table(log: Logged) -> LoggedFlight | None:
    up = np.flatnonzero(log.height_m > OFF_GROUND_M)
    if not len(up):
        return None
    first, last = max(up[0] - 1, 0), min(up[-1] + 1, len(log.time_s) - 1)
    part = np.zeros(len(log.time_s), np.bool_)
    part[first : last + 1] = True
    times_s = log.time_s
    return LoggedFlight(
        log.at(part), times_s[first], times_s[up[0]], times_s[last], landed=False, by_arming=False
    )


def _armed_flight(log: Logged, span: Span) -> LoggedFlight | None:
    """None where it stayed on the ground."""
    armed = (span.begins_s <= log.time_s) & (log.time_s <= span.ends_s)
    if armed.sum() < 2:
        return None
    times_s, rises_m = log.time_s[armed], log.height_m[armed] - log.height_m[armed][0]
    air = [
        Span(max(one.begins_s, span.begins_s), min(one.ends_s, span.ends_s), one.is_open)
        for one in log.in_air or ()
        if one.begins_s < span.ends_s and span.begins_s < one.ends_s
    ]
    if rises_m.max() < RISE_M:
        return None
    take_off_s = float(times_s[max(int((rises_m > OFF_GROUND_M).argmax()) - 1, 0)])
    down = bool(air) and not air[-1].is_open
    ends_s = air[-1].ends_s if down else span.ends_s
    in_flight = armed & (log.time_s <= ends_s)
    if in_flight.sum() < 2 or ends_s <= take_off_s:  # its landing was told too early
        in_flight, ends_s, down = armed, span.ends_s, False
    # what it covers ends with what was measured
    ends_s = ends_s if down or not span.is_open else float(times_s[-1])
    return LoggedFlight(
        log.at(in_flight),
        float(times_s[0]),
        take_off_s,
        ends_s,
        landed=down or not span.is_open,
        by_arming=True,
    )
