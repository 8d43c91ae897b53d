"""What happened when: marks on the time axis of a replay page, each with its reason."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.replay.home_data import WayHome
from uas_coverage_env.replay.runs import runs
from uas_coverage_env.replay.safety_data import (
    FENCE,
    HEIGHT,
    MOVING,
    OBSTACLES,
    OTHERS,
    Nearest,
)
from uas_coverage_env.scenario import Scenario

LARGE_GAP = 0.05
"""A decision that was solved to a larger gap than this is marked."""

_TOLERANCE_M = 1e-6


def marks(
    flight: Flight, history: SceneHistory, rooms: dict[str, Nearest], home: WayHome
) -> list[dict[str, Any]]:
    """Breaches, points of no return, fallbacks, large gaps and events and swaps, in order of time.

    Of a flight from a log also what was estimated, and when it is not known where a UAS was.

    What lasts is one mark: `t_s`, `until_s`, `kind`, `uas` (None: of no one in particular) and
    `text`. Contacts and limits are not among them: the page has them as violations.
    """
    found = [
        *_breaches(flight, history.scenario, rooms),
        *_no_returns(flight, home),
        *_fallbacks(flight),
        *_gaps(flight),
        *_events(flight),
        *_swaps(flight),
        *_of_log(flight),
    ]
    return sorted(found, key=lambda mark: mark["t_s"])


def _mark(
    flight: Flight, first: int, last: int, kind: str, text: str, uas: str | None = None
) -> dict[str, Any]:
    dt_s = flight.scenario.dt_s
    return {
        "t_s": round(first * dt_s, 6),
        "until_s": round(last * dt_s, 6),
        "kind": kind,
        "uas": uas,
        "text": text,
    }


def _breaches(
    flight: Flight, scenario: Scenario, rooms: dict[str, Nearest]
) -> Iterator[dict[str, Any]]:
    for kind, (room_m, which) in rooms.items():
        for i, name in enumerate(flight.names):
            near = room_m[:, i] < -_TOLERANCE_M
            near[0] = False  # where a mission begins is given
            for first, last in _spans(np.where(near, which[:, i], -1).tolist()):
                worst_m = -float(room_m[first : last + 1, i].min())
                partner = _partner(scenario, kind, int(which[first, i]))
                if kind == HEIGHT:
                    text = f"{name}: {worst_m:.2f} m below the least height"
                else:
                    text = f"{name}: {worst_m:.2f} m within the safe distance of {partner}"
                yield _mark(flight, first, last, "breach", text, name)


def _partner(scenario: Scenario, kind: str, index: int) -> str:
    if kind == FENCE:
        return "the fence"
    if kind == HEIGHT:
        return "the ground"
    named = {OBSTACLES: scenario.obstacles, MOVING: scenario.moving_obstacles, OTHERS: scenario.uas}
    return named[kind][index].name


def _no_returns(flight: Flight, home: WayHome) -> Iterator[dict[str, Any]]:
    for name, sample, (least, spare) in zip(
        flight.names, home.no_return, home.least_spare, strict=True
    ):
        if sample is not None:
            text = (
                f"{name}: point of no return; coming home with margin takes more charge than is "
                f"left, {-100.0 * spare:.1f} % more at {least * flight.scenario.dt_s:g} s"
            )
            yield _mark(flight, sample, sample, "no return", text, name)


def _fallbacks(flight: Flight) -> Iterator[dict[str, Any]]:
    reasons = [
        (decision.reason or "no reason given") if decision.fallback else ""
        for decision in flight.decisions
    ]
    for first, last in _spans([reason or -1 for reason in reasons]):
        count = f" ({last - first + 1} decisions)" if last > first else ""
        yield _mark(flight, first, last, "fallback", f"fallback{count}: {reasons[first]}")


def _gaps(flight: Flight) -> Iterator[dict[str, Any]]:
    gaps = [decision.mip_gap or 0.0 for decision in flight.decisions]
    for first, last in _spans([0 if gap > LARGE_GAP else -1 for gap in gaps]):
        largest = max(gaps[first : last + 1])
        count = f"{last - first + 1} decisions" if last > first else "decision"
        yield _mark(flight, first, last, "gap", f"{count} solved to a gap of {largest:.0%} at most")


def _events(flight: Flight) -> Iterator[dict[str, Any]]:
    for event in flight.events:
        k = round(event.time_s / flight.scenario.dt_s)
        what = event.kind.replace("_", " ")
        of = f"{event.uas}: " if event.uas else ""
        yield _mark(flight, k, k, "event", f"{of}{what}", event.uas)


def _swaps(flight: Flight) -> Iterator[dict[str, Any]]:
    for swap in flight.swaps:
        first, last = (
            round(time_s / flight.scenario.dt_s) for time_s in (swap.landed_s, swap.time_s)
        )
        yield _mark(flight, first, last, "event", f"{swap.uas}: swaps its battery pack", swap.uas)


def _of_log(flight: Flight) -> Iterator[dict[str, Any]]:
    if flight.of_log is None:
        return
    for estimate in flight.of_log.estimates:
        yield _mark(flight, 0, flight.steps, "estimated", str(estimate), estimate.uas)
    for unknown in flight.of_log.unknown:
        first, last = (
            min(round(time_s / flight.scenario.dt_s), flight.steps)
            for time_s in (unknown.from_s, unknown.to_s)
        )
        text = f"{unknown.uas}: where it was is not known ({unknown.why})"
        yield _mark(flight, first, last, "not known", text, unknown.uas)


def _spans(values: Sequence[Any]) -> Iterator[tuple[int, int]]:
    """First and last index of each run of equal values that are not -1."""
    return ((first, after - 1) for value, first, after in runs(values) if value != -1)
