import dataclasses
import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import box, meadow, waypoint

from uas_coverage_env.draw import Picture, picture
from uas_coverage_env.draw.colours import UAS, of_charge
from uas_coverage_env.draw.colours import of_words as of_words_
from uas_coverage_env.draw.frame import Frame
from uas_coverage_env.draw.signs import SIGNS, decoration_kinds, legend, obstacle_kinds
from uas_coverage_env.entities.state import LANDED, LOST
from uas_coverage_env.scenario import generate_scenario, load_scenario, scenario_names
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, PSI


@pytest.fixture(scope="module")
def village():
    return load_scenario("village")


@pytest.fixture
def swarm(village):
    return World(village).swarm_state()


def differs(one, other) -> Any:
    """The box (top, bottom, left, right) in which two pictures differ; None where they do not."""
    rows, columns = np.nonzero((one != other).any(axis=2))
    return (rows.min(), rows.max(), columns.min(), columns.max()) if len(rows) else None


def pixel(scenario, position_m, size_px=512):
    """Row and column of a place in the picture."""
    x, y = Frame.around(scenario.fence.vertices_m, size_px).pixels(np.array(position_m)) / 2
    return round(float(y)), round(float(x))


def test_a_uas_is_drawn_as_it_looks(village, swarm):
    east = dataclasses.replace(swarm, turned_rad=np.array([0.5 * np.pi, 0.0]))
    top, bottom, left, right = differs(picture(village, swarm), picture(village, east))
    row, column = pixel(village, swarm.x[0, :3])
    assert top <= row <= bottom
    assert left <= column <= right
    assert max(bottom - top, right - left) < 30


def test_the_names_of_uas_side_by_side_do_not_hide_each_other(village, swarm):
    """Also where the mark of one lies over the place of the other's name."""

    def of_words(image, i):
        colour = np.array(of_words_(UAS[i]))
        return int((np.abs(image.astype(int) - colour).max(axis=2) < 12).sum())

    for moved_m in ((0.0, 0.0), (-6.0, 6.0), (6.0, -6.0)):
        x = swarm.x.copy()
        x[0, :2] = 250.0
        x[1, :2] = x[0, :2] + moved_m
        image = picture(village, dataclasses.replace(swarm, x=x), size_px=900)
        assert min(of_words(image, i) for i in range(2)) > 8, moved_m


def test_a_picture_is_an_array_of_bytes(village, swarm):
    image = picture(village, swarm)
    assert image.shape == (512, 512, 3)
    assert image.dtype == np.uint8
    assert image.flags.writeable
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 50


@pytest.mark.parametrize("size_px", [128, 300, 777])
def test_a_picture_has_the_size_asked_for(village, swarm, size_px):
    assert picture(village, swarm, size_px=size_px).shape == (size_px, size_px, 3)


@pytest.mark.parametrize("size_px", [0, 127, 5000, 512.0, "512", True, None])
def test_a_size_that_makes_no_sense_is_refused(village, size_px):
    with pytest.raises(ValueError, match="128 to 4096"):
        Picture(village, size_px=size_px)


def test_the_same_state_makes_the_same_picture_and_an_array_of_its_own(village, swarm):
    painter = Picture(village)
    one = painter.draw(swarm)
    one_copy = one.copy()
    other = painter.draw(swarm)
    np.testing.assert_array_equal(one, other)
    other[:] = 0
    np.testing.assert_array_equal(one, one_copy)
    np.testing.assert_array_equal(one, picture(village, swarm))


