"""What a planner does, as learners see it: observations, and in hindsight what was done next."""

import io
import json
import math
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env.actions.in_plane import kind_in
from uas_coverage_env.env.actions.velocity import VELOCITY
from uas_coverage_env.env.actions.waypoint import HOME_CHOICE
from uas_coverage_env.env.observation import OBSERVATION
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.loop import Progress, rollout
from uas_coverage_env.flight.planner import Planner
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.runner.store import STORE, rows_in
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.world import SwarmState

UNKNOWN_CHOICE = -1
"""The choice where the waypoint that came next was not among those to choose from."""

SCHEMA = 1
_LARGEST_FILE_BYTES = 1 << 30

_COLUMNS: dict[str, tuple[type, int | None]] = {
    "observation": (np.float32, sum(block.size for block in OBSERVATION)),
    "velocity": (np.float32, 3),
    "choice": (np.int64, None),
    "choice_mask": (np.bool_, HOME_CHOICE + 1),
    "reward": (np.float64, None),
    "step": (np.int64, None),
    "uas": (np.int64, None),
}
"""Name -> kind of number, and how many in a row; None: one."""


class _Seen(NamedTuple):
    swarm: SwarmState
    observation: NDArray[np.float32]
    candidates: NDArray[np.int64]


@dataclass(frozen=True)
class Demonstrations:
    """Missions of a planner, a row for each UAS and step in which it flew, mission by mission.

    Attributes:
        observation: (N, V) float32, what the environments show before the step (the truth, where a
            scenario has sensors with errors).
        velocity: (N, 3) float32 in ±1: the action `velocity` that asks for the velocity and the
            altitude at the end of the step.
        choice: (N,) the action `waypoint` of whoever flies to the waypoint that this UAS covered
            next, or home where it covered none; UNKNOWN_CHOICE where that was none of the choices.
        choice_mask: (N, 13) the choices that there were.
        reward: (N,) of the step, by the environments' default terms.
        step: (N,) number of the step in its mission.
        uas: (N,) index of the UAS in its mission.
        mission: (N,) index into `missions`.
        missions: Scenario, planner, seed, steps and outcome of each.
    """

    observation: NDArray[np.float32]
    velocity: NDArray[np.float32]
    choice: NDArray[np.int64]
    choice_mask: NDArray[np.bool_]
    reward: NDArray[np.float64]
    step: NDArray[np.int64]
    uas: NDArray[np.int64]
    mission: NDArray[np.int64]
    missions: tuple[dict[str, Any], ...]

    def __len__(self) -> int:
        return len(self.step)

    def returns(self, discount: float = 1.0) -> NDArray[np.float64]:
        """(N,) the reward of each row and of all later ones of its UAS, discounted.

        Raises:
            ValueError: The discount is not between 0 and 1.
        """
        if not 0.0 <= discount <= 1.0:
            raise ValueError(f"discount is {discount!r}; give a number from 0 to 1")
        result = self.reward.copy()
        order = np.lexsort((self.step, self.uas, self.mission))[::-1]
        # from the last step of each UAS back
        for later, row in pairwise(order):
            if self.mission[row] == self.mission[later] and self.uas[row] == self.uas[later]:
                result[row] += discount * result[later]
        return result

    @classmethod
    def load(cls, directory: str | Path) -> Self:
        """Read what `uas-coverage planner demonstrate` has written; nothing is unpickled.

        Raises:
            InputError: There are none, or a file is damaged; names it.
        """
        paths = _files_in(Path(directory))
        if not paths:
            raise InputError(f"{directory}: holds no demonstrations (*.npz)")
        read = [_read(path) for path in paths]
        columns = {name: np.concatenate([rows[name] for rows, _ in read]) for name in _COLUMNS}
        lengths = [len(rows["step"]) for rows, _ in read]
        mission = np.repeat(np.arange(len(read)), lengths)
        return cls(**columns, mission=mission, missions=tuple(about for _, about in read))


def demonstrate(scenario: Scenario, planner: Planner | str, seed: int = 0) -> Demonstrations:
    """Fly one mission, as `rollout` does, and keep what a learner can imitate.

    Args:
        scenario: The mission.
        planner: A planner, or the name of an installed one.
        seed: Of the planner.

    Raises:
        InputError: Unknown planner, or it refuses the scenario.
        PlannerError: The planner raised an exception, or gave commands that cannot be flown.
    """
    watch = Demonstrator(scenario)
    return watch.shown(rollout(scenario, planner, seed, on_step=watch))


class Demonstrator:
    """Watches a flight, as `on_step` of `rollout`, for what a learner can imitate.

    Args:
        scenario: The mission.
    """

    def __init__(self, scenario: Scenario) -> None:
        self._observer = MissionInterface(MissionBrief.of(scenario))
        self._seen: list[_Seen] = []

    def __call__(self, progress: Progress) -> None:
        """See the swarm as learners do."""
        swarm = progress.swarm
        observation = self._observer.observe(swarm)
        self._seen.append(_Seen(swarm, observation, self._observer.candidates.copy()))

    def shown(self, flight: Flight) -> Demonstrations:
        """The flight that was watched."""
        scenario, seen = flight.scenario, self._seen
        about = {
            "scenario": scenario.name,
            "planner": flight.planner,
            "planner_options": dict(flight.planner_options),
            "seed": flight.seed,
            "steps": flight.steps,
            "ended": flight.ended,
            "covered": int(flight.covered[-1]),
            "waypoints": len(scenario.waypoints),
            "versions": dict(flight.versions),
        }
        next_covered = _next_covered(scenario, [each.swarm for each in seen])
        assert flight.reward_terms is not None  # as every rollout keeps them
        paid = flight.reward_terms.sum(axis=2)
        rows = [_rows_of(scenario, paid[k], k, seen, next_covered[k]) for k in range(len(seen) - 1)]
        columns = {name: np.concatenate([row[name] for row in rows]) for name in _COLUMNS}
        mission = np.zeros(len(columns["step"]), np.int64)
        return Demonstrations(**columns, mission=mission, missions=(about,))


