"""A score of a level: one number per mission, made of coverage, losses and energy.

The value of a mission is

    v = c · h · (1 - e / 2)

with c the share of waypoints covered, h the share of the fleet that is home at the end, and e the
energy drawn over what all batteries may give. The score is v between that of the random policy (0)
and that of the best planner (1):

    score = (v - v_random) / (v_best - v_random)

It may be above 1 or below 0. Scores of several missions are summed up by the interquartile mean
with a 95 % bootstrap interval over missions, or over trainings where several policies of one
learner are given (R. Agarwal et al., NeurIPS 2021). Both anchors are interquartile means over the
test missions of the level, so that random policy and best planner have exactly 0 and 1 there; they
are published with the package (`anchors.json`).
"""

import json
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from types import SimpleNamespace
from typing import Any, Self

import numpy as np

from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.flight import Planner, as_planner
from uas_coverage_env.flight.figure import ByName
from uas_coverage_env.flight.figures import repeated
from uas_coverage_env.flight.policy import Policy, PolicyFunction
from uas_coverage_env.leaderboard import PlannerSpec, Row
from uas_coverage_env.leaderboard.flying import flown
from uas_coverage_env.leaderboard.scenario_sets import scenario_hash
from uas_coverage_env.leaderboard.statistics import Estimate, estimate
from uas_coverage_env.leaderboard.sweep import Entry
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.tasks.in_batch import BatchedPolicy, flown_in_batches
from uas_coverage_env.tasks.levels import level_named
from uas_coverage_env.tasks.task import Task

RANDOM = "random"
"""The policy that draws each action uniformly from the action space of the level."""

DESCRIPTION = {"command": "score"}
"""What a store of scored missions says of itself: levels and planners can be added to it."""


@dataclass(frozen=True)
class Anchors:
    """Between which values scores lie.

    Attributes:
        random: Interquartile mean of the values of the random policy: score 0.
        best: That of the best planner: score 1.
        best_planner: Which planner that is.
        missions: Over how many test missions.
    """

    random: float
    best: float
    best_planner: str
    missions: int


@dataclass(frozen=True)
class MissionScore(ByName):
    """One mission of a planner.

    Attributes:
        seed: Of the mission.
        value: See above.
        figures: Of its flight (docs/flight_directory.md), by name, but for those of what it took
            to compute; they are attributes of it, too.
    """

    seed: int
    value: float
    figures: Mapping[str, bool | int | float | None]

    @classmethod
    def of(cls, row: Row) -> Self:
        """The score of a flight; one that could not be flown is worth nothing."""
        found = {name: getattr(row, name) for name in repeated()}
        return cls(row.seed, mission_value(row), found)


@dataclass(frozen=True)
class Score:
    """A planner on a level, summed up over missions.

    Attributes:
        level: Which.
        missions: One for each seed.
        score: Interquartile mean with its interval; None in it where there are no anchors.
    """

    level: str
    missions: tuple[MissionScore, ...]
    score: Estimate

    def mean(self, measure: str) -> float:
        """The mean of the value, or of a figure of the missions that have it; 0: none has."""
        found = [getattr(mission, measure) for mission in self.missions]
        there = [value for value in found if value is not None]
        return float(np.mean(there)) if there else 0.0


def mission_value(flown: Any) -> float:
    """The value of a mission, see above, of what has its figures: a row, an episode."""
    at_home = flown.home / flown.n_uas
    return flown.coverage * at_home * (1.0 - 0.5 * min(flown.energy_share or 0.0, 1.0))


def anchors_of(level: str) -> Anchors | None:
    """The published anchors of a level; None: there are none yet.

    The best planner flies the same in all versions of the environments, random actions do not.
    """
    published = json.loads((files("uas_coverage_env.tasks") / "anchors.json").read_text("utf-8"))
    if level not in published:
        return None
    return Anchors(**{**published.get(level_named(level).level, {}), **published[level]})


def score(
    planner: str | Planner | Policy,
    level: str,
    *,
    missions: int = 20,
    split: str = "test",
    swarm_of: int | None = None,
    batch: int | None = None,
    on_mission: Callable[[MissionScore], object] | None = None,
    **chosen: Any,
) -> Score:
    """Fly the first missions of a split and score them.

    The seeds of the missions are `seeds_of(split)[:missions]`. A seed draws the mission, and in its
    flight whatever disturbances draw (gusts): `CoverageBatch.reset(seeds, scenarios=...)` flies the
    same. Other seeds are other gusts, which move single missions of `hard` by up to half a point,
    and means of 50 by some 0.03.

    Args:
        planner: `random`, the name of a planner, a planner, or a policy: a function from
            observation to action. Planners fly with the assistants of the level, whatever they
            ask for.
        level: Its name.
        missions: How many.
        split: validation or test.
        swarm_of: For a policy of the whole swarm, see `as_planner`.
        batch: For a policy that takes the observations of many at once, (N, …), and returns N
            actions, and for `policy:DIR` of what a library has learned: how many missions are flown
            side by side, which is much faster. The same values to the last digit, where it answers
            each row as it would by itself; figures that a batch does not measure are None. None:
            missions are flown one by one.
        on_mission: Called with each mission that was flown.
        **chosen: For a policy: action, observation and so on, where they are not the level's.

    Raises:
        InputError: Unknown planner, or it refuses a mission.
        PlannerError: The planner raised an exception, or gave commands that cannot be flown.
        ValueError: Unknown level or split, a number of missions that there is not, or a setting
            that is the level's affair.
    """
    task = level_named(level)
    drawn = task.scenarios(split, missions)
    if batch is None:
        flown_one = _flown_one_by_one(spec_of(planner, task, swarm_of, chosen), task, drawn)
    else:
        flown_one = _flown_side_by_side(planner, task, drawn, batch, swarm_of, chosen)
    found = []
    for mission in flown_one:
        if on_mission is not None:
            on_mission(mission)
        found.append(mission)
    return scored(level, found)


