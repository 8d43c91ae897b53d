"""What is kept of a flight: one frozen record that metrics, pictures and benchmarks read."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.codes import ContactKind
from uas_coverage_env.entities.outcome import CONTACT_NAMES
from uas_coverage_env.flight.of_log import OfLog
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.attitude import body_attitude
from uas_coverage_env.vehicle.limits import LIMITS

MODES = ("covering", "transit", "return", "landed", "lost")
COVERING, TRANSIT, RETURN, LANDED, LOST = range(len(MODES))

LIMIT = "limit"
"""The kind of a violation that is no contact."""

_OUT_OF_CONTROL = CONTACT_NAMES[ContactKind.LIMITS]

_UNITS = {limit.name: limit.unit for limit in LIMITS}

PLAN_DTYPE = np.dtype(
    [("step", np.int64), ("uas", np.int64), ("n", np.int64), ("position_m", np.float64, (3,))]
)


@dataclass(frozen=True)
class Violation:
    """What must not happen: a contact, which costs the UAS, or a limit of the vehicle exceeded.

    A flight has one of kind `limit` for each UAS and limit, however long it was exceeded.

    Attributes:
        time_s: When; of a limit, the first time [s].
        uas: Which UAS.
        kind: A contact's name, or `limit`.
        partner: What the contact was with (None: nothing named); the name of the limit.
        value: Of a limit, the worst value, in the limit's unit; else None.
        limit: Of a limit, its bound.
        samples: Of a limit, at how many samples it was exceeded.
    """

    time_s: float
    uas: str
    kind: str
    partner: str | None
    value: float | None = None
    limit: float | None = None
    samples: int | None = None

    def worse(self, now: Self) -> Self:
        """The same limit exceeded at one more sample."""
        values = [value for value in (self.value, now.value) if value is not None]
        value = max(values, key=lambda one: abs(one - (self.limit or 0.0)))
        return dataclasses.replace(self, value=value, samples=(self.samples or 0) + 1)

    def entry(self) -> dict[str, Any]:
        """As plain data of a file."""
        entry = {"t_s": self.time_s, "uas": self.uas, "kind": self.kind, "with": self.partner}
        if self.kind == LIMIT:
            entry |= {"value": self.value, "limit": self.limit, "samples": self.samples}
        return entry

    def __str__(self) -> str:
        """As a line for people."""
        if self.kind == LIMIT:
            unit = _UNITS.get(str(self.partner), "")
            return (
                f"{self.uas}, beyond its limit of {self.partner} from {self.time_s:g} s on: "
                f"{self.value:.4g} {unit} of {self.limit:g} {unit} at the worst, "
                f"samples: {self.samples}"
            )
        if self.kind == _OUT_OF_CONTROL:
            return f"{self.uas}, out of control beyond its limits at {self.time_s:g} s"
        partner = f" with {self.partner}" if self.partner else ""
        return f"{self.uas}, {self.kind} contact{partner} at {self.time_s:g} s"


@dataclass(frozen=True)
class EventRecord:
    """An event of the scenario that has happened.

    Attributes:
        time_s: The sample at which it happened [s].
        kind: Its kind, as in the scenario.
        uas: The UAS that it concerned; None: no one in particular, or all.
        event: Its place among the scenario's events, from 0 on.
    """

    time_s: float
    kind: str
    uas: str | None
    event: int

    def entry(self) -> dict[str, Any]:
        """As plain data of a file."""
        return {"t_s": self.time_s, "kind": self.kind, "uas": self.uas}

    def __str__(self) -> str:
        """As a line for people."""
        concerned = f" of {self.uas}" if self.uas else ""
        return f"{self.kind}{concerned} at {self.time_s:g} s"


@dataclass(frozen=True)
class Swap:
    """A UAS that landed, was given a fresh battery pack, and flew on with it.

    Attributes:
        uas: Which UAS.
        landed_s: The sample at which it had landed [s].
        time_s: The sample from which it flies with the fresh pack [s].
    """

    uas: str
    landed_s: float
    time_s: float

    def entry(self) -> dict[str, Any]:
        """As plain data of a file."""
        return {"t_s": self.time_s, "uas": self.uas, "landed_s": self.landed_s}


class Why(StrEnum):
    """Why a waypoint was left open; the first that holds.

    Attributes:
        meaning: The same in a sentence.
    """

    meaning: str

    def __new__(cls, words: str, meaning: str) -> Self:
        """A reason by its words."""
        member = str.__new__(cls, words)
        member._value_, member.meaning = words, meaning
        return member

    NO_SENSOR = "no sensor for it", "no UAS carries the sensor that it asks for"
    NO_ROOM = "no room in it", "no part of its sphere keeps all safe distances"
    NO_WAY = (
        "no way to it",
        "obstacles or no-fly zones, which are named, close it off from every UAS that could cover "
        "it; routes keep 1 m more than the safe distances, less for small vehicles",
    )
    TOO_FAR = (
        "out of reach",
        "the charge with which the mission begins would not last there and home again",
    )
    LOST = "UAS lost", "no UAS that could cover it is left"
    CHARGE = "charge", "the charge left in the end would not last there and home again"
    TIME = "time", "the mission would have ended before a UAS was there and home again"
    ENDED = "flight ended", "the flight was ended while a UAS that could cover it was in the air"
    BLOCKED = "blocked", "something that moves kept it closed in the end"
    PLANNER = (
        "left by the planner",
        "a UAS landed with it open, though its charge and the time would have sufficed; what the "
        "planner says about it, where it does",
    )


@dataclass(frozen=True)
class LeftOpen:
    """A waypoint that was left open.

    Attributes:
        waypoint: Its number among the scenario's, those that events added included.
        why: Why.
        detail: The same in a line, with names and figures.
    """

    waypoint: int
    why: Why
    detail: str

    def entry(self) -> dict[str, Any]:
        """As plain data of a file."""
        return {"waypoint": self.waypoint, "why": str(self.why), "detail": self.detail}

    def __str__(self) -> str:
        """As a line for people."""
        return f"waypoints[{self.waypoint}]: {self.why}: {self.detail}"


@dataclass(frozen=True)
class DecisionRecord:
    """One decision of the planner: how long it took, how it came about, what was left of it.

    `filtered` counts the UAS whose command the safety filter replaced; `reason` says why there was
    a fallback, where the planner says it; `processor_s` is the processor time [s] of all threads,
    None in a flight from a log or of a version before; `flown_by` says who flew in place of the
    planner, see `Decision`.
    """

    duration_s: float
    fallback: bool = False
    mip_gap: float | None = None
    filtered: int = 0
    reason: str | None = None
    processor_s: float | None = None
    flown_by: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class FlightRecord:
    """One mission as it was flown, sample by sample, with all that is needed to repeat it.

    Samples run from t = 0 to the end of the flight (T = steps + 1). Inputs and current of a sample
    act from its time to the next; after a UAS has landed or is lost its last sample is repeated.

    Attributes:
        scenario: The scenario flown.
        planner: Name of the planner.
        planner_options: Its options as plain data.
        seed: The seed of the planner, and of what disturbances draw.
        dynamics: `lpv` or `nonlinear`.
        return_mode: Whether the world brought UAS home in time.
        safety_filter: Whether the world kept commands clear of harm.
        disturbances: Names of what pushed back.
        ended: `complete` (no UAS is flying), `steps` (limit of steps) or `stopped` (by hand).
        x: (T, U, 14) states, see `uas_coverage_env.vehicle.layout`.
        u: (T, U, 5) inputs, zero once landed or lost.
        voltage_V: (T, U) [V] battery voltage under the current.
        current_A: (T, U) [A] battery current.
        mode: (T, U) index into `MODES`.
        covered: (T,) number of waypoints that the swarm has covered so far.
        moving_position_m: (T, M, 3) [m] centres of the moving obstacles.
        plan: PLAN_DTYPE rows of what the planner predicted; empty where it does not predict.
        decisions: One entry per step.
        violations: Contacts and limits exceeded, in order of time.
        breaches: Count of samples closer than the safe distances, or below the least height.
        min_separation_m: Smallest distance between two flying UAS [m]; None: never two.
        min_obstacle_clearance_m: Smallest clearance from any obstacle [m]; None: no obstacle.
        wall_time_s: Time the flight took to compute [s], compilation apart.
        versions: Package -> version.
        height_breaches: How many of the breaches are below the least height.
        events: What has happened, in order of time; none where the scenario has no events.
        swaps: Of battery packs while the others flew on, in order of time.
        open_waypoints: How many were still to be covered at the end, where the scenario has events;
            None: all of the scenario's that are not covered.
        reward_terms: (T - 1, U, R) the weighted terms of the reward that an environment pays for
            these steps; None: a record from before they were kept.
        reward_names: (R,) of the terms.
        left_open: Why waypoints were left open; empty, too, of a flight from a log, or from before
            that was kept.
        of_log: What only a flight from a log has; None: it was simulated.
    """

    scenario: Scenario
    planner: str
    planner_options: Mapping[str, Any]
    seed: int
    dynamics: str
    return_mode: bool
    safety_filter: bool
    disturbances: tuple[str, ...]
    ended: str
    x: NDArray[np.float64]
    u: NDArray[np.float64]
    voltage_V: NDArray[np.float64]
    current_A: NDArray[np.float64]
    mode: NDArray[np.int8]
    covered: NDArray[np.int64]
    moving_position_m: NDArray[np.float64]
    plan: NDArray[np.void]
    decisions: tuple[DecisionRecord, ...]
    violations: tuple[Violation, ...]
    breaches: int
    min_separation_m: float | None
    min_obstacle_clearance_m: float | None
    wall_time_s: float
    versions: Mapping[str, str]
    height_breaches: int = 0
    events: tuple[EventRecord, ...] = ()
    swaps: tuple[Swap, ...] = ()
    open_waypoints: int | None = None
    reward_terms: NDArray[np.float64] | None = None
    reward_names: tuple[str, ...] = ()
    left_open: tuple[LeftOpen, ...] = ()
    of_log: OfLog | None = None

    def __eq__(self, other: object) -> bool:
        """Flights are equal when every field is: arrays to the last bit, scenarios by content."""
        if not isinstance(other, FlightRecord):
            return NotImplemented
        return all(
            _equal(getattr(self, field.name), getattr(other, field.name))
            for field in dataclasses.fields(self)
        )

    __hash__ = None  # arrays cannot be hashed

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the UAS, in the order of the axis U."""
        return tuple(uas.name for uas in self.scenario.uas)

    @property
    def steps(self) -> int:
        """Steps until the last UAS was home, lost, or the flight ended."""
        return len(self.x) - 1

    @property
    def time_s(self) -> NDArray[np.float64]:
        """(T,) [s] times of the samples."""
        return np.arange(len(self.x), dtype=np.float64) * self.scenario.dt_s

    @property
    def soc(self) -> NDArray[np.float64]:
        """(T, U) state of charge, 0..1."""
        return 1.0 - self.x[..., S.DOD]

    @property
    def resting(self) -> NDArray[np.bool_]:
        """(T, U) whether each stands on the ground until it flies on with a fresh pack."""
        resting = np.zeros(self.mode.shape, np.bool_)
        for swap in self.swaps:
            first, last = np.rint(np.divide((swap.landed_s, swap.time_s), self.scenario.dt_s))
            resting[int(first) : int(last), self.names.index(swap.uas)] = True
        return resting

    @property
    def known(self) -> NDArray[np.bool_]:
        """(T, U) whether it is known where each was: always, but for gaps of a log."""
        if self.of_log is None:
            return np.ones(self.mode.shape, np.bool_)
        return self.of_log.known(self.time_s, self.names)

    @property
    def attitude_rad(self) -> NDArray[np.float64]:
        """(T, U, 3) roll, pitch, yaw of the bodies [rad], those that look where they fly included.

        These have their tilts in `x` on axes that do not turn, see `vehicle.layout`.
        """
        angles = self.x[..., S.PHI : S.WX].copy()
        for i, uas in enumerate(self.scenario.uas):
            if uas.heading == "course":
                angles[:, i] = body_attitude(self.x[:, i])
        return angles

    @property
    def last_sample(self) -> NDArray[np.int64]:
        """(U,) the sample in which each UAS has landed or is lost, else the last of the flight."""
        return last_samples(self.mode)


def last_samples(mode: NDArray[np.int8]) -> NDArray[np.int64]:
    """(U,) the first sample of each column of `mode` (T, U) that is LANDED or LOST, else T - 1."""
    over = mode >= LANDED
    return np.where(over.any(axis=0), over.argmax(axis=0), len(mode) - 1)


def _equal(mine: Any, theirs: Any) -> bool:
    if isinstance(mine, np.ndarray):
        return np.array_equal(mine, theirs)
    if isinstance(mine, Scenario) and isinstance(theirs, Scenario):
        return mine.content() == theirs.content()
    return mine == theirs
