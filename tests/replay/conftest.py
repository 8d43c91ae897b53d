"""Flights to look at: the village for a minute, with predictions and a violation put in."""

import dataclasses
import itertools

import numpy as np
import pytest

from uas_coverage_env.flight import Flight, Violation, load_planner, rollout
from uas_coverage_env.flight.record import PLAN_DTYPE
from uas_coverage_env.scenario import load_scenario

HORIZON = 18


@pytest.fixture(scope="session")
def plain() -> Flight:
    return rollout(load_scenario("village"), load_planner("nearest-waypoint"), max_steps=60)


@pytest.fixture(scope="session")
def flight(plain) -> Flight:
    """Every decision predicts the horizon, straight on; one contact is noted at 30 s."""
    rows = [
        (k, i, n, plain.x[k, i, :3] + n * plain.x[k, i, 3:6])
        for k, i, n in itertools.product(range(plain.steps), range(2), range(HORIZON))
    ]
    return dataclasses.replace(
        plain,
        plan=np.array(rows, PLAN_DTYPE),
        violations=(Violation(30.0, "uas_1", "obstacle", "church"),),
    )
