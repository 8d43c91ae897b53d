"""A flight directory judged anew, between the samples too; see `docs/safety.md`."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import QhullError

from uas_coverage_env.independent_check.distances import (
    Partner,
    curve,
    on_curves,
    on_segments,
    partners_of,
    relative_m,
    scheduled,
    too_low,
)
from uas_coverage_env.independent_check.limits import dod_landed, inputs_beyond, limits_exceeded
from uas_coverage_env.independent_check.record import (
    BadFlightError,
    FlightRecord,
    Track,
    read_record,
)

FloatArray = NDArray[np.float64]

PLAN_TOLERANCE_M = 1e-3
_ROUNDING = 1e-9
_SAME = 1e-6  # of figures that were computed in another order
# what the linear drag, unknown here, makes of the mean velocity over a step of 1 s
_DRAG_M_PER_S2 = 0.15
_GRAVITY_MPS2 = 9.81


@dataclass
class Report:
    """What the check has found.

    Attributes:
        coverage: Fraction of the waypoints covered.
        steps: Steps until the last UAS was home or lost.
        energy_Wh: Sum of voltage times current times dt.
        all_home: Whether every UAS has landed.
        contacts: (time [s], UAS, kind, with whom), straight from sample to sample.
        limits: (first time [s], UAS, `limit`, which) of the vehicle's limits exceeded.
        breaches: Samples closer than the safe distances or below the least height, and landings
            with less charge than the reserve.
        height_breaches: How many of these are below the least height.
        reserve_breaches: How many are landings with less charge than the reserve.
        straight_room_m: Kind -> smallest distance left before a contact, straight segments.
        curved_room_m: The same on the cubic curve through positions and velocities.
        disagreements: What the flight or its summary says and the check does not, and what does not
            fit together, a line each.
        touched: Contacts, limits exceeded, and what comes too close between samples, a line each.
    """

    coverage: float = 0.0
    steps: int = 0
    energy_Wh: float = 0.0
    all_home: bool = False
    contacts: list[tuple[float, str, str, str | None]] = field(default_factory=list)
    limits: list[tuple[float, str, str, str]] = field(default_factory=list)
    breaches: int = 0
    height_breaches: int = 0
    reserve_breaches: int = 0
    straight_room_m: dict[str, float] = field(default_factory=dict)
    curved_room_m: dict[str, float] = field(default_factory=dict)
    disagreements: list[str] = field(default_factory=list)
    touched: list[str] = field(default_factory=list)

    @property
    def problems(self) -> list[str]:
        """Every disagreement, contact and oddity, a line each."""
        return [*self.disagreements, *self.touched]


def check(directory: Path, plan_tolerance_m: float = PLAN_TOLERANCE_M) -> Report:
    """Judge a flight directory anew.

    Args:
        directory: A flight directory.
        plan_tolerance_m: How far a plan's first step may be from what was flown [m].

    Raises:
        BadFlightError: It is no flight.
    """
    record = read_record(directory)
    try:
        report = Report(steps=record.steps)
        report.all_home = all(track.end == "landed" for track in record.tracks)
        _judge_distances(record, report)
        report.limits = sorted(limits_exceeded(record))
        _judge_coverage(record, report)
        _judge_tracks(record, report)
        _judge_plan(record, report, plan_tolerance_m)
        _compare(record.summary, report)
    except (KeyError, TypeError, ValueError, QhullError) as error:
        reason = " ".join(str(error).split())
        raise BadFlightError(f"{directory}: does not fit the format ({reason})") from error
    return report


def _judge_distances(record: FlightRecord, report: Report) -> None:
    """Contacts on segments and curves, breaches at samples, smallest distances."""
    dt_s, n = record.dt_s, len(record.tracks)
    names = [track.name for track in record.tracks]
    rests = {track.name: track.rests[:-1] for track in record.tracks}
    curves = {t.name: curve(t.position_m, t.velocity_mps, dt_s) for t in record.tracks}
    partners = [list(partners_of(record, row)) for row in range(n)]
    straight = [
        [_in_flight(on_segments(p, track), track.name, p, rests) for p in partners[row]]
        for row, track in enumerate(record.tracks)
    ]
    touched = [_first_contacts(record, row, partners[row], straight[row]) for row in range(n)]
    report.contacts = sorted(contact for found in touched for contact in found.values())
    smallest: dict[str, float] = {}
    for row, track in enumerate(record.tracks):
        report.disagreements += _end_without_cause(track, touched[row])
        for partner, distance in zip(partners[row], straight[row], strict=True):
            kind = partner.kind
            _keep_least(smallest, kind, distance)
            _keep_least(report.straight_room_m, kind, distance - partner.contact_m)
            curved = on_curves(partner, row, curves, dt_s) - partner.contact_m
            curved = _in_flight(curved, track.name, partner, rests)
            _keep_least(report.curved_room_m, kind, curved)
            for step in np.flatnonzero((curved < -_SAME) & (distance >= partner.contact_m)):
                report.touched.append(
                    f"{track.name} is {-curved[step]:.3g} m too close to "
                    f"{partner.name or 'the fence'} on the curve from {step * dt_s:g} s"
                )
            # one that is lost in a step is too near to none any more, and none to it
            gone = set(touched[row]) | (
                set(touched[names.index(str(partner.name))]) if kind == "uas" else set()
            )
            at_samples = partner.distance(relative_m(partner, track))[1:]
            at_samples = _in_flight(at_samples, track.name, partner, rests)
            close = np.flatnonzero(at_samples < partner.safe_m - _ROUNDING)
            report.breaches += len(set(close.tolist()) - gone)
        low = len(set(too_low(record.scenario, track).tolist()) - set(touched[row]))
        report.height_breaches += low
        short = int(
            (track.columns["dod"][track.landings] > dod_landed(record.scenario, track)).sum()
        )
        report.reserve_breaches += short
        report.breaches += low + short
    _compare_smallest(record.summary, smallest, report)


def _in_flight(
    distance: FloatArray, name: str, partner: Partner, rests: dict[str, NDArray[np.bool_]]
) -> FloatArray:
    """Distances of steps; infinite where the UAS, or the one that is its partner, rests."""
    away = distance.copy()
    for resting in (rests[name], rests.get(str(partner.name)) if partner.kind == "uas" else None):
        if resting is not None:
            away[: len(resting)][resting[: len(away)]] = np.inf
    return away


def _end_without_cause(track: Track, contacts: Collection[int]) -> Iterator[str]:
    """Lost is what touched something, and no other UAS."""
    last = track.steps - 1 if track.end == "lost" else None
    if last is not None and last not in contacts:
        yield f"{track.name} is lost without a contact"
    if any(step != last for step in contacts):
        yield f"{track.name} flies on after a contact"


def _first_contacts(
    record: FlightRecord, row: int, partners: Sequence[Partner], straight: Sequence[FloatArray]
) -> dict[int, tuple[float, str, str, str | None]]:
    """Step -> its contact: obstacle (the nearest), moving obstacle, UAS, fence, battery."""
    track, found = record.tracks[row], {}
    empty = track.columns["dod"][1:] > track.entry["dod_max"]
    for step in range(track.steps):
        contacts = [
            (distance[step] if p.kind == "obstacle" else 0.0, p)
            for p, distance in zip(partners, straight, strict=True)
            if step < len(distance) and distance[step] < p.contact_m - _ROUNDING
        ]
        time_s = (step + 1) * record.dt_s
        if contacts:
            kind = contacts[0][1].kind
            first = min((c for c in contacts if c[1].kind == kind), key=lambda c: c[0])[1]
            found[step] = (time_s, track.name, kind, first.name)
        elif empty[step]:
            found[step] = (time_s, track.name, "battery", None)
    return found


def _keep_least(kept: dict[str, float], kind: str, values: FloatArray) -> None:
    if len(values):
        kept[kind] = min(kept.get(kind, np.inf), float(values.min()))


def _compare_smallest(summary: dict[str, Any], smallest: dict[str, float], report: Report) -> None:
    solid = [smallest[kind] for kind in ("obstacle", "moving_obstacle") if kind in smallest]
    for key, mine in (
        ("min_obstacle_clearance_m", min(solid, default=None)),
        ("min_separation_m", smallest.get("uas")),
    ):
        theirs = summary[key]
        if (mine is None) != (theirs is None) or (mine is not None and abs(mine - theirs) > _SAME):
            report.disagreements.append(f"{key} is {mine}, the summary says {theirs}")


def _judge_coverage(record: FlightRecord, report: Report) -> None:
    """Covered counts from the first sample at which a flying UAS is within the radius, as asked.

    What is asked for again at a sample counts anew from the next one on.
    """
    visits: list[float] = []
    for waypoint in record.scenario["waypoints"]:
        asked_at = -1.0
        for gap_s in (0.0, *waypoint.get("again_after_s", ())):
            asked_at += np.ceil(round(gap_s / record.dt_s, 9))
            asked_at = min(_reached(record, t, waypoint, asked_at) for t in record.tracks)
            visits.append(asked_at)
    first = np.array(visits)
    report.coverage = float(np.isfinite(first).mean())
    for track in record.tracks:
        counted = (first <= np.arange(len(track.modes))[:, None]).sum(axis=1)
        wrong = np.flatnonzero(counted != track.columns["covered"])
        if len(wrong):
            step = wrong[0]
            report.disagreements.append(
                f"{track.name}: {counted[step]} waypoints are covered at {step * record.dt_s:g} s, "
                f"its row says {track.columns['covered'][step]:g}"
            )


def _reached(
    record: FlightRecord, track: Track, waypoint: dict[str, Any], asked_at: float
) -> float:
    """The first sample after `asked_at` at which a UAS covers a waypoint; infinity: none."""
    flying = track.position_m[: track.steps if track.end == "lost" else None]
    away = np.linalg.norm(flying - np.array(waypoint["position_m"], float), axis=1)
    near = away <= waypoint["radius_m"] + _ROUNDING
    reached = np.flatnonzero(near & _as_asked(record, track, waypoint)[: len(near)])
    stands = np.concatenate([[False], track.rests[:-1]])  # in the step to a sample
    reached = reached[(reached > asked_at) & ~stands[reached]]
    return float(reached[0]) if len(reached) else np.inf


def _as_asked(record: FlightRecord, track: Track, waypoint: dict[str, Any]) -> NDArray[np.bool_]:
    """Where a UAS has the sensor, the height and the speed that a waypoint asks for."""
    own = next(uas for uas in record.scenario["uas"] if uas["name"] == track.name)
    carried = {sensor["name"] for sensor in own.get("sensors", ())}
    wanted = waypoint.get("sensor")
    lowest, highest = waypoint.get("heights_m", (-np.inf, np.inf))
    speed = np.linalg.norm([track.columns[f"v{axis}_mps"] for axis in "xyz"], axis=0)
    height = -track.position_m[:, 2]
    fits = (height >= lowest - _ROUNDING) & (height <= highest + _ROUNDING)
    fits &= speed <= waypoint.get("max_speed_mps", np.inf) + _ROUNDING
    return fits & (wanted is None or wanted in carried)


def _judge_tracks(record: FlightRecord, report: Report) -> None:
    """Start, motion, battery and end of each UAS; the moving obstacles' schedule."""
    for track in record.tracks:
        power_W = track.columns["voltage_V"] * track.columns["current_A"]
        report.energy_Wh += float(power_W.sum()) * record.dt_s / 3600.0
        report.disagreements += [f"{track.name} {what}" for what in _oddities(track, record)]
    times_s = np.arange(record.steps + 1, dtype=np.float64) * record.dt_s
    for m, moving in enumerate(record.scenario["moving_obstacles"]):
        off = np.abs(record.moving_m[:, m] - scheduled(moving, times_s)).max()
        if off > _SAME:
            report.disagreements.append(f"{moving['name']} is {off:.3g} m off its schedule")


