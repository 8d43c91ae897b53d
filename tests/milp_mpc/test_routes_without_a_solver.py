"""Home on the last charge, and along routes out of a standstill: flown without a solver."""

import dataclasses

import numpy as np
import pytest
from practice_missions import mission, obstacle, planner
from uas_coverage_baselines.milp_mpc.fallback.route_following import Sent
from uas_coverage_baselines.milp_mpc.model.problem import Plan
from uas_coverage_baselines.milp_mpc.model.verify import first_trouble

from uas_coverage_env.entities.commands import HOME
from uas_coverage_env.mission import MissionBrief, Range, first_sight
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import DOD, VX, VZ
from uas_coverage_env.vehicle.range import dod_per_s

S500 = load_vehicle("s500_v2")
STARTS = ((20.0, 20.0, -10.0), (20.0, 60.0, -10.0))
AWAY = ((150.0, 20.0, -10.0), (150.0, 60.0, -10.0))
PLACES = [((150.0, 120.0, -10.0), 8.0), ((80.0, 150.0, -10.0), 8.0)]
BRAKING = 14


class Scene:
    """Two UAS away from home, with so much charge and so many steps left."""

    def __init__(self, dod=(0.2, 0.2), step=0, n_uas=2, **fields):
        scenario = mission(PLACES, STARTS[:n_uas], **fields)
        self.made = planner(scenario)
        swarm = first_sight(MissionBrief.of(scenario))
        x = swarm.x.copy()
        x[:, :3], x[:, DOD] = AWAY[:n_uas], dod[:n_uas]
        self.swarm = dataclasses.replace(swarm, x=x, step=step)
        self.problem = self.made.problem(self.swarm)
        self.follower = self.made._follower

    def apply(self, backup=None, planned=(), sent=None):
        return self.follower.apply(self.problem, self.swarm, backup, planned, sent)

    def hovers(self, steps=20):
        x, n = self.problem.x0, self.problem.n_uas
        held = np.repeat(x[:, None], steps + 1, axis=1)
        covers = np.zeros((n, steps, self.problem.n_scenario_waypoints), bool)
        return Plan(self.problem.names, held, np.zeros((n, steps, 5)), covers, 0.0, -np.inf)

    def left_s(self, row):
        return self.follower._left_at_home_s(self.problem, self.swarm, row)


def scarce(dod_row, spare_s):
    """A scene in which one UAS is left so many seconds once it is at home."""
    dod = [0.2, 0.2]
    for _ in range(6):  # the first ones by an estimate that is on the safe side
        scene = Scene(tuple(dod))
        dod[dod_row] += (scene.left_s(dod_row) - spare_s) * dod_per_s(S500, 0.75)
    return Scene(tuple(dod))


def way_m(plan, row, steps):
    """How far a UAS of a plan gets towards home, in the south, within some steps."""
    return plan.x[row, 0, 0] - plan.x[row, steps, 0]


# home on the last charge


def test_a_uas_with_enough_charge_is_not_sent_home():
    assert Scene().apply() is None
    assert Scene().apply(Scene().hovers()) is None


@pytest.mark.parametrize("row", [0, 1])
def test_a_uas_that_would_be_home_with_less_than_the_reserve_flies_home_and_the_other_stays(row):
    assert scarce(row, 33.0).apply() is None
    scene = scarce(row, 27.0)
    followed = scene.apply()
    name = scene.problem.names[row]
    assert (followed.names, followed.home) == ({name}, {name})
    assert way_m(followed.plan, row, 8) > 30.0
    assert abs(way_m(followed.plan, 1 - row, 8)) < 0.1
    assert np.linalg.norm(followed.plan.x[:, -1, VX : VZ + 1], axis=1).max() < 0.1
    assert followed.plan.u.shape[1] == 8 + BRAKING
    assert (followed.plan.objective, followed.plan.bound) == (0.0, -np.inf)


def test_a_uas_with_a_new_plan_sees_to_its_way_home_itself():
    scene = scarce(0, 5.0)
    assert scene.apply(planned=["uas_1"]) is None
    assert scene.apply(planned=["uas_2"]).names == {"uas_1"}


def test_a_uas_that_can_come_home_no_more_flies_home_too():
    assert scarce(1, -40.0).apply().home == {"uas_2"}


@pytest.mark.parametrize(("step", "left_s"), [(249, 30.0), (250, 29.0), (262, 17.0)])
def test_the_end_of_the_mission_counts_like_the_end_of_the_charge(step, left_s):
    # the way home takes 21 steps
    scene = Scene(step=step)
    assert (scene.left_s(0), scene.left_s(1)) == (left_s, left_s)
    assert (scene.apply() is None) == (left_s >= 30.0)


def test_the_end_of_the_mission_is_counted_in_seconds():
    way_s = 300.0 - 249 - 30.0
    scene = Scene(step=200, dt_s=0.5)
    assert scene.left_s(0) == pytest.approx(0.5 * 100 - way_s, abs=1.0)
    assert scene.apply().home == {"uas_1", "uas_2"}


def test_the_others_go_on_with_their_backups_and_hover_at_their_ends():
    scene = scarce(0, 20.0)
    backup = scene.hovers(3)
    backup.x[1, :, 1] += np.arange(4)  # a metre a step to the east
    backup.u[1, :, 1] = 0.01
    followed = scene.apply(backup).plan
    np.testing.assert_array_equal(followed.x[1, :4], backup.x[1])
    np.testing.assert_array_equal(followed.u[1, :3], backup.u[1])
    assert followed.u.shape[1] == 8 + BRAKING
    long = scene.apply(scene.hovers(40)).plan
    assert long.u.shape[1] == 40
    assert not long.covers.any()


