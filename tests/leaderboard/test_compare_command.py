"""`uas-coverage compare` in this process: what it says, writes, keeps and returns."""

import json
import sqlite3
import sys
from pathlib import Path

import numpy as np
import pytest
from leaderboard_rows import flights_in

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import PlannerError, evaluate, load_planner
from uas_coverage_env.leaderboard import flying, planner_specs
from uas_coverage_env.world import Velocity

pytestmark = pytest.mark.usefixtures("elsewhere")


def compare(scenarios, *more: str, planners="nearest-waypoint,hover", out="sweep") -> int:
    return main(
        [
            *("compare", "--scenarios", str(scenarios), "--planners", planners, "--jobs", "1"),
            *("--seeds", "0:2", "--out", str(out), *more),
        ]
    )


def flights(out="sweep", **wanted):
    """The rows of a folder, or those with some values."""
    return [
        row
        for row in flights_in(out)
        if all(getattr(row, name) == value for name, value in wanted.items())
    ]


def values(name, **wanted):
    """One figure of some rows."""
    return [getattr(row, name) for row in flights(**wanted)]


@pytest.fixture
def with_planners(monkeypatch):
    """Put planners in the place of `hover`, for whoever flies in this process."""

    def put(make):
        # with all of its options it is loaded to fly
        monkeypatch.setattr(
            planner_specs,
            "load_planner",
            lambda name, options: (
                make() if name == "hover" and options else load_planner(name, options)
            ),
        )

    return put


def table_cells(text: str, heading: str, planner: str) -> dict[str, str]:
    """Heading -> cell, of the row of a planner in the table that has a heading."""
    lines = [[cell.strip() for cell in line.split("|")[1:-1]] for line in text.splitlines()]
    (first,) = [n for n, cells in enumerate(lines) if heading in cells]
    (row,) = [cells for cells in lines[first : first + 6] if cells and cells[0] == planner]
    return dict(zip(lines[first], row, strict=True))


def test_a_sweep_prints_tables_and_writes_its_files(two_yards, elsewhere, capsys):
    assert compare(two_yards) == 0
    out, err = capsys.readouterr()
    assert [line for line in err.splitlines() if "compiling for" not in line] == []
    assert "8 flights: 2 planners, 2 scenarios, 2 seeds" in out
    assert "8 flights to fly" in out
    for heading in ("Outcome", "Effort", "Against nearest-waypoint"):
        assert heading in out
    table = (elsewhere / "sweep" / "table.md").read_text()
    cells = table_cells(table, "flights", "nearest-waypoint")
    assert (cells["flights"], cells["accomplished"], cells["violations"]) == ("4", "4/4", "0")
    assert (cells["covered, %"], cells["worst, %"]) == ("100.0 [100.0, 100.0]", "100")
    effort = table_cells(table, "steps", "nearest-waypoint")
    assert float(effort["processor p50, ms"]) > 0.0
    assert f"uas-coverage compare --scenarios {two_yards}" in table
    assert values("status") == ["flown"] * 8
    assert values("accomplished", label="hover") == [False] * 4
    assert values("steps", label="hover") == [60] * 4
    own = evaluate("hover", two_yards.partition(",")[0], seeds=[0]).mean("episode_return")
    assert values("episode_return", label="hover", scenario="yard") == [own] * 2


def test_the_same_sweep_goes_on_and_flies_nothing_twice(yard, elsewhere, capsys, monkeypatch):
    assert compare(yard) == 0
    first = flights()
    table = (elsewhere / "sweep" / "table.md").read_text()
    monkeypatch.setattr(flying, "rollout", None)
    assert compare(yard) == 0
    assert "4 of 4 flights are there" in capsys.readouterr().out
    assert flights() == first
    assert (elsewhere / "sweep" / "table.md").read_text() == table


def test_bounds_are_left_out_where_nobody_wants_to_wait_for_them(yard, elsewhere):
    def above_the_bound():
        text = (elsewhere / "sweep" / "table.md").read_text()
        cells = table_cells(text, "above the bound, %", "nearest-waypoint")
        return cells["above the bound, %"], "--no-bounds" in text

    assert compare(yard, "--no-bounds") == 0
    assert above_the_bound() == ("–", True)
    assert compare(yard) == 0
    cell, without = above_the_bound()
    assert float(cell.split()[0]) > 0.0
    assert not without


