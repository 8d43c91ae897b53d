"""The missions of one environment, one after another."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from gymnasium.error import ResetNeeded

from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.env.episode.episode import Episode
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.files.suggestions import meant
from uas_coverage_env.scenario import MissionSource, Scenario
from uas_coverage_env.scenario.source import ScenarioLike


class MissionSequence:
    """Flies the same scenario again, or one that is drawn for each mission.

    Args:
        scenario: See `MissionSource.of`.
        settings: How missions are flown and paid.

    Attributes:
        source: Of the missions.
        episode: The mission that is flown; before the first one an example.

    Raises:
        ValueError: `scenario` is none of what is allowed; says what is.
    """

    def __init__(self, scenario: ScenarioLike, settings: MissionSettings) -> None:
        self.source = MissionSource.of(scenario)
        self._settings = settings
        self._flown = self.source.example
        self._drawn = self.source.fixed
        self._seed = int(np.random.default_rng().integers(SEEDS, dtype=np.uint64))
        self._mission = -1
        self.episode = self._made()

    @property
    def scenario(self) -> Scenario:
        """The scenario flown.

        Raises:
            ResetNeeded: It is drawn, and none was drawn yet.
        """
        if not self._drawn:
            raise ResetNeeded("no mission is drawn yet: call reset() first")
        return self.episode.scenario

    def begin(
        self, rng: np.random.Generator, options: Mapping[str, Any] | None, seed: int | None
    ) -> Episode:
        """Begin the next mission.

        Args:
            rng: To draw it with.
            options: Of `reset`: `scenario`, what to fly instead of drawing.
            seed: Of all that disturbances draw in this mission and in those after it, each of which
                draws other numbers; None: missions go on, at first from a seed of no meaning.

        Raises:
            ValueError: An option is wrong, or the mission does not fit; the former one goes on.
        """
        options = options or {}
        check_options(options, "scenario")
        given = options.get("scenario")
        scenario = self.source.draw(rng) if given is None else self.source.fitted(given)
        if scenario is not self._flown:
            self._flown = scenario
            self.episode = self._made()
        self._drawn = True
        if seed is not None:
            self._seed, self._mission = seed % SEEDS, -1
        self._mission += 1
        self.episode.reset(self._seed, self._mission)
        return self.episode

    def cut_after(self, steps: int) -> Episode:
        """Give missions another time limit; the one that is flown is over."""
        # all anew: return mode and observations reckon with it from the start
        self._settings = replace(self._settings, max_steps=steps)
        self.episode = self._made()
        return self.episode

    def _made(self) -> Episode:
        return Episode(self._flown, self._settings, self.source.room)


def check_options(options: Mapping[str, Any], *known: str) -> None:
    """Refuse misspelt options of `reset`; others are ignored, as PettingZoo's tests demand.

    Raises:
        ValueError: One is close to a known one; says which. Or they are no mapping.
    """
    if not isinstance(options, Mapping):
        raise ValueError(f"options of reset() are {options!r}; give a mapping from name to value")
    for name in options:
        close = meant(str(name), known)
        if close and name not in known:
            raise ValueError(f"reset() has no option {name!r}; did you mean {close!r}?")
