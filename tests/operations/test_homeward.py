"""Ways home on paths that are made for it: how far braking goes, how near a return may pass."""

import numpy as np
import pytest

pytest.importorskip("pyproj")

from small_worlds import box, meadow, waypoint

from uas_coverage_env import rollout
from uas_coverage_env.operations.mission_export.lay_tracks import make_tracks
from uas_coverage_env.operations.mission_export.return_paths import RETRACE, RETURN, return_path
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, Followed

START_M = (20.0, 100.0, -1.0)
BY = Autopilot(speed_mps=12.0)
TALL = 60.0


@pytest.fixture(scope="module")
def track():
    """Any: only where it starts and lands counts here."""
    there = waypoint((100.0, 100.0, -20.0))
    flight = rollout(meadow((START_M,), waypoints=[there]), "nearest-waypoint")
    return make_tracks(flight, 0, Tolerances())[0]


def path_of(corners_m, speed_mps):
    """Flown at one speed, the last corner, too, as no vehicle could: it is stopped there."""
    corners = np.array(corners_m)
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    ends_s = np.concatenate([[0.0], np.cumsum(lengths / speed_mps)])
    times_s = np.arange(0.0, ends_s[-1] + 1e-9, DT_S)
    places = np.stack([np.interp(times_s, ends_s, corners[:, c]) for c in range(3)], axis=1)
    return Followed(times_s, places, ends_s)


def way_home(track, followed, *obstacles, **options):
    scenario = meadow((START_M,), obstacles=obstacles)
    told = {"holds_s": [0.0] * (len(followed.corner_s) - 1), "begins_s": 0.0, "others": ()}
    return return_path(scenario, track, followed, BY, **told, **options)


NORTH = [(20.0, 100.0, -20.0), (140.0, 100.0, -20.0)]


@pytest.mark.parametrize(("speed_mps", "gap_m", "clear"), [(12.0, 25.0, False), (12.0, 35.0, True)])
def test_a_vehicle_at_12_m_s_needs_30_m_to_stop(track, speed_mps, gap_m, clear):
    wall = box("wall", (140.0 + gap_m, 80.0, -TALL), (144.0 + gap_m, 120.0, 0.0), 0.0)
    found = way_home(track, path_of(NORTH, speed_mps), wall)
    assert (found.braking == ()) == clear
    if not clear:
        assert found.braking[-1].to_s == pytest.approx(10.0, abs=0.11)


@pytest.mark.parametrize(("gap_m", "action"), [(1.5, RETRACE), (4.0, RETURN)])
def test_a_return_keeps_2_m_from_what_is_higher_than_it(track, gap_m, action):
    beside_m = 100.0 + 0.36 + gap_m  # its radius, and what is left of the way that it flew
    mast = box("mast", (80.0, beside_m, -TALL), (81.0, beside_m + 1.0, 0.0), 0.0)
    assert way_home(track, path_of(NORTH, 3.0), mast).action == action


def test_a_higher_return_passes_over_what_a_lower_one_does_not(track):
    block = box("block", (60.0, 90.0, -30.0), (80.0, 110.0, 0.0), 3.0)
    over = [(20.0, 100.0, -40.0), (140.0, 100.0, -40.0)]
    assert way_home(track, path_of(over, 5.0)).height_m == 15.0
    found = way_home(track, path_of(over, 5.0), block)
    assert found.height_m == 30.0 + 3.0 + 1.0


def test_what_hangs_above_a_return_is_no_obstacle_to_it_and_what_it_flies_through_is(track):
    low = [(20.0, 100.0, -10.0), (140.0, 100.0, -10.0)]
    bridge = box("bridge", (60.0, 60.0, -45.0), (70.0, 140.0, -30.0), 0.0)
    assert way_home(track, path_of(low, 5.0), bridge).height_m == 15.0
    below = box("bridge", (60.0, 60.0, -45.0), (70.0, 140.0, -14.0), 0.0)
    assert way_home(track, path_of(low, 5.0), below).height_m == 46.0


def test_a_way_back_takes_as_long_as_the_way_out_and_px4_goes_on_where_less_is_left(track):
    wall = box("wall", (20.0, 90.0, -TALL), (22.0, 92.0, 0.0), 0.0)
    out = [(20.0, 100.0, -20.0), *((20.0 + 30.0 * n, 90.0, -20.0) for n in range(5))]
    followed = path_of(out, 5.0)
    back = way_home(track, followed, wall)
    assert back.action == RETRACE
    assert np.all(np.diff(back.needs_s) > 0.0)
    lands_s = back.needs_at(0.0)
    # SmartRTL was seen to take 1.4 times as long back as out
    assert back.needs_at(20.0) == pytest.approx(lands_s + 1.1 * (1.5 * 20.0 + 2.0), abs=2.5)
    either = way_home(track, followed, wall, nearer_end=True)
    assert either.needs_at(followed.duration_s) < 6.0 < back.needs_at(followed.duration_s)
    assert either.needs_at(2.0) == back.needs_at(2.0)