def test_another_sweep_in_the_same_directory_is_refused(yard, capsys):
    assert compare(yard) == 0
    before = flights()
    capsys.readouterr()
    for more, said in {
        ("--filter",): "safety_filter is False there, True asked for",
        ("--dynamics", "nonlinear"): "dynamics is lpv there, nonlinear asked for",
        ("--seeds", "0:3"): "seeds is 0:2 there, 0:3 asked for",
        ("--planners", "lawnmower"): "planners: it has no lawnmower",
        ("--option", "hover:climb_m=6"): "options: climb_m is 5.0 there, 6.0 asked for",
    }.items():
        assert compare(yard, *more) == 2
        out, err = capsys.readouterr()
        assert (out, err.count("\n")) == ("", 1)
        assert said in err
    assert compare(yard, planners="hover") == 2
    assert "planners: it has nearest-waypoint" in capsys.readouterr().err
    assert flights() == before
    assert compare(yard, "--filter", "--overwrite") == 0
    assert values("safety_filter") == [True] * 4


def test_flights_of_another_sweep_are_not_mixed_in(yard, capsys):
    assert compare(yard) == 0
    with sqlite3.connect("sweep/flights.sqlite") as connection:
        connection.execute("UPDATE flights SET key = 'another' WHERE label = 'hover' AND seed = 1")
    connection.close()
    capsys.readouterr()
    assert compare(yard) == 2
    assert "holds flights of no sweep, or of another" in capsys.readouterr().err


def test_the_figure_of_damaged_files_is_refused_in_a_line(yard, elsewhere, capsys):
    assert compare(yard) == 0
    with sqlite3.connect("sweep/flights.sqlite") as connection:
        connection.execute("UPDATE flights SET coverage = 9e999")
    connection.close()
    capsys.readouterr()
    assert main(["figure", "sweep", "--kind", "leaderboard"]) == 2
    assert "coverage of a flight is inf" in capsys.readouterr().err
    assert compare(yard, "--overwrite") == 0
    (elsewhere / "sweep" / "table.json").write_text('{"reference": ["hover"]}')
    capsys.readouterr()
    assert main(["figure", "sweep", "--kind", "leaderboard"]) == 2
    assert "the reference ['hover'] has no flight" in capsys.readouterr().err


def test_flights_are_a_parquet_file_too_where_that_is_asked_for(
    yard, elsewhere, monkeypatch, capsys
):
    polars = pytest.importorskip("polars")
    assert compare(yard, "--parquet") == 0
    frame = polars.read_parquet("sweep/flights.parquet")
    assert frame["steps"].to_list() == values("steps")
    assert frame.schema["accomplished"] == polars.Boolean
    assert "--parquet" in (elsewhere / "sweep" / "table.md").read_text()
    monkeypatch.setitem(sys.modules, "polars", None)
    capsys.readouterr()
    assert compare(yard, "--parquet", out="other") == 2
    assert "uas-coverage-env[parquet]" in capsys.readouterr().err
    assert not (elsewhere / "other").exists()


def test_the_folder_of_another_command_is_refused(yard, capsys):
    assert (
        main(
            [
                "planner",
                "demonstrate",
                str(yard),
                "--planner",
                "hover",
                "--jobs",
                "1",
                "--out",
                "mine",
            ]
        )
        == 0
    )
    capsys.readouterr()
    assert compare(yard, out="mine") == 2
    assert "command is demonstrate there, compare asked for" in capsys.readouterr().err


def test_processes_side_by_side_give_what_one_gives(two_yards):
    assert compare(two_yards, planners="nearest-waypoint,random-walk") == 0
    command = ["compare", "--scenarios", two_yards, "--planners", "nearest-waypoint,random-walk"]
    assert main([*command, "--seeds", "0:2", "--jobs", "2", "--out", "two"]) == 0
    assert flights("two") == flights()


