"""How well a planner or a policy flies: returns and measures of missions, drawn from seeds."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.flight.figure import NOTHING, ByName, Figure
from uas_coverage_env.flight.figures import computed, figures, repeated, rows_part
from uas_coverage_env.flight.flight import Flight, unless_stopped
from uas_coverage_env.flight.loop import rollout
from uas_coverage_env.flight.planner import Planner
from uas_coverage_env.flight.policy import as_planner
from uas_coverage_env.flight.registry import load_planner
from uas_coverage_env.scenario import MissionSource
from uas_coverage_env.scenario.source import ScenarioLike


@dataclass(frozen=True)
class Episode(ByName):
    """One mission, in numbers: `figures` (docs/flight_directory.md) are attributes of it, too.

    Attributes:
        seed: Of the mission, as in `reset(seed=...)`.
        scenario: Name of the scenario that it drew.
        reward_terms: Term -> its part of the return.
        figures: By name, as rows have them: `coverage`, `energy_Wh`, `steps`, `lost`, ...; not
            those of what it took to compute, so that a mission flown again is equal.
        failed_figures: Which could not be computed -> why.
    """

    seed: int
    scenario: str
    reward_terms: Mapping[str, float]
    figures: Mapping[str, bool | int | float | None]
    failed_figures: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, flight: Flight, seed: int) -> "Episode":
        """What a flight is in numbers."""
        values, failed = computed(flight)
        terms = values["reward_terms"] or {}
        row = rows_part(values)
        return cls(
            seed, flight.scenario.name, terms, {name: row[name] for name in repeated()}, failed
        )


@dataclass(frozen=True)
class Evaluation:
    """Some missions of one planner or policy; `print` shows the means.

    Attributes:
        episodes: In the order of the seeds.
    """

    episodes: tuple[Episode, ...]

    def mean(self, measure: str) -> float:
        """The mean of a figure over the missions that have it, or of a term of the reward.

        Raises:
            ValueError: No mission has it.
        """
        if measure in self.episodes[0].figures:
            found = [episode.figures[measure] for episode in self.episodes]
        else:
            found = [episode.reward_terms.get(measure) for episode in self.episodes]
        values = [value for value in found if value is not None]
        if not values:
            known = [*self.episodes[0].figures, *self.episodes[0].reward_terms]
            raise ValueError(f"no mission has {measure!r}; there are {', '.join(known)}")
        return float(np.mean(values))

    def __str__(self) -> str:
        """Means over the missions, a line for each figure; of what is counted, the sum."""
        terms = {f"  {name}": f"{self.mean(name):.2f}" for name in self.episodes[0].reward_terms}
        lines = {"missions": f"{len(self.episodes)}"}
        for name, figure in figures().items():
            if figure.shown and name in self.episodes[0].figures:
                lines[figure.label] = self._summed_up(figure)
            if name == "episode_return":
                lines |= terms
        wide = max(map(len, lines)) + 2
        failed = dict.fromkeys(
            why for each in self.episodes for why in each.failed_figures.values()
        )
        return "\n".join([*(f"{name:{wide}}{text}" for name, text in lines.items()), *failed])

    def _summed_up(self, figure: Figure) -> str:
        values = [episode.figures[figure.name] for episode in self.episodes]
        there = [value for value in values if value is not None]
        if not there:
            return NOTHING
        if figure.kind is bool:
            return f"{sum(there)} of {len(there)}"
        if figure.over == "total":
            return str(sum(there))
        if figure.kind is int:
            return f"{np.mean(there):.1f}"
        return figure.printed(float(np.mean(there)))


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
