"""How well a planner or a policy flies: returns and measures of missions, drawn from seeds."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.flight.flight import Flight
from uas_coverage_env.flight.interruption import unless_stopped
from uas_coverage_env.flight.loop import rollout
from uas_coverage_env.flight.metrics import (
    accomplished,
    coverage,
    energy_Wh,
    episode_return,
    home,
    reward_sums,
)
from uas_coverage_env.flight.planner import Planner
from uas_coverage_env.flight.policy import as_planner
from uas_coverage_env.flight.record import LOST
from uas_coverage_env.flight.registry import load_planner
from uas_coverage_env.scenario import MissionSource, ScenarioLike


@dataclass(frozen=True)
class Episode:
    """One mission, in numbers.

    Attributes:
        seed: Of the mission, as in `reset(seed=...)`.
        scenario: Name of the scenario that it drew.
        episode_return: Sum of the rewards of all UAS, not discounted.
        reward_terms: Term -> its part of the return.
        coverage: Fraction of the waypoints, 0..1.
        energy_Wh: Drawn by all UAS [Wh].
        steps: Until the last UAS was home, lost, or time was up.
        n_uas: UAS of the mission.
        home: UAS that have landed.
        lost: UAS that were lost.
        breaches: Samples closer than the safe distances, or below the least height.
        accomplished: Everything covered, all home, no violation.
    """

    seed: int
    scenario: str
    episode_return: float
    reward_terms: Mapping[str, float]
    coverage: float
    energy_Wh: float
    steps: int
    n_uas: int
    home: int
    lost: int
    breaches: int
    accomplished: bool

    @classmethod
    def of(cls, flight: Flight, seed: int) -> "Episode":
        """What a flight is in numbers."""
        return cls(
            seed=seed,
            scenario=flight.scenario.name,
            episode_return=episode_return(flight) or 0.0,
            reward_terms=reward_sums(flight),
            coverage=coverage(flight),
            energy_Wh=float(energy_Wh(flight).sum()),
            steps=flight.steps,
            n_uas=len(flight.names),
            home=int(home(flight).sum()),
            lost=int((flight.mode[-1] == LOST).sum()),
            breaches=flight.breaches,
            accomplished=accomplished(flight),
        )


@dataclass(frozen=True)
class Evaluation:
    """Some missions of one planner or policy; `print` shows the means.

    Attributes:
        episodes: In the order of the seeds.
    """

    episodes: tuple[Episode, ...]

    def mean(self, measure: str) -> float:
        """The mean of a measure of `Episode`, or of a term of the reward."""
        if measure in Episode.__dataclass_fields__:
            return float(np.mean([getattr(episode, measure) for episode in self.episodes]))
        return float(np.mean([episode.reward_terms[measure] for episode in self.episodes]))

    def __str__(self) -> str:
        """Means over the missions, a line for each measure."""
        lost = sum(episode.lost for episode in self.episodes)
        flown = sum(episode.n_uas for episode in self.episodes)
        terms = {name: f"{self.mean(name):.2f}" for name in self.episodes[0].reward_terms}
        lines = {
            "missions": f"{len(self.episodes)}",
            "return": f"{self.mean('episode_return'):.2f}",
            **{f"  {name}": value for name, value in terms.items()},
            "covered": f"{100.0 * self.mean('coverage'):.1f} %",
            "energy": f"{self.mean('energy_Wh'):.1f} Wh",
            "steps": f"{self.mean('steps'):.0f}",
            "lost": f"{lost} of {flown} UAS",
            "accomplished": f"{100.0 * self.mean('accomplished'):.0f} %",
        }
        return "\n".join(f"{name:16}{value}" for name, value in lines.items())


def evaluate(
    planner: str | Planner | Callable[[Any], Any],
    scenario: ScenarioLike = "village",
    *,
    seeds: Iterable[int] = range(10),
    swarm_of: int | None = None,
    on_episode: Callable[[Episode], object] | None = None,
    **settings: Any,
) -> Evaluation:
    """Fly a mission for each seed, and tell what an environment would have paid for it.

    The mission of a seed is that of `reset(seed=...)` of the environments with the same scenario
    and settings. Policies fly it as there, to the bit. Planners give commands and no actions:
    `action` and `observation` do not concern them.

    Args:
        planner: Name of a planner, a planner, or a policy: a function from observation to action,
            such as `lambda seen: model.predict(seen, deterministic=True)[0]`.
        scenario: What is flown, as the environments take it; a family draws a mission per seed.
        seeds: Of the missions, of what disturbances draw in them, and of the planner.
        swarm_of: For a policy of the whole swarm, see `as_planner`.
        on_episode: Called after each mission.
        **settings: Of the environment, see `MissionSettings`. Without `return_mode` and
            `safety_filter` a planner flies with those assistants that it asks for.

    Raises:
        InputError: Unknown scenario or planner, or the planner refuses a mission.
        ValueError: A setting is wrong, there is no seed, or an action is not of the action space.
        KeyboardInterrupt: A mission was stopped by hand.
    """
    source = MissionSource.of(scenario)
    made = MissionSettings.of(settings, beside=("seeds", "swarm_of", "on_episode"))
    flies: Any = load_planner(planner) if isinstance(planner, str) else planner
    if not hasattr(flies, "act"):
        flies = as_planner(flies, swarm_of=swarm_of, **settings)
    episodes = []
    for seed in seeds:
        drawn = made.limited(source.draw(np.random.default_rng(seed)))
        flight = rollout(
            drawn,
            flies,
            seed,
            dynamics=made.dynamics,
            return_mode=settings.get("return_mode"),
            safety_filter=settings.get("safety_filter"),
            disturbances=made.disturbances,
            reward=made.reward,
            reward_weights=made.reward_weights,
        )
        episodes.append(Episode.of(unless_stopped(flight), seed))
        if on_episode is not None:
            on_episode(episodes[-1])
    if not episodes:
        raise ValueError("seeds are empty; give at least one, as in range(10)")
    return Evaluation(tuple(episodes))
