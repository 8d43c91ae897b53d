"""What the commands say of waypoints without a way to them, and of those that are left open."""

import json
import re

import pytest
from closed_yards import HOME, OPEN, ring, yard
from small_worlds import meadow, waypoint

from uas_coverage_env.cli import main

pytestmark = pytest.mark.usefixtures("elsewhere")


def test_a_check_names_all_waypoints_without_a_way_to_them_and_says_what_closes_them_off(
    elsewhere, capsys
):
    yard().to_file(elsewhere / "yard.toml")
    assert main(["scenario", "check", "yard.toml"]) == 0
    said = capsys.readouterr()
    assert "meadow is valid" in said.out
    assert said.err.startswith("warning: 1 of 3 waypoints have no way to them: waypoints[1]; ")
    assert "closed off by no-fly zone zone_" in said.err
    assert said.err.count("\n") == 1


def test_a_check_names_gaps_that_are_too_narrow_for_routes(elsewhere, capsys):
    yard(ring(gap_m=5.0)).to_file(elsewhere / "yard.toml")
    assert main(["scenario", "check", "yard.toml"]) == 0
    err = capsys.readouterr().err
    assert re.search(r"Too narrow: 5 m between zone_\w+ and zone_\w+ of 6\.72 m needed", err)
    assert "route_margin_m" in err
    assert err.count("\n") == 1


def test_of_many_waypoints_without_a_way_each_is_named(elsewhere, capsys):
    inside = [waypoint((115.0 + 6.0 * k, 130.0, -10.0), 2.0) for k in range(6)]
    places = [waypoint(OPEN[0]), *inside]
    meadow((HOME,), obstacles=ring(), waypoints=places).to_file(elsewhere / "many.toml")
    assert main(["scenario", "check", "many.toml"]) == 0
    err = capsys.readouterr().err
    assert err.startswith("warning: 6 of 7 waypoints have no way to them: ")
    assert re.findall(r"waypoints\[(\d)\]", err) == list("123456")


def test_a_check_says_nothing_of_ways_where_all_waypoints_have_one(elsewhere, capsys):
    yard(ring(gap_m=20.0)).to_file(elsewhere / "open.toml")
    assert main(["scenario", "check", "open.toml"]) == 0
    assert capsys.readouterr().err == ""


def test_a_check_names_waypoints_that_no_charge_reaches(elsewhere, capsys):
    places = [waypoint((60.0, 30.0, -10.0)), waypoint((190.0, 190.0, -40.0))]
    meadow((HOME,), waypoints=places, soc_0=0.28).to_file(elsewhere / "weak.toml")
    assert main(["scenario", "check", "weak.toml"]) == 0
    assert "charge     1 of 2 waypoints are out of reach: waypoints[1]; there and home takes" in (
        capsys.readouterr().out
    )


def test_a_run_says_of_each_waypoint_that_is_left_open_why(elsewhere, capsys):
    yard().to_file(elsewhere / "yard.toml")
    assert main(["run", "yard.toml", "--planner", "nearest-waypoint", "--out", "mine"]) == 1
    out = capsys.readouterr().out
    assert "left open: waypoints[1]: no way to it: closed off by no-fly zone zone_" in out
    kept = json.loads((elsewhere / "mine" / "summary.json").read_text())["left_open"]
    assert [(one["waypoint"], one["why"]) for one in kept] == [(1, "no way to it")]
    assert main(["show", "mine"]) == 0
    assert re.search(r"left open +1 no way to it", capsys.readouterr().out)
