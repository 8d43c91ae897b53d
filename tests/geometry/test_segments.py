"""Exact segment kernels against dense sampling and linear programs."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.optimize import linprog

from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.segments import (
    cylinder_clearance,
    segment_clearance,
    segment_meets,
    signed_distance,
)

EXAMPLES = settings(max_examples=150, deadline=None, derandomize=True)
POINT = arrays(np.float64, 3, elements=st.floats(-15, 15))
GRID_POINT = arrays(np.float64, 3, elements=st.integers(-6, 6).map(float))
AT = np.linspace(0.0, 1.0, 2001)
# two hulls in one pair of arrays: the kernels must keep to the rows they are given
HULLS = [
    ConvexPolytope.from_points(points)
    for points in (
        [[x, y, z] for x in (-3.0, 4.0) for y in (-2.0, 2.0) for z in (0.0, -6.0)],
        [[0, 0, -5], [6, 0, 0], [-4, 5, 0], [-4, -5, 0], [0, 0, 5], [1, 1, -5.5]],
        [[-9, -9, 1], [-8, -9, 1], [-9, -8, 1], [-9, -9, 2]],
    )
]
NORMALS = np.vstack([hull.normals for hull in HULLS])
OFFSETS_M = np.concatenate([hull.offsets_m for hull in HULLS])
ENDS = np.cumsum([0, *(hull.n_faces for hull in HULLS)])
HULL = st.integers(0, len(HULLS) - 1)


def sampled(p0, p1):
    return p0 + AT[:, None] * (p1 - p0)


def cylinder_distance(points, radius_m, half_height_m):
    horizontal = np.hypot(points[:, 0], points[:, 1]) - radius_m
    return np.maximum(horizontal, np.abs(points[:, 2]) - half_height_m)


def clearance(hull, p0, p1):
    return segment_clearance(NORMALS, OFFSETS_M, ENDS[hull], ENDS[hull + 1], *p0, *p1)


@EXAMPLES
@given(HULL, POINT)
def test_the_kernel_and_the_polytope_give_the_same_signed_distance(hull, point):
    distance = signed_distance(NORMALS, OFFSETS_M, ENDS[hull], ENDS[hull + 1], *point)
    assert distance == pytest.approx(HULLS[hull].signed_distance(point), abs=1e-12)


@EXAMPLES
@given(HULL, st.one_of(POINT, GRID_POINT), st.one_of(POINT, GRID_POINT))
def test_segment_clearance_is_the_smallest_sampled_distance_and_never_above_it(hull, p0, p1):
    exact = clearance(hull, p0, p1)
    dense = HULLS[hull].signed_distance(sampled(p0, p1)).min()
    between_samples = 0.5 * np.linalg.norm(p1 - p0) / (len(AT) - 1)
    assert exact <= dense + 1e-12
    assert exact >= dense - between_samples - 1e-12


@settings(max_examples=60, deadline=None, derandomize=True)
@given(HULL, POINT, POINT)
def test_segment_clearance_solves_its_linear_program(hull, p0, p1):
    """Minimise s over (t, s): d_h(p0 + t (p1 - p0)) <= s, 0 <= t <= 1."""
    body = HULLS[hull]
    rise = body.normals @ (p1 - p0)
    program = linprog(
        [0.0, 1.0],
        A_ub=np.column_stack([rise, -np.ones(body.n_faces)]),
        b_ub=-body.face_distances(p0),
        bounds=[(0, 1), (None, None)],
    )
    assert clearance(hull, p0, p1) == pytest.approx(program.fun, abs=1e-8)


@EXAMPLES
@given(HULL, POINT)
def test_a_segment_without_length_has_the_distance_of_its_point(hull, point):
    distance = signed_distance(NORMALS, OFFSETS_M, ENDS[hull], ENDS[hull + 1], *point)
    assert clearance(hull, point, point) == distance


@EXAMPLES
@given(HULL, POINT, POINT)
def test_segment_clearance_does_not_depend_on_the_direction(hull, p0, p1):
    assert clearance(hull, p0, p1) == pytest.approx(clearance(hull, p1, p0), abs=1e-9)


@EXAMPLES
@given(HULL, st.floats(-1, 6), st.one_of(POINT, GRID_POINT), st.one_of(POINT, GRID_POINT))
def test_a_segment_meets_an_inflated_hull_exactly_where_its_clearance_is_smaller(
    hull, inflation_m, p0, p1
):
    exact = clearance(hull, p0, p1)
    assume(abs(exact - inflation_m) > 1e-9)
    met = segment_meets(NORMALS, OFFSETS_M, ENDS[hull], ENDS[hull + 1], inflation_m, *p0, *p1)
    assert met == (exact < inflation_m)


def test_a_segment_along_a_wall_at_exactly_the_distance_kept_does_not_meet_it():
    box = ConvexPolytope.from_points(
        [[x, y, z] for x in (0, 4.0) for y in (0, 4.0) for z in (0, 4.0)]
    )
    arguments = (box.normals, box.offsets_m, 0, 6)
    along = (6.0, -5.0, 2.0, 6.0, 9.0, 2.0)
    assert segment_clearance(*arguments, *along) == 2.0
    assert not segment_meets(*arguments, 2.0, *along)
    assert segment_meets(*arguments, 2.0 + 1e-9, *along)


@EXAMPLES
@given(
    st.one_of(st.just(0.0), st.floats(0, 8)),
    st.one_of(st.just(0.0), st.floats(0, 8)),
    st.one_of(POINT, GRID_POINT),
    st.one_of(POINT, GRID_POINT),
)
def test_cylinder_clearance_is_the_smallest_sampled_distance_and_never_above_it(
    radius_m, half_height_m, p0, p1
):
    exact = cylinder_clearance(radius_m, half_height_m, *p0, *p1)
    dense = cylinder_distance(sampled(p0, p1), radius_m, half_height_m).min()
    between_samples = 0.5 * np.linalg.norm(p1 - p0) / (len(AT) - 1)
    assert exact <= dense + 1e-12
    assert exact >= dense - between_samples - 1e-12


@settings(max_examples=60, deadline=None, derandomize=True)
@given(st.floats(0, 8), st.floats(0, 8), POINT, POINT)
def test_cylinder_clearance_agrees_with_a_search_on_the_convex_distance(
    radius_m, half_height_m, p0, p1
):
    low, high = 0.0, 1.0
    for _ in range(120):
        third = (high - low) / 3
        ends = np.array([low + third, high - third])
        left, right = cylinder_distance(p0 + ends[:, None] * (p1 - p0), radius_m, half_height_m)
        if left < right:
            high -= third
        else:
            low += third
    found = p0 + 0.5 * (low + high) * (p1 - p0)
    expected = cylinder_distance(found[None], radius_m, half_height_m)[0]
    assert cylinder_clearance(radius_m, half_height_m, *p0, *p1) <= expected + 1e-9
    # the search stalls on flat stretches by rounding, never by more than this
    assert cylinder_clearance(radius_m, half_height_m, *p0, *p1) >= expected - 1e-6


@EXAMPLES
@given(POINT, POINT)
def test_separation_of_two_uas_is_symmetric(p0, p1):
    one = cylinder_clearance(0.0, 0.0, *p0, *p1)
    other = cylinder_clearance(0.0, 0.0, *(-p1), *(-p0))
    assert one == pytest.approx(other, abs=1e-9)
    assert one >= 0.0


@pytest.mark.parametrize(
    ("p0", "p1", "expected"),
    [
        ((-5, 0, 0), (5, 0, 0), -2.0),  # through the axis at mid height: the end caps are nearer
        ((-9, 4, 0), (9, 4, 0), 1.0),  # past the side
        ((0, 0, -9), (0, 0, -3), 1.0),  # down onto the top
        ((0, 0, -9), (0, 0, 9), -2.0),  # along the axis
        ((7, 0, -2), (7, 0, 2), 4.0),  # parallel to the axis
        ((3, 0, 0), (3, 0, 0), 0.0),  # on the side, at rest
        ((13, 0, 0), (3, 0, -12), 10 - 10 * 12 / 22),  # 10 - 10 t = 12 t - 2
    ],
)
def test_cylinder_clearance_of_segments_one_can_work_out(p0, p1, expected):
    """Radius 3 m, half height 2 m."""
    found = cylinder_clearance(3.0, 2.0, *map(float, p0), *map(float, p1))
    assert found == pytest.approx(expected, abs=1e-12)


def test_the_kernels_stay_finite_on_huge_and_tiny_segments():
    for scale in (1e-150, 1e-9, 1.0, 1e5):
        found = cylinder_clearance(1.0, 1.0, scale, scale, -scale, -scale, scale, scale)
        assert math.isfinite(found)
        p0, p1 = np.full(3, scale), np.array([-scale, scale, 2 * scale])
        assert math.isfinite(clearance(0, p0, p1))
