"""What the end of a run is held against: the best flight known of a shipped scenario."""

import pytest

from uas_coverage_env.cli.figures_of_flight import beside_the_best
from uas_coverage_env.flight import load_planner, planner_names, rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.leaderboard.best_flown import best_flown
from uas_coverage_env.scenario import load_scenario, scenario_names


def flown(scenario, **settings):
    return rollout(scenario, load_planner("nearest-waypoint"), **settings)


@pytest.mark.parametrize("name", scenario_names())
def test_of_every_shipped_scenario_one_is_known_and_can_be_flown(name):
    best = best_flown(load_scenario(name))
    assert best is not None
    assert best.planner in planner_names()


def test_the_planner_that_is_named_takes_that_much():
    """In this mission a waypoint opens when all others have been covered for long."""
    scenario = load_scenario("gasche2025")
    best = best_flown(scenario)
    assert best is not None
    result = summary(rollout(scenario, load_planner(best.planner)))
    assert (result["coverage"], result["all_home"], result["violations"]) == (1.0, True, [])
    assert result["energy_Wh"] == pytest.approx(best.energy_Wh, rel=0.02)
    assert result["steps"] == pytest.approx(best.steps, rel=0.02)


def test_a_scenario_that_was_changed_is_another_one():
    scenario = load_scenario("open_field")
    changed = scenario.model_copy(update={"waypoints": scenario.waypoints[:-1]})
    assert best_flown(changed) is None
    assert beside_the_best(flown(changed, max_steps=2)) == ""


def test_a_flight_is_told_how_much_more_it_took():
    flight = flown(load_scenario("open_field"))
    best = best_flown(flight.scenario)
    assert best is not None
    more = summary(flight)["energy_Wh"] / best.energy_Wh - 1.0
    assert more > 0.1
    assert beside_the_best(flight).startswith(f"{more:.0%} more energy than the best flight known")


def test_one_that_did_not_accomplish_its_mission_is_told_what_can_be_done():
    cut = beside_the_best(flown(load_scenario("open_field"), max_steps=3))
    assert cut.startswith("the best flight known of this mission: 6.45 Wh in 54 steps")


def test_other_models_take_another_energy():
    exact = flown(load_scenario("open_field"), max_steps=2, dynamics="nonlinear")
    assert beside_the_best(exact) == ""
