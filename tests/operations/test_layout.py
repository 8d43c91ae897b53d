"""Waypoints are laid so that what is called covered has been seen."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

pytest.importorskip("shapely")
import shapely
from shapely.geometry import Point, Polygon, box

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.area_import.cameras import camera_names, load_camera
from uas_coverage_env.operations.area_import.waypoint_layout import lay_waypoints
from uas_coverage_env.operations.convex import convex_pieces, few_corners

EXAMPLES = settings(max_examples=60, deadline=None, derandomize=True)
EVERYWHERE = box(-5_000, -5_000, 5_000, 5_000)
WIDE = box(-1e5, -1e5, 1e5, 1e5)


def star(radii, centre=(0.0, 0.0)):
    """A polygon with a corner in each of so many directions."""
    turn = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    ring = np.column_stack([np.cos(turn), np.sin(turn)]) * np.array(radii)[:, None]
    return Polygon(ring + np.array(centre))


RADII = st.lists(st.floats(5.0, 300.0), min_size=3, max_size=12)
PITCHES = st.tuples(st.floats(20.0, 60.0), st.floats(20.0, 60.0))  # finer takes many times longer


def seen_from(places, pitch_m):
    east, north = 0.5 * pitch_m[0], 0.5 * pitch_m[1]
    return shapely.union_all([box(x - east, y - north, x + east, y + north) for x, y in places])


@EXAMPLES
@given(RADII, st.floats(0.1, 0.9), PITCHES)
def test_the_whole_area_is_seen_from_its_waypoints(radii, hole, pitch_m):
    outline = star(radii)
    area = outline.difference(shapely.affinity.scale(outline, hole, 0.5 * hole))
    layout = lay_waypoints(area, pitch_m, EVERYWHERE, "area")
    assert layout.left_out_m2 == 0.0
    assert area.difference(seen_from(layout.places_m, pitch_m).buffer(1e-6)).area < 0.1


@EXAMPLES
@given(RADII, RADII, PITCHES)
def test_what_is_not_seen_around_a_forbidden_zone_is_counted(radii, forbidden, pitch_m):
    area, allowed = star(radii), WIDE.difference(star(forbidden, (40.0, 20.0)))
    layout = lay_waypoints(area, pitch_m, allowed, "area")
    assert all(allowed.buffer(1e-6).contains(Point(place)) for place in layout.places_m)
    seen = seen_from(layout.places_m, pitch_m).buffer(1e-6) if layout.places_m else Polygon()
    assert area.difference(seen).area <= layout.left_out_m2 + 0.1


def test_a_small_forbidden_zone_costs_no_ground():
    area, pitch_m = box(0, 0, 200, 100), (40.0, 25.0)
    layout = lay_waypoints(area, pitch_m, WIDE.difference(Point(60.0, 62.0).buffer(3.0)), "area")
    assert layout.left_out_m2 == 0.0


def test_an_area_of_too_many_waypoints_is_refused_with_their_number():
    with pytest.raises(InputError, match=r"field needs about 10000 waypoints.*--height"):
        lay_waypoints(box(0, 0, 1_000, 1_000), (10.0, 10.0), EVERYWHERE, "field")


@pytest.mark.parametrize("name", camera_names())
@pytest.mark.parametrize("overlap", [0.0, 0.3])
def test_a_cell_is_in_the_picture_from_everywhere_in_the_sphere(name, overlap):
    camera, height_m, radius_m = load_camera(name), 80.0, 6.0
    cell_m = np.array(camera.pitch_m(height_m, radius_m, overlap))
    directions = np.random.default_rng(0).normal(size=(500, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    for east, north, up in radius_m * directions:
        shown_m = np.array(camera.footprint_m(height_m + up))
        assert (np.abs([east, north]) + 0.5 * cell_m <= 0.5 * shown_m + 1e-9).all()


def test_a_height_that_shows_nothing_is_refused_with_one_that_does():
    camera = load_camera("sony-a6000")
    with pytest.raises(InputError, match=r"fly higher than ([\d.]+) m") as refused:
        camera.pitch_m(12.0, 6.0, 0.1)
    enough_m = float(str(refused.value).partition("than ")[2].partition(" m")[0])
    assert min(camera.pitch_m(enough_m + 0.2, 6.0, 0.1)) > 0.0


def test_an_own_camera_comes_from_a_file(tmp_path):
    (tmp_path / "own.toml").write_text(
        "[own]\nsensor_mm = [10, 10]\nfocal_mm = 10\npicture_px = [1000, 1000]\n"
    )
    assert load_camera(str(tmp_path / "own.toml")).footprint_m(50.0) == (50.0, 50.0)
    with pytest.raises(InputError, match=r"unknown camera 'kodak'; take .*mavic3e"):
        load_camera("kodak")


@EXAMPLES
@given(RADII, st.floats(1.0, 1.5))
def test_convex_pieces_hold_their_polygon_and_waste_no_more_than_said(radii, slack):
    polygon = star(radii)
    pieces = convex_pieces(polygon, slack)
    assert polygon.difference(shapely.union_all(pieces).buffer(1e-6)).area < 1e-3
    for piece in pieces:
        assert piece.convex_hull.area == pytest.approx(piece.area)
        assert len(piece.exterior.coords) - 1 <= 8
    if slack == 1.0:
        assert shapely.union_all(pieces).area == pytest.approx(polygon.area, rel=1e-6)


@EXAMPLES
@given(st.lists(st.tuples(st.floats(-90, 90), st.floats(-90, 90)), min_size=9, max_size=60))
def test_a_hull_of_few_corners_holds_the_one_of_many(points):
    hull = shapely.MultiPoint(points).convex_hull
    if isinstance(hull, Polygon) and hull.area > 1.0:
        few = few_corners(hull)
        assert len(few.exterior.coords) - 1 <= 8
        assert hull.difference(few.buffer(1e-6)).area < 1e-6
