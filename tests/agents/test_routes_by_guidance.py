"""Routes of `learned-route` and `learned-velocity` in wind, and where guidance flies them."""

import numpy as np
import pytest
from tiny_trainings import untrained
from uas_coverage_agents.route import policy_runner
from uas_coverage_agents.route.velocity_runner import LEARNED_UP_TO_MPS
from uas_coverage_agents.training.velocity_learning import (
    DaggerRunner,
    DaggerSettings,
)

from uas_coverage_env import generate_scenario, rollout
from uas_coverage_env.flight import load_planner
from uas_coverage_env.flight.metrics import accomplished, energy_Wh
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.scenario import Wind, with_disturbances
from uas_coverage_env.world import GoTo, Velocity

BOTH = pytest.mark.parametrize("name", ["learned-route", "learned-velocity"])


@pytest.fixture(scope="module")
def town():
    return generate_scenario(seed=5, n_uas=2, n_waypoints=8, n_obstacles=0)


def _kinds(scenario, name):
    """The kinds of commands that are given at the start to UAS that cover."""
    planner, brief = load_planner(name), MissionBrief.of(scenario)
    planner.reset(brief, 0)
    commands = planner.act(first_sight(brief)).values()
    return {type(each) for each in commands if each.mode == "covering"}


@pytest.mark.parametrize(
    ("name", "in_more"), [("learned-route", Velocity), ("learned-velocity", GoTo)]
)
def test_guidance_flies_for_the_network_above_a_stated_mean_wind_not_for_the_search(
    town, name, in_more
):
    def in_wind(mean_mps):
        return town.model_copy(update={"wind": Wind(mean_mps=mean_mps, from_deg=0.0)})

    assert _kinds(town, name) == {Velocity}
    assert _kinds(in_wind(LEARNED_UP_TO_MPS), name) == {Velocity}
    assert _kinds(in_wind(LEARNED_UP_TO_MPS + 0.5), name) == {in_more}


def test_plans_are_searched_in_the_wind_that_each_uas_has_learnt(town, monkeypatch):
    believed, searched = [], policy_runner.plan_along

    def plan_along(*arguments):
        believed.append(arguments[-1])
        return searched(*arguments)

    monkeypatch.setattr(policy_runner, "plan_along", plan_along)
    rollout(town, "learned-route", max_steps=5)
    assert believed
    assert all(belief is None for belief in believed)
    believed.clear()
    wind = Wind(mean_mps=5.0, from_deg=180.0)
    rollout(town.model_copy(update={"wind": wind}), "learned-route", max_steps=12)
    north_mps, east_mps = believed[-1][:2]
    assert (north_mps, east_mps) == (pytest.approx(5.0, abs=0.5), pytest.approx(0.0, abs=0.2))


@BOTH
def test_in_a_moderate_wind_it_takes_less_energy_than_the_nearest_waypoint(name):
    windy = generate_scenario(seed=5000, disturbances="moderate")
    flight, nearest = rollout(windy, name), rollout(windy, "nearest-waypoint")
    assert accomplished(flight)
    assert energy_Wh(flight).sum() < 0.9 * energy_Wh(nearest).sum()


def test_a_network_flies_to_large_spheres_and_guidance_to_small_ones(town):
    def of_radius(radius_m):
        waypoints = [w.model_copy(update={"radius_m": radius_m}) for w in town.waypoints]
        return town.model_copy(update={"waypoints": tuple(waypoints)})

    assert _kinds(of_radius(9.5), "learned-velocity") == {Velocity}
    assert _kinds(of_radius(8.5), "learned-velocity") == {GoTo}
    assert _kinds(of_radius(8.5), "learned-route") == {Velocity}


def test_what_is_to_be_learned_is_flown_in_any_wind(town):
    training, rng = untrained(), np.random.default_rng(0)
    settings = DaggerSettings(samples=2)
    runner = DaggerRunner(training.learned(), training.expert, 1.0, settings, rng)
    rollout(with_disturbances(town, "strong", 1), runner, return_mode=False, max_steps=10)
    assert len(runner.labels) >= 10