def _rows_of(
    scenario: Scenario,
    paid: NDArray[np.float64],
    k: int,
    seen: Sequence[_Seen],
    next_covered: NDArray[np.int64],
) -> dict[str, NDArray[Any]]:
    swarm, observation, candidates = seen[k]
    flies = np.flatnonzero(swarm.status == FLYING)
    after = seen[k + 1].swarm.x[flies]
    asked = np.column_stack([after[:, S.VX], after[:, S.VY], -after[:, S.Z]])
    offered = candidates[flies] >= 0
    wanted = next_covered[flies, None]
    is_next = (candidates[flies] == wanted) & offered
    kind = kind_in(VELOCITY, scenario)
    choice = np.where(is_next.any(axis=1), is_next.argmax(axis=1), UNKNOWN_CHOICE)
    return {
        "observation": observation[flies],
        "velocity": _shares(kind.scaled_to(scenario)[flies], asked[:, : kind.size]),
        "choice": np.where(wanted[:, 0] < 0, HOME_CHOICE, choice),
        "choice_mask": np.column_stack([offered, np.ones(len(flies), np.bool_)]),
        "reward": paid[flies],
        "step": np.full(len(flies), swarm.step, np.int64),
        "uas": flies.astype(np.int64),
    }


def _shares(ranges: NDArray[np.float64], values: NDArray[np.float64]) -> NDArray[np.float32]:
    """Numbers of an action in ±1, from ranges (U, A, 3): lowest, middle, highest."""
    lowest, middle, highest = ranges[..., 0], ranges[..., 1], ranges[..., 2]
    reach = np.where(values > middle, highest - middle, middle - lowest)
    shares = np.divide(values - middle, reach, out=np.zeros_like(values), where=reach > 0.0)
    return shares.clip(-1.0, 1.0).astype(np.float32)


def _next_covered(scenario: Scenario, swarms: Sequence[SwarmState]) -> NDArray[np.int64]:
    """(K, U) the waypoint that each UAS covers next; -1: none any more.

    Of several UAS that come near in the same step, the one whose path comes nearest has covered it.
    """
    at_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    covers = np.full((len(swarms), len(scenario.uas)), -1, np.int64)
    for k in range(len(swarms) - 1, 0, -1):
        before, now = swarms[k - 1], swarms[k]
        covers[k - 1] = covers[k]
        flew = before.status == FLYING
        for w in np.flatnonzero(before.uncovered & ~now.uncovered):
            away_m = np.linalg.norm(now.x[:, S.X : S.X + 3] - at_m[w], axis=1)
            away_m[~flew] = math.inf
            if np.isfinite(away_m).any():
                covers[k - 1, away_m.argmin()] = w
    return covers


def written(demonstrations: Demonstrations) -> bytes:
    """One mission as a file: compressed columns, and what it is as JSON."""
    arrays = {name: getattr(demonstrations, name) for name in _COLUMNS}
    about = {"schema": SCHEMA, **demonstrations.missions[0]}
    text = np.frombuffer(json.dumps(about, sort_keys=True).encode(), np.uint8)
    buffer = io.BytesIO()
    np.savez_compressed(buffer, allow_pickle=False, about=text, **arrays)
    return buffer.getvalue()


@dataclass(frozen=True)
class _Mission:
    """What is read of a row of the store."""

    key: str
    scenario: str
    status: str


def _files_in(directory: Path) -> list[Path]:
    """The missions that a folder says it holds; of one without a store, all of its files."""
    if not (directory / STORE).exists():
        return sorted(directory.glob("*.npz"))
    missions = rows_in(directory, _Mission)
    return [directory / f"{one.scenario}.npz" for one in missions if one.status == "flown"]


def _read(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, Any]]:
    try:
        with zipfile.ZipFile(path) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST_FILE_BYTES:
                raise ValueError("holds more than 1 GiB")
        with np.load(path, allow_pickle=False) as file:
            about = json.loads(file["about"].tobytes())
            rows = {name: file[name] for name in _COLUMNS}
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile) as error:
        raise InputError(f"{path}: is damaged, or none of ours ({error})") from error
    if not isinstance(about, dict) or about.pop("schema", None) != SCHEMA:
        raise InputError(f"{path}: schema should be {SCHEMA}; write it again with this version")
    for name, (kind, width) in _COLUMNS.items():
        shape = (len(rows["step"]), *(() if width is None else (width,)))
        if rows[name].dtype != kind or rows[name].shape != shape:
            raise InputError(
                f"{path}: {name} is {rows[name].dtype} {rows[name].shape}; "
                f"should be {np.dtype(kind)} {shape}"
            )
        if not np.isfinite(rows[name]).all():
            raise InputError(f"{path}: {name} holds numbers that are not finite")
    return rows, about
