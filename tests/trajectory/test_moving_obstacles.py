"""What moves, as a planner sees it, and how far a path keeps from it and from what stands."""

from dataclasses import replace

import numpy as np
import pytest
from hand_made import NOTHING, moving
from small_fleets import fleet_of
from small_worlds import box, meadow, mover
from uas_coverage_baselines.trajectory.moving_obstacles import NEVER, MovingObstacles
from uas_coverage_baselines.trajectory.space import (
    spare_fixed_m,
    spare_from_body_m,
    spare_height_m,
    spare_of_rules_m,
)

from uas_coverage_env.planning.backup.course import apart_m
from uas_coverage_env.vehicle.layout import VX, VZ

UAS_M, MARGIN_M = 0.36, 1.0
KEEP_M = UAS_M + 3.0 + MARGIN_M  # with its safe distance, from what stands still
STANDING = (0.0, 0.0, 0.0)


def path(*places):
    return np.array(places, float)


def spare(moving, *places):
    return moving.spare_m(path(*places), UAS_M, MARGIN_M)


# how far a path keeps from what moves


def test_a_path_beside_what_stands_has_the_distance_to_spare_that_is_beyond_all_margins():
    parked = moving(((50.0, 60.0, -20.0), STANDING))
    beside, under = (30.0, 60.0, -20.0), (50.0, 60.0, -8.0)
    assert spare(parked, beside, beside) == pytest.approx(20.0 - 4.0 - KEEP_M)
    assert spare(parked, under, under) == pytest.approx(12.0 - 3.0 - KEEP_M)
    nearer = (33.0, 60.0, -20.0)
    assert spare(parked, beside, nearer, beside) == pytest.approx(17.0 - 4.0 - KEEP_M)
    assert spare(parked, beside, (30.0, 80.0, -20.0)) == pytest.approx(20.0 - 4.0 - KEEP_M)


def test_what_moves_is_kept_from_where_it_will_be_and_may_turn_for_a_second():
    passing = moving(((50.0, 0.0, -20.0), (0.0, 6.0, 0.0)))
    here = (30.0, 60.0, -20.0)
    # it is beside the path after ten seconds, and may have gone 6 m another way
    assert spare(passing, *[here] * 11) == pytest.approx(20.0 - 4.0 - KEEP_M - 6.0)
    assert spare(passing, *[here] * 6) > 20.0
    half = replace(passing, dt_s=0.5)
    assert spare(half, *[here] * 21) == pytest.approx(20.0 - 4.0 - KEEP_M - 6.0)
    assert spare(half, *[here] * 11) > 20.0


def test_of_several_the_nearest_counts():
    here = (30.0, 60.0, -20.0)
    far, near = ((90.0, 60.0, -20.0), STANDING), ((50.0, 60.0, -20.0), STANDING)
    for bodies in ((far, near), (near, far)):
        assert spare(moving(*bodies), here, here) == pytest.approx(20.0 - 4.0 - KEEP_M)
    assert spare(NOTHING, here) == np.inf


@pytest.mark.parametrize(
    ("nearer_m", "kept"), [(0.002, False), (5e-4, True), (0.0, True), (-2.0, True)]
)
@pytest.mark.parametrize("way", [(1.0, 0.0, 0.0), (0.0, 0.0, 1.0)])
def test_what_is_too_near_already_is_kept_where_it_comes_no_nearer(way, nearer_m, kept):
    size_m = 4.0 if way[0] else 3.0
    start_m = np.array((50.0, 60.0, -20.0)) + np.array(way) * (size_m + 2.0)
    parked = moving(((50.0, 60.0, -20.0), STANDING))
    assert (spare(parked, start_m, start_m - nearer_m * np.array(way)) >= 0.0) == kept


def test_what_is_too_near_already_and_comes_nearer_by_itself_is_not_kept():
    here = (50.0, 69.0, -20.0)  # 5 m from its edge
    coming, going = (moving(((50.0, 60.0, -20.0), (0.0, way, 0.0))) for way in (1.0, -1.0))
    assert spare(coming, here, here) == pytest.approx(4.0 - 5.0, abs=2e-3)
    assert spare(going, here, here) >= 0.0