def _oddities(track: Track, record: FlightRecord) -> Iterator[str]:
    """What does not fit together in one UAS's rows."""
    scenario, column = record.scenario, track.columns
    if np.abs(track.position_m[0] - track.entry["start_m"]).max() > _SAME:
        yield "does not begin at its start"
    # take-off lies before the first sample: the motors draw no more than 5 % of a charge for it
    before = track.entry["soc_0"] - column["soc"][0]
    climbed = 0.05 if scenario.get("from_ground") else 0.0
    if not -_SAME <= before <= climbed + _SAME:
        yield "does not begin with its charge"
    if np.abs(column["soc"] + column["dod"] - 1.0).max() > _SAME:
        yield "has a charge and a depth of discharge that do not add up"
    beyond = inputs_beyond(track)
    if beyond is not None:
        yield beyond
    off = _motion_gap_m(track, record.dt_s, scenario["landing_speed_mps"])
    if len(off) and off.max() > 0.0:
        step = int(off.argmax())
        time_s = step * record.dt_s
        yield f"moves {off[step]:.3g} m more than its velocity explains from {time_s:g} s on"
    drawn = column["current_A"][:-1] * record.dt_s
    gained = np.where(track.rests[:-1], 0.0, np.diff(column["dod"]))
    if len(drawn) and drawn.max() > 0.0:
        capacity_As = drawn.sum() / max(gained.sum(), 1e-12)
        if np.abs(gained - drawn / capacity_As).max() > _SAME:
            yield "has a current that does not explain its depth of discharge"
    home_m = np.linalg.norm(track.position_m - track.home_m, axis=1)
    near = home_m <= scenario["landing_distance_m"]
    slow = np.linalg.norm(track.velocity_mps, axis=1) < scenario["landing_speed_mps"] - _ROUNDING
    if track.end == "landed" and home_m[-1] > scenario["landing_distance_m"] + _ROUNDING:
        yield f"has landed {home_m[-1]:.3g} m from its home"
    if track.end in ("landed", "lost"):
        last = [column[name][-1] for name in ("current_A", "lift_N", "tau_x_Nm", "tau_y_Nm")]
        if np.any(last):
            yield f"is {track.end} and still has inputs or a current"
    over = 1 if track.end in ("landed", "lost") else 0
    begins = [0, *(took_off for _, took_off in track.swaps)]
    ends = [*(landed for landed, _ in track.swaps), len(near) - over]
    for first, last in zip(begins, ends, strict=True):
        flown = slice(first, last)
        if (np.maximum.accumulate(~near[flown]) & near[flown] & slow[flown]).any():
            yield "is home and slow but has not landed"
    for landed, took_off in track.swaps:
        if home_m[landed] > scenario["landing_distance_m"] + _ROUNDING:
            yield f"swaps its pack {home_m[landed]:.3g} m from its home"
        if (took_off - landed) * record.dt_s < scenario["sorties"]["swap_s"] - _ROUNDING:
            yield "swaps its pack faster than the scenario allows"
    if len(track.swaps) >= scenario.get("sorties", {"packs": 1})["packs"]:
        yield "has used more packs than it has"