def test_a_planner_that_refuses_or_crashes_is_a_row_with_its_reason(
    yard, capsys, with_planners, elsewhere
):
    class Crashes:
        def reset(self, scenario, seed):
            if seed == 0:
                raise InputError("no map of\nthis place")

        def act(self, swarm):
            raise ZeroDivisionError("of the\nplan")

    with_planners(Crashes)
    assert compare(yard) == 1
    err = capsys.readouterr().err
    assert "hover failed 1 flight (first: yard, seed 0)" in err
    assert values("status", label="hover") == ["failed", "failed"]
    refused, crashed = values("reason", label="hover")
    assert refused.endswith("no map of this place")
    assert "at step 0 (t = 0 s): ZeroDivisionError: of the plan (" in crashed
    assert f"{Path(__file__).name}:" in crashed
    assert values("energy_Wh", label="hover") == [None, None]
    assert "2 (2 failed)" in (elsewhere / "sweep" / "table.md").read_text()
    # a failure is a result: it is not flown again
    assert compare(yard) == 1
    assert "4 of 4 flights are there" in capsys.readouterr().out


def test_commands_that_cannot_be_flown_fail_the_flight_alone(yard, with_planners):
    class Wild:
        def reset(self, scenario, seed):
            pass

        def act(self, swarm):
            return dict.fromkeys(swarm.active, Velocity(np.nan, 0.0, 1.0))

    assert issubclass(PlannerError, ValueError)
    with_planners(Wild)
    assert compare(yard) == 1
    assert "at step 0 (t = 0 s)" in values("reason", label="hover")[0]


def test_a_flight_that_is_stopped_by_hand_is_not_kept(yard, capsys, with_planners):
    class Interrupted:
        def reset(self, scenario, seed):
            self.seed = seed

        def act(self, swarm):
            if self.seed and swarm.step == 3:
                raise KeyboardInterrupt
            return {name: Velocity(0.0, 0.0, 1.0) for name in swarm.active}

    with_planners(Interrupted)
    assert compare(yard) in (1, 130)
    out, err = capsys.readouterr()
    assert err.splitlines()[-1].startswith("error: stopped by hand; what was finished before is ke")
    assert "3 flights of 4 (not finished)" in out
    assert len(flights()) == 3
    with_planners(lambda: load_planner("hover"))
    assert compare(yard) == 0
    assert len(flights()) == 4


def test_a_flight_that_kills_every_process_is_named_and_the_others_are_kept(
    yard, elsewhere, capsys, monkeypatch
):
    (elsewhere / "deadly.py").write_text(DEADLY)
    monkeypatch.syspath_prepend(elsewhere)
    asked = ["compare", "--scenarios", str(yard), "--planners", "hover,deadly:Deadly"]
    asked += ["--seeds", "0:2", "--jobs", "2", "--out", "sweep"]
    assert main(asked) == 1
    assert "its process ended (by SIGKILL), 3 times" in capsys.readouterr().err
    assert values("label") == ["hover", "hover"]
    (elsewhere / "mended").touch()
    assert main(asked) == 0
    assert len(flights()) == 4


def test_a_planner_of_ones_own_whose_file_has_changed_is_another_one(yard, elsewhere, capsys):
    file = elsewhere / "own_circles.py"
    circles = "from uas_coverage_baselines.hover import Hover\nclass Circles(Hover):\n    pass\n"
    file.write_text(circles)
    planners = "hover,own_circles:Circles"
    assert compare(yard, planners=planners) == 0
    file.write_text(circles + "    radius_m = 3.0\n")
    capsys.readouterr()
    assert compare(yard, planners=planners) == 2
    assert "own_circles:Circles: own_sha256 is " in capsys.readouterr().err
    assert compare(yard, "--reuse", "sweep", planners=planners, out="edited") == 0
    assert "2 of 4 flights are there" in capsys.readouterr().out


def test_a_policy_that_changes_under_way_fails(yard, with_planners):
    class Policy:
        fingerprint = "other weights"

        def reset(self, scenario, seed):
            pass

        def act(self, swarm):
            return {}

    with_planners(Policy)
    assert compare(yard) == 1
    assert "have changed" in values("reason", label="hover")[0]


