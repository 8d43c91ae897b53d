"""Flights to look at: the village for a minute, with predictions and a violation put in."""

import dataclasses
import itertools

import numpy as np
import pytest
from chromium import started

from uas_coverage_env.flight import MODES, Flight, Violation, load_planner, rollout
from uas_coverage_env.flight.record import PLAN_DTYPE
from uas_coverage_env.scenario import generate_scenario, load_scenario
from uas_coverage_env.vehicle.layout import DOD

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


@pytest.fixture(scope="session")
def discharged(plain) -> Flight:
    """The second UAS loses charge so fast that on the way it cannot be sure to come home."""
    x = plain.x.copy()
    x[:, 1, DOD] += np.linspace(0.0, 0.2, len(x))
    return dataclasses.replace(plain, x=x)


@pytest.fixture(scope="session")
def swarm():
    """Thirty UAS, the second half of which has landed after two steps."""
    town = generate_scenario(seed=5, n_uas=30, n_waypoints=60, n_obstacles=5)
    flown = rollout(town, load_planner("hover"), max_steps=4)
    mode = flown.mode.copy()
    mode[2:, 15:] = MODES.index("landed")
    return dataclasses.replace(flown, mode=mode)


@pytest.fixture(scope="module")
def browser():
    driver = started()
    yield driver
    driver.quit()


@pytest.fixture(scope="module")
def browser_without_webgl():
    driver = started("--disable-3d-apis")
    yield driver
    driver.quit()
