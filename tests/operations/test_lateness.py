"""How late a UAS may be, held against two files flown again with that delay."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

pytest.importorskip("pyproj")

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.operations.geodesy import LocalFrame
from uas_coverage_env.operations.mission_export.scheduling import check_slack
from uas_coverage_env.planning.execution.lateness import Timed, encounters, pairs_of
from uas_coverage_env.planning.execution.leg_model import DT_S, Autopilot, Followed, follow
from uas_coverage_env.scenario import Place, load_scenario

FIELD = load_scenario("open_field")
KEPT_M = 2 * 0.36 + 5.0
HOMES = (0.0, 0.0), (0.0, 40.0)


def flown(home, corners):
    points = [(*home, -10.0), *corners, (*home, -10.0)]
    n = len(points) - 1
    return follow(points, [8.0] * n, [0.0] * n, Autopilot())


def pair_of(a, b):
    (pair,) = pairs_of(FIELD, [Timed(0, "uas_1", a), Timed(1, "uas_2", b)])
    return pair


def least_m(a, b, late_s):
    """Smallest distance where the second takes off so much later; each waits on the ground."""
    shift = round(late_s / DT_S)
    n = max(len(a.places_m), len(b.places_m)) + abs(shift)
    index = np.arange(-abs(shift), n)
    one = a.places_m[np.clip(index, 0, len(a.places_m) - 1)]
    other = b.places_m[np.clip(index - shift, 0, len(b.places_m) - 1)]
    away = one - other
    return np.maximum(np.hypot(away[:, 0], away[:, 1]), np.abs(away[:, 2])).min()


PLACES = st.lists(
    st.tuples(st.floats(20, 150), st.floats(-60, 100), st.floats(-30, -8)), min_size=1, max_size=4
)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(PLACES, PLACES)
def test_with_less_delay_than_the_slack_all_distances_are_kept(one, other):
    a, b = flown(HOMES[0], one), flown(HOMES[1], other)
    pair = pair_of(a, b)
    assert pair.kept_m == pytest.approx(KEPT_M)
    assert pair.least_m == pytest.approx(least_m(a, b, 0.0))
    most_s = 100.0 if pair.slack_s is None else pair.slack_s - DT_S
    for late_s in np.linspace(-most_s, most_s, 15) if most_s > 0 else ():
        assert least_m(a, b, late_s) >= KEPT_M


@settings(max_examples=25, deadline=None, derandomize=True)
@given(PLACES, PLACES)
def test_the_slack_is_no_more_careful_than_a_few_seconds(one, other):
    a, b = flown(HOMES[0], one), flown(HOMES[1], other)
    pair = pair_of(a, b)
    assume(pair.slack_s is not None)
    delays = pair.slack_s + np.arange(-2.0, 3.0, 0.2)
    assert min(least_m(a, b, sign * d) for sign in (1, -1) for d in delays) < KEPT_M + 2.0


@pytest.mark.parametrize(("step_m", "meets"), [(11.0, True), (5.0, False)])
def test_between_two_samples_each_may_be_half_a_step_nearer(step_m, meets):
    # passes level with what hovers, its samples on either side beyond what is to be kept
    nearest_m = KEPT_M + 0.5 * step_m - 0.1 if meets else KEPT_M + 0.5 * step_m + 0.1
    places = [(0.0, nearest_m + k * step_m, -10.0) for k in range(4)]
    moves = Followed(DT_S * np.arange(4.0), np.array(places), np.zeros(2))
    hovers = Followed(DT_S * np.arange(3.0), np.tile([0.0, 0.0, -10.0], (3, 1)), np.zeros(2))
    for a, b in ((moves, hovers), (hovers, moves)):
        assert (len(encounters(a, b, KEPT_M)) > 0) == meets


def test_paths_apart_allow_any_delay():
    pair = pair_of(flown(HOMES[0], [(100.0, 0.0, -10.0)]), flown(HOMES[1], [(100.0, 40.0, -10.0)]))
    assert pair.slack_s is None
    assert pair.place_m is None


def test_too_little_slack_is_refused_with_the_pair_and_the_place():
    crossing = flown(HOMES[0], [(100.0, 40.0, -10.0)]), flown(HOMES[1], [(100.0, 0.0, -10.0)])
    pair = pair_of(*crossing)
    assert pair.slack_s is not None
    assert pair.slack_s < 20.0
    frame = LocalFrame(Place(latitude_deg=47.0, longitude_deg=8.0))
    with pytest.raises(InputError, match=r"uas_1 and uas_2 come closer than 5.7 m at 47\.000\d+"):
        check_slack([pair], frame, 20.0)
    check_slack([pair], frame, 0.0)