@settings(max_examples=10, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), size_px=st.sampled_from([200, 333, 512]))
def test_a_kept_picture_shows_what_a_new_one_shows(village, seed, size_px):
    rng = np.random.default_rng(seed)
    # crowded: marks overlap each other, and the edge of the map
    places_m = rng.uniform([2, 2, -48], [90, 90, -47], (49, 3)).tolist()
    crowded = village.model_copy(
        update={
            "waypoints": tuple(
                waypoint.model_copy(update={"position_m": tuple(place_m)})
                for waypoint, place_m in zip(village.waypoints, places_m, strict=True)
            )
        }
    )
    swarm, other = World(village).swarm_state(), World(village).swarm_state()
    kept = Picture(crowded, size_px=size_px)
    kept.draw(swarm)
    clone = kept.clone()
    for _ in range(3):
        swarm.uncovered[:] = rng.random(49) < rng.random()
        swarm.x[:, :3] += rng.normal(0, 30, (2, 3))
        expected = picture(crowded, swarm, size_px=size_px)
        np.testing.assert_array_equal(kept.draw(swarm), expected)
        np.testing.assert_array_equal(
            clone.draw(other), picture(crowded, other, size_px=size_px), "another mission's"
        )


def test_north_is_up_and_east_to_the_right(village, swarm):
    before = picture(village, swarm)
    swarm.x[0, :3] = [450.0, 450.0, -20.0]
    top, _, _, right = differs(before, picture(village, swarm))
    assert top < 100
    assert right > 380


def test_a_covered_waypoint_is_filled_where_it_lies(village, swarm):
    before = picture(village, swarm)
    swarm.uncovered[24] = False
    after = picture(village, swarm)
    row, column = pixel(village, village.waypoints[24].position_m)
    assert not (before[row - 5, column] == after[row - 5, column]).all()
    assert after[row - 5, column, 1] > after[row - 5, column, 0]


def test_the_ring_of_an_open_waypoint_has_its_radius(village, swarm):
    image = picture(village, swarm).astype(int)
    row, column = pixel(village, village.waypoints[24].position_m)
    radius_px = 15.0 * Frame.around(village.fence.vertices_m, 512).scale / 2
    dark = [image[row, column + offset].sum() < 450 for offset in range(4, 22)]
    assert abs(4 + dark.index(True) - radius_px) <= 1.5


def test_heavier_waypoints_look_different(village, swarm):
    weights = [waypoint.weight for waypoint in village.waypoints]
    assert set(weights) == {1.0, 2.0}
    same = village.model_copy(
        update={"waypoints": tuple(w.model_copy(update={"weight": 1.0}) for w in village.waypoints)}
    )
    assert differs(picture(village, swarm), picture(same, swarm)) is not None


@pytest.mark.parametrize("change", ["charge", "heading", "altitude", "landed", "lost", "moving"])
def test_what_changes_in_the_state_changes_in_the_picture(village, swarm, change):
    before = picture(village, swarm)
    if change == "charge":
        swarm.x[0, DOD] = 0.5
    elif change == "heading":
        swarm.x[0, PSI] = 0.3
    elif change == "altitude":
        swarm.x[0, 2] = -40.0
    elif change == "moving":
        swarm.moving_position_m[0] += [-60.0, 0.0, 0.0]
    else:
        swarm.status[0] = LANDED if change == "landed" else LOST
    assert differs(before, picture(village, swarm)) is not None


def test_paths_and_plans_are_drawn(village, swarm):
    plain = picture(village, swarm)
    paths_m = np.linspace([[250.0, 10.0, -1.0]] * 2, [[400.0, 250.0, -9.0], [50.0, 250.0, -9.0]], 9)
    assert differs(plain, picture(village, swarm, paths_m=paths_m)) is not None
    planned_m = {"uas_2": np.array([[200.0, 100.0, -10.0], [200.0, 120.0, -10.0]])}
    top, bottom, left, right = differs(plain, picture(village, swarm, planned_m=planned_m))
    row, column = pixel(village, (200.0, 110.0, -10.0))
    assert abs((top + bottom) / 2 - row) <= 2
    assert abs((left + right) / 2 - column) <= 2


def test_one_sample_of_a_path_is_no_line_yet(village, swarm):
    paths_m = swarm.x[None, :, :3]
    assert differs(picture(village, swarm), picture(village, swarm, paths_m=paths_m)) is None


