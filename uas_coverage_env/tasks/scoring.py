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
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from typing import Any

import numpy as np

from uas_coverage_env.env.actions import actions_of
from uas_coverage_env.env.versions import V0
from uas_coverage_env.flight import Episode, Planner, Policy, as_planner, evaluate
from uas_coverage_env.leaderboard.statistics import Estimate, estimate
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.tasks.levels import level_named
from uas_coverage_env.tasks.task import Task, seeds_of

RANDOM = "random"
"""The policy that draws each action uniformly from the action space of the level."""

Entry = str | Planner | Policy
"""A name (of a planner, or `random`), a planner, or a function from observation to action."""


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
class MissionScore:
    """One mission of a planner.

    Attributes:
        seed: Of the mission.
        value: See above.
        episode_return: Sum of the rewards of all UAS.
        coverage: Share of the waypoints.
        energy_share: Energy drawn over what all batteries may give.
        lost: UAS that were lost.
        home: UAS that are home at the end.
        n_uas: UAS of the mission.
        steps: Until its end.
    """

    seed: int
    value: float
    episode_return: float
    coverage: float
    energy_share: float
    lost: int
    home: int
    n_uas: int
    steps: int


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
        """The mean of a measure of `MissionScore`."""
        return float(np.mean([getattr(mission, measure) for mission in self.missions]))


def mission_value(episode: Episode, scenario: Scenario) -> tuple[float, float]:
    """The value of a mission, and its share of energy, see above."""
    share = episode.energy_Wh / available_Wh(scenario)
    at_home = episode.home / episode.n_uas
    return episode.coverage * at_home * (1.0 - 0.5 * min(share, 1.0)), share


def available_Wh(scenario: Scenario) -> float:
    """What all batteries may give: charge above what must be left, at the mean voltage [Wh]."""
    total_Wh = 0.0
    for uas, vehicle in zip(scenario.uas, scenario.vehicles, strict=True):
        battery = vehicle.battery
        usable = uas.soc_0 - (1.0 - uas.dod_max)
        total_Wh += usable * battery.capacity_Ah * float(np.mean(battery.ocv_V))
    return total_Wh


def anchors_of(level: str) -> Anchors | None:
    """The published anchors of a level; None: there are none yet."""
    text = (files("uas_coverage_env.tasks") / "anchors.json").read_text("utf-8")
    found = json.loads(text).get(level)
    return None if found is None else Anchors(**found)


def score(
    planner: Entry,
    level: str,
    *,
    missions: int = 20,
    split: str = "test",
    swarm_of: int | None = None,
    on_mission: Callable[[MissionScore], object] | None = None,
    known: Sequence[MissionScore] = (),
    **chosen: Any,
) -> Score:
    """Fly the first missions of a split and score them.

    Args:
        planner: `random`, the name of a planner, a planner, or a policy. Planners fly with the
            assistants of the level, whatever they ask for.
        level: Its name.
        missions: How many.
        split: validation or test.
        swarm_of: For a policy of the whole swarm, see `as_planner`.
        on_mission: Called with each mission that was flown.
        known: Missions that were flown before; they are not repeated.
        **chosen: For a policy: action, observation and so on, where they are not the level's.

    Raises:
        InputError: Unknown planner, or it refuses a mission.
        ValueError: Unknown level or split, a number of missions that there is not, or a setting
            that is the level's affair.
    """
    task = level_named(level)
    seeds = seeds_of(split)
    if not 1 <= missions <= len(seeds):
        raise ValueError(f"missions is {missions}; give 1 to {len(seeds)}")
    before = {mission.seed: mission for mission in known}
    flown = []
    for seed in seeds[:missions]:
        mission = before.get(seed)
        if mission is None:
            mission = _flown(planner, task, seed, swarm_of, chosen)
            if on_mission is not None:
                on_mission(mission)
        flown.append(mission)
    return scored(level, flown)


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


def as_row(mission: MissionScore) -> dict[str, Any]:
    """A mission as plain data."""
    return asdict(mission)


def _by_training(missions: Sequence[MissionScore]) -> list[list[MissionScore]]:
    trainings: list[list[MissionScore]] = []
    flown: Counter[int] = Counter()
    for mission in missions:
        if flown[mission.seed] == len(trainings):
            trainings.append([])
        trainings[flown[mission.seed]].append(mission)
        flown[mission.seed] += 1
    return trainings


def _flown(
    planner: Entry, task: Task, seed: int, swarm_of: int | None, chosen: Mapping[str, Any]
) -> MissionScore:
    scenario = task.scenario(seed)
    settings = task.settings(**chosen)
    flies = planner
    if planner == RANDOM:
        space = actions_of(V0.kind_of(task.action), scenario).space()
        space.seed(seed)
        flies = as_planner(lambda seen: space.sample(), **settings)
    (episode,) = evaluate(flies, scenario, seeds=[seed], swarm_of=swarm_of, **settings).episodes
    value, energy_share = mission_value(episode, scenario)
    return MissionScore(
        seed=seed,
        value=value,
        episode_return=episode.episode_return,
        coverage=episode.coverage,
        energy_share=energy_share,
        lost=episode.lost,
        home=episode.home,
        n_uas=episode.n_uas,
        steps=episode.steps,
    )
