"""Waypoints from the pictures of cameras: what is called covered has been seen."""

import pytest

pytest.importorskip("shapely")
pytest.importorskip("shapefile")
import shapely
from drawings import HOME, SQUARE, collection, feature, imported, refused

from uas_coverage_env.cli import main
from uas_coverage_env.flight import load_planner, rollout, seen_ground
from uas_coverage_env.operations import load_camera
from uas_coverage_env.scenario import load_scenario

pytestmark = pytest.mark.usefixtures("elsewhere")


def test_what_is_called_covered_has_been_seen_by_the_camera_at_the_resolution_asked_for():
    hole = [[10.001, 50.0005], [10.0015, 50.0005], [10.0015, 50.001], [10.001, 50.0005]]
    area = collection(feature(SQUARE, hole))
    options = ("--resolution", "2", "--max-speed", "6", "--out", "sharp.toml")
    assert main(["import", str(area), *HOME, *options]) == 0
    scenario = load_scenario("sharp.toml")
    (sensor,) = scenario.uas[0].sensors
    assert sensor.name == "sony-a6000"
    assert sensor.field_of_view_deg == pytest.approx((72.58, 51.98), abs=0.01)
    for asking in scenario.waypoints:
        assert (asking.sensor, asking.max_speed_mps) == ("sony-a6000", 6.0)
        highest_m = asking.radius_m - asking.position_m[2]
        assert 100.0 * load_camera(sensor.name).ground_sample_m(highest_m) <= 2.0
    flight = rollout(scenario, load_planner("lawnmower"))
    assert flight.covered[-1] == len(scenario.waypoints)
    (ground,) = seen_ground(flight)
    assert ground.share > 0.999


def test_areas_for_different_cameras_are_flown_by_the_uas_that_carry_them():
    part = [[10.001, 50.0005], [10.0015, 50.0005], [10.0015, 50.001], [10.001, 50.001]]
    hot = feature([*part, part[0]], camera="h20t-thermal", weight=3)
    area = collection(feature(SQUARE), hot)
    fleet = ("--fleet", "s500_v2:1,hexacopter+h20t-thermal:1")
    scenario = imported(area, *HOME, *fleet)
    asked = [waypoint.sensor for waypoint in scenario.waypoints]
    assert set(asked) == {"sony-a6000", "h20t-thermal"}
    assert [uas.sensors[0].name for uas in scenario.uas] == ["sony-a6000", "h20t-thermal"]
    flight = rollout(scenario, load_planner("nearest-waypoint"))
    assert flight.covered[-1] == len(asked)
    assert min(ground.share for ground in seen_ground(flight)) > 0.999


def test_without_a_resolution_or_speed_any_planner_flies_what_is_imported():
    scenario = imported("karhula")
    assert all(waypoint.sensor is None for waypoint in scenario.waypoints)
    assert all(uas.sensors[0].name == "sony-a6000" for uas in scenario.uas)


def test_an_area_with_a_hole_is_drawn_as_areas_without():
    hole = [[10.001, 50.0005], [10.0015, 50.0005], [10.0015, 50.001], [10.001, 50.001]]
    scenario = imported(collection(feature(SQUARE, [*hole, hole[0]])), *HOME)
    whole = imported(collection(feature(SQUARE)), *HOME)

    def drawn_m2(of):
        rings = [[corner[::-1] for corner in d.polygon_m] for d in of.decorations]
        return sum(shapely.Polygon(ring).area for ring in rings)

    share = (0.0005 * 0.0005) / (0.003 * 0.002)
    assert drawn_m2(scenario) == pytest.approx((1.0 - share) * drawn_m2(whole), rel=1e-3)


def test_a_camera_that_no_uas_carries_is_refused_with_what_to_do(capsys):
    path = collection(feature(SQUARE, camera="mavic3e"))
    assert "seen by 'mavic3e', which no UAS carries (they carry sony-a6000)" in refused(
        capsys, path, *HOME
    )
    zone = collection(feature(SQUARE, role="no_fly", camera="mavic3e"))
    assert "no area to be seen" in refused(capsys, zone, *HOME)
