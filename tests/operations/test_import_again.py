"""Areas that are to be seen again after some time: as drawn, as asked for, and flown."""

import pytest

pytest.importorskip("shapely")
from drawings import HOME, SQUARE, collection, feature, imported, refused

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import warnings

pytestmark = pytest.mark.usefixtures("elsewhere")

PART = [[10.001, 50.0005], [10.0015, 50.0005], [10.0015, 50.001], [10.001, 50.001]]
SITE = [*PART, PART[0]]


def gaps_s(scenario):
    return {waypoint.again_after_s for waypoint in scenario.waypoints}


def test_an_area_says_for_itself_and_the_option_for_those_that_do_not():
    often = feature(SITE, again_min="2,3.5", weight=2)
    area = collection(feature(SQUARE), often)
    assert gaps_s(imported(area, *HOME)) == {(), (120.0, 210.0)}
    assert gaps_s(imported(area, *HOME, "--again", "10")) == {(600.0,), (120.0, 210.0)}
    assert gaps_s(imported(collection(feature(SQUARE, again_min=5)), *HOME)) == {(300.0,)}


def test_what_is_imported_so_is_flown_as_often_as_asked(capsys):
    area = collection(feature(SQUARE), feature(SITE, again_min=4, weight=2))
    scenario = imported(area, *HOME)
    visits = sum(waypoint.visits for waypoint in scenario.waypoints)
    assert f"to be covered {visits} times in all" in " ".join(capsys.readouterr().out.split())
    assert not any("again" in line for line in warnings(scenario))
    flight = rollout(scenario, load_planner("nearest-waypoint"))
    assert accomplished(flight)
    assert flight.covered[-1] == visits > len(scenario.waypoints)
    assert flight.steps > 240


@pytest.mark.parametrize("given", ["soon", "0", "-3", "1,,2", "nan", "1e9", [], True])
def test_what_are_no_minutes_is_refused_in_one_line(given, capsys):
    area = collection(feature(SQUARE, again_min=given))
    assert "again_min" in refused(capsys, area, *HOME)
    if isinstance(given, str):
        assert "--again" in refused(capsys, collection(feature(SQUARE)), *HOME, "--again", given)


def test_a_no_fly_zone_is_not_seen_again(capsys):
    zone = feature(SITE, role="no_fly", again_min=5)
    assert "is no area to be seen" in refused(capsys, collection(feature(SQUARE), zone), *HOME)