def _motion_gap_m(track: Track, dt_s: float, landing_speed_mps: float) -> FloatArray:
    """(steps,) how much farther each step is from its velocities than a vehicle explains [m].

    Position over a step is the mean velocity, corrected by the change of acceleration, which the
    tilt gives up to the drag; a landed UAS's row holds no velocity and no tilt any more. Wind and
    forces of disturbances are held over a step: they change the acceleration at samples only.
    """
    v, tilt = track.velocity_mps, np.zeros((len(track.modes), 3))
    tilt[:, 0], tilt[:, 1] = -track.columns["theta_rad"], track.columns["phi_rad"]
    moved = np.diff(track.position_m, axis=0) - 0.5 * dt_s * (v[:-1] + v[1:])
    moved += dt_s**2 / 12.0 * _GRAVITY_MPS2 * np.diff(tilt, axis=0)
    allowed = np.full(len(moved), _DRAG_M_PER_S2 * dt_s**2 + _SAME)
    if track.end == "landed" and len(allowed):
        allowed[-1] += 0.5 * dt_s * landing_speed_mps + 0.5 * dt_s**2
    for landed, _ in track.swaps:
        allowed[landed - 1] += 0.5 * dt_s * landing_speed_mps + 0.5 * dt_s**2
    return np.abs(moved).max(axis=1) - allowed


