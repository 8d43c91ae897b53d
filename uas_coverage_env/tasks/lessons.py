"""Lessons: levels with one thing made easier, to learn on; no score is given on them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from uas_coverage_env.scenario import Scenario


@dataclass(frozen=True)
class Lesson:
    """What is easier than on the level.

    Attributes:
        meaning: That, in a sentence.
        of: From a mission of the level to one of the lesson; None: it is the same.
        task: Fields of `Task` that are other than the level's.
    """

    meaning: str
    of: Callable[[Scenario], Scenario] | None = None
    task: Mapping[str, Any] = field(default_factory=dict)


WIDE_M, FAST_MPS = 8.0, 3.0
"""From where, and how fast, a UAS can land in the lesson `landing`; else 2 m and 0.5 m/s."""

FEW = 2
"""Waypoints for each UAS in the lesson `few`."""


def wide_landing(scenario: Scenario) -> Scenario:
    """The mission with landings that noise can find."""
    wide = {"landing_distance_m": WIDE_M, "landing_speed_mps": FAST_MPS}
    return scenario.model_copy(update=wide)


def few_waypoints(scenario: Scenario) -> Scenario:
    """The mission with two waypoints for each UAS, spread over its area as all of them are."""
    every = scenario.waypoints
    n = min(FEW * len(scenario.uas), len(every))
    kept = tuple(every[k * len(every) // n] for k in range(n))
    return scenario.model_copy(update={"waypoints": kept})


def nearest_waypoints(scenario: Scenario) -> Scenario:
    """The mission with a waypoint for each UAS, those nearest to the starts: soon all come home."""
    places_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
    starts_m = np.array([uas.start_m for uas in scenario.uas])
    away_m = np.linalg.norm(places_m[:, np.newaxis] - starts_m, axis=2).min(axis=1)
    nearest = np.sort(np.argsort(away_m, kind="stable")[: len(starts_m)])
    return scenario.model_copy(update={"waypoints": tuple(scenario.waypoints[k] for k in nearest)})


def full_batteries(scenario: Scenario) -> Scenario:
    """The mission with every battery full at its beginning."""
    fleet = tuple(uas.model_copy(update={"soc_0": 1.0}) for uas in scenario.uas)
    return scenario.model_copy(update={"uas": fleet})


LESSONS: dict[str, Lesson] = {
    "landing": Lesson(
        f"a UAS can land from {WIDE_M:g} m and {FAST_MPS:g} m/s instead of 2 m and 0.5 m/s",
        wide_landing,
    ),
    "few": Lesson(f"{FEW} waypoints for each UAS", few_waypoints),
    "near": Lesson("a waypoint for each UAS, those nearest to the starts", nearest_waypoints),
    "charged": Lesson("every battery is full at the beginning", full_batteries),
    "assisted": Lesson(
        "return mode and safety filter are on", task={"return_mode": True, "safety_filter": True}
    ),
}
"""Name -> lesson; one of your own is one entry more."""
