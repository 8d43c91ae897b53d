"""Local metres and degrees agree with geodesics that are not ours, everywhere on the Earth."""

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

pytest.importorskip("pyproj")
from geographiclib.geodesic import Geodesic

from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.scenario import Place

MOST_M = 0.01
EXAMPLES = settings(max_examples=200, deadline=None, derandomize=True)
LATITUDES = st.floats(-90.0, 90.0)
LONGITUDES = st.floats(-180.0, 180.0)


def frame_at(latitude_deg, longitude_deg):
    return LocalFrame(Place(latitude_deg=latitude_deg, longitude_deg=longitude_deg))


@EXAMPLES
@given(LATITUDES, LONGITUDES, st.floats(0.0, 360.0), st.floats(0.0, 5_000.0))
@example(90.0, 12.0, 200.0, 4_000.0)
@example(-90.0, -70.0, 10.0, 4_000.0)
@example(12.0, 180.0, 90.0, 5_000.0)
@example(-33.0, -180.0, 270.0, 5_000.0)
def test_distance_and_bearing_from_the_origin_are_those_of_geodesics(lat, lon, bearing, away_m):
    place = Geodesic.WGS84.Direct(lat, lon, bearing, away_m)
    wanted = away_m * np.array([math.cos(math.radians(bearing)), math.sin(math.radians(bearing))])
    ned = frame_at(lat, lon).to_ned(place["lat2"], place["lon2"], 30.0)
    assert np.linalg.norm(ned[:2] - wanted) < 1e-3  # the map takes less than 0.1 mm for nothing
    assert ned[2] == -30.0


@EXAMPLES
@given(LATITUDES, LONGITUDES, st.lists(st.floats(-3_500.0, 3_500.0), min_size=4, max_size=4))
@example(90.0, 0.0, [3_500.0, -3_500.0, -3_500.0, 3_500.0])
@example(-89.99, 100.0, [3_500.0, -3_500.0, -3_500.0, 3_500.0])
@example(60.0, 180.0, [0.0, 3_500.0, 0.0, -3_500.0])
@example(45.0, 10.0, [3_500.0, 3_500.0, 3_500.0, -3_500.0])
def test_distances_5_km_from_the_origin_are_right_to_1_mm(lat, lon, numbers):
    points = np.array([[*numbers[:2], -10.0], [*numbers[2:], -10.0]])
    (lat1, lon1, _), (lat2, lon2, _) = frame_at(lat, lon).to_geodetic(points)
    geodesic_m = Geodesic.WGS84.Inverse(lat1, lon1, lat2, lon2)["s12"]
    error_m = abs(np.linalg.norm(points[0] - points[1]) - geodesic_m)
    assert error_m < 1e-3 < MOST_M


@EXAMPLES
@given(LATITUDES, LONGITUDES, st.lists(st.floats(-20_000.0, 20_000.0), min_size=2, max_size=2))
@example(90.0, 0.0, [100.0, 0.0])
@example(0.0, 180.0, [0.0, 100.0])
@example(0.0, 0.0, [0.0, 6.103515625e-05])  # PROJ takes what is within 1e-10 rad for the origin
def test_degrees_read_back_are_the_same_metres(lat, lon, north_east):
    frame = frame_at(lat, lon)
    latitude, longitude, altitude = frame.to_geodetic([*north_east, -12.5])
    assert -90.0 <= latitude <= 90.0
    assert -180.0 <= longitude <= 180.0
    assert frame.to_ned(latitude, longitude, altitude) == pytest.approx(
        np.array([*north_east, -12.5]), abs=7e-4
    )


@pytest.mark.parametrize(
    ("latitudes", "longitudes", "middle"),
    [
        ([10.0, 10.0, 10.1, 10.1], [20.0, 20.1, 20.1, 20.0], (10.05, 20.05)),
        ([-17.0, -17.0, -16.9], [179.95, -179.95, 180.0], (-16.95, 180.0)),
        ([89.9, 89.9, 89.9, 89.9], [0.0, 90.0, 180.0, -90.0], (90.0, None)),
        ([-89.9, -89.9, -89.9], [0.0, 120.0, -120.0], (-90.0, None)),
    ],
)
def test_the_origin_is_in_the_middle_across_the_date_line_and_at_the_poles(
    latitudes, longitudes, middle
):
    place = LocalFrame.around(latitudes, longitudes).place
    assert place.latitude_deg == pytest.approx(middle[0], abs=0.03)
    if middle[1] is not None:
        assert abs(place.longitude_deg) == pytest.approx(middle[1], abs=0.001)


def test_many_corners_on_one_side_do_not_move_the_middle():
    latitudes = [50.0, 50.0, *np.linspace(50.0, 50.02, 100)]
    longitudes = [8.0, 8.04, *np.full(100, 8.0)]
    place = LocalFrame.around(latitudes, longitudes).place
    assert (place.latitude_deg, place.longitude_deg) == pytest.approx((50.01, 8.02), abs=1e-4)
