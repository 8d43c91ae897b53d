"""Waypoints that are asked for again, in wind, by planners that send UAS by guidance."""

import pytest

from uas_coverage_env import generate_scenario, load_planner, rollout
from uas_coverage_env.flight import home
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.world import GoTo

N_WAYPOINTS = 4


@pytest.mark.parametrize("name", ["trajectory", "tour"])
def test_what_is_asked_for_again_is_flown_to_as_the_waypoint_that_it_is_now(name, monkeypatch):
    town = generate_scenario(3, n_uas=1, n_waypoints=N_WAYPOINTS, n_obstacles=0)
    waypoints = tuple(w.model_copy(update={"again_after_s": (15.0,)}) for w in town.waypoints)
    windy = with_disturbances(town.model_copy(update={"waypoints": waypoints}), "moderate", 0)
    monkeypatch.setattr("uas_coverage_baselines.tour.planner._OFF_MPS", -1.0)  # guided
    planner, targets = load_planner(name), set()
    act = planner.act

    def noted(swarm):
        commands = act(swarm)
        targets.update(c.waypoint for c in commands.values() if isinstance(c, GoTo))
        return commands

    monkeypatch.setattr(planner, "act", noted)
    assert home(rollout(windy, planner)).all()
    # those asked for again come after the others
    assert max(targets - {None}) >= N_WAYPOINTS