def _judge_plan(record: FlightRecord, report: Report, tolerance_m: float) -> None:
    """A plan begins where the UAS is; its first step is what is flown."""
    tracks = {track.name: track for track in record.tracks}
    for (step, name), path in record.plan.items():
        if step >= tracks[name].steps:
            report.disagreements.append(
                f"{name} has a plan at {step * record.dt_s:g} s, flown by no UAS"
            )
            continue
        flown = tracks[name].position_m[step : step + 2][: len(path)]
        off = np.abs(flown - path[:2]).max()
        if off > tolerance_m:
            report.disagreements.append(
                f"the plan of {name} at {step * record.dt_s:g} s is {off:.3g} m off what was flown"
            )


def _compare(summary: dict[str, Any], report: Report) -> None:
    """The summary says what was found; contacts are problems of their own."""
    for key, tolerance in (("coverage", 1e-9), ("steps", 0), ("energy_Wh", _SAME)):
        mine = getattr(report, key)
        if not abs(mine - summary[key]) <= tolerance:
            report.disagreements.append(f"{key} is {mine}, the summary says {summary[key]}")
    for key in ("all_home", "breaches", "height_breaches", "reserve_breaches"):
        mine, theirs = getattr(report, key), summary.get(key, 0)
        if mine != theirs:
            report.disagreements.append(f"{key} is {mine}, the summary says {theirs}")
    theirs = [(v["t_s"], v["uas"], v["kind"], v["with"]) for v in summary["violations"]]
    mine = [*report.contacts, *report.limits]
    if sorted(map(repr, theirs)) != sorted(map(repr, mine)):
        report.disagreements.append(f"violations are {mine}, the summary says {theirs}")
    for time_s, uas, kind, partner in report.contacts:
        with_whom = f" with {partner}" if partner else ""
        report.touched.append(f"{uas}: {kind} contact{with_whom} at {time_s:g} s")
    for time_s, uas, _, name in report.limits:
        report.touched.append(f"{uas}: beyond its limit of {name} from {time_s:g} s on")
