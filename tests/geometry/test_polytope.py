"""Convex hulls against scipy's own triangulation and linear programs."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog
from scipy.spatial import Delaunay

from uas_coverage_env.geometry import ConvexPolytope

EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)
BOX = [[x, y, z] for x in (-2.0, 8.0) for y in (3.0, 5.0) for z in (0.0, -7.0)]


@st.composite
def clouds(draw, shift_m=0.0):
    n_points = draw(st.integers(4, 14))
    grid = st.integers(-40, 40).map(lambda value: value / 4)
    points = draw(arrays(np.float64, (n_points, 3), elements=grid))
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[-1]
    assume(spread > 0.3)
    return points + shift_m


def is_convex_combination(points, target):
    """An LP over the weights of the points: the definition of a convex hull."""
    found = linprog(
        np.zeros(len(points)),
        A_eq=np.vstack([points.T, np.ones(len(points))]),
        b_eq=np.append(target, 1.0),
        bounds=(0, None),
    )
    return found.status == 0


@EXAMPLES
@given(clouds(), arrays(np.float64, 3, elements=st.floats(-12, 12)))
def test_a_point_is_in_the_hull_exactly_where_its_signed_distance_is_not_positive(points, target):
    distance_m = float(ConvexPolytope.from_points(points).signed_distance(target))
    assume(abs(distance_m) > 1e-6)
    assert is_convex_combination(points, target) == (distance_m <= 0)


@EXAMPLES
@given(clouds(), st.integers(0, 2**32 - 1))
def test_the_hull_agrees_with_delaunay_on_random_points(points, seed):
    targets = np.random.default_rng(seed).uniform(-12, 12, size=(200, 3))
    distance_m = ConvexPolytope.from_points(points).signed_distance(targets)
    clear = np.abs(distance_m) > 1e-6
    inside = Delaunay(points).find_simplex(targets) >= 0
    np.testing.assert_array_equal(inside[clear], distance_m[clear] <= 0)


@EXAMPLES
@given(clouds())
def test_normals_are_unit_vectors_and_every_face_touches_the_body(points):
    hull = ConvexPolytope.from_points(points)
    np.testing.assert_allclose(np.linalg.norm(hull.normals, axis=1), 1.0, atol=1e-12)
    of_points = hull.face_distances(points)
    assert of_points.max() <= 1e-9
    on_face = np.abs(of_points) < 1e-9
    assert (on_face.sum(axis=0) >= 3).all()
    assert hull.n_faces == len(hull.offsets_m) == of_points.shape[1]


@EXAMPLES
@given(clouds())
def test_outside_the_signed_distance_never_exceeds_the_euclidean_distance(points):
    hull = ConvexPolytope.from_points(points)
    outward = points + 3.0 * (points - points.mean(axis=0))
    nearest = np.linalg.norm(outward[:, None] - points[None], axis=2).min(axis=1)
    assert (hull.signed_distance(outward) <= nearest + 1e-9).all()


@EXAMPLES
@given(clouds(), st.floats(0.0, 9.0))
def test_a_raised_body_is_as_far_away_whether_its_corners_are_found_or_not(points, height_m):
    hull = ConvexPolytope.from_points(points)
    around = 2.0 * (points - points.mean(axis=0))
    distances_m = hull.distance_when_raised(around, height_m)
    np.testing.assert_array_equal(distances_m, hull.raised(height_m).signed_distance(around))


@EXAMPLES
@given(clouds(), st.randoms(use_true_random=False))
def test_the_faces_do_not_depend_on_the_order_of_the_points(points, random):
    shuffled = list(points)
    random.shuffle(shuffled)
    one, other = ConvexPolytope.from_points(points), ConvexPolytope.from_points(shuffled)
    np.testing.assert_allclose(one.normals, other.normals, atol=1e-8)
    np.testing.assert_allclose(one.offsets_m, other.offsets_m, atol=1e-8)


@EXAMPLES
@given(clouds(), st.sampled_from([-99_000.0, 1234.5, 99_000.0]))
def test_a_body_keeps_its_shape_far_from_the_origin(points, shift_m):
    here, there = ConvexPolytope.from_points(points), ConvexPolytope.from_points(points + shift_m)
    target = np.array([1.0, -2.0, 3.0])
    there_m, here_m = there.signed_distance(target + shift_m), here.signed_distance(target)
    assert there_m == pytest.approx(here_m, abs=1e-6)


def test_a_box_has_six_faces_in_lexicographic_order_of_their_normals():
    hull = ConvexPolytope.from_points(BOX)
    expected = [[-1, 0, 0], [0, -1, 0], [0, 0, -1], [0, 0, 1], [0, 1, 0], [1, 0, 0]]
    np.testing.assert_array_equal(hull.normals, expected)
    np.testing.assert_allclose(hull.offsets_m, [-2, 3, -7, 0, -5, -8], atol=1e-12)
    np.testing.assert_array_equal(hull.vertices_m, BOX)


def test_a_turned_box_still_has_six_faces():
    turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    assert ConvexPolytope.from_points(np.array(BOX) @ turn.T).n_faces == 6


def test_points_inside_the_body_or_given_twice_change_nothing():
    plain = ConvexPolytope.from_points(BOX)
    crowded = ConvexPolytope.from_points([[0.0, 4.0, -3.0], *BOX, *BOX])
    np.testing.assert_array_equal(plain.normals, crowded.normals)
    np.testing.assert_allclose(plain.offsets_m, crowded.offsets_m, atol=1e-12)
    assert len(crowded.vertices_m) == 8


def test_distances_keep_the_leading_shape_of_the_points():
    hull = ConvexPolytope.from_points(BOX)
    points = np.zeros((2, 5, 3))
    assert hull.face_distances(points).shape == (2, 5, 6)
    assert hull.signed_distance(points).shape == (2, 5)
    assert hull.signed_distance(points[0, 0]) == 3.0


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (BOX[:3], "at least 4 points, not 3"),
        ([], "shape"),
        ([[1.0, 2.0]] * 5, "rows of x, y, z"),
        ([[x, y, -3.0] for x in (0, 1, 2) for y in (0, 1, 2)], "in one plane"),
        ([[float(t), 2.0 * t, 0.0] for t in range(6)], "in one plane"),
        ([[1.0, 1.0, 1.0]] * 6, "in one plane"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1e-6]], "in one plane"),
        ([*BOX, [float("nan"), 0, 0]], "point 8 is .* finite"),
        ([*BOX, [0, float("inf"), 0]], "finite"),
    ],
)
def test_points_that_span_no_volume_are_refused_in_plain_words(points, message):
    with pytest.raises(ValueError, match=message):
        ConvexPolytope.from_points(points)


def test_the_arrays_of_a_polytope_cannot_be_changed():
    hull = ConvexPolytope.from_points(BOX)
    with pytest.raises(ValueError, match="read-only"):
        hull.normals[0, 0] = 5.0


@pytest.mark.parametrize(
    ("normals", "offsets_m", "message"),
    [
        ([[1.0, 0.0]], [0.0], "normals has shape"),
        ([[1.0, 0.0, 0.0]], [[0.0]], "offsets_m has shape"),
        ([[1.0, 0.0, 0.0]], [0.0, 1.0], "one of each per face"),
        ([[1.0, 0.0, float("nan")]], [0.0], "finite"),
    ],
)
def test_inconsistent_plane_arrays_are_refused(normals, offsets_m, message):
    with pytest.raises(ValueError, match=message):
        ConvexPolytope(normals, offsets_m, BOX)
