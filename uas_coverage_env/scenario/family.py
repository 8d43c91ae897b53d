"""Scenarios of a family: the counts are drawn from the seed too."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from uas_coverage_env.scenario.families import BUILT_IN
from uas_coverage_env.scenario.flood_village import FLOOD_VILLAGE, flood_village
from uas_coverage_env.scenario.generator import generate_scenario
from uas_coverage_env.scenario.levels import LEVELS, check_level
from uas_coverage_env.scenario.model import Scenario

Range = tuple[int, int]
"""Least and most."""

N_UAS, N_WAYPOINTS, N_OBSTACLES = (1, 4), (20, 60), (5, 20)
"""The ranges of the benchmarks and of the leaderboard's sets."""

MIN_HEIGHT_M = 3.0
"""The least height of the benchmarks, of the family and of the leaderboard's sets [m]."""

# above the seeds of every set that planners are compared on: nothing is trained on those
_SEEDS = (2**31, 2**32)


def sample_scenario(
    seed: int,
    n_uas: Range = N_UAS,
    n_waypoints: Range = N_WAYPOINTS,
    n_obstacles: Range = N_OBSTACLES,
    min_height_m: float = MIN_HEIGHT_M,
    disturbances: str | None = None,
) -> Scenario:
    """The generated scenario of a seed, with counts that the seed draws.

    Args:
        seed: From 0 on.
        n_uas: Least and most.
        n_waypoints: Least and most.
        n_obstacles: Least and most.
        min_height_m: See `generate_scenario`.
        disturbances: Likewise.

    Raises:
        ValueError: See `generate_scenario`.
    """
    rng = np.random.default_rng([seed, *n_waypoints, *n_obstacles])
    uas, waypoints, obstacles = (
        int(rng.integers(least, most + 1)) for least, most in (n_uas, n_waypoints, n_obstacles)
    )
    return generate_scenario(
        seed,
        n_uas=uas,
        n_waypoints=waypoints,
        n_obstacles=obstacles,
        min_height_m=min_height_m,
        disturbances=disturbances,
    )


@dataclass(frozen=True)
class GeneratedScenarios:
    """A family of generated scenarios: an environment's `scenario=` that draws one at each reset.

    Called with a generator of random numbers it draws a seed, and `sample_scenario` does the rest.
    The seeds are above those of the leaderboard's sets, which nothing should be trained on.

    Attributes:
        n_uas: Least and most.
        n_waypoints: Least and most.
        n_obstacles: Least and most.
        min_height_m: See `generate_scenario`.
        disturbances: Likewise; turbulence, gusts and vehicles are drawn in every mission.

    Raises:
        ValueError: A range is not two whole numbers, the least first, or there is no such level.
    """

    n_uas: Range = N_UAS
    n_waypoints: Range = N_WAYPOINTS
    n_obstacles: Range = N_OBSTACLES
    min_height_m: float = MIN_HEIGHT_M
    disturbances: str | None = None

    def __post_init__(self) -> None:
        check_level(self.disturbances)
        for name in ("n_uas", "n_waypoints", "n_obstacles"):
            given = getattr(self, name)
            pair = isinstance(given, tuple | list) and len(given) == 2
            if not pair or not all(type(count) is int for count in given) or given[0] > given[1]:
                raise ValueError(f"{name} is {given!r}; give least and most, as in (2, 4)")
            object.__setattr__(self, name, tuple(given))

    def __call__(self, rng: np.random.Generator) -> Scenario:
        """Draw a scenario."""
        seed = int(rng.integers(*_SEEDS))
        return sample_scenario(seed, **vars(self))


FAMILIES: Mapping[str, GeneratedScenarios] = {
    "generated": GeneratedScenarios(),
    **{f"generated-{level}": GeneratedScenarios(disturbances=level) for level in LEVELS},
}
"""The families that are known by name."""

ALIASES: Mapping[str, str] = {"town": "generated"}
"""Other names of series: generated scenarios are towns, and named so."""

SERIES: Mapping[str, Callable[[int], Scenario]] = {
    "generated": sample_scenario,
    **{f"generated-{level}": partial(sample_scenario, disturbances=level) for level in LEVELS},
    FLOOD_VILLAGE: flood_village,
    **{name: family.of_seed for name, family in BUILT_IN.items()},
}
"""Scenarios that are known by a name and a seed: name -> the scenario of a seed."""
