"""The independent check agrees with the world on true flights, and sees what was tampered with."""

import csv
import json
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from own_disturbances import gusts

from uas_coverage_env import generate_scenario, independent_check, load_planner, rollout
from uas_coverage_env.features import constant_wind
from uas_coverage_env.independent_check.__main__ import main
from uas_coverage_env.independent_check.distances import (
    curve,
    cylinder_distance,
    hull_distance,
    least_on_segments,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.world import Wrench


def flown(directory, scenario, planner, **keywords):
    rollout(scenario, planner, **keywords).save(directory)
    return directory


@pytest.fixture(scope="module")
def covered_town(lively_town, tmp_path_factory):
    return flown(tmp_path_factory.mktemp("flights") / "town", lively_town, "nearest-waypoint")


@pytest.fixture
def copied(covered_town, tmp_path):
    for path in covered_town.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    return tmp_path


def problems(directory):
    return "; ".join(independent_check.check(directory).problems)


def rewrite(path, change):
    """Pass all rows of a CSV file through `change`, which edits them in place."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    names = list(rows[0])
    change(rows)
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(rows)


def test_it_agrees_on_a_mission_that_ends_well(covered_town):
    report = independent_check.check(covered_town)
    assert report.problems == []
    assert report.coverage == 1.0
    assert report.all_home
    assert set(report.straight_room_m) == {"obstacle", "moving_obstacle", "uas", "geofence"}
    assert min(report.straight_room_m.values()) > 0.0


@pytest.mark.parametrize("packs", [0, 3])
def test_it_agrees_how_often_waypoints_were_covered_that_are_asked_for_again(
    lively_town, tmp_path, packs
):
    every = {"again_after_s": (20.0, 45.0)}
    waypoints = (
        *(waypoint.model_copy(update=every) for waypoint in lively_town.waypoints[:3]),
        *lively_town.waypoints[3:],
    )
    sorties = Sorties(packs=packs, swap_s=5.0, together=False) if packs else None
    changes = {"waypoints": waypoints, "sorties": sorties, "relaunch": not packs}
    flown(tmp_path / "f", lively_town.model_copy(update=changes), "nearest-waypoint")
    report = independent_check.check(tmp_path / "f")
    assert report.problems == []
    assert report.coverage == 1.0
    first, *rows = (tmp_path / "f" / "flight.csv").read_text("utf-8").splitlines()
    assert int(rows[-1].split(",")[first.split(",").index("covered")]) == len(waypoints) + 6


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_it_agrees_on_both_dynamics_and_on_flights_cut_short(lively_town, tmp_path, dynamics):
    flown(tmp_path / "f", lively_town, "lawnmower", dynamics=dynamics, max_steps=40)
    assert problems(tmp_path / "f") == ""


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_it_agrees_on_flights_with_disturbances(lively_town, tmp_path, dynamics):
    pushed = (constant_wind(3.0, 200.0), gusts(1.0))
    flight = {"dynamics": dynamics, "max_steps": 40, "disturbances": pushed}
    flown(tmp_path / "f", lively_town, "lawnmower", **flight)
    assert problems(tmp_path / "f") == ""


def test_a_limit_is_judged_by_the_tolerance_of_disturbances_only_where_they_act(
    lively_town, tmp_path
):
    flown(tmp_path / "f", lively_town, "lawnmower", max_steps=10, disturbances=(gusts(0.0),))

    def faster(rows):
        rows[8]["vx_mps"] = 1.1 * lively_town.vehicles[0].limits.v_xy_max_mps
        rows[8]["vy_mps"] = 0.0

    rewrite(tmp_path / "f" / "flight.csv", faster)
    assert "limit of speed" not in problems(tmp_path / "f")
    run = json.loads((tmp_path / "f" / "run.json").read_text())
    assert run.pop("disturbances") == ["gusts"]
    (tmp_path / "f" / "run.json").write_text(json.dumps(run))
    assert "limit of speed" in problems(tmp_path / "f")


def test_it_agrees_that_a_swarm_hovers_until_its_batteries_are_empty(lively_town, tmp_path):
    data = lively_town.model_dump(by_alias=True)
    uas = [entry | {"soc_0": 0.29 - 0.01 * row} for row, entry in enumerate(data["uas"])]
    weak = Scenario.model_validate(data | {"uas": uas})
    report = independent_check.check(flown(tmp_path / "f", weak, "hover"))
    assert [contact[2] for contact in report.contacts] == ["battery", "battery"]
    assert len(report.problems) == 2


@pytest.mark.parametrize("seed", range(8))
def test_it_finds_the_contacts_that_the_world_finds(lively_town, tmp_path, seed):
    crowd = generate_scenario(seed, n_uas=4, n_waypoints=6, n_obstacles=8, size_m=260.0)
    data = crowd.model_dump(by_alias=True)
    moving = lively_town.model_dump(by_alias=True)["moving_obstacles"]
    crowd = Scenario.model_validate(data | {"moving_obstacles": moving})
    wild = load_planner("random-walk", {"filter": "false", "return_mode": "false"})
    report = independent_check.check(flown(tmp_path / "f", crowd, wild, seed=seed, max_steps=150))
    assert report.contacts, "a flight that touches nothing proves nothing"
    assert len(report.problems) == len(report.contacts)


TAMPERED = {
    "a_sample_in_an_obstacle": ("flight.csv", {"x_m": 120.0, "y_m": 80.0, "z_m": -5.0}, "contact"),
    "a_sample_a_little_off": ("flight.csv", {"x_m": lambda x: x + 1.0}, "velocity explains"),
    "another_current": ("flight.csv", {"current_A": lambda i: 0.9 * i}, "energy_Wh"),
    "another_charge": ("flight.csv", {"dod": lambda d: d + 1e-3}, "do not add up"),
    "another_coverage": ("flight.csv", {"covered": lambda c: int(c) + 1}, "waypoints are covered"),
    "another_way_of_the_balloon": ("moving_obstacles.csv", {"x_m": 110.0}, "off its schedule"),
}


@pytest.mark.parametrize("case", TAMPERED)
def test_it_sees_one_row_that_was_tampered_with(copied, case):
    file, changes, expected = TAMPERED[case]

    def change(rows):
        for name, new in changes.items():
            rows[30][name] = new(float(rows[30][name])) if callable(new) else new

    rewrite(copied / file, change)
    assert expected in problems(copied)


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("coverage", 0.8),
        ("steps", 12),
        ("energy_Wh", 1.0),
        ("all_home", False),
        ("min_separation_m", None),
        ("min_obstacle_clearance_m", 0.1),
        ("breaches", 3),
        ("violations", [{"t_s": 3.0, "uas": "uas_1", "kind": "geofence", "with": None}]),
    ],
)
def test_it_sees_a_summary_that_was_tampered_with(copied, key, value):
    path = copied / "summary.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | {key: value}))
    assert key in problems(copied)


class _Somersault:
    """The largest torque about pitch, which leads beyond tilt, rate and speed."""

    def reset(self, brief, seed):
        self.torque_Nm = 0.0165 * 0.5

    def act(self, swarm):
        return dict.fromkeys(swarm.active, Wrench(0.0, 0.0, -self.torque_Nm, 0.0))


@pytest.fixture(scope="module")
def somersault(tmp_path_factory):
    directory = tmp_path_factory.mktemp("flights") / "somersault"
    return flown(directory, "open_field", _Somersault(), max_steps=4)


def test_it_agrees_which_limits_were_exceeded_and_from_when_on(somersault):
    report = independent_check.check(somersault)
    assert {(time_s, name) for time_s, _, _, name in report.limits} == {
        (2.0, "tilt"), (2.0, "tilt_rate"), (3.0, "speed"),
    }  # fmt: skip
    assert "violations are" not in "; ".join(report.problems)


def test_it_sees_a_limit_that_the_summary_hides_and_an_input_beyond_its_own(somersault, tmp_path):
    for path in somersault.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    summary = json.loads((tmp_path / "summary.json").read_text())
    hidden = [one for one in summary["violations"] if one["with"] != "speed"]
    (tmp_path / "summary.json").write_text(json.dumps(summary | {"violations": hidden}))
    rewrite(tmp_path / "flight.csv", lambda rows: rows[2].update(tau_x_Nm=0.0083))
    assert "violations are" in problems(tmp_path)
    assert "tau_x_Nm = 0.0083, beyond its limits -0.00825 to 0.00825" in problems(tmp_path)


def test_it_sees_that_a_uas_was_taken_home_by_hand(copied):
    def stop_early(rows):
        del rows[20:]
        for row in rows[-2:]:
            row["mode"] = "landed"

    rewrite(copied / "flight.csv", stop_early)
    rewrite(copied / "moving_obstacles.csv", lambda rows: rows.__delitem__(slice(10, None)))
    assert "from its home" in problems(copied)


def test_it_sees_a_plan_whose_first_step_was_not_flown(copied):
    lines = ["t_s,uas,n,x_m,y_m,z_m", "0.0,uas_1,0,112.0,10.0,-1.0", "0.0,uas_1,1,113.0,10.0,-1.0"]
    (copied / "plan.csv").write_text("\n".join(lines) + "\n")
    assert "plan of uas_1" in problems(copied)


def test_a_curve_that_bulges_into_a_wall_is_seen_where_the_straight_way_is_clear(copied):
    # from one side of the fence's edge along it, leaning out in between
    def lean(rows):
        mine = [row for row in rows if row["uas"] == "uas_1"][10:12]
        for row, speed in zip(mine, (-12.0, 12.0), strict=True):
            row.update(x_m=0.5, vx_mps=speed)

    rewrite(copied / "flight.csv", lean)
    found = problems(copied)
    assert "too close to the fence on the curve" in found
    assert "geofence contact" not in found


@pytest.mark.parametrize("file", ["scenario.json", "flight.csv", "summary.json", "plan.csv"])
def test_what_is_no_flight_is_refused_in_one_line(copied, file, capsys):
    (copied / file).unlink()
    assert main([str(copied)]) == 2
    assert file in capsys.readouterr().err
    (copied / file).write_text("{broken,\n1,2,3\n")
    assert main([str(copied)]) == 2
    assert capsys.readouterr().err.count("\n") == 1


def test_the_command_says_what_it_found_and_imports_nothing_of_ours(covered_town):
    code = (
        "import runpy, sys\n"
        "try: runpy.run_module('uas_coverage_env.independent_check', run_name='__main__')\n"
        "except SystemExit as end: assert not end.code, end.code\n"
        "ours = [name for name in sys.modules if name.startswith('uas_coverage')]\n"
        "of_the_check = 'uas_coverage_env.independent_check'\n"
        # what any import of the package brings: the ids of the environments, no code of the world
        "brought = ('', '.registration', '.program', '.interruptions')\n"
        "ours = [n for n in ours if n.removeprefix('uas_coverage_env') not in brought]\n"
        "assert all(name.startswith(of_the_check) for name in ours), ours"
    )
    result = subprocess.run(
        [sys.executable, "-c", code, str(covered_town)], capture_output=True, text=True
    )
    assert result.returncode == 0, result.stderr
    assert "agrees, nothing touched" in result.stdout


points = st.tuples(*[st.floats(-6.0, 6.0)] * 3)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(points, points)
def test_the_smallest_distance_on_a_segment_is_no_larger_than_any_on_it(start, end):
    box = hull_distance([(x, y, z) for x in (-1, 2) for y in (-2, 1) for z in (-1, 1)])
    for distance in (box, cylinder_distance(1.5, 2.0), cylinder_distance(0.0, 0.0)):
        p, q = np.array([start]), np.array([end])
        (least,) = least_on_segments(distance, p, q)
        dense = distance(p + np.linspace(0.0, 1.0, 401)[:, None] * (q - p))
        assert least <= dense.min() + 1e-9
        assert least >= dense.min() - 0.5 * np.linalg.norm(q - p) / 400 - 1e-9


def test_a_curve_goes_through_its_samples_with_their_velocities():
    position = np.array([[0.0, 0.0, 0.0], [3.0, 1.0, -2.0], [5.0, 2.0, -2.5]])
    velocity = np.array([[1.0, 0.0, 0.0], [4.0, 2.0, -1.0], [1.0, 1.0, 0.0]])
    points_m = curve(position, velocity, 0.5)
    assert points_m[:, 0] == pytest.approx(position[:-1])
    assert points_m[:, -1] == pytest.approx(position[1:])
    step_s = 0.5 / (points_m.shape[1] - 1)
    assert (points_m[:, 1] - points_m[:, 0]) / step_s == pytest.approx(velocity[:-1], abs=1.0)
