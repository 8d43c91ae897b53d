"""Labels: where nothing hides them, and no longer than there is room for."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env.draw import colours, picture
from uas_coverage_env.draw.labels import free_place, overlap, short_name
from uas_coverage_env.draw.text import fitted, width_of
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.simulation import World

SQUARE = np.array([[0.0, 0.0], [100.0, 0.0], [100.0, 80.0], [0.0, 80.0]])
NO_MARKS = np.empty((0, 3))


def test_a_label_stands_in_the_middle_where_that_is_free():
    assert free_place(SQUARE, np.array([20.0, 10.0]), NO_MARKS) == (50.0, 40.0)
    assert free_place(SQUARE[::-1], np.array([20.0, 10.0]), NO_MARKS) == (50.0, 40.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    marks=st.lists(
        st.tuples(st.floats(-20, 120), st.floats(-20, 100), st.floats(0, 45)), max_size=5
    )
)
def test_a_label_lies_in_its_area_and_under_no_mark(marks):
    width, height = box = np.array([24.0, 10.0])
    place = free_place(SQUARE, box, np.array(marks).reshape(-1, 3))
    if place is None:
        assert marks, "without a mark there is room"
        return
    x, y = place
    assert width / 2 <= x <= 100 - width / 2
    assert height / 2 <= y <= 80 - height / 2
    for mark_x, mark_y, radius in marks:
        nearest = np.clip([mark_x, mark_y], [x, y] - box / 2, [x, y] + box / 2)
        assert np.hypot(*(nearest - [mark_x, mark_y])) > radius


def test_where_there_is_no_room_there_is_no_label():
    assert free_place(SQUARE, np.array([120.0, 10.0]), NO_MARKS) is None
    assert free_place(SQUARE, np.array([20.0, 10.0]), np.array([[50.0, 40.0, 90.0]])) is None


def test_a_long_name_is_cut_and_a_short_one_is_not():
    assert fitted("village", 20, 200.0) == "village"
    cut = fitted("the_village_at_the_river_with_a_helicopter", 20, 200.0)
    assert cut.startswith("the_vill")
    assert cut.endswith("...")
    assert width_of(cut, 20) <= 200.0
    assert fitted("village", 20, 1.0) == ""


def test_a_long_name_of_a_scenario_does_not_run_into_what_is_covered():
    village = load_scenario("village")
    names = ("a_village_at_a_river_with_four_forests", "a_village_at_a_river_with_four_forests_too")
    one, other = (
        picture(named, World(named).swarm_state())
        for named in (village.model_copy(update={"name": name}) for name in names)
    )
    np.testing.assert_array_equal(one, other, "both are cut before they differ")


def test_writing_too_small_to_read_is_left_out():
    village = load_scenario("village")
    swarm = World(village).swarm_state()
    small, large = (picture(village, swarm, size_px=size) for size in (256, 512))
    # the figures of the altitude scale, right of it
    assert len(np.unique(small[40:220, 241:].reshape(-1, 3), axis=0)) == 1
    assert len(np.unique(large[80:440, 482:].reshape(-1, 3), axis=0)) > 5


def test_boxes_overlap_where_they_share_more_than_an_edge():
    box = (0.0, 0.0, 10.0, 5.0)
    assert overlap(box, (9.0, 4.0, 3.0, 3.0))
    assert overlap(box, (2.0, 1.0, 1.0, 1.0))
    assert not overlap(box, (10.0, 0.0, 3.0, 3.0))
    assert not overlap(box, (0.0, 5.0, 3.0, 3.0))


def test_a_short_name_is_the_end_of_a_name():
    assert short_name("uas_12") == "12"
    assert short_name("scout") == "sco"


def luminance(colour):
    parts = np.array(colour) / 255
    linear = np.where(parts <= 0.04045, parts / 12.92, ((parts + 0.055) / 1.055) ** 2.4)
    return float(linear @ (0.2126, 0.7152, 0.0722))


@pytest.mark.parametrize("colour", colours.UAS)
def test_words_about_a_uas_are_read_on_white(colour):
    assert 1.05 / (luminance(colours.of_words(colour)) + 0.05) >= 4.5
