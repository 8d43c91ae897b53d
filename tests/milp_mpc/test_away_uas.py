"""A UAS that takes no commands is no part of a decision, and kept clear of as what moves."""

import numpy as np
import pytest
from practice_missions import mission
from uas_coverage_baselines.milp_mpc import MilpMpc, MilpMpcPaper

from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.around.handover import without
from uas_coverage_env.vehicle.layout import VX

BRIEF = MissionBrief.of(
    mission([((90.0, 52.0, -8.0), 10.0)], [(50.0, 50.0, -8.0), (50.0, 90.0, -8.0)])
)


@pytest.mark.parametrize("planner", [MilpMpcPaper, MilpMpc])
def test_a_uas_that_is_away_is_a_moving_obstacle_of_the_program(planner, monkeypatch):
    made, asked = planner(planner.Options(horizon=8)), []
    made.reset(BRIEF, 0)

    class AskedError(Exception):
        pass

    def seen(problem, *args, **options):
        asked.append(problem)
        raise AskedError

    monkeypatch.setattr(made, "solved", seen, raising=False)
    monkeypatch.setattr("uas_coverage_baselines.milp_mpc.moving_horizon.decide", seen)
    swarm = first_sight(BRIEF)
    swarm.x[1, VX] = 2.0
    with pytest.raises(AskedError):
        made.act(without(swarm, np.array([False, True])))
    (problem,) = asked
    assert tuple(problem.names) == ("uas_1",)
    assert [body.name for body in problem.moving] == ["uas_2"]
    centres_m = problem.moving[0].position_m
    np.testing.assert_allclose(np.diff(centres_m[:, 0]), 2.0 * BRIEF.dt_s)
    kept_m = 2 * BRIEF.uas[0].radius_m + BRIEF.uas_safe_distance_m
    assert problem.moving_clearance_m[0, -1] >= kept_m