def test_what_has_left_the_map_is_not_drawn_over_the_writing(village, swarm):
    swarm.moving_position_m[0] = [250.0, 5000.0, -90.0]
    gone = picture(village, swarm)
    swarm.moving_position_m[0] = [250.0, 520.0, -90.0]
    top, bottom, _, right = differs(gone, picture(village, swarm))
    assert right < 466
    assert top > 30
    assert bottom < 484


def test_red_yellow_and_green_stand_for_the_charge():
    green, yellow, red = of_charge(0.9), of_charge(0.5), of_charge(0.2)
    assert green[1] > green[0]
    assert min(yellow[0], yellow[1]) > yellow[2]
    assert red[0] > red[1]


@pytest.mark.parametrize("name", scenario_names())
def test_every_shipped_scenario_can_be_drawn(name):
    scenario = load_scenario(name)
    image = picture(scenario, World(scenario).swarm_state())
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 30


def test_a_large_swarm_is_summed_up():
    scenario = generate_scenario(2, n_uas=20, n_waypoints=40, n_obstacles=8)
    swarm = World(scenario).swarm_state()
    before = picture(scenario, swarm)
    swarm.status[3] = LOST
    top, bottom, *_ = differs(before, picture(scenario, swarm))
    assert bottom > 484
    assert top < 484


def test_a_legend_is_as_wide_as_its_picture_and_taller_the_more_there_is(village):
    few, all_of_them = (legend(village, signs, 900) for signs in (("open",), SIGNS))
    assert few.shape[1:] == all_of_them.shape[1:] == (900, 3)
    assert all_of_them.shape[0] > few.shape[0]
    assert legend(village, SIGNS, 300).shape[0] > 0.33 * all_of_them.shape[0]  # in fewer columns


def test_a_legend_has_the_tint_of_everything_that_stands_or_lies_on_the_map(village):
    pixels = {tuple(pixel) for pixel in legend(village, (), 900).reshape(-1, 3).tolist()}
    kinds = {**obstacle_kinds(village), **decoration_kinds(village)}
    assert {"forest", "high rise", "water"} <= set(kinds)
    assert set(kinds.values()) <= pixels


def test_a_legend_speaks_of_heights_only_where_one_is_written_on_an_obstacle():
    narrow, wide = (
        meadow(
            waypoints=(waypoint((20.0, 20.0, -20.0)),),
            obstacles=(box("house", (20.0, 110.0, -12.0), (20.0 + side, 170.0, 0.0)),),
        )
        for side in (0.5, 60.0)
    )
    without, with_heights = (legend(scenario, (), 900) for scenario in (narrow, wide))
    assert without.shape[0] < with_heights.shape[0]
    assert differs(without[:20], with_heights[:20]) is None


def test_where_a_moving_obstacle_has_been_is_drawn(village, swarm):
    before, drawn = picture(village, swarm), Picture(village)
    been_m = np.array([[[100.0, 250.0, -3.0]], [[100.0, 400.0, -3.0]]])
    top, bottom, left, right = differs(before, drawn.draw(swarm, moving_paths_m=been_m))
    assert bottom - top < 5
    assert right - left > 100


def test_importing_the_room_does_not_import_pillow():
    code = "import sys, uas_coverage_env.draw; sys.exit('PIL' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_scale_and_north_stand_below_the_map_where_no_mark_covers_them(village, swarm):
    before = picture(village, swarm)
    south, west = village.fence.vertices_m[:, :2].min(axis=0)
    row, column = pixel(village, (south, west, 0.0))
    below = (slice(row + 11, row + 12), slice(column + 1, column + 20))
    assert (before[below] < 60).all()  # the bar
    swarm.x[:, :2] = [south + 5.0, west + 5.0]
    assert (picture(village, swarm)[below] == before[below]).all()
