"""What a flight has left to do is a mission that is flown like any other."""

import dataclasses

import numpy as np
import pytest

from uas_coverage_env import Flight, generate_scenario, load_planner, load_scenario, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import covered_at, rest_of
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.flight.record import LOST


def nearest(scenario, **options):
    return rollout(scenario, load_planner("nearest-waypoint"), 0, **options)


@pytest.fixture(scope="module")
def mission():
    return generate_scenario(seed=3, n_uas=2, n_waypoints=8, n_obstacles=3)


@pytest.fixture(scope="module")
def broken_off(mission):
    """With some waypoints covered, some not, and both UAS in the air."""
    flight = nearest(mission, max_steps=25)
    assert 0 < flight.covered[-1] < len(mission.waypoints)
    return flight


def test_the_rest_holds_what_was_not_covered_and_nothing_else(mission, broken_off):
    rest = rest_of(broken_off)
    late = covered_at(broken_off) == len(broken_off.x)
    assert rest.waypoints == tuple(
        w for w, open_ in zip(mission.waypoints, late, strict=True) if open_
    )
    assert len(rest.waypoints) == len(mission.waypoints) - broken_off.covered[-1]
    changed = {"name": mission.name, "waypoints": mission.waypoints}
    assert rest.model_copy(update=changed) == mission
    assert rest.name == f"{mission.name}-rest"
    assert accomplished(nearest(rest))


def test_weights_stay(mission):
    weighted = mission.model_copy(
        update={
            "waypoints": tuple(
                w.model_copy(update={"weight": 1.0 + k}) for k, w in enumerate(mission.waypoints)
            )
        }
    )
    flight = nearest(weighted, max_steps=25)
    left = {w.weight for w in rest_of(flight).waypoints}
    open_ = np.flatnonzero(covered_at(flight) == len(flight.x))
    assert left == {1.0 + k for k in open_}


def test_from_here_uas_go_on_with_what_they_had_and_land_where_they_started(mission, broken_off):
    rest = rest_of(broken_off, from_here=True)
    for i, uas in enumerate(rest.uas):
        assert uas.start_m == tuple(broken_off.x[-1, i, :3])
        assert uas.soc_0 == broken_off.soc[-1, i]
    flight = nearest(rest)
    assert accomplished(flight)
    for i, uas in enumerate(mission.uas):
        home_m = np.linalg.norm(flight.x[-1, i, :3] - uas.start_m)
        assert home_m <= mission.landing_distance_m
        assert flight.soc[-1, i] < broken_off.soc[-1, i]


def test_the_rest_of_the_rest_keeps_its_name(broken_off):
    again = nearest(rest_of(broken_off), max_steps=1)
    assert rest_of(again).name == rest_of(broken_off).name


def test_uas_that_were_lost_are_left_out(broken_off):
    mode = broken_off.mode.copy()
    mode[-1, 0] = LOST
    lost = dataclasses.replace(broken_off, mode=mode)
    assert [uas.name for uas in rest_of(lost).uas] == [broken_off.names[1]]
    with pytest.raises(InputError, match="no UAS is left"):
        rest_of(dataclasses.replace(broken_off, mode=np.full_like(mode, LOST)))


def test_of_a_mission_that_is_done_nothing_is_left(mission):
    with pytest.raises(InputError, match="has covered everything"):
        rest_of(nearest(mission))


def test_what_events_have_changed_stays_changed(mission):
    added = {"position_m": (100.0, 100.0, -30.0), "radius_m": 10.0, "weight": 2.0}
    events = (
        {"kind": "waypoint_dropped", "at_s": 1.0, "waypoint": 0},
        {"kind": "waypoint_added", "at_s": 5.0, **added},
        {"kind": "waypoint_dropped", "at_s": 900.0, "waypoint": 1},
    )
    field = load_scenario("open_field").model_copy(update={"events": events})
    flight = nearest(field, max_steps=8)
    rest = rest_of(flight)
    assert len(rest.waypoints) == flight.open_waypoints
    assert field.waypoints[0] not in rest.waypoints
    assert rest.waypoints[-1].position_m == added["position_m"]
    assert rest.events == ()
    # what has not happened yet is not in it
    assert field.waypoints[1] in rest.waypoints


def test_moving_obstacles_go_on_from_where_they_were():
    village = load_scenario("gasche2025")
    assert village.moving_obstacles
    flight = nearest(village, max_steps=12)
    rest = rest_of(flight, from_here=True)
    for later_s in (0.0, 30.0, 200.0):
        expected = village.moving_positions(12 * village.dt_s + later_s)
        assert rest.moving_positions(later_s) == pytest.approx(expected)
    assert rest_of(flight).moving_obstacles == village.moving_obstacles


def test_the_command_writes_a_scenario_that_is_flown(broken_off, tmp_path, capsys):
    broken_off.save(tmp_path / "flight")
    for extra in ((), ("--from-here",)):
        out = tmp_path / f"rest{len(extra)}.toml"
        assert (
            main(["scenario", "resume", str(tmp_path / "flight"), "--out", str(out), *extra]) == 0
        )
        said = capsys.readouterr().out
        left = len(broken_off.scenario.waypoints) - broken_off.covered[-1]
        assert f"{left} of 8 waypoints are left" in said
        assert ("goes on with" in said) == bool(extra)
        written = load_scenario(out)
        assert written == rest_of(Flight.load(tmp_path / "flight"), from_here=bool(extra))
        flown = tmp_path / f"flown{len(extra)}"
        command = ["run", str(out), "--planner", "nearest-waypoint", "--out", str(flown)]
        assert main(command) == 0
        capsys.readouterr()


def test_mistakes_are_refused_in_one_line(mission, broken_off, tmp_path, capsys):
    broken_off.save(tmp_path / "flight")
    nearest(mission).save(tmp_path / "done")
    (tmp_path / "there.toml").write_text("")
    new = str(tmp_path / "rest.toml")
    for directory, out, said in (
        ("flight", str(tmp_path / "rest.json"), "should end in .toml"),
        ("flight", str(tmp_path / "there.toml"), "exists; give another --out"),
        ("nowhere", new, "nowhere"),
        ("done", new, "has covered everything"),
    ):
        assert main(["scenario", "resume", str(tmp_path / directory), "--out", out]) == 2
        err = capsys.readouterr().err
        assert said in err
        assert err.count("\n") == 1
