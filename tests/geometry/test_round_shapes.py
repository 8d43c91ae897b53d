"""The paper's polygons and polyhedra around and inside round shapes."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env.geometry import cylinder_faces, sphere_faces
from uas_coverage_env.geometry.round_shapes import closed_cylinder_faces, inner_factor

EXAMPLES = settings(max_examples=80, deadline=None, derandomize=True)
SIDES = st.sampled_from([4, 6, 8, 10, 12, 16])
COORDINATE = st.floats(-5, 5)


@pytest.mark.parametrize("H", [4, 6, 8, 12])
def test_the_number_of_faces_is_the_papers(H):
    assert cylinder_faces(H).shape == (H, 3)
    assert closed_cylinder_faces(H).shape == (H + 2, 3)
    assert sphere_faces(H).shape == (H * (H // 2 - 1) + 2, 3)


@pytest.mark.parametrize("H", [4, 6, 8, 12])
def test_cylinder_faces_come_in_the_papers_order(H):
    for h in range(1, H + 1):
        alpha = 2 * math.pi * h / H
        expected = [math.cos(alpha), math.sin(alpha), 0.0]
        np.testing.assert_allclose(cylinder_faces(H)[h - 1], expected, atol=1e-12)
    np.testing.assert_array_equal(closed_cylinder_faces(H)[:H], cylinder_faces(H))
    np.testing.assert_array_equal(closed_cylinder_faces(H)[H:], [[0, 0, 1], [0, 0, -1]])


@pytest.mark.parametrize("H", [4, 6, 8, 12])
def test_sphere_faces_come_in_the_papers_order(H):
    faces = sphere_faces(H)
    for h in range(1, H * (H // 2 - 1) + 1):
        i = math.floor((h - 1) / (0.5 * H - 1)) + 1
        j = (h - 1) % (H // 2 - 1) + 1
        alpha, beta = 2 * math.pi * i / H, 2 * math.pi * j / H
        expected = [
            math.cos(alpha) * math.sin(beta),
            math.sin(alpha) * math.sin(beta),
            math.cos(beta),
        ]
        np.testing.assert_allclose(faces[h - 1], expected, atol=1e-12)
    np.testing.assert_array_equal(faces[-2:], [[0, 0, 1], [0, 0, -1]])


def test_with_four_sides_a_sphere_is_a_cube():
    axes = {tuple(row) for row in sphere_faces(4).round(12) + 0.0}
    assert axes == {(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)}


@EXAMPLES
@given(SIDES, COORDINATE, COORDINATE, COORDINATE)
def test_the_outer_approximation_contains_the_round_shape(H, x, y, z):
    vector = np.array([x, y, z])
    assert (cylinder_faces(H) @ vector).max() <= math.hypot(x, y) + 1e-12
    assert (sphere_faces(H) @ vector).max() <= np.linalg.norm(vector) + 1e-12
    closed = (closed_cylinder_faces(H) @ vector).max()
    assert closed <= max(math.hypot(x, y), abs(z)) + 1e-12


@EXAMPLES
@given(SIDES, COORDINATE, COORDINATE, COORDINATE)
def test_the_inner_approximation_lies_in_the_round_shape(H, x, y, z):
    vector = np.array([x, y, z])
    assert (cylinder_faces(H) @ vector).max() >= inner_factor(H, 2) * math.hypot(x, y) - 1e-12
    assert (sphere_faces(H) @ vector).max() >= inner_factor(H, 3) * np.linalg.norm(vector) - 1e-12


@pytest.mark.parametrize("H", [4, 6, 8, 12])
def test_the_inner_polygon_touches_the_circle_at_its_corners(H):
    corner = np.array([math.cos(math.pi / H), math.sin(math.pi / H), 0.0])
    assert (cylinder_faces(H) @ corner).max() == pytest.approx(inner_factor(H, 2))


@pytest.mark.parametrize("H", [5, 2, 0, -4, 4.0, True, "8"])
@pytest.mark.parametrize("shape", [cylinder_faces, closed_cylinder_faces, sphere_faces])
def test_the_number_of_sides_is_even_and_at_least_four(shape, H):
    with pytest.raises(ValueError, match="even and at least 4"):
        shape(H)


@pytest.mark.parametrize("dimensions", [1, 4, "2"])
def test_inner_factors_exist_in_two_and_three_dimensions(dimensions):
    with pytest.raises(ValueError, match="2 or 3"):
        inner_factor(8, dimensions)
