"""In wind no flight goes as planned: `trajectory` then pursues its order, or steers along it."""

import numpy as np
import pytest
from small_fleets import field
from uas_coverage_baselines.trajectory import Trajectory
from uas_coverage_baselines.trajectory.steering import FAILURES, Failures

from uas_coverage_env import rollout
from uas_coverage_env.flight import MODES
from uas_coverage_env.flight.metrics import accomplished, coverage, energy_Wh, home
from uas_coverage_env.scenario import Wind
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS
from uas_coverage_env.tasks import level_named, seeds_of

STARTS_M = ((20.0, 20.0, -1.0), (180.0, 20.0, -1.0))


def windy(mean_mps, **more):
    wind = Wind(mean_mps=mean_mps, from_deg=240.0, turbulence=1.0, reference_height_m=20.0,
                roughness_m=0.05, power="rotor")  # fmt: skip
    town = field(starts_m=STARTS_M)
    return town.model_copy(update={"wind": wind, **more})


def planner():
    return Trajectory(Trajectory.Options(orders=1, moves=20_000, programs=20))


@pytest.mark.parametrize("mean_mps", [2.0, 6.5])
def test_a_mission_in_wind_is_accomplished_without_violation(mean_mps):
    scenario = windy(mean_mps, uncertainty=DISTURBANCE_LEVELS["moderate"].uncertainty)
    flight = rollout(scenario, planner(), seed=3)
    assert accomplished(flight)
    assert flight.steps < 110


def test_the_waypoints_of_a_uas_that_is_lost_in_wind_are_covered_by_the_other():
    lost = {"kind": "uas_lost", "at_s": 20.0, "uas": "uas_1"}
    flight = rollout(windy(4.0, events=(lost,)), planner(), seed=1)
    assert accomplished(flight)


def test_a_uas_flies_home_in_time_where_no_return_mode_calls_it():
    uas = tuple(one.model_copy(update={"soc_0": 0.3}) for one in windy(2.0).uas)
    scenario = windy(2.0, uas=uas, uncertainty=DISTURBANCE_LEVELS["moderate"].uncertainty)
    flight = rollout(scenario, planner(), seed=3, return_mode=False, safety_filter=False)
    assert not flight.violations
    assert home(flight).all()
    assert 0.0 < coverage(flight) < 1.0


def test_in_still_air_nothing_is_steered():
    flown = planner()
    flight = rollout(field(starts_m=STARTS_M), flown)
    assert accomplished(flight)
    assert not flight.safety_filter
    assert {decision.fallback for decision in flight.decisions} == {False}


@pytest.mark.parametrize("assistants", [(False, True), (True, False), (True, True)])
def test_what_assistants_change_is_taken_for_no_disturbance(assistants):
    return_mode, safety_filter = assistants
    scenario = level_named("easy").scenario(seeds_of("test")[0])
    alone, flown = rollout(scenario, planner()), planner()
    flight = rollout(scenario, flown, return_mode=return_mode, safety_filter=safety_filter)
    assert accomplished(flight)
    assert not flight.violations
    assert any(decision.filtered for decision in flight.decisions) == safety_filter
    assert flown.steering is None
    # guidance alone takes 1.8 times the energy
    assert float(energy_Wh(flight).sum()) < 1.35 * float(energy_Wh(alone).sum())


def test_in_strong_wind_nothing_is_flown_as_planned_for_long():
    flight = rollout(windy(9.0), planner(), seed=3)
    assert not flight.violations
    assert all(mode in ("landed", "lost") for mode in map(MODES.__getitem__, flight.mode[-1]))


def test_few_late_steps_are_forgiven_and_many_are_not():
    failures = Failures()
    for _ in range(100):
        failures.add(0.1)
        assert not failures.are_many
        failures.next_step()
    failures.add(np.nextafter(FAILURES, 9.0))
    assert failures.are_many


def test_the_record_says_that_tour_flies_in_a_stated_wind_and_no_other_planner_in_still_air():
    in_wind = rollout(windy(3.0), planner(), max_steps=3)
    assert all("tour" in decision.flown_by for decision in in_wind.decisions)
    still = rollout(field(), planner(), max_steps=3)
    assert not any(decision.flown_by for decision in still.decisions)
