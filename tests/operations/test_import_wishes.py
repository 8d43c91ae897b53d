"""What a drawing asks of one of its areas: height, sharpness, speed, overlap."""

import numpy as np
import pytest

pytest.importorskip("shapely")
from drawings import HOME, SQUARE, collection, feature, imported, refused

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight import seen_ground
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.operations import load_camera

pytestmark = pytest.mark.usefixtures("elsewhere")

WEST = [[10.0, 50.0], [10.0014, 50.0], [10.0014, 50.002], [10.0, 50.002], [10.0, 50.0]]
EAST = [[10.0016, 50.0], [10.003, 50.0], [10.003, 50.002], [10.0016, 50.002], [10.0016, 50.0]]


def two(**wishes):
    """A plain area, and one with wishes."""
    return imported(collection(feature(WEST), feature(EAST, **wishes)), *HOME)


def heights_m(scenario):
    return {-waypoint.position_m[2] for waypoint in scenario.waypoints}


def test_each_area_lies_at_its_own_height_and_is_seen_whole(capsys):
    scenario = two(height_m=45)
    assert heights_m(scenario) == {60.0, 45.0}
    said = capsys.readouterr().out
    assert "sony-a6000, 60 m: " in said
    assert "sony-a6000, 45 m: " in said
    flight = rollout(scenario, load_planner("lawnmower"))
    assert accomplished(flight)
    (ground,) = seen_ground(flight)
    assert ground.share > 0.999


def test_sharper_pictures_are_taken_from_lower_and_ask_for_the_camera():
    scenario = two(pixel_cm="0.9")
    camera = load_camera("sony-a6000")
    low = [w for w in scenario.waypoints if w.sensor == "sony-a6000"]
    assert 0 < len(low) < len(scenario.waypoints)
    highest_m = max(-w.position_m[2] + w.radius_m for w in low)
    assert 100.0 * camera.ground_sample_m(highest_m) <= 0.9
    assert {-w.position_m[2] for w in scenario.waypoints if w.sensor is None} == {60.0}


def test_an_area_may_be_flown_slower_and_with_more_overlap():
    scenario = two(speed_mps=4.5, overlap=0.5)
    slow = [w for w in scenario.waypoints if w.max_speed_mps == 4.5]
    assert {w.sensor for w in slow} == {"sony-a6000"}
    assert len(slow) > 2 * (len(scenario.waypoints) - len(slow))
    assert all(w.sensor is None for w in scenario.waypoints if w.max_speed_mps is None)


def test_an_area_above_the_others_raises_the_ceiling():
    scenario = two(height_m=120)
    assert -np.array(scenario.geofence.vertices_m)[:, 2].min() == 150.0


@pytest.mark.parametrize(
    ("wishes", "said"),
    [
        ({"height_m": "low"}, "height_m 'low' should be a number between 1 and 1000"),
        ({"height_m": 3}, "fly higher than"),
        ({"height_m": 50, "pixel_cm": 2}, "leave out height_m"),
        ({"pixel_cm": 0.1}, "needs a height below"),
        ({"speed_mps": 0}, "speed_mps '0'"),
        ({"overlap": 1}, "overlap '1'"),
        ({"overlap": True}, "overlap 'True'"),
        ({"role": "fence", "speed_mps": 3}, "is no area to be seen, but has speed_mps"),
    ],
)
def test_what_cannot_be_is_refused_in_one_line_that_names_the_area(wishes, said, capsys):
    area = collection(feature(SQUARE), feature(EAST, name="yard", **wishes))
    line = refused(capsys, area, *HOME)
    assert said in line
    assert "'yard'" in line
