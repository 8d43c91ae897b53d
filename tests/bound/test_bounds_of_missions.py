"""No flight that accomplishes its mission takes less than the bound."""

import numpy as np
import pytest
from bound_missions import plain
from uas_coverage_baselines.nearest_waypoint import NearestWaypoint
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions

from uas_coverage_env import rollout
from uas_coverage_env.bound import MissionBound, bound_of
from uas_coverage_env.flight.metrics import accomplished, energy_Wh

HOME = (20.0, 20.0, -1.0)
OTHER_HOME = (60.0, 20.0, -1.0)


def quick_trajectory():
    return Trajectory(TrajectoryOptions(orders=1, moves=10_000, programs=40))


PLANNERS = {"trajectory": quick_trajectory, "tour": Tour, "nearest-waypoint": NearestWaypoint}


def random_mission(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(1, 9))
    places = rng.uniform((10.0, 10.0, -30.0), (490.0, 490.0, -5.0), (n, 3)).tolist()
    return plain(
        [HOME, OTHER_HOME][: int(rng.integers(1, 3))],
        places,
        radius_m=float(rng.uniform(5.0, 20.0)),
        soc_0=float(rng.choice([0.65, 0.95])),  # a table of turns is made for each charge
    )


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("planner", PLANNERS)
def test_no_flight_takes_less_than_the_bound(planner, seed):
    mission = random_mission(seed)
    flight = rollout(mission, PLANNERS[planner](), seed=0)
    assert accomplished(flight)
    bound = bound_of(mission)
    used_Wh = float(energy_Wh(flight).sum())
    assert 0.0 < bound.energy_Wh() <= bound.energy_Wh(flight.steps) <= used_Wh
    assert bound.steps <= flight.steps


def test_on_one_waypoint_straight_ahead_the_bound_is_close():
    mission = plain([HOME], [(470.0, 20.0, -10.0)], radius_m=15.0)
    flight = rollout(mission, quick_trajectory())
    assert accomplished(flight)
    bound = MissionBound(mission)
    assert energy_Wh(flight).sum() < 1.09 * bound.energy_Wh()
    assert flight.steps <= bound.steps + 2


def test_names_and_order_do_not_matter():
    mission = random_mission(5)
    other = mission.model_copy(
        update={"name": "other", "waypoints": mission.waypoints[::-1], "uas": mission.uas[::-1]}
    )
    one, two = MissionBound(mission), MissionBound(other)
    assert two.energy_Wh() == pytest.approx(one.energy_Wh(), rel=1e-3)
    assert two.energy_Wh(60) == pytest.approx(one.energy_Wh(60), rel=1e-3)
    assert two.steps == one.steps


def test_the_bound_does_not_fall_with_another_waypoint():
    rng = np.random.default_rng(1)
    places = rng.uniform((50.0, 50.0, -30.0), (490.0, 490.0, -5.0), (9, 3)).tolist()
    bounds = [MissionBound(plain([HOME], places[:n])).energy_Wh() for n in range(1, 10)]
    assert np.diff(bounds).min() > -1e-3 * bounds[-1]


def test_the_fewer_steps_the_more_energy_but_for_what_the_search_for_prices_misses():
    rng = np.random.default_rng(2)
    places = rng.uniform((100.0, 100.0, -30.0), (490.0, 490.0, -5.0), (7, 3)).tolist()
    bound = MissionBound(plain([HOME, OTHER_HOME], places))
    by_steps = [bound.energy_Wh(steps) for steps in (60, 100, 400)]
    assert (np.diff(by_steps) < 0.01 * by_steps[-1]).all(), "prices with cuts are others"
    assert by_steps[0] > 1.03 * by_steps[-1], "one UAS does not suffice"
    assert by_steps[-1] == bound.energy_Wh()


def test_nothing_farther_than_a_start_is_a_mission_of_one_step():
    mission = plain([HOME], [(22.0, 22.0, -2.0)])
    bound = MissionBound(mission)
    assert bound.steps == 1
    flight = rollout(mission, quick_trajectory())
    assert bound.energy_Wh() <= energy_Wh(flight).sum()


def test_there_is_no_bound_in_wind():
    windy = plain([HOME], [(300.0, 20.0, -5.0)], wind={"mean_mps": 3.0, "from_deg": 0.0})
    assert bound_of(windy) is None
    with pytest.raises(ValueError, match="the air is not still"):
        MissionBound(windy)
