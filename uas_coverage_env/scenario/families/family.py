"""What a family of scenarios is: what environments take as `scenario=` and draw from."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from uas_coverage_env.scenario.families.site import Rng, Size
from uas_coverage_env.scenario.levels import check_level, with_disturbances
from uas_coverage_env.scenario.model import Scenario
from uas_coverage_env.scenario.room import MOVING, Room

_SEEDS = 2**31


class FamilyOfSeeds(ABC):
    """Scenarios that are functions of a seed; where one is drawn, its seed is."""

    @property
    @abstractmethod
    def room(self) -> Room:
        """The most that a mission may have."""

    @abstractmethod
    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed."""

    def __call__(self, rng: Rng) -> Scenario:
        """Draw a scenario."""
        # above the seeds of every set that planners are compared on: nothing is trained on those
        return self.of_seed(int(rng.integers(_SEEDS, 2 * _SEEDS)))


@dataclass(frozen=True)
class Family:
    """Draws scenarios of one kind.

    Attributes:
        draw: (rng, size) -> a scenario that it draws with this generator alone.
        size: How large the missions are.
        n_moving: The most moving obstacles that it draws.
        disturbances: Level of wind and wrong models, see `DISTURBANCE_LEVELS`; None: still air.

    Raises:
        ValueError: There is no such level.
    """

    draw: Callable[[Rng, Size], Scenario]
    size: Size = field(default_factory=Size)
    n_moving: int = 0
    disturbances: str | None = None

    def __post_init__(self) -> None:
        check_level(self.disturbances)

    def __call__(self, rng: Rng) -> Scenario:
        """Draw a scenario."""
        scenario = self.draw(rng, self.size)
        return with_disturbances(scenario, self.disturbances, int(rng.integers(_SEEDS)))

    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed: the one that an environment draws after `reset(seed=seed)`."""
        return self(np.random.default_rng(seed))

    def sized(self, **size: Any) -> "Family":
        """The same family with missions of another size, see `Size`."""
        return replace(self, size=replace(self.size, **size))

    @property
    def room(self) -> Room:
        """The most that a mission may have."""
        return Room(self.size.n_uas[1], self.size.n_waypoints[1], max(MOVING, self.n_moving))
