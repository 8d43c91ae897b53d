"""Each kind of contact and breach just within its limit and just beyond, also between samples."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import clearance_of_segment
from small_worlds import box, meadow, mover

from uas_coverage_env.entities.outcome import CONTACT_NAMES, OUTCOME_DTYPE
from uas_coverage_env.entities.state import LANDED, LOST
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world.contacts import (
    check_fence_and_battery,
    check_obstacles,
    check_separation,
    count_breaches,
    face_between,
)

SMALL_M, LARGE_M = 0.36, 1.2
CENTRE_M, PER_STEP_M = np.array([40.0, 150.0, -20.0]), np.array([2.0, -1.0, 0.5])
WALL = box("wall", (100.0, 20.0, -30.0), (110.0, 40.0, 0.0), 2.0)
FAR_M = np.array([[160.0, 60.0, -20.0], [60.0, 60.0, -20.0], [180.0, 120.0, -20.0]])
BIT_M = 1e-7
BREACHES = ((-2e-9, 1), (-5e-10, 0))
"""Of a distance short by so much [m], whether it is one: the last digits do not count."""


def scene(**more):
    """A wall, a cylinder on its way and three UAS, the second of them large."""
    homes_m = [(10.0, 10.0 + 10.0 * i, -1.0) for i in range(3)]
    moving = mover(
        tuple(CENTRE_M - 3.0 * PER_STEP_M), (0.0, tuple(PER_STEP_M)), safe_distance_m=3.0
    )
    scenario = meadow(homes_m, **{"obstacles": [WALL], "moving_obstacles": [moving], **more})
    radii = (SMALL_M, LARGE_M, SMALL_M)
    fleet = [u.model_copy(update={"radius_m": r}) for u, r in zip(scenario.uas, radii, strict=True)]
    world = World(scenario.model_copy(update={"uas": tuple(fleet)}))
    world.state.x[:, :3] = FAR_M
    world.state.step[0] = 3
    return world


def judged(world, before_m=None):
    """Outcome of a step that ends in the world's state, and began at before_m (U, 3) or there."""
    outcome = np.zeros(len(world.state.uas), OUTCOME_DTYPE).view(np.recarray)
    outcome["before_m"] = world.state.x[:, :3] if before_m is None else before_m
    for name in ("obstacle_clearance_m", "separation_m", "fence_clearance_m"):
        outcome[name] = np.inf
    outcome["contact_with"] = -1
    check_obstacles(world.arena, world.state, outcome)
    check_separation(world.arena, world.state, outcome)
    check_fence_and_battery(world.arena, world.state, outcome)
    count_breaches(world.arena, world.state, outcome)
    return outcome


def names(outcome):
    return [CONTACT_NAMES[code] for code in outcome["contact"]]


def wall_beside(gap_m):
    return np.array([100.0 - gap_m, 30.0, -10.0]), np.zeros(3)


def wall_edge(gap_m):
    return np.array([100.0 - gap_m, 20.0 - gap_m, -10.0]), np.array([6.0, -6.0, 0.0])


def wall_roof(gap_m):
    return np.array([105.0, 30.0, -30.0 - gap_m]), np.array([2.0, 3.0, 0.0])


WALLS = (wall_beside, wall_edge, wall_roof)


