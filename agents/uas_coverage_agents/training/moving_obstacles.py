"""Moving obstacles for generated towns, which have none."""

from collections.abc import Sequence

import numpy as np

from uas_coverage_env.scenario import MovingObstacle, Scenario, ScheduledVelocity

_SAFE_DISTANCE_M = (3.0, 25.0)
_DEPARTURE_S = (20.0, 200.0)
_SPEED_MPS = (0.5, 3.0)
_FREE_WEST_M = 100.0
"""The west belongs to the starts [m]."""


def some_with_moving_obstacles(
    scenarios: Sequence[Scenario], share: float, seed: int
) -> list[Scenario]:
    """The scenarios, a share of them with moving obstacles; each seed of a training draws others.

    Args:
        scenarios: Of the training.
        share: Of those that get some, 0 to 1.
        seed: Of the training.
    """
    rng = np.random.default_rng([seed, len(scenarios)])
    moving = rng.random(len(scenarios)) < share
    return [
        with_moving_obstacles(scenario, seed * len(scenarios) + number) if moves else scenario
        for number, (scenario, moves) in enumerate(zip(scenarios, moving, strict=True))
    ]


def with_moving_obstacles(scenario: Scenario, seed: int) -> Scenario:
    """The scenario with one or two obstacles that are parked and leave, or cross it slowly."""
    rng = np.random.default_rng(seed)
    corners_m = np.array(scenario.geofence.vertices_m)
    moving = tuple(
        _moving_obstacle(rng, f"moving_{m + 1}", corners_m.min(axis=0), corners_m.max(axis=0))
        for m in range(int(rng.integers(1, 3)))
    )
    return scenario.model_copy(update={"moving_obstacles": moving})


def _moving_obstacle(
    rng: np.random.Generator, name: str, low_m: np.ndarray, high_m: np.ndarray
) -> MovingObstacle:
    west_m = min(low_m[1] + _FREE_WEST_M, high_m[1])
    start_m = rng.uniform((low_m[0], west_m), high_m[:2])
    if rng.random() < 0.5:
        leaves_s = float(rng.uniform(*_DEPARTURE_S))
        pieces = (
            (0.0, (0.0, 0.0, 0.0)),
            (leaves_s, (0.0, 0.0, -3.0)),
            (leaves_s + 6.0, (0.0, 15.0, -2.0)),
            (leaves_s + 66.0, (0.0, 0.0, 0.0)),
        )
    else:
        heading = float(rng.uniform(0.0, 2.0 * np.pi))
        speed_mps = float(rng.uniform(*_SPEED_MPS))
        pieces = ((0.0, (speed_mps * np.cos(heading), speed_mps * np.sin(heading), 0.0)),)
    return MovingObstacle(
        name=name,
        radius_m=8.0,
        height_m=float(rng.uniform(6.0, 30.0)),
        safe_distance_m=float(rng.uniform(*_SAFE_DISTANCE_M)),
        start_m=(float(start_m[0]), float(start_m[1]), -5.0),
        schedule=tuple(
            ScheduledVelocity(from_s=from_s, velocity_mps=velocity_mps)
            for from_s, velocity_mps in pieces
        ),
    )
