"""Waypoints that are asked for again, in wind, by guidance and by the plans of `tour`."""

import pytest

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished, coverage, home
from uas_coverage_env.planning.around.around import Around
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.world import GoTo, Velocity

N_WAYPOINTS = 4


@pytest.mark.parametrize("name", ["trajectory", "tour"])
def test_what_is_asked_for_again_is_flown_to_as_the_waypoint_that_it_is_now(name, monkeypatch):
    town = generate_scenario(3, n_uas=1, n_waypoints=N_WAYPOINTS, n_obstacles=0)
    waypoints = tuple(w.model_copy(update={"again_after_s": (15.0,)}) for w in town.waypoints)
    windy = with_disturbances(town.model_copy(update={"waypoints": waypoints}), "moderate", 0)
    monkeypatch.setattr("uas_coverage_baselines.tour.tour_flight._OFF_MPS", -1.0)  # guided
    targets, act = set(), Around.act

    def noted(self, swarm):
        commands = act(self, swarm)
        targets.update(c.waypoint for c in commands.values() if isinstance(c, GoTo))
        return commands

    monkeypatch.setattr(Around, "act", noted)
    assert home(rollout(windy, load_planner(name))).all()
    # those asked for again come after the others
    assert max(targets - {None}) >= N_WAYPOINTS


@pytest.mark.parametrize("seed", [3, 4])
def test_tour_pursues_what_is_asked_for_again_and_at_which_height_and_speed_in_light_wind(seed):
    town = generate_scenario(seed, n_uas=1, n_waypoints=N_WAYPOINTS, n_obstacles=2)
    altitude_m = -town.waypoints[0].position_m[2]
    asks = {"max_speed_mps": 5.0, "heights_m": (altitude_m - 1.5, altitude_m + 1.5)}
    first = town.waypoints[0].model_copy(update=asks)
    waypoints = (first, *town.waypoints[1:])
    again = tuple(w.model_copy(update={"again_after_s": (20.0,)}) for w in waypoints)
    town = town.model_copy(update={"waypoints": again, "relaunch": True})
    planner, commands = load_planner("tour"), []
    act = planner.act

    def noted(swarm):
        commands.append(act(swarm))
        return commands[-1]

    planner.act = noted
    flight = rollout(with_disturbances(town, "light", seed), planner)
    assert accomplished(flight)
    assert coverage(flight) == 1.0
    assert flight.covered[-1] == 2 * N_WAYPOINTS
    assert flight.breaches == 0
    pursued = [isinstance(c, Velocity) for one in commands for c in one.values()]
    assert sum(pursued) > 0.8 * len(pursued)