def test_paths_are_apart_as_far_as_their_nearest_moments_between_samples_too():
    north = path((0.0, 0.0, 0.0), (10.0, 0.0, 0.0))
    south = path((10.0, 7.0, 2.0), (0.0, 7.0, 2.0))
    assert apart_m(north, south, 0.0, 0.0) == pytest.approx(7.0)
    assert apart_m(north, south, 3.0, 0.0) == pytest.approx(4.0)
    above = south - (0.0, 7.0, 0.0)
    assert apart_m(north, above, 0.0, 0.0) == pytest.approx(2.0)
    assert apart_m(north, above, 1.0, 0.5) == pytest.approx(1.5)
    longer = np.vstack([np.add(above, (0.0, 20.0, 0.0)), north[1:]])
    assert apart_m(north, longer, 0.0, 0.0) == pytest.approx(20.0), "beyond its end it is gone"


# what is seen


def test_obstacles_and_silent_uas_are_seen_with_their_sizes_and_distances():
    scenario = meadow(
        ((20.0, 20.0, -9.0), (80.0, 20.0, -9.0)),
        moving_obstacles=(mover((60.0, 60.0, -20.0), (0.0, (1.0, -2.0, 0.0))),),
    )
    fleet, swarm = fleet_of(scenario)
    x = swarm.x.copy()
    x[1, VX : VZ + 1] = 3.0, 2.0, -1.0
    seen = MovingObstacles.seen(
        fleet.brief,
        replace(swarm, x=x, moving_velocity_mps=np.array([[1.0, -2.0, 0.0]])),
        np.array([False, True]),
    )
    assert (len(seen), seen.n_obstacles, seen.dt_s) == (2, 1, 1.0)
    np.testing.assert_allclose(seen.position_m, [(60.0, 60.0, -20.0), (80.0, 20.0, -9.0)])
    np.testing.assert_allclose(seen.velocity_mps, [(1.0, -2.0, 0.0), (3.0, 2.0, -1.0)])
    np.testing.assert_allclose(seen.radius_m, [4.0, 0.0])
    np.testing.assert_allclose(seen.half_height_m, [3.0, 0.0])
    np.testing.assert_allclose(seen.safe_m, [3.0, 0.36 + 5.0])
    np.testing.assert_allclose(
        replace(seen, dt_s=0.5).later(8).position_m, seen.later(4).position_m
    )
    later = seen.later(4)
    np.testing.assert_allclose(later.position_m, [(64.0, 52.0, -20.0), (92.0, 28.0, -13.0)])


def test_an_obstacle_has_turned_and_a_uas_is_off_where_they_go_otherwise():
    uas = (80.0, 20.0, -9.0), (0.0, -3.0, 0.0)
    before = replace(moving(((50.0, 60.0, -20.0), (1.0, 0.0, 0.0)), uas), n_obstacles=1)
    assert not before.later(3).has_turned(before)
    assert before.later(3).off_m(before, 3.0) == pytest.approx(0.0)
    velocities = before.velocity_mps
    turned = replace(before, velocity_mps=velocities + np.array([(0.1, 0.0, 0.0), STANDING]))
    assert turned.has_turned(before)
    of_a_uas = replace(
        before, velocity_mps=np.add(before.velocity_mps, [STANDING, [0.0, 0.4, 0.0]])
    )
    assert not of_a_uas.has_turned(before)
    assert of_a_uas.later(5).off_m(before, 5.0) == pytest.approx(2.0)
    assert turned.later(5).off_m(before, 5.0) == pytest.approx(0.0)


def test_plans_keep_from_what_moves_for_minutes_and_from_what_is_parked_for_a_while():
    flies, parked = ((50.0, 60.0, -20.0), (0.0, -2.0, 0.0)), ((20.0, 60.0, -20.0), STANDING)
    for dt_s in (1.0, 0.5):
        first, second = moving(flies, parked, dt_s=dt_s).bodies(UAS_M, MARGIN_M)
        assert (len(first.path_m), len(second.path_m)) == (400 / dt_s + 1, 25 / dt_s + 1)
        np.testing.assert_allclose(first.path_m[-1], (50.0, -740.0, -20.0))
        assert (first.level_m, first.height_m) == pytest.approx((4 + KEEP_M + 2, 3 + KEEP_M + 2))
        assert (second.level_m, second.height_m) == pytest.approx((4 + KEEP_M, 3 + KEEP_M))