@pytest.mark.parametrize("uas", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("place", WALLS)
def test_a_wall_is_touched_nearer_than_the_radius_also_between_samples(place, sign, uas):
    world = scene()
    radius_m = (SMALL_M, LARGE_M)[uas]
    for gap_m, contact in ((radius_m + BIT_M, "none"), (radius_m - BIT_M, "obstacle")):
        middle_m, half_m = place(gap_m)
        before_m = FAR_M.copy()
        before_m[uas], world.state.x[uas, :3] = middle_m - sign * half_m, middle_m + sign * half_m
        outcome = judged(world, before_m)
        assert outcome["obstacle_clearance_m"][uas] == pytest.approx(gap_m, abs=1e-9)
        assert names(outcome)[uas] == contact
        assert outcome["contact_with"][uas] == (0 if contact == "obstacle" else -1)
        assert [names(outcome)[i] for i in range(3) if i != uas] == ["none", "none"]


def beside(gap_m):
    return np.array([gap_m, 0.0, 0.5]), np.array([0.0, 7.0, 0.3])


def askew(gap_m):
    return gap_m * np.array([0.6, -0.8, 0.0]), np.array([4.0, 3.0, 0.0])


def above(gap_m):
    return np.array([0.2, 0.1, -gap_m]), np.array([9.0, 2.0, 0.0])


def below(gap_m):
    return np.array([0.0, 0.3, gap_m]), np.array([0.0, 12.0, 0.0])


ROUND = (beside, askew, above, below)


def cylinder_size(place, radius_m, half_height_m):
    return half_height_m if place in (above, below) else radius_m


@pytest.mark.parametrize("moves", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("place", ROUND)
def test_what_moves_is_touched_nearer_than_the_radius_where_it_is_at_that_moment(place, moves):
    world = scene()
    size_m = cylinder_size(place, 4.0, 3.0)
    for gap_m, contact in ((SMALL_M + BIT_M, "none"), (SMALL_M - BIT_M, "moving_obstacle")):
        middle_m, half_m = place(size_m + gap_m)
        before_m = FAR_M.copy()
        before_m[0] = CENTRE_M + middle_m - moves * half_m
        world.state.x[0, :3] = CENTRE_M + PER_STEP_M + middle_m + moves * half_m
        outcome = judged(world, before_m)
        assert outcome["obstacle_clearance_m"][0] == pytest.approx(gap_m, abs=1e-9)
        assert names(outcome) == [contact, "none", "none"]
        assert outcome["contact_with"][0] == (0 if contact == "moving_obstacle" else -1)


@pytest.mark.parametrize("moves", [0.0, 1.0, -1.0])
@pytest.mark.parametrize("place", ROUND)
@pytest.mark.parametrize("pair", [(0, 1), (1, 2), (0, 2)])
def test_two_uas_touch_nearer_than_both_radii_and_both_are_lost(pair, place, moves):
    world = scene()
    one, other = pair
    both_m = sum((SMALL_M, LARGE_M, SMALL_M)[i] for i in pair)
    for gap_m, contact in ((both_m + BIT_M, "none"), (both_m - BIT_M, "uas")):
        middle_m, half_m = place(gap_m)
        before_m = FAR_M.copy()
        before_m[one] = before_m[other] + middle_m - moves * half_m
        world.state.x[:, :3] = FAR_M
        world.state.x[other, :3] += (3.0, -2.0, 1.0)
        world.state.x[one, :3] = world.state.x[other, :3] + middle_m + moves * half_m
        outcome = judged(world, before_m)
        third = ({0, 1, 2} - set(pair)).pop()
        assert outcome["separation_m"][[one, other]] == pytest.approx(gap_m, abs=1e-9)
        assert [names(outcome)[i] for i in (one, other, third)] == [contact, contact, "none"]
        if contact == "uas":
            assert outcome["contact_with"][[one, other, third]].tolist() == [other, one, -1]


@pytest.mark.parametrize("status", [LANDED, LOST])
def test_what_does_not_fly_touches_nothing(status):
    world = scene()
    world.state.x[0, :3] = world.state.x[2, :3] = 105.0, 30.0, -10.0
    assert names(judged(world)) == ["obstacle", "none", "obstacle"]
    world.state.uas[2].status = status
    outcome = judged(world)
    assert names(outcome) == ["obstacle", "none", "none"]
    assert outcome["separation_m"][0] > 50.0
    world.state.uas[0].status = status
    world.state.uas[1].status = status
    world.state.x[:, 2], world.state.x[:, DOD] = 5.0, 0.9
    assert names(judged(world)) == ["none"] * 3
    assert not judged(world)["breaches"].any()


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("side", ["low", "high"])
def test_a_uas_is_lost_at_the_first_bit_outside_of_any_face_of_the_fence(axis, side):
    world = scene()
    face_m = {"low": (0.0, 0.0, -50.0), "high": (200.0, 200.0, 0.0)}[side][axis]
    outward = 1.0 if side == "high" else -1.0
    for beyond_m, contact in ((0.0, "none"), (-BIT_M, "none"), (BIT_M, "geofence")):
        world.state.x[0, axis] = face_m + outward * beyond_m
        outcome = judged(world)
        assert names(outcome) == [contact, "none", "none"]
        assert outcome["fence_clearance_m"][0] == pytest.approx(-beyond_m, abs=1e-9)
        # nearer than the margin, unless it is lost
        assert outcome["breaches"][0] == (contact == "none")


def test_a_battery_may_be_used_up_to_its_limit_and_no_further():
    world = scene(dod_max=0.6)
    for dod, contact in ((0.6, "none"), (0.6 + 1e-12, "battery")):
        world.state.x[1, DOD] = dod
        assert names(judged(world)) == ["none", contact, "none"]


def test_of_several_contacts_the_first_kind_counts():
    world = scene()
    world.state.x[:2, :3] = 105.0, 30.0, -10.0
    world.state.x[:, DOD] = 0.9
    outcome = judged(world)
    assert names(outcome) == ["obstacle", "obstacle", "battery"]
    assert outcome["contact_with"].tolist() == [0, 0, -1]


def test_a_no_fly_zone_is_too_near_but_touches_no_uas_and_what_stands_in_it_does():
    zone = box("zone", (60.0, 90.0, -40.0), (90.0, 120.0, 0.0))
    inner = box("inner", (70.0, 100.0, -20.0), (72.0, 102.0, 0.0))
    world = scene(obstacles=[WALL, zone, inner])
    world.arena.obstacles["no_fly_zone"][1] = True
    for place_m, contact, touched in (
        ((65.0, 95.0, -10.0), "none", -1),
        ((71.0, 101.0, -10.0), "obstacle", 2),
        ((70.0 - SMALL_M + BIT_M, 101.0, -10.0), "obstacle", 2),
        ((70.0 - SMALL_M - BIT_M, 101.0, -10.0), "none", -1),
    ):
        world.state.x[0, :3] = place_m
        outcome = judged(world)
        assert names(outcome)[0] == contact
        assert outcome["contact_with"][0] == touched
        if contact == "none":
            assert outcome["breaches"][0] == (1 if place_m[0] < 68.0 else 2)


@pytest.mark.parametrize("place", WALLS)
def test_a_wall_is_too_near_within_its_safe_distance_beyond_the_radius(place):
    world = scene()
    for more_m, breaches in BREACHES:
        gap_m = LARGE_M + 2.0 + more_m
        middle_m, _ = place(gap_m)
        world.state.x[1, :3] = middle_m
        assert judged(world)["breaches"].tolist() == [0, breaches, 0]


@pytest.mark.parametrize("place", ROUND)
def test_what_moves_is_too_near_where_it_is_at_the_sample(place):
    world = scene()
    size_m = cylinder_size(place, 4.0, 3.0)
    for more_m, breaches in BREACHES:
        gap_m = SMALL_M + 3.0 + more_m
        middle_m, _ = place(size_m + gap_m)
        world.state.x[0, :3] = CENTRE_M + PER_STEP_M + middle_m
        assert judged(world)["breaches"].tolist() == [breaches, 0, 0]


@pytest.mark.parametrize("place", ROUND)
def test_two_uas_are_too_near_within_their_distance_beyond_both_radii(place):
    world = scene()
    both_m = SMALL_M + LARGE_M + 5.0
    for more_m, breaches in BREACHES:
        middle_m, _ = place(both_m + more_m)
        world.state.x[0, :3] = world.state.x[1, :3] + middle_m
        assert judged(world)["breaches"].tolist() == [breaches, breaches, 0]
    # from one that is lost no distance is kept
    world.state.x[0, :3] = world.state.x[1, :3] + place(both_m - 1.0)[0]
    world.state.x[1, DOD] = 0.9
    outcome = judged(world)
    assert names(outcome) == ["none", "battery", "none"]
    assert not outcome["breaches"].any()


@pytest.mark.parametrize("first", [0, 1, 30, 63, 64, 99])
def test_of_many_obstacles_the_nearest_counts(first):
    """More than are looked at at once; the one in question is anywhere in the list."""
    posts = [
        box(f"post_{k}", (20.0 + 1.6 * k, 100.0, -9.0), (20.4 + 1.6 * k, 100.4, 0.0), 0.5)
        for k in range(100)
    ]
    world = scene(obstacles=posts, moving_obstacles=())
    world.state.x[0, :3] = 20.2 + 1.6 * first, 99.7, -5.0
    before_m = world.state.x[:, :3] - (0.0, 3.0, 0.0)
    outcome = judged(world, before_m)
    assert outcome["obstacle_clearance_m"][0] == pytest.approx(0.3)
    assert (names(outcome)[0], outcome["contact_with"][0]) == ("obstacle", first)


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_face_between_bounds_the_clearance_from_below(seed):
    rng = np.random.default_rng(seed)
    hull = ConvexPolytope.from_points(rng.uniform(-5.0, 5.0, (8, 3)))
    before_m, after_m = rng.uniform(-12.0, 12.0, (2, 3))
    bound_m = face_between(hull.normals, hull.offsets_m, 0, hull.n_faces, *before_m, *after_m)
    faces_m = np.minimum(hull.face_distances(before_m), hull.face_distances(after_m))
    assert bound_m == pytest.approx(faces_m.max())
    assert bound_m <= clearance_of_segment(hull, before_m, after_m) + 1e-9
