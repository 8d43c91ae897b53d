"""The errors of sensors, as records for kernels."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.scenario import Scenario

SENSING_DTYPE = record_dtype(
    [
        # standard deviations; of what a mission draws once (bias), or at each sample
        ("position_noise_m", "f8"),
        ("position_bias_m", "f8"),
        ("velocity_noise_mps", "f8"),
        ("velocity_bias_mps", "f8"),
        ("charge_bias", "f8"),
        ("delay_steps", "i8"),
    ]
)


def senses(scenario: Scenario) -> bool:
    """Whether what is known of the UAS may be another than what is true."""
    return scenario.sensing is not None or any(event.senses for event in scenario.events)


def sensing_records(scenario: Scenario) -> NDArray[np.void]:
    """(S,) of SENSING_DTYPE: one for each UAS, or none where all are known as they are."""
    sensing = scenario.sensing
    records = np.zeros(len(scenario.uas) if senses(scenario) else 0, dtype=SENSING_DTYPE)
    if sensing is not None:
        for name in SENSING_DTYPE.names or ():
            records[name] = getattr(sensing, name)
    return records
