"""Levels of wind and of wrong models: light, moderate, strong. All of their numbers are here."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from uas_coverage_env.features.parameter_errors import Uncertainty
from uas_coverage_env.features.wind import RandomGusts, Wind
from uas_coverage_env.scenario.model import Scenario

REFERENCE_HEIGHT_M = 20.0
"""Where the mean wind of a level is reached: about where UAS fly."""

ROUGHNESS_M = 0.05
"""Of open country with few obstacles."""


@dataclass(frozen=True)
class DisturbanceLevel:
    """What a level draws from.

    Attributes:
        mean_mps: Least and largest mean wind at REFERENCE_HEIGHT_M; of each scenario it is drawn
            uniformly, likewise the direction.
        gusts: Its random gusts.
        uncertainty: Its bounds of the true vehicles.
        turbulence: Multiple of MIL-F-8785C.
    """

    mean_mps: tuple[float, float]
    gusts: RandomGusts
    uncertainty: Uncertainty
    turbulence: float = 1.0


DISTURBANCE_LEVELS: Mapping[str, DisturbanceLevel] = {
    "light": DisturbanceLevel(
        mean_mps=(1.0, 4.0),
        gusts=RandomGusts(per_min=0.5, peak_mps=1.5, lasts_s=6.0),
        uncertainty=Uncertainty(
            mass=0.02, thrust=0.02, drag=0.1, power=0.05,
            capacity_lost=0.05, resistance_gained=0.2,
        ),
    ),
    "moderate": DisturbanceLevel(
        mean_mps=(4.0, 7.0),
        gusts=RandomGusts(per_min=0.5, peak_mps=2.5, lasts_s=6.0),
        uncertainty=Uncertainty(
            mass=0.04, thrust=0.03, drag=0.2, power=0.08,
            capacity_lost=0.10, resistance_gained=0.4,
        ),
    ),
    "strong": DisturbanceLevel(
        mean_mps=(7.0, 10.0),
        gusts=RandomGusts(per_min=1.0, peak_mps=4.0, lasts_s=6.0),
        uncertainty=Uncertainty(
            mass=0.06, thrust=0.05, drag=0.3, power=0.10,
            capacity_lost=0.15, resistance_gained=0.6,
        ),
    ),
}  # fmt: skip
"""Name -> level, from weak to strong."""


def check_level(level: Any) -> None:
    """Refuse what is neither the name of a level nor None.

    Raises:
        ValueError: It is.
    """
    if level is not None and (not isinstance(level, str) or level not in DISTURBANCE_LEVELS):
        raise ValueError(
            f"disturbances is {level!r}; it should be {', '.join(DISTURBANCE_LEVELS)} or None"
        )


def with_disturbances(scenario: Scenario, level: str | None, seed: int) -> Scenario:
    """A scenario with the wind and the true vehicles of a level, in place of its own.

    Everything else is the same, but for the name, which says the level.

    Args:
        scenario: The scenario.
        level: light, moderate or strong; None: nothing changes.
        seed: Of the mean wind and its direction. Turbulence, gusts and vehicles are drawn in every
            mission, from the seed of that.

    Raises:
        ValueError: There is no such level.
    """
    check_level(level)
    if level is None:
        return scenario
    numbers = DISTURBANCE_LEVELS[level]
    rng = np.random.default_rng([seed, *level.encode()])
    wind = Wind(
        mean_mps=round(float(rng.uniform(*numbers.mean_mps)), 2),
        from_deg=round(float(rng.uniform(0.0, 360.0)), 1),
        reference_height_m=REFERENCE_HEIGHT_M,
        roughness_m=ROUGHNESS_M,
        turbulence=numbers.turbulence,
        random_gusts=numbers.gusts,
        power="rotor",
    )
    return scenario.model_copy(
        update={
            "name": f"{scenario.name}-{level}",
            "wind": wind,
            "uncertainty": numbers.uncertainty,
        }
    )