def test_a_waypoint_opens_when_what_moves_has_left_it_or_is_above_it():
    reach_m = 5.0
    away_m = 4.0 + KEEP_M + 2.0 - 0.8 * reach_m  # of a centre that is covered from beside it
    leaving = moving(((50.0, 60.0, -20.0), (0.0, 2.0, 0.0)))
    places = path((50.0, 60.0, -20.0), (50.0, 60.0 - away_m - 0.1, -20.0), (50.0, 60.0, -40.0))
    opens = leaving.open_from(places, np.full(3, reach_m), UAS_M, MARGIN_M)
    assert opens.tolist() == [int(away_m / 2.0) + 1, 0, 0]
    half = replace(leaving, dt_s=0.5).open_from(places, np.full(3, reach_m), UAS_M, MARGIN_M)
    assert half[0] in (2 * opens[0] - 1, 2 * opens[0])
    slow = replace(leaving, velocity_mps=np.array([(0.0, 0.05, 0.0)]), dt_s=0.5)
    assert slow.open_from(places, np.full(3, reach_m), UAS_M, MARGIN_M)[0] < NEVER
    parked = moving(((50.0, 60.0, -20.0), STANDING))
    level_m, up_m = 4.0 + KEEP_M - 4.0, 3.0 + KEEP_M - 4.0
    for off, is_open in ((0.05, True), (-0.05, False)):
        aslant = (level_m + off) / np.sqrt(2.0)
        beside = path((50.0 + aslant, 60.0 + aslant, -20.0), (50.0, 60.0, -20.0 - up_m - off))
        opens = parked.open_from(beside, np.full(2, reach_m), UAS_M, MARGIN_M)
        assert (opens == 0).tolist() == [is_open] * 2
    assert parked.open_from(places[:1], np.full(1, reach_m), UAS_M, MARGIN_M).tolist() == [NEVER]
    both = moving(((50.0, 60.0, -20.0), (0.0, 2.0, 0.0)), ((50.0, 60.0, -20.0), (0.0, 4.0, 0.0)))
    further_m = away_m + 2.0  # the faster one may surprise more, and is gone sooner
    opens = both.open_from(places[:1], np.full(1, reach_m), UAS_M, MARGIN_M)
    assert opens.tolist() == [max(int(away_m / 2.0), int(further_m / 4.0)) + 1]


# how far a path keeps from what stands


@pytest.fixture(scope="module")
def space():
    """Of a UAS in a meadow with a wall in the north, that flies at 5 m at least."""
    wall = box("wall", (100.0, 20.0, -30.0), (110.0, 180.0, 0.0))
    scenario = meadow(((60.0, 60.0, -20.0),), obstacles=(wall,), min_height_m=5.0)
    return fleet_of(scenario)[0].programs[0].space


def of_rules(space, *places, lands=False):
    return spare_of_rules_m(space, path(*places), lands)


def test_the_distance_to_an_obstacle_is_that_of_segments_less_radius_and_safe_distance(space):
    far = (80.0, 60.0, -20.0)
    for gap_m in (2.3, 1.0, 0.1):
        near = (100.0 - gap_m, 60.0, -20.0)
        assert of_rules(space, far, near, far) == pytest.approx(gap_m - 2.36)
        assert of_rules(space, far, near) == pytest.approx(gap_m - 2.36)
    assert of_rules(space, far, (97.6, 60.0, -20.0), far) > 0.0
    assert of_rules(space, far, (94.0, 60.0, -20.0), (116.0, 60.0, -20.0)) < -2.36
    # over the roof the least height is kept
    high = (80.0, 60.0, -40.0)
    for height_m in (33.0, 34.9):
        over = (105.0, 60.0, -height_m)
        assert of_rules(space, high, over, high) == pytest.approx(height_m - 35.0)
    assert of_rules(space, high, (105.0, 60.0, -35.1), high) > 0.0


def test_the_last_sample_of_a_landing_is_near_to_obstacles_too_but_not_to_the_fence(space):
    far, near = (60.0, 60.0, -20.0), (98.0, 60.0, -20.0)
    for lands in (False, True):
        assert of_rules(space, far, near, lands=lands) == pytest.approx(2.0 - 2.36)
    over = (60.0, -1.0, -20.0)
    assert of_rules(space, far, over) == pytest.approx(-1.5)
    assert of_rules(space, far, over, lands=True) > 0.0
    assert of_rules(space, far, over, far, lands=True) == pytest.approx(-1.5)


