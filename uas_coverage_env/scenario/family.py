"""Scenarios of a family: the counts are drawn from the seed too."""

import numpy as np

from uas_coverage_env.scenario.generator import generate_scenario
from uas_coverage_env.scenario.model import Scenario


def draw_scenario(
    seed: int,
    n_uas: tuple[int, int] = (1, 4),
    n_waypoints: tuple[int, int] = (20, 60),
    n_obstacles: tuple[int, int] = (5, 20),
) -> Scenario:
    """The generated scenario of a seed, with counts that the seed draws.

    The default ranges are those of the benchmarks and of the leaderboard's sets.

    Args:
        seed: From 0 on.
        n_uas: Least and most.
        n_waypoints: Least and most.
        n_obstacles: Least and most.

    Raises:
        ValueError: See `generate_scenario`.
    """
    lots = np.random.default_rng([seed, *n_waypoints, *n_obstacles])
    uas, waypoints, obstacles = (
        int(lots.integers(least, most + 1)) for least, most in (n_uas, n_waypoints, n_obstacles)
    )
    return generate_scenario(seed, n_uas=uas, n_waypoints=waypoints, n_obstacles=obstacles)
