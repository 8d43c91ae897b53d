"""Planar missions in files: places without a height, and what of obstacles counts there."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.scenario import load_scenario, warnings
from uas_coverage_env.scenario.planar import Planar

MISSION = """schema = 1
name = "plane"
dt_s = 1.0
max_steps = 100
landing_distance_m = 2.0
landing_speed_mps = 0.5
uas_safe_distance_m = 3.0
[planar]
height_m = 10.0
[geofence]
margin_m = 0.5
vertices_m = [[0.0, 0.0, 0.0], [60.0, 0.0, 0.0], [60.0, 60.0, 0.0], [0.0, 60.0, 0.0],
  [0.0, 0.0, -20.0], [60.0, 0.0, -20.0], [60.0, 60.0, -20.0], [0.0, 60.0, -20.0]]
[[uas]]
name = "u"
vehicle = "s500_v2"
start_m = [10.0, 10.0]
soc_0 = 0.9
radius_m = 0.36
dod_max = 0.75
[[waypoints]]
position_m = [50.0, 50.0]
radius_m = 4.0
weight = 1.0
[[events]]
kind = "waypoint_added"
at_s = 5.0
position_m = [40.0, 10.0]
radius_m = 4.0
"""


def read(tmp_path, text):
    path = tmp_path / "mission.toml"
    path.write_text(text, encoding="utf-8")
    return load_scenario(path)


def test_places_of_a_planar_mission_may_be_given_by_two_numbers(tmp_path):
    scenario = read(tmp_path, MISSION)
    assert scenario.uas[0].start_m == (10.0, 10.0, -10.0)
    assert scenario.waypoints[0].position_m == (50.0, 50.0, -10.0)
    assert scenario.events[0].position_m == (40.0, 10.0, -10.0)
    assert warnings(scenario) == []
    scenario.to_file(tmp_path / "again.toml")
    assert load_scenario(tmp_path / "again.toml") == scenario


def test_without_the_table_two_numbers_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"uas\[0\].start_m"):
        read(tmp_path, MISSION.replace("[planar]\nheight_m = 10.0\n", ""))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("start_m = [10.0, 10.0]", "start_m = [10.0, 10.0, -9.0]", "uas[0].start_m: z = -9 is not"),
        ("[50.0, 50.0]", "[50.0, 50.0, -9.0]", "waypoints[0].position_m: z = -9 is not at planar"),
        ("[40.0, 10.0]", "[40.0, 10.0, -9.0]", "events[0] (waypoint_added): then waypoints[1]"),
        ("height_m = 10.0", "height_m = 0.0", "planar.height_m: should be greater than 0"),
        ("height_m = 10.0", "height_m = 25.0", "outside the geofence"),
        ("height_m = 10.0", 'height_m = "low"', "planar.height_m: should be a number"),
        ("height_m = 10.0", "heigth_m = 10.0", "planar.heigth_m: unknown key"),
        ("dt_s = 1.0", "dt_s = 1.0\nmin_height_m = 12.0", "planar.height_m: 10 is below"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_planar_mission_is_one_line_that_names_it(
    tmp_path, old, new, expected
):
    with pytest.raises(InputError) as caught:
        read(tmp_path, MISSION.replace(old, new, 1))
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    assert expected in line


LEVEL, DOWN = st.floats(-20.0, 20.0, width=32), st.floats(-30.0, 0.0, width=32)
BODIES = st.lists(st.tuples(LEVEL, LEVEL, DOWN), min_size=6, max_size=10)


@settings(max_examples=60, deadline=None)
@given(points=BODIES, kept_m=st.floats(0.1, 5.0), seed=st.integers(0, 2**31))
def test_a_place_at_the_height_keeps_the_distance_where_it_keeps_it_from_the_hull(
    points, kept_m, seed
):
    try:
        hull = ConvexPolytope.from_points(points)
    except ValueError:
        return
    kept = Planar(height_m=10.0).kept(hull, kept_m)
    places = np.random.default_rng(seed).uniform(-30.0, 30.0, size=(300, 3))
    places[:, 2] = -10.0
    from_hull_m, from_kept_m = hull.signed_distance(places), kept.signed_distance(places)
    sure = np.abs(from_hull_m - kept_m) > 1e-4
    assert ((from_hull_m >= kept_m) == (from_kept_m >= kept_m))[sure].all()


def test_what_is_passed_under_or_over_does_not_count_and_a_wall_reaches_up_to_everything():
    def box(low_m, high_m):
        corners = [(n, e, -z) for z in (low_m, high_m) for n in (0.0, 4.0) for e in (0.0, 6.0)]
        return Planar(height_m=1.2).kept(ConvexPolytope.from_points(corners), 0.2)

    beside = np.array([[2.0, 2.0, -1.2], [2.0, 2.0, -90.0]])
    assert box(0.0, 2.5).signed_distance(beside).tolist() == [-2.0, -2.0]
    assert (box(2.0, 2.5).signed_distance(beside) > 1e5).all()
    assert (box(0.0, 0.9).signed_distance(beside) > 1e5).all()
    # a table nearer below than what is kept
    assert (box(0.0, 1.1).signed_distance(beside) < 0.0).all()