def test_options_and_labels_reach_the_planners(yard):
    options = ("--option", "high:climb_m=12", "--reference", "high")
    assert compare(yard, *options, planners="hover,high=hover") == 0
    climbs = {row.label: json.loads(row.options)["climb_m"] for row in flights(seed=0)}
    assert climbs == {"hover": 5.0, "high": 12.0}
    assert values("planner", seed=0) == ["hover"] * 2
    assert len(set(values("trajectory_sha256", seed=0))) == 2


def test_flights_that_another_sweep_has_in_common_are_taken_over(yard, two_yards, capsys):
    assert compare(yard, planners="hover,random-walk", out="old") == 0
    before = flights("old")
    capsys.readouterr()
    # more scenarios, other planners: hover on the yard is in both
    assert compare(two_yards, "--reuse", "old", "--reuse", "old") == 0
    assert "2 of 8 flights are there" in capsys.readouterr().out
    assert flights(label="hover", scenario="yard") == [r for r in before if r.label == "hover"]
    assert flights("old") == before
    assert compare(yard, "--filter", "--reuse", "old", out="filtered") == 0
    assert "4 flights to fly" in capsys.readouterr().out


DEADLY = """
import os, signal
from pathlib import Path
from uas_coverage_env.world import Velocity

class Deadly:
    def reset(self, brief, seed):
        if not Path("mended").exists():
            os.kill(os.getpid(), signal.SIGKILL)

    def act(self, swarm):
        return {name: Velocity(0.0, 0.0, 1.0) for name in swarm.active}
"""

MISTAKES = {
    "no scenario": (["--scenarios", ","], "names none"),
    "unknown scenario": (["--scenarios", "villagge"], "villagge"),
    "no such file": (["--scenarios", "nowhere.toml"], "nowhere.toml"),
    "bad range": (["--scenarios", "generated:9:9"], "FIRST:END"),
    "too many": (["--scenarios", "generated:0:999999999"], "at most"),
    "unknown planner": (["--planners", "hoover"], "hoover"),
    "planner twice": (["--planners", "hover,hover"], "twice"),
    "no planner": (["--planners", ""], "names none"),
    "option without planner": (["--option", "horizon=3"], "PLANNER:KEY=VALUE"),
    "option of another": (["--option", "tour:x=3"], "no 'tour'"),
    "unknown option": (["--option", "hover:x=3"], "no option 'x'"),
    "option twice": (["--option", "hover:x=3", "--option", "hover:x=4"], "twice"),
    "no seeds": (["--seeds", "4:4"], "FIRST < END"),
    "not a range": (["--seeds", "4"], "0:20"),
    "seeds for ever": (["--seeds", "0:999999999999"], "at most 10000"),
    "seeds that no column holds": (["--seeds", f"{2**63}:{2**63 + 1}"], "18 digits"),
    "seeds beyond any number": (["--seeds", f"0:{'9' * 5000}"], "18 digits"),
    "generated beyond any number": (["--scenarios", f"generated:0:{'9' * 5000}"], "18 digits"),
    "unknown reference": (["--reference", "tour"], "tour"),
    "unknown backend": (["--backend", "dask"], "dask"),
    "no jobs": (["--jobs", "0"], "jobs"),
    "nothing to reuse": (["--reuse", "nowhere"], "holds no flights"),
    "a file": (["--out", "taken.txt"], "is a file"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_and_nothing_is_flown(mistake, elsewhere, capsys):
    (elsewhere / "taken.txt").write_text("")
    change, said = MISTAKES[mistake]
    given = {"--scenarios": "village", "--planners": "hover", "--seeds": "0:1", "--out": "sweep"}
    for option in change[::2]:
        given.pop(option, None)
    command = [part for pair in given.items() for part in pair]
    assert main(["compare", *command, *change]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.count("\n") == 1, err
    assert said in err
    assert not (elsewhere / "sweep").exists()


def test_ray_that_is_not_there_is_named(yard, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "ray", None)
    assert compare(yard, "--backend", "ray") == 2
    assert "uas-coverage-env[cluster]" in capsys.readouterr().err