def test_the_way_home_is_followed_as_long_as_braking_is_clear():
    free = scarce(0, 10.0)
    keep_m = 3.0 + 0.36 + 3.0 + 3.0  # radii, safe distance and the margin of what moves

    def pursued(away_m):
        """For how long the way home is followed towards a truck so far away."""
        truck = {
            "name": "truck",
            "radius_m": 3.0,
            "height_m": 98.0,
            "safe_distance_m": 3.0,
            "start_m": (150.0 - away_m, 20.0, -10.0),
            "schedule": [{"from_s": 0.0, "velocity_mps": (0.0, 0.0, 0.0)}],
        }
        dod = float(free.swarm.x[0, DOD]), 0.2
        followed = Scene(dod, moving_obstacles=[truck]).apply()
        return None if followed is None else followed.plan.u.shape[1] - BRAKING

    for seconds, less in ((8, 4), (4, 2), (2, 1), (1, None)):
        x, _ = free.follower._flown(free.problem, 0, seconds, seconds + BRAKING)
        reach_m = 150.0 - float(x[:, 0].min()) + keep_m
        assert pursued(reach_m + 0.5) == seconds
        assert pursued(reach_m - 0.5) == less


def shortened(plan, scene):
    n = scene.problem.horizon
    return dataclasses.replace(plan, x=plan.x[:, : n + 1], u=plan.u[:, :n])


# routes out of a standstill


def test_a_uas_that_is_sent_follows_its_route_whether_it_has_a_plan_or_not():
    scene = Scene()
    for planned in ((), ("uas_1", "uas_2")):
        followed = scene.apply(scene.hovers(), planned, {"uas_2": Sent(0)})
        assert followed.names == {"uas_2"}
        assert followed.home == frozenset()
        moved = followed.plan.x[1, 8, :2] - followed.plan.x[1, 0, :2]
        assert moved[1] > 30.0, "the waypoint is in the east"
        assert abs(moved[0]) < 2.0


def test_a_uas_that_is_sent_with_care_flies_slowly():
    scene = Scene()
    quick, slow = (
        scene.apply(scene.hovers(), (), {"uas_2": Sent(0, care)}).plan for care in (False, True)
    )
    speeds = [np.linalg.norm(plan.x[1, :, VX : VZ + 1], axis=1).max() for plan in (quick, slow)]
    assert speeds[0] > 6.0
    assert 1.0 < speeds[1] < 3.5


def test_a_uas_sent_home_is_among_those_that_fly_home():
    scene = Scene()
    followed = scene.apply(scene.hovers(), (), {"uas_1": Sent(HOME), "uas_2": Sent(1)})
    assert (followed.names, followed.home) == ({"uas_1", "uas_2"}, {"uas_1"})


def test_a_uas_that_has_to_fly_home_is_not_sent_elsewhere():
    scene = scarce(1, 10.0)
    followed = scene.apply(scene.hovers(), (), {"uas_2": Sent(0)})
    assert followed.home == {"uas_2"}
    assert way_m(followed.plan, 1, 8) > 30.0


def test_the_way_home_goes_before_a_route_that_would_cross_it():
    # both want through one place: a UAS that flies home goes first, whatever the order
    scene = Scene()
    x = scene.swarm.x.copy()
    x[0, :3], x[1, :3] = (80.0, 52.0, -10.0), (88.0, 60.0, -10.0)
    scene.swarm = dataclasses.replace(scene.swarm, x=x)
    scene.problem = scene.made.problem(scene.swarm)
    ways = {"uas_1": Sent(1), "uas_2": Sent(HOME)}
    followed = scene.apply(scene.hovers(), (), ways)
    assert "uas_2" in followed.home
    assert way_m(followed.plan, 1, 8) > 20.0


def test_a_route_into_what_stands_is_not_flown():
    # the walls leave no way out of the yard
    walls = [
        obstacle((140.0, 10.0, -49.0), (142.0, 30.0, 0.0), "south"),
        obstacle((158.0, 10.0, -49.0), (160.0, 30.0, 0.0), "north"),
        obstacle((140.0, 8.0, -49.0), (160.0, 10.0, 0.0), "west"),
        obstacle((140.0, 30.0, -49.0), (160.0, 32.0, 0.0), "east"),
    ]
    scene = Scene(n_uas=1, obstacles=walls)
    followed = scene.apply(scene.hovers(), (), {"uas_1": Sent(0)})
    if followed is not None:
        assert first_trouble(scene.problem, shortened(followed.plan, scene)) is None
        assert np.abs(followed.plan.x[0, :, :2] - (150.0, 20.0)).max() < 8.0


# when a UAS has to return


@pytest.mark.parametrize(("dt_s", "later_s"), [(1.0, 2.0), (0.5, 1.0)])
def test_a_uas_has_to_return_while_a_decision_later_still_comes_home(dt_s, later_s):
    def has_to(dod):
        scene = Scene((dod, 0.2), dt_s=dt_s)
        return scene.follower.has_to_return(scene.problem, 0)

    low, high = 0.2, 0.75
    assert not has_to(low)
    assert has_to(high)
    for _ in range(14):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if has_to(middle) else (middle, high)
    scene = Scene((high, 0.2))
    per_s = dod_per_s(S500, 0.75)
    # charge for the way with its margin, and two steps more
    estimate = Range(MissionBrief.of(mission(PLACES, STARTS))).home(0, scene.swarm.x[0])
    left_s = (0.75 - high) / per_s
    assert left_s == pytest.approx(estimate.time_s + estimate.time_margin_s + later_s, abs=0.3)
