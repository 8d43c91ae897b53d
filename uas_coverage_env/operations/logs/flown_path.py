"""Where a UAS was in one flight of its log: what is measured, what is not known, where it ends."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.of_log import Estimate, Unknown
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.logs.flights import LoggedFlight
from uas_coverage_env.operations.logs.logged import Logged, Span
from uas_coverage_env.operations.path_geometry import interpolated
from uas_coverage_env.scenario import Scenario

FloatArray = NDArray[np.float64]

AT_HOME_M = 5.0
"""Of its start, horizontally, a UAS on the ground is at home: satellite navigation is no better."""

BESIDE_M = 15.0
"""So far from its start it may be put down: it comes home to where it took off."""

OFFSET_M = 0.5
"""A smaller error of the height at take-off is noise of the barometer."""

LONGEST_GAP_S = 3.0
"""Between two positions a straight line is taken to have been flown; a longer time is a gap, unless
the log is as slow as that."""

GAP_INTERVALS = 2.5
"""How many of the usual intervals a log may be silent for."""

JUMP_M, JUMP_SPEEDS = 5.0, 2.0
"""From one position to the next a UAS moves by no more than a distance, and as many times its top
speed; what does is no flight."""

_DOWN_M = 10.0
"""A barometer that has drifted by less than this shows a UAS on the ground."""


@dataclass(frozen=True, eq=False)
class FlownPath:
    """One UAS in the frame of the mission, on the clock of its log.

    Attributes:
        flight: The flight.
        log: Its samples that can be believed, N of them.
        places_m: (N, 3) NED, without the offset of its height [m].
        left_s: Until then it stands at its start.
        ends_s: When it was home, or nothing more is known.
        home: Whether it landed at home.
        unknown: When it is not known where it was.
        doubtful: When its autopilot took its position to be wrong, and went on by its own estimate.
        estimates: Of its places.
        notes: What is to be said.
    """

    flight: LoggedFlight
    log: Logged
    places_m: FloatArray
    left_s: float
    ends_s: float
    home: bool
    unknown: tuple[Unknown, ...]
    doubtful: tuple[Span, ...]
    estimates: tuple[Estimate, ...]
    notes: tuple[str, ...]

    def places_at(self, times_s: FloatArray, start_m: FloatArray, home_m: FloatArray) -> FloatArray:
        """(T, 3) where it was at some times [m]: at its start before it left, home at the end."""
        places_m = interpolated(times_s, self.log.time_s, self.places_m)
        # the ground is under the volume in which missions are judged: how it gets to its start
        # and from there to the ground is no part of them
        lowest_m = np.zeros(len(times_s))
        for end_m in (start_m, home_m):
            near = np.linalg.norm(places_m[:, :2] - end_m[:2], axis=1) <= BESIDE_M
            lowest_m[near] = np.minimum(lowest_m[near], end_m[2])
        places_m[:, 2] = np.minimum(places_m[:, 2], lowest_m)
        standing = self.standing(times_s)
        places_m[standing] = np.where((times_s <= self.left_s)[:, None], start_m, home_m)[standing]
        return places_m

    def standing(self, times_s: FloatArray) -> NDArray[np.bool_]:
        """(T,) whether it stands at its start, or at home."""
        return (times_s <= self.left_s) | (self.home & (times_s >= self.ends_s))

    def knows(self, times_s: FloatArray) -> NDArray[np.bool_]:
        """(T,) whether it is known where it was, well enough for contacts to be judged."""
        known = np.ones(len(times_s), np.bool_)
        for from_s, to_s in (
            *((one.from_s, one.to_s) for one in self.unknown),
            *((span.begins_s, span.ends_s) for span in self.doubtful),
        ):
            known &= (times_s <= from_s) | (to_s <= times_s)
        return known

    def attitude_at(self, times_s: FloatArray) -> FloatArray | None:
        """(T, 3) roll, pitch, yaw [rad]; None: not logged."""
        if self.log.attitude_rad is None:
            return None
        return interpolated(times_s, self.log.time_s, self.log.attitude_rad)


def path_of(scenario: Scenario, i: int, flight: LoggedFlight, frame: LocalFrame) -> FlownPath:
    """Where UAS i was.

    Raises:
        InputError: The log is of another place.
    """
    uas, log = scenario.uas[i], flight.log
    start_m, home_m = np.array(uas.start_m), np.array(uas.home_m)
    places_m = frame.to_ned(log.latitude_deg, log.longitude_deg, log.height_m)
    _check_place(scenario, uas.name, places_m)
    top_mps = scenario.vehicles[i].limits.v_xy_max_mps
    good, unknown, notes = _believed(uas.name, flight, places_m, top_mps)
    log, places_m = log.at(good), places_m[good]
    notes = [*log.notes, *notes]
    notes += [
        f"its autopilot says {said.text!r} {flight.since(said.time_s)}"
        for said in log.said
        if flight.begins_s <= said.time_s <= flight.ends_s
    ]
    doubtful = tuple(
        span
        for span in flight.log.glitches
        if span.begins_s < flight.ends_s and flight.begins_s < span.ends_s
    )
    estimates = [Estimate(uas.name, "position", _in_doubt(flight, span)) for span in doubtful]
    if flight.by_arming:
        offset_m = _offset_m(start_m, -places_m[0, 2])
        if abs(offset_m) > OFFSET_M:
            places_m = places_m + np.array([0.0, 0.0, offset_m])
            side = "high" if offset_m > 0.0 else "low"
            how = f"from take-off: an offset of {abs(offset_m):.1f} m (too {side}) is taken off"
            estimates.append(Estimate(uas.name, "height", how))
    left_s, ends_s, home, said = _ends(scenario, flight, (start_m, home_m), log.time_s, places_m)
    return FlownPath(
        flight, log, places_m, left_s, ends_s, home,
        tuple(unknown), doubtful, tuple(estimates), (*notes, *said)
    )  # fmt: skip


def _in_doubt(flight: LoggedFlight, span: Span) -> str:
    until = flight.since(span.ends_s) + ", never cleared" * span.is_open
    return (
        f"by its autopilot, which says GPS glitch from {flight.since(span.begins_s)} until "
        f"{until}: contacts are not judged then"
    )


def _check_place(scenario: Scenario, name: str, places_m: FloatArray) -> None:
    corners_m = scenario.fence.vertices_m
    size_m = float(np.linalg.norm(np.ptp(corners_m, axis=0)))
    away_m = np.linalg.norm(places_m - corners_m.mean(axis=0), axis=1).min()
    if away_m > size_m:
        raise InputError(
            f"the log of {name} is never nearer than {away_m / 1e3:.1f} km to the mission; give "
            f"the log of this place, or the right --place"
        )


def _believed(
    name: str, flight: LoggedFlight, places_m: FloatArray, top_mps: float
) -> tuple[NDArray[np.bool_], list[Unknown], list[str]]:
    """(N,) the positions that can be believed, when none can, and what is to be said of it."""
    times_s = flight.log.time_s
    good, notes = np.ones(len(times_s), np.bool_), []
    jumps = _jumps(times_s, places_m, top_mps)
    for first, after, far_m in jumps:
        at_s = float(times_s[first])
        if after is None:
            notes.append(f"its position jumps by {far_m:.0f} m {flight.since(at_s)}, for good")
            continue
        good[first:after] = False
        back = ""
        if first > 0 and after < len(times_s):
            back = f" and comes back {flight.since(float(times_s[after]))}"
        notes.append(
            f"its position jumps by {far_m:.0f} m {flight.since(at_s)}{back}: taken for a GPS "
            f"glitch"
        )
    if good.sum() < 2:  # nothing would be left
        return np.ones(len(times_s), np.bool_), [], notes
    kept_s, unknown = times_s[good], []
    intervals_s = np.diff(kept_s)
    longest_s = max(LONGEST_GAP_S, GAP_INTERVALS * float(np.median(intervals_s)))
    numbers = np.flatnonzero(good)
    left_out = np.diff(numbers) > 1
    for k in np.flatnonzero(left_out | (intervals_s > longest_s)).tolist():
        from_s, to_s = float(kept_s[k]), float(kept_s[k + 1])
        why = "GPS glitch" if left_out[k] else "nothing was logged"
        unknown.append(Unknown(name, from_s, to_s, why))
        if not left_out[k]:
            notes.append(f"nothing was logged for {to_s - from_s:.1f} s, {flight.since(from_s)}")
    if unknown:
        notes.append("where it was in these times is not known: nothing is judged of it then")
    return good, unknown, notes


def _jumps(
    times_s: FloatArray, places_m: FloatArray, top_mps: float
) -> list[tuple[int, int | None, float]]:
    """Which positions have jumped: the first, the one after (None: all later), and how far [m]."""

    def jump_m(n: int, m: int) -> float:
        """How far it is from one to another, if that is too far, else 0."""
        far_m = float(np.linalg.norm(places_m[m] - places_m[n]))
        most_m = JUMP_M + JUMP_SPEEDS * top_mps * float(times_s[m] - times_s[n])
        return far_m if far_m > most_m else 0.0

    steps_m = np.linalg.norm(np.diff(places_m, axis=0), axis=1)
    most_m = JUMP_M + JUMP_SPEEDS * top_mps * np.diff(times_s)
    # runs of positions that do not jump; the first that lasts is believed
    parts = np.split(np.arange(len(times_s)), 1 + np.flatnonzero(steps_m > most_m))
    runs = [(int(part[0]), int(part[-1])) for part in parts]
    lasts = [times_s[last] - times_s[first] >= LONGEST_GAP_S for first, last in runs]
    begin = lasts.index(True) if True in lasts else 0
    found: list[tuple[int, int | None, float]] = []
    if begin:
        first, after = runs[0][0], runs[begin][0]
        found.append((first, after, jump_m(runs[begin - 1][1], after)))
    trusted, away = runs[begin][1], None
    for first, last in runs[begin + 1 :]:
        far_m = jump_m(trusted, first)
        if far_m and away is None:
            away = (first, far_m)
        elif not far_m:
            if away is not None:
                found.append((away[0], first, away[1]))
            trusted, away = last, None
    if away is not None:
        first, far_m = away
        brief = times_s[-1] - times_s[first] < LONGEST_GAP_S
        found.append((first, len(times_s) if brief else None, far_m))
    return found


def _offset_m(start_m: FloatArray, height_m: float) -> float:
    """By how much a height at take-off is above the start, or below the ground [m]."""
    return height_m - float(np.clip(height_m, 0.0, max(-start_m[2], 0.0)))


def _ends(
    scenario: Scenario,
    flight: LoggedFlight,
    ends_m: tuple[FloatArray, FloatArray],
    times_s: FloatArray,
    places_m: FloatArray,
) -> tuple[float, float, bool, list[str]]:
    """Until when it stands at its start, when its way ends, whether that is at home, and notes."""
    start_m, home_m = ends_m
    at_start, at_home = (_is_at(scenario, end_m, places_m) for end_m in ends_m)
    notes = []
    if not flight.by_arming:
        away = np.flatnonzero(~(at_start | at_home))
        left_s = float(times_s[max(away[0] - 1, 0)]) if len(away) and at_start[0] else -np.inf
        home = bool(at_home[-1])
        back = min(away[-1] + 1, len(times_s) - 1) if len(away) else len(times_s) - 1
        ends_s = float(times_s[back]) if home else float(times_s[-1])
    else:
        ends_s = flight.ends_s
        from_start_m = float(np.linalg.norm(places_m[0, :2] - start_m[:2]))
        beside = AT_HOME_M < from_start_m <= BESIDE_M
        left_s = flight.take_off_s if from_start_m <= BESIDE_M else -np.inf
        if from_start_m > AT_HOME_M:
            taken = ", and is taken to be there" if beside else ""
            notes.append(f"it takes off {from_start_m:.1f} m from its start{taken}")
        returns = bool((start_m == home_m).all())
        homes_m = [home_m[:2], *([places_m[0, :2]] if beside and returns else [])]
        near = min(np.linalg.norm(places_m[-1, :2] - each_m) for each_m in homes_m) <= AT_HOME_M
        low = -places_m[-1, 2] - max(-home_m[2], 0.0) <= _DOWN_M
        home = bool(near and low) if flight.landed else bool(at_home[-1])
    if not home:
        far_m = float(np.linalg.norm(places_m[-1, :2] - home_m[:2]))
        when, up_m = flight.since(ends_s), -places_m[-1, 2]
        if flight.landed:
            notes.append(f"it lands away from home, {when}, {far_m:.0f} m from it")
        else:
            notes.append(
                f"its log ends away from home, {when}, {far_m:.0f} m from it and "
                f"{up_m:.0f} m up; what came after is not known"
            )
    return left_s, ends_s, home, notes


def _is_at(scenario: Scenario, end_m: FloatArray, places_m: FloatArray) -> NDArray[np.bool_]:
    """(N,) whether a UAS is on the ground below its start or home, or on the way to or from it."""
    beside_m = np.linalg.norm(places_m[:, :2] - end_m[:2], axis=1)
    top_m = max(-end_m[2], 0.0) + scenario.landing_distance_m
    return (beside_m <= AT_HOME_M) & (-places_m[:, 2] <= top_m)
