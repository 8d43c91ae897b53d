"""What cameras have seen of the ground."""

import dataclasses
import math

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight import seen_ground
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.seen import footprints_m, seen_pictures
from uas_coverage_env.scenario import Decoration, Scenario, Sensor
from uas_coverage_env.vehicle.layout import PHI, PSI, THETA, Z

CAMERA = Sensor(name="camera", field_of_view_deg=(90.0, 60.0))
FIXED = CAMERA.model_copy(update={"stabilised": False})


def at(height_m, phi=0.0, theta=0.0, psi=0.0):
    x = np.zeros((1, 14))
    x[0, Z], x[0, PHI], x[0, THETA], x[0, PSI] = -height_m, phi, theta, psi
    return x


def hovering(sensors, area_m=None, **asked) -> Scenario:
    """One UAS 20 m above the middle of a meadow of 200 m, and what it is to see."""
    scenario = meadow(
        [(100.0, 100.0, -20.0)], waypoints=[waypoint((100.0, 100.0, -20.0), 4.0) | asked]
    )
    uas = scenario.uas[0].model_copy(update={"sensors": tuple(sensors)})
    areas = () if area_m is None else (_area(area_m),)
    return scenario.model_copy(update={"uas": (uas,), "decorations": areas})


def _area(corners_m):
    return Decoration(name="area", kind="search_area", polygon_m=corners_m)


def flown(scenario, steps=2):
    return rollout(scenario, load_planner("hover", {"climb_m": "0"}), max_steps=steps)


def test_a_picture_is_as_wide_as_its_angle_and_turns_with_the_heading():
    (picture,) = footprints_m(CAMERA, at(40.0))
    ahead_m = 40.0 * math.tan(math.radians(30.0))
    assert np.abs(picture[:, 0]) == pytest.approx([ahead_m] * 4)
    assert np.abs(picture[:, 1]) == pytest.approx([40.0] * 4)
    (turned,) = footprints_m(CAMERA, at(40.0, psi=math.pi / 2))
    assert np.abs(turned[:, 1]) == pytest.approx([ahead_m] * 4)


def test_a_uas_that_looks_where_it_flies_sees_across_its_way():
    flight = flown(hovering([CAMERA]))
    uas = flight.scenario.uas[0].model_copy(update={"heading": "course"})
    scenario = flight.scenario.model_copy(update={"uas": (uas,)})
    x = flight.x.copy()
    x[..., PSI], x[..., THETA] = math.pi / 2, 0.2
    for sensor in (CAMERA, FIXED):
        (north, east) = (np.ptp(footprints_m(sensor, x[:1, 0])[0][:, k]) for k in range(2))
        assert north > east
    turned = dataclasses.replace(flight, scenario=scenario, x=x)
    # on axes that do not turn it leans to the south, which is to the right of who looks east
    np.testing.assert_allclose(turned.attitude_rad[0, 0], [0.2, 0.0, math.pi / 2], atol=1e-12)
    carrying = dataclasses.replace(
        turned,
        scenario=scenario.model_copy(
            update={"uas": (uas.model_copy(update={"sensors": (FIXED,)}),)}
        ),
    )
    (ground,) = seen_ground(carrying)
    places = ground.seen.nonzero()
    # the picture lies north of the UAS, to where its belly points
    assert ground.north_m[places[0]].mean() > 103.0
    assert ground.east_m[places[1]].mean() == pytest.approx(100.0, abs=0.5)


def test_tilt_moves_the_picture_of_a_camera_that_nothing_keeps_level():
    (level,) = footprints_m(FIXED, at(40.0))
    (nose_up,) = footprints_m(FIXED, at(40.0, theta=0.2))
    (right_down,) = footprints_m(FIXED, at(40.0, phi=0.2))
    assert level.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)
    assert nose_up[:2, 0].mean() == pytest.approx(40.0 * math.tan(math.radians(30.0) + 0.2))
    assert right_down[:, 1].max() == pytest.approx(40.0 * math.tan(math.pi / 4 - 0.2), rel=0.05)
    np.testing.assert_allclose(footprints_m(CAMERA, at(40.0, theta=0.2, phi=0.1)), [level])


def test_there_is_no_picture_beyond_the_tilt_allowed_nor_of_the_horizon():
    steady = CAMERA.model_copy(update={"max_tilt_deg": 10.0})
    assert np.isfinite(footprints_m(steady, at(40.0, theta=0.17))).all()
    assert np.isnan(footprints_m(steady, at(40.0, theta=0.13, phi=0.13))).all()
    assert np.isnan(footprints_m(FIXED, at(40.0, phi=0.9))).all()


def test_the_share_is_that_of_the_area_in_the_pictures():
    # a picture of 40 m by 23.09 m above a square of 40 m: of it, 23.09 / 40
    square = ((80.0, 80.0), (80.0, 120.0), (120.0, 120.0), (120.0, 80.0))
    flight = flown(hovering([CAMERA], square))
    (ground,) = seen_ground(flight)
    assert ground.share == pytest.approx(2.0 * 20.0 * math.tan(math.radians(30.0)) / 40.0, abs=0.03)
    assert summary(flight)["seen_ground"] == {"camera": ground.share}


def test_without_areas_it_is_the_ground_under_the_waypoints():
    narrow = Sensor(name="narrow", field_of_view_deg=(11.0, 11.0))
    seen = {g.sensor: g for g in seen_ground(flown(hovering([CAMERA, narrow])))}
    assert seen["camera"].share == 1.0
    assert seen["narrow"].share == pytest.approx(3.85**2 / (math.pi * 4.0**2), abs=0.05)
    cell_m = np.diff(seen["camera"].north_m[:2])[0]
    assert seen["camera"].asked.sum() * cell_m**2 == pytest.approx(math.pi * 4.0**2, rel=0.05)


@pytest.mark.parametrize(
    ("asked", "share"),
    [
        ({"sensor": "camera", "heights_m": (18.0, 25.0)}, 1.0),
        ({"sensor": "camera", "heights_m": (20.5, 25.0), "position_m": (100, 100, -21.0)}, 0.0),
    ],
)
def test_pictures_from_heights_that_nothing_asks_for_do_not_count(asked, share):
    assert seen_ground(flown(hovering([CAMERA], **asked)))[0].share == share


def test_without_cameras_nothing_is_said_of_it():
    flight = flown(hovering([Sensor(name="gas")]))
    assert seen_ground(flight) == ()
    assert "seen_ground" not in summary(flight)


def test_pictures_with_new_ground_hold_all_that_is_seen_and_say_when():
    flight = flown(hovering([CAMERA, FIXED.model_copy(update={"name": "fixed"})]), steps=4)
    x = flight.x.copy()
    x[2:, 0, 0] += 30.0  # it stands for two samples, jumps, and stands again
    moved = dataclasses.replace(flight, x=x)
    for pictures, ground in zip(seen_pictures(moved), seen_ground(moved), strict=True):
        assert pictures.sensor == ground.sensor
        assert pictures.sample.tolist() == [0, 2]
        assert pictures.corners_m[0, :, 0].mean() == pytest.approx(100.0, abs=0.5)
        assert pictures.corners_m[1, :, 0].mean() == pytest.approx(130.0, abs=0.5)
        for k, share in enumerate(pictures.share):
            (until,) = (g for g in seen_ground(moved, k) if g.sensor == pictures.sensor)
            assert share == pytest.approx(until.share)