def test_a_path_that_begins_too_near_comes_no_nearer(space):
    for start_m, nearer_m, away_m in (
        ((98.5, 60.0, -20.0), (98.6, 60.0, -20.0), (90.0, 60.0, -20.0)),
        ((60.0, 0.3, -20.0), (60.0, 0.2, -20.0), (60.0, 9.0, -20.0)),
        ((60.0, 199.7, -20.0), (60.0, 199.8, -20.0), (60.0, 190.0, -20.0)),
        ((0.3, 60.0, -20.0), (0.2, 60.0, -20.0), (9.0, 60.0, -20.0)),
        ((199.7, 60.0, -40.0), (199.8, 60.0, -40.0), (190.0, 60.0, -40.0)),
        ((60.0, 60.0, -49.7), (60.0, 60.0, -49.8), (60.0, 60.0, -40.0)),
        ((90.0, 30.0, -3.0), (90.0, 30.0, -2.9), (90.0, 30.0, -9.0)),
    ):
        assert of_rules(space, start_m, nearer_m, away_m) == pytest.approx(-0.1)
        assert of_rules(space, start_m, away_m) >= 0.0
        assert of_rules(space, away_m, start_m, away_m) < 0.0


def test_the_least_height_holds_outside_of_the_landing_zone(space):
    high = (60.0, 60.0, -20.0)
    zone_m = float(space.zone_m)
    inside, outside = ((60.0 - zone_m - off_m, 60.0, -4.0) for off_m in (-0.1, 0.1))
    assert of_rules(space, high, inside, high) > 0.0
    assert of_rules(space, high, outside, high) == pytest.approx(-1.0)
    assert of_rules(space, high, outside) == pytest.approx(-1.0)
    assert of_rules(space, high, outside, lands=True) > 0.0
    diagonal_m = zone_m * np.array([0.75, 0.75])
    corner = (60.0 - diagonal_m[0], 60.0 - diagonal_m[1], -4.0)
    assert of_rules(space, high, corner, high) == pytest.approx(-1.0)


# how far a plan keeps from what stands: margins beyond the rules', by one face for each step


def test_a_plan_keeps_its_margin_beyond_the_rules_from_both_ends_of_a_step(space):
    far = (80.0, 60.0, -20.0)
    for gap_m in (2.6, 1.0):
        near = (100.0 - gap_m, 60.0, -20.0)
        for places in ((far, near), (near, far), (far, near, far)):
            assert spare_fixed_m(space, path(*places)) == pytest.approx(gap_m - 2.36 - 0.3)
    assert spare_fixed_m(space, path(far, (90.0, 60.0, -20.0))) > 0.0
    # past a corner one face has to separate both ends, though the segment is clear
    corner = path((97.8, 21.0, -20.0), (103.0, 17.5, -20.0))
    assert spare_fixed_m(space, corner) == pytest.approx(-1.0 - 2.66)
    beside = path((98.0, 18.5, -20.0), (108.0, 17.8, -20.0))
    assert spare_fixed_m(space, beside) == pytest.approx(1.5 - 2.66)


def test_a_plan_keeps_a_body_s_distances_level_or_upright(space):
    here, body = path((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), path((8.0, 6.0, 3.0), (8.0, 6.0, 3.0))
    assert spare_from_body_m(here, body, 7.0, 9.0) == pytest.approx(3.0)
    assert spare_from_body_m(here, body, 11.0, 2.0) == pytest.approx(1.0)
    assert spare_from_body_m(here, body, 11.0, 4.0) == pytest.approx(-1.0)
    approaching = path((20.0, 0.0, 0.0), (9.0, 0.0, 0.0), (20.0, 0.0, 0.0))
    still = np.zeros((3, 3))
    assert spare_from_body_m(still, approaching, 7.0, 7.0) == pytest.approx(2.0)
    assert spare_from_body_m(still[:2], approaching[::2], 7.0, 7.0) == pytest.approx(13.0)


def test_the_least_height_of_a_plan_leaves_out_its_ends_and_the_landing_zone(space):
    low, high = (100.0, 100.0, -4.0), (100.0, 100.0, -9.0)
    assert spare_height_m(space, path(low, high, low)) == pytest.approx(9.0 - 5.1)
    assert spare_height_m(space, path(high, low, high)) == pytest.approx(4.0 - 5.1)
    assert spare_height_m(space, path(high, (60.0, 60.0, -1.0), high)) == np.inf
