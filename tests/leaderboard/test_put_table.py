"""The script that publishes a comparison in the READMEs."""

import importlib.util
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.leaderboard import Comparison

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))

from marks import marks_of  # noqa: E402


@pytest.fixture
def put_table(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("put_table", ROOT / "benchmarks/put_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("README.md", "baselines/README.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        blocks = ["{}old\n{}\n".format(*marks_of(mark)) for mark in module.MARKS]
        (tmp_path / name).write_text(f"before\n{''.join(blocks)}after\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setitem(module.PICTURES, "leaderboard", tmp_path / "picture.png")
    return module


def test_tables_and_picture_go_between_the_marks_as_often_as_one_likes(put_table, tmp_path):
    rows = [row(s, "base") for s in "ab"] + [row(s, "p", steps=90) for s in "ab"]
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    Comparison.of([*rows, failed_row("a", "q")], 5, "base", "a command", "1").write(sweep)
    for _ in range(2):
        assert put_table.main(str(sweep)) == 0
    short = (tmp_path / "README.md").read_text()
    assert short.startswith("before\n")
    assert short.endswith("after\n")
    assert short.count("old") == len(put_table.MARKS) - 1  # between the other marks
    assert short.count("`a command`") == 1
    assert "| `p` | 2/2 | 0 | 1.00 | +0.0 [+0.0, +0.0] | -10.0 [-10.0, -10.0] |" in short
    assert "| `q` | 0/1 | 0 | – | – | – |" in short
    tables, words = (sweep / "table.md").read_text().split("\nInterquartile means")
    long = (tmp_path / "baselines/README.md").read_text()
    assert tables.strip() in long
    assert "Energy and steps on each scenario" in words
    assert "Energy and steps on each scenario" not in long
    assert (tmp_path / "picture.png").read_bytes() == (sweep / "coverage-energy.png").read_bytes()


def test_a_readme_without_marks_is_left_alone(put_table, tmp_path, capsys):
    (tmp_path / "baselines/README.md").write_text("mine")
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    Comparison.of([row()], 1, "p", "a command", "1").write(sweep)
    assert put_table.main(str(sweep)) == 2
    assert "has no <!-- leaderboard -->" in capsys.readouterr().err
    assert (tmp_path / "baselines/README.md").read_text() == "mine"
    assert put_table.main(str(tmp_path / "nowhere")) == 2


def test_the_test_set_has_marks_of_its_own(put_table, tmp_path):
    rows = [row(s, "base") for s in "ab"] + [row(s, "p", steps=90) for s in "ab"]
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    Comparison.of(rows, 5, "base", "a command", "1").write(sweep)
    readme, other = tmp_path / "baselines/README.md", tmp_path / "README.md"
    untouched = other.read_text()
    assert put_table.main(str(sweep), "test") == 0
    begin, end = marks_of("test")
    inside = readme.read_text().split(begin)[1].split(end)[0]
    assert "| `p` | 2/2 | 0 | 1.00 |" in inside
    assert "bound" not in inside  # nothing has one
    assert readme.read_text().count("old") == len(put_table.MARKS) - 1
    assert other.read_text() == untouched
    assert not (tmp_path / "picture.png").exists()


def test_tables_of_flights_in_wind_say_how_much_was_covered_and_who_came_home(put_table, tmp_path):
    rows = [row(s, "base") for s in "ab"] + [row(s, "p", steps=90) for s in "ab"]
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    Comparison.of([*rows, failed_row("a", "q")], 5, "base", "a command", "1").write(sweep)
    assert put_table.main(str(sweep), "strong") == 0
    begin, end = marks_of("strong")
    inside = (tmp_path / "baselines/README.md").read_text().split(begin)[1].split(end)[0]
    headings = inside.splitlines()[3]
    assert "| all home | violations | breaches | covered, % |" in headings
    assert "bound" not in headings
    assert "| `base` | 2/2 | 2/2 | 0 | 0 | 100.0 [100.0, 100.0] |  |  |" in inside
    assert "| `q` | 0/1 | 0/1 | 0 | 0 | 0.0 |" in inside


@pytest.mark.parametrize("content", ["", "{", "[]", "{}", '{"reference": "p", "scores": [{}]}'])
def test_a_damaged_table_is_named_and_changes_nothing(put_table, tmp_path, capsys, content):
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    Comparison.of([row()], 1, "p", "a command", "1").write(sweep)
    (sweep / "table.json").write_text(content)
    before = (tmp_path / "README.md").read_text()
    assert put_table.main(str(sweep)) == 2
    assert "table.json: was damaged" in capsys.readouterr().err
    assert (tmp_path / "README.md").read_text() == before


def test_flights_of_a_planner_are_a_median_and_a_range_and_one_flight_is_itself(put_table):
    flights = [("far", 9, 4.0, False), ("near", 7, 3.0, True), ("near", 8, 1.0, True)]
    rows = [
        SimpleNamespace(label=label, steps=steps, energy_Wh=energy_Wh, accomplished=accomplished)
        for label, steps, energy_Wh, accomplished in [*flights, ("near", 20, 2.0, True)]
    ]
    lines = put_table.spread_table(rows, "compare").splitlines()
    assert lines[0] == "`compare`"
    assert lines[-2:] == [
        "| `near` | 3 of 3 | 8 (7 to 20) | 2.00 (1.00 to 3.00) |",
        "| `far` | 0 of 1 | 9 | 4.00 |",
    ]


def test_fronts_are_a_row_for_each_mission_and_what_was_not_accomplished_has_no_figures(put_table):
    flights = [("b", "0.4", 9, 4.0, True), ("b", "20", 30, 3.0, False), ("a", "0.6", 7, 2.5, True)]
    rows = [
        SimpleNamespace(
            label=f"trajectory+weight_energy-{weight}+planned_orders-3",
            scenario=scenario,
            steps=steps,
            energy_Wh=energy_Wh,
            accomplished=accomplished,
        )
        for scenario, weight, steps, energy_Wh, accomplished in flights
    ]
    lines = put_table.fronts_table(rows, "compare").splitlines()
    assert lines[0] == "`compare`"
    assert lines[-2:] == ["| a | – | 7 steps, 2.50 Wh | – |", "| b | 9 steps, 4.00 Wh | – | – |"]