def spec_of(
    planner: str | Planner | Policy,
    task: Task,
    swarm_of: int | None = None,
    chosen: Mapping[str, Any] | None = None,
) -> PlannerSpec:
    """What is scored.

    Args:
        planner: See `score`.
        task: The level.
        swarm_of: See `score`.
        chosen: See `score`.

    Raises:
        InputError: Unknown planner.
        ValueError: A setting is wrong, or the level's affair.
    """
    settings = task.settings(**(chosen or {}))
    if planner == RANDOM:
        return _Random(RANDOM, RANDOM, {}, "", "uas_coverage_env", settings)
    if isinstance(planner, str):
        return PlannerSpec.named(planner, planner)
    flies: Any = planner
    if not hasattr(planner, "act"):
        flies = as_planner(flies, swarm_of=swarm_of, **settings)
    return _InMemory("", type(planner).__name__, {}, "", "", flies)


def entry_of(spec: PlannerSpec, task: Task, seed: int, scenario: Scenario) -> Entry:
    """The flight of a mission of a level."""
    limited = MissionSettings(max_steps=task.max_steps).limited(scenario)
    return Entry(
        limited,
        scenario_hash(limited),
        spec,
        seed,
        safety_filter=task.safety_filter,
        return_mode=task.return_mode,
        environment=task.version,
        reward_weights=task.reward_weights,
        level=task.name,
    )


def _flown_one_by_one(
    spec: PlannerSpec, task: Task, missions: Mapping[int, Scenario]
) -> Iterator[MissionScore]:
    """Missions of a level as a planner or a policy flies them, in this process."""
    for seed, scenario in missions.items():
        entry = entry_of(spec, task, seed, scenario)
        yield MissionScore.of(Row.of(entry, flown(entry), ""))


def _flown_side_by_side(
    policy: Any,
    task: Task,
    missions: Mapping[int, Scenario],
    batch: int,
    swarm_of: int | None,
    chosen: Mapping[str, Any],
) -> Iterator[MissionScore]:
    """Missions of a level as a policy flies them, many at once."""
    offered = batched(policy, task)
    if offered is not None:
        policy, swarm_of, _, own = offered
        chosen = {**own, **chosen}
    if not callable(policy) or hasattr(policy, "act"):
        raise ValueError(
            f"batch is {batch}, and {policy!r} is no policy; give a function from observations "
            f"(N, …) to N actions, or leave batch out"
        )
    whole = isinstance(batch, int) and not isinstance(batch, bool)
    if not whole or batch < 1:
        raise ValueError(f"batch is {batch!r}; give a whole number from 1 on, or None")
    measured = repeated()
    settings = task.settings(**chosen)
    for seed, found in flown_in_batches(policy, missions, settings, batch, swarm_of):
        every = {name: found.get(name) for name in measured}
        yield MissionScore(seed, mission_value(SimpleNamespace(**every)), every)


def batched(planner: Any, task: Task) -> BatchedPolicy | None:
    """What a planner offers to fly missions of a level side by side; None: one by one.

    Raises:
        InputError: Unknown planner.
    """
    if isinstance(planner, str) and planner != RANDOM:
        planner = PlannerSpec.named(planner, planner).load()
    offered = getattr(planner, "in_batch", None)
    return offered if offered is not None and offered.version == task.version else None


class RandomPolicy(PolicyFunction):
    """Draws each action uniformly from the action space; the seed of a mission repeats it.

    Args:
        settings: Of the environments of the level.
    """

    def __init__(self, settings: Mapping[str, Any]) -> None:
        super().__init__(self._drawn, MissionSettings.of(settings))

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission."""
        super().reset(brief, seed)
        self._space = self._interface.actions.space()
        self._space.seed(seed)

    def _drawn(self, seen: Any) -> Any:
        return self._space.sample()


@dataclass(frozen=True)
class _Random(PlannerSpec):
    """The random policy of a level."""

    settings: Mapping[str, Any] = field(default_factory=dict)

    def load(self) -> Planner:
        return RandomPolicy(self.settings)


@dataclass(frozen=True)
class _InMemory(PlannerSpec):
    """A planner that has no name."""

    planner_itself: Any = field(default=None, compare=False)

    def load(self) -> Planner:
        return self.planner_itself


def scored(level: str, missions: Sequence[MissionScore]) -> Score:
    """Missions of a planner, summed up.

    Args:
        level: Its name.
        missions: Where a seed comes again, it was flown by another training of the same learner:
            the first by the first, and so on; the interval is over trainings then.
    """
    anchors = anchors_of(level)
    if anchors is None or not anchors.best > anchors.random:
        return Score(level, tuple(missions), Estimate(None, None, None, len(missions)))
    drawn = _by_training(missions)
    if len(drawn) == 1:
        drawn = [[mission] for mission in missions]
    values = [np.array([mission.value for mission in each]) for each in drawn]
    shares = [(each - anchors.random) / (anchors.best - anchors.random) for each in values]
    return Score(level, tuple(missions), estimate(shares, "scenarios"))


def _by_training(missions: Sequence[MissionScore]) -> list[list[MissionScore]]:
    trainings: list[list[MissionScore]] = []
    flown: Counter[int] = Counter()
    for mission in missions:
        if flown[mission.seed] == len(trainings):
            trainings.append([])
        trainings[flown[mission.seed]].append(mission)
        flown[mission.seed] += 1
    return trainings
