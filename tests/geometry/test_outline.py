"""Outlines seen from above."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial import ConvexHull, QhullError

from uas_coverage_env.geometry.outline import outline_of

POINTS = arrays(np.float64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.integers(-9, 9))


@given(POINTS)
def test_an_outline_has_the_area_of_the_hull_and_corners_of_the_points(points):
    outline = outline_of(points)
    assert {*map(tuple, outline)} <= {*map(tuple, points[:, :2])}
    assert len({*map(tuple, outline)}) == len(outline)
    try:
        area = ConvexHull(points[:, :2]).volume
    except (QhullError, ValueError):  # points on a line
        area = 0.0
    north, east = outline.T
    # of a polygon that goes round counter-clockwise as a map shows it, east to the right
    signed = 0.5 * float(east @ np.roll(north, -1) - north @ np.roll(east, -1))
    assert signed == pytest.approx(area)
    assert tuple(outline[0][::-1]) == min((e, n) for n, e, _ in points)


def test_no_corner_of_an_outline_lies_on_a_straight_edge():
    square = np.array([(n, e, d) for d in (0.0, -3.0) for n in (0, 1, 2) for e in (0, 1, 2)])
    assert outline_of(square).tolist() == [[0, 0], [0, 2], [2, 2], [2, 0]]
