"""Rows that keep outside a shape, measured against the geometry that the world judges with."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from toy_problems import S500, feasible, flight, moving, state, toy, written
from uas_coverage_baselines.milp_mpc.model.blocks import (
    Collision,
    CornerCutting,
    MovingObstacles,
    Obstacles,
)

from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.round_shapes import closed_cylinder_faces
from uas_coverage_env.geometry.segments import cylinder_clearance, segment_clearance

ROUNDING_M = 1e-5
FAR = state((5.0, 5.0, -5.0))
ELSEWHERE = state((195.0, 195.0, -45.0))

few = settings(max_examples=25, deadline=None, derandomize=True)


def coordinates(low, high):
    return st.floats(low, high, allow_nan=False).map(lambda value: round(value, 2))


def points(reach_m, height_m):
    return st.tuples(
        coordinates(-reach_m, reach_m),
        coordinates(-reach_m, reach_m),
        coordinates(-height_m, height_m),
    ).map(np.array)


hull_points = st.lists(points(20.0, 15.0), min_size=4, max_size=8)
about = points(32.0, 20.0)
MIDDLE = np.array([100.0, 100.0, -25.0])


def hull_about(centre, corners):
    try:
        hull = ConvexPolytope.from_points(centre + np.array(corners))
    except ValueError:
        hull = None
    assume(hull is not None)
    return hull


def is_close_to(distance_m, wanted_m):
    return abs(distance_m - wanted_m) < ROUNDING_M


class PaperCornerCutting:
    """The corner cutting constraints word for word: b and c whole, 2 c on the right."""

    def add_to(self, milp, v, problem):
        relaxed = milp.columns("tower_0.relaxed")
        N = relaxed.shape[1] - 1
        crossed = milp.variables(
            "paper.crossed", (*relaxed[:, 1:].shape,), lower=0.0, upper=1.0, integer=True
        )
        milp.subject_to(
            "paper.corner",
            (1.0, relaxed[:, :N, :, None]),
            (1.0, relaxed[:, 1:, :, None]),
            (-2.0, crossed[..., None]),
            upper=0.0,
        )
        milp.subject_to("paper.one_face", (1.0, crossed), upper=relaxed.shape[2] - 1)


@few
@given(hull_points, st.lists(about, min_size=3, max_size=5), coordinates(0.0, 4.0))
def test_obstacle_rows_hold_exactly_where_a_position_keeps_the_clearance(
    corners, places, clearance_m
):
    hull = hull_about(MIDDLE, corners)
    problem = toy(FAR, horizon=1, obstacles=[hull], clearance_m=clearance_m, prune=False)
    milp, v = written(problem, Obstacles())
    for place in MIDDLE + np.array(places):
        distance_m = float(hull.signed_distance(place))
        if not is_close_to(distance_m, clearance_m):
            accepted = feasible(milp, [(v.position[0, 1], place)])
            assert accepted == (distance_m >= clearance_m)


@few
@given(
    hull_points,
    st.lists(points(10.0, 3.0), min_size=3, max_size=3),
    st.lists(about, min_size=3, max_size=3),
    points(8.0, 1.5),
)
def test_pruned_obstacle_rows_still_hold_exactly_where_a_flown_path_keeps_the_clearance(
    corners, commands, shifts, velocity
):
    start = state(MIDDLE, velocity)
    path = flight(S500, start, commands)[:, :3]
    for shift in shifts:
        hull = hull_about(path[-1] + shift, corners)
        distances_m = hull.signed_distance(path)
        assume(not any(is_close_to(d, 1.0) for d in distances_m))
        milp, v = written(toy(start, horizon=3, obstacles=[hull]), Obstacles())
        accepted = feasible(milp, [(v.position[0, 1:], path[1:])])
        assert accepted == bool((distances_m[1:] >= 1.0).all())


def polygon_distance_m(away, H, radius_m, half_height_m):
    faces = closed_cylinder_faces(H)
    size = np.r_[np.full(H, radius_m), half_height_m, half_height_m]
    return float((faces @ away - size).max())


@few
@given(st.sampled_from([4, 8, 12]), coordinates(1.0, 15.0), coordinates(1.0, 9.0), st.data())
def test_moving_obstacle_rows_mean_the_polygon_around_the_cylinder(H, radius_m, half_m, data):
    path = MIDDLE + np.array([[0.0, 0.0, 0.0], [3.0, -2.0, 1.0]])
    problem = toy(
        FAR,
        horizon=1,
        moving_obstacles=[moving(path, radius_m, half_m)],
        moving_clearance_m=2.0,
        obstacle_sides=H,
        prune=False,
    )
    milp, v = written(problem, MovingObstacles())
    for away in data.draw(st.lists(points(25.0, 14.0), min_size=3, max_size=4)):
        assume(not is_close_to(polygon_distance_m(away, H, radius_m, half_m), 2.0))
        accepted = feasible(milp, [(v.position[0, 1], path[1] + away)])
        assert accepted == (polygon_distance_m(away, H, radius_m, half_m) >= 2.0)
        true_m = max(np.hypot(away[0], away[1]) - radius_m, abs(away[2]) - half_m)
        if accepted:
            assert true_m >= 2.0 - ROUNDING_M
        # what the polygon gives away: no more than its corners stand out of the circle
        if np.hypot(away[0], away[1]) >= (radius_m + 2.0) / np.cos(np.pi / H):
            assert accepted


@few
@given(st.sampled_from([4, 8]), points(12.0, 8.0), points(12.0, 8.0))
def test_collision_rows_mean_the_polygon_around_the_other_uas(H, one, other):
    problem = toy(FAR, ELSEWHERE, horizon=1, separation_m=6.0, obstacle_sides=H, prune=False)
    milp, v = written(problem, Collision())
    apart = one - other
    assume(not is_close_to(polygon_distance_m(apart, H, 0.0, 0.0), 6.0))
    places = [(v.position[0, 1], MIDDLE + one), (v.position[1, 1], MIDDLE + other)]
    accepted = feasible(milp, places)
    assert accepted == (polygon_distance_m(apart, H, 0.0, 0.0) >= 6.0)
    if accepted:
        assert max(np.hypot(apart[0], apart[1]), abs(apart[2])) >= 6.0 - ROUNDING_M


@few
@given(hull_points, st.lists(st.tuples(about, about), min_size=3, max_size=4))
def test_a_segment_that_the_corner_rows_accept_misses_the_inflated_hull(corners, pairs):
    hull = hull_about(MIDDLE, corners)
    problem = toy(FAR, horizon=2, obstacles=[hull], clearance_m=1.5, prune=False)
    milp, v = written(problem, Obstacles(), CornerCutting())
    for one, other in pairs:
        p, q = MIDDLE + one, MIDDLE + other
        both = np.minimum(hull.face_distances(p), hull.face_distances(q))
        first = np.minimum(hull.face_distances(FAR[:3]), hull.face_distances(p))
        assume(not any(is_close_to(d, 1.5) for d in (both.max(), first.max())))
        accepted = feasible(milp, [(v.position[0, 1], p), (v.position[0, 2], q)])
        assert accepted == bool(both.max() >= 1.5 and first.max() >= 1.5)
        if accepted:
            for start, end in ((FAR[:3], p), (p, q)):
                clearance_m = segment_clearance(
                    hull.normals, hull.offsets_m, 0, hull.n_faces, *start, *end
                )
                assert clearance_m >= 1.5 - ROUNDING_M


@pytest.mark.parametrize("prune", [False, True])
@few
@given(
    corners=hull_points,
    shift=points(16.0, 10.0),
    turn=points(14.0, 4.0),
    onward=points(14.0, 4.0),
    velocity=points(8.0, 1.5),
)
def test_tighter_corner_rows_accept_the_same_paths_as_those_of_the_paper(
    prune, corners, shift, turn, onward, velocity
):
    start = state(MIDDLE, velocity)
    commands = [turn, turn, onward, onward]
    path = flight(S500, start, commands)[:, :3]
    hull = hull_about(path[2] + shift, corners)
    problem = toy(start, horizon=4, obstacles=[hull], prune=prune)
    ours, v = written(problem, Obstacles(), CornerCutting())
    paper, w = written(toy(start, horizon=4, obstacles=[hull], prune=False), Obstacles())
    PaperCornerCutting().add_to(paper, w, problem)
    distances_m = hull.face_distances(path)
    kept_m = np.minimum(distances_m[:-1], distances_m[1:]).max(axis=1)
    assume(distances_m[0].max() >= 1.0 + ROUNDING_M)
    assume(not any(is_close_to(d, 1.0) for d in kept_m))
    accepted = feasible(ours, [(v.position[0, 1:], path[1:])])
    assert accepted == feasible(paper, [(w.position[0, 1:], path[1:])])
    assert accepted == bool((kept_m >= 1.0).all())


@few
@given(points(14.0, 6.0), points(14.0, 6.0), points(6.0, 3.0))
def test_nothing_that_moves_is_jumped_over(one, other, stride):
    path = MIDDLE + np.outer(np.arange(3), stride)
    mover = moving(path, 4.0, 3.0)
    problem = toy(FAR, horizon=2, moving_obstacles=[mover], prune=False)
    milp, v = written(problem, MovingObstacles(), CornerCutting())
    p, q = path[1] + one, path[2] + other
    if feasible(milp, [(v.position[0, 1], p), (v.position[0, 2], q)]):
        assert cylinder_clearance(4.0, 3.0, *one, *other) >= 1.0 - ROUNDING_M


@few
@given(points(12.0, 7.0), points(12.0, 7.0), points(4.0, 2.0))
def test_two_uas_do_not_pass_through_each_other_between_samples(one, other, drift):
    problem = toy(FAR, ELSEWHERE, horizon=2, separation_m=6.0, prune=False)
    milp, v = written(problem, Collision(), CornerCutting())
    first = np.array([MIDDLE + one, MIDDLE + drift + other])
    second = np.array([MIDDLE, MIDDLE + drift])
    if feasible(milp, [(v.position[0, 1:], first), (v.position[1, 1:], second)]):
        assert cylinder_clearance(0.0, 0.0, *one, *other) >= 6.0 - ROUNDING_M


def test_two_uas_that_swap_places_in_one_step_are_refused_though_both_samples_are_clear():
    problem = toy(FAR, ELSEWHERE, horizon=2, separation_m=6.0, prune=False)
    milp, v = written(problem, Collision(), CornerCutting())
    left, right = MIDDLE, MIDDLE + np.array([8.0, 0.0, 0.0])
    stays = [(v.position[0, 1:], [left, left]), (v.position[1, 1:], [right, right])]
    swaps = [(v.position[0, 1:], [left, right]), (v.position[1, 1:], [right, left])]
    assert feasible(milp, stays)
    assert not feasible(milp, swaps)


@few
@given(hull_points, st.integers(0, 50), coordinates(0.1, 2.9), points(14.0, 8.0))
def test_a_uas_that_starts_too_close_may_only_leave_and_comes_no_closer_on_the_way(
    corners, face, distance_m, stride
):
    hull = hull_about(MIDDLE, corners)
    face %= hull.n_faces
    on_face = np.abs(hull.face_distances(hull.vertices_m)[:, face]) < 1e-9
    start = hull.vertices_m[on_face].mean(axis=0) + distance_m * hull.normals[face]
    problem = toy(state(start), horizon=1, obstacles=[hull], clearance_m=3.0, prune=False)
    milp, v = written(problem, Obstacles(), CornerCutting())
    away = start + hull.normals[face] * (3.0 - distance_m + 0.1)
    assert feasible(milp, [(v.position[0, 1], away)])
    if feasible(milp, [(v.position[0, 1], start + stride)]):
        least_m = segment_clearance(
            hull.normals, hull.offsets_m, 0, hull.n_faces, *start, *(start + stride)
        )
        assert least_m >= distance_m - ROUNDING_M
        assert hull.signed_distance(start + stride) >= 3.0 - ROUNDING_M
