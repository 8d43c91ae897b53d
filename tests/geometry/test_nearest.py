import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from uas_coverage_env.geometry.nearest import nearest_on_segment

places = arrays(np.float64, 3, elements=st.floats(-50.0, 50.0))


@given(point=places, start=places, end=places, share=st.floats(0.0, 1.0))
def test_no_place_of_the_segment_is_nearer(point, start, end, share):
    found = nearest_on_segment(point[None], start, end)
    there = start + share * (end - start)
    assert found.distance_m[0] <= np.linalg.norm(there - point) + 1e-4
    np.testing.assert_allclose(found.place_m[0], start + found.share[0] * (end - start))
    assert found.distance_m[0] == pytest.approx(np.linalg.norm(found.place_m[0] - point))


def test_of_a_segment_without_length_it_is_its_start():
    start = np.array([1.0, 2.0, -3.0])
    found = nearest_on_segment(np.array([[1.0, 2.0, 1.0]]), start, start)
    assert found.distance_m[0] == 4.0
    np.testing.assert_array_equal(found.place_m[0], start)
