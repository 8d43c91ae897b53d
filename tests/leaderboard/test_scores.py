"""What the rows say about a planner."""

import json

import pytest
from leaderboard_rows import failed_row, row
from small_worlds import meadow, waypoint

from uas_coverage_env.cli import compare
from uas_coverage_env.cli.output import console
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Figure
from uas_coverage_env.leaderboard import (
    Comparison,
    Row,
    bounds_of,
    leaderboard_figure,
    read_comparison,
    scores_of,
)
from uas_coverage_env.leaderboard.row import FLOWN
from uas_coverage_env.leaderboard.scores import Flights, Scores, _of_figure
from uas_coverage_env.leaderboard.table import (
    NOTHING,
    cells,
    markdown,
    notes,
    scenarios_cells,
)
from uas_coverage_env.runner.store import opened
from uas_coverage_env.runner.workers import Workers


def by_label(rows, reference="base"):
    return {one.label: one for one in scores_of(rows, reference)}


def test_a_violating_flight_has_no_energy_and_no_part_in_pairs():
    rows = [
        row("a", "base", energy_Wh=20.0),
        row("b", "base", energy_Wh=30.0),
        row("a", "p", energy_Wh=10.0),
        row("b", "p", energy_Wh=1.0, violations=2, accomplished=False, all_home=False),
    ]
    one = by_label(rows)["p"]
    assert (one.energy_Wh.value, one.energy_Wh.n) == (10.0, 1)
    assert (one.violations, one.violating, one.accomplished, one.all_home) == (2, 1, 1, 1)
    assert one.energy_difference_percent.value == pytest.approx(-50.0)
    assert one.energy_difference_percent.n == 1
    assert one.improves_energy.value == 0.5, "better on a; worse than any on b"


def test_a_failed_flight_covers_nothing_and_the_rest_is_still_counted():
    rows = [row("a", "base"), row("a", "p"), failed_row("b", "p"), row("b", "base")]
    one = by_label(rows)["p"]
    assert (one.flights, one.failed, one.accomplished) == (2, 1, 1)
    assert one.coverage_percent.value == 50.0
    assert one.worst_coverage_percent == 0.0
    assert one.decision_p50_ms == 1.0
    assert one.steps.n == 1


def test_what_the_filter_replaced_is_averaged_over_the_flights_there_are():
    rows = [
        *(row("a", "base"), row("a", "p", filtered_share=0.1), row("b", "p", filtered_share=0.2)),
        failed_row("c", "p"),
    ]
    assert by_label(rows)["p"].filtered_percent == pytest.approx(15.0)
    nothing = by_label([row("a", "base"), failed_row("a", "p")])["p"]
    assert nothing.filtered_percent is None


def test_energy_per_percent_leaves_out_planners_that_covered_nothing():
    rows = [
        row("a", "p", coverage=0.5, accomplished=False),
        row("b", "p", coverage=0.0, accomplished=False),
    ]
    one = by_label(rows, "p")["p"]
    assert (one.Wh_per_percent.value, one.Wh_per_percent.n) == (0.2, 1)
    assert one.steps.value is None


def test_a_planner_that_accomplishes_more_comes_first_then_one_that_needs_less():
    rows = [
        row("a", "base"),
        row("a", "idle", coverage=0.0, energy_Wh=1.0, accomplished=False),
        row("a", "thrifty", energy_Wh=8.0),
        failed_row("a", "broken"),
    ]
    order = [one.label for one in scores_of(rows, "base")]
    assert order == ["thrifty", "base", "idle", "broken"]


def test_pairs_are_flights_of_the_same_scenario_and_seed():
    rows = [
        *(row("a", "base", seed, energy_Wh=10.0 + seed) for seed in range(3)),
        *(row("a", "p", seed, energy_Wh=5.0 + 0.5 * seed) for seed in (2, 1, 7)),
    ]
    one = by_label(rows)["p"]
    assert one.energy_difference_percent.n == 2
    assert one.energy_difference_percent.value == pytest.approx(-50.0)
    assert one.steps_difference_percent.value == 0.0


def test_a_reference_that_has_not_flown_yet_leaves_the_comparison_empty():
    one = by_label([row("a", "p")], "base")["p"]
    assert one.improves_energy.value is None
    assert one.relative_energy_percent.value is None


def test_cells_say_nothing_where_there_is_nothing_to_say():
    rows = [failed_row("a", "p"), row("a", "q|r", violations=1, accomplished=False)]
    headings, lines = cells(scores_of(rows, "p"), "outcome")
    text = markdown((headings, lines))
    assert all(len(line) == len(headings) for line in lines)
    assert "nan" not in text
    assert r"q\|r" in text
    assert scenarios_cells(rows, ["p", "q|r", "s"])[1] == [["a", "failed", "violation", NOTHING]]


def test_energy_is_compared_with_the_bound_where_there_is_one():
    rows = [row("a", energy_Wh=12.0, steps=90), row("b", energy_Wh=30.0), row("c", energy_Wh=9.0)]
    rows += [row("a", "q", accomplished=False, steps=90)]
    scores = {one.label: one for one in scores_of(rows, "p", {("a", 90): 10.0, ("b", 100): 20.0})}
    assert scores["p"].above_bound_percent.value == pytest.approx(35.0)
    assert scores["p"].above_bound_percent.n == 2
    assert scores["q"].above_bound_percent.value is None
    headings, lines = cells(list(scores.values()), "effort")
    assert lines[0][headings.index("above the bound, %")].startswith("35.0")


def test_accomplished_lpv_flights_have_a_bound():
    mission = meadow(waypoints=(waypoint((190.0, 190.0, -10.0)),))
    rows = [
        row("meadow", steps=40),
        row("meadow", steps=41, accomplished=False),
        row("meadow", steps=42, dynamics="nonlinear"),
        row("elsewhere"),
    ]
    told = []
    bounds = bounds_of(rows, {"meadow": mission}, Workers(1), lambda *counts: told.append(counts))
    assert list(bounds) == [("meadow", 40)]
    assert told == [(0, 1), (1, 1)]
    assert bounds["meadow", 40] > 0.0


def test_ctrl_c_leaves_out_the_bounds_and_not_what_was_flown(monkeypatch, capsys):
    def stopped(*_, **__):
        raise KeyboardInterrupt

    monkeypatch.setattr(compare, "bounds_of", stopped)
    assert compare.bounds_shown([row("meadow")], {}, console(), Workers(1)) == {}
    assert capsys.readouterr().err.startswith("warning: lower bounds: stopped by hand")


def test_the_files_of_a_comparison_hold_every_flight_and_every_score(tmp_path):
    rows = [
        *(row(s, "base", seed, energy_Wh=20.0 + seed) for s in "ab" for seed in (0, 1)),
        *(row(s, "p", seed) for s in "ab" for seed in (0, 1)),
        failed_row("a", "p", 2),
    ]
    comparison = Comparison.of(rows, 12, "base", "uas-coverage compare ...", "2 flights at a time")
    names = comparison.write(tmp_path)
    assert set(names) <= {path.name for path in tmp_path.iterdir()}
    scores = json.loads((tmp_path / "table.json").read_text())
    assert [one["label"] for one in scores["scores"]] == ["base", "p"]
    assert scores["scores"][0]["energy_Wh"] == {"value": 20.5, "low": 20.0, "high": 21.0, "n": 4}
    header, *lines = (tmp_path / "table.csv").read_text().splitlines()
    assert len(lines) == 2
    assert {"energy_Wh", "energy_Wh_low", "energy_Wh_high"} <= set(header.split(","))
    table = (tmp_path / "table.md").read_text()
    assert "9 flights of 12 (not finished)" in table
    assert "p failed 1 flight (first: a, seed 2): refused" in table
    assert not [path for path in tmp_path.iterdir() if path.name.startswith(".")]


def test_the_picture_is_drawn_for_any_flights(tmp_path):
    rows = [row("a", "base"), failed_row("a", "p"), row("b", "q", violations=1)]
    assert "coverage-energy.png" in Comparison.of(rows, 3, "base", "c", "j").write(tmp_path)
    assert (tmp_path / "coverage-energy.png").read_bytes().startswith(b"\x89PNG")


def test_the_picture_holds_every_flight_and_every_mean():
    rows = [
        *(row(s, "base", energy_Wh=20.0) for s in "ab"),
        *(row(s, "p", energy_Wh=e, coverage=c) for s, e, c in (("a", 10.0, 1.0), ("b", 15.0, 0.5))),
        row("c", "p", violations=1),
    ]
    scores = scores_of(rows, "base")
    figure = leaderboard_figure(scores, rows, "base")
    coverage, energy = figure.axes
    assert [label.get_text() for label in coverage.get_yticklabels()] == ["base", "p"]
    assert coverage.get_ylim() == (1.5, -0.5), "the best on top"

    def dots(axes):
        return [
            sorted(line.get_xdata().tolist())
            for line in axes.get_lines()
            if line.get_marker() == "."
        ]

    def means(axes):
        return [line.get_xdata()[0] for line in axes.get_lines() if line.get_marker() == "D"]

    assert dots(coverage) == [[100.0, 100.0], [50.0, 100.0, 100.0]]
    assert dots(energy) == [[100.0, 100.0], [50.0, 75.0]], "without the flight with a violation"
    assert means(energy) == [one.relative_energy_percent.value for one in scores]
    assert means(coverage) == [one.mean_coverage_percent.value for one in scores]


def kept(rows, directory):
    """What `compare` leaves."""
    with opened(directory, {"command": "compare"}, Row) as store:
        for one in rows:
            store.add(one)
    Comparison.of(rows, 3, rows[0].label, "c", "j").write(directory)


def test_what_is_published_is_read_again(tmp_path):
    rows = [row("a", "base"), failed_row("a", "p"), row("b", "base", energy_Wh=None)]
    kept(rows, tmp_path)
    assert read_comparison(tmp_path) == (rows, "base")


def test_what_is_no_comparison_of_this_version_is_refused(tmp_path):
    with pytest.raises(InputError, match="holds no flights that can be read"):
        read_comparison(tmp_path)
    kept([row("a", "base")], tmp_path)
    table = tmp_path / "table.json"
    table.write_text('{"reference": "nobody"}')
    with pytest.raises(InputError, match="'nobody' has no flight"):
        read_comparison(tmp_path)
    for text in ("{", "[]", "{}"):
        table.write_text(text)
        with pytest.raises(InputError, match=r"table\.json: cannot be read"):
            read_comparison(tmp_path)


def test_the_return_is_that_of_all_flights_there_are_and_says_of_how_many():
    rows = [
        row("a", "p", 0, episode_return=10.0),
        row("a", "p", 1, episode_return=30.0, violations=1, accomplished=False),
        row("a", "p", 2, episode_return=None),
        failed_row("b", "p"),
    ]
    one = by_label(rows, "p")["p"]
    assert (one.episode_return.value, one.episode_return.n) == (20.0, 2)
    assert one.flat()["episode_return_high"] == 30.0
    headings, (line,) = cells([one], "outcome")
    assert line[headings.index("return")] == "20.0 [10.0, 30.0]"


def test_a_note_names_the_planners_that_fly_alike_with_every_seed():
    rows = [
        row("a", label, seed, trajectory_sha256=f"{label}{seed if label == 'random' else ''}")
        for label in ("same", "random")
        for seed in range(2)
    ]
    assert notes(rows, "same")[-1].endswith("one suffices: same.")
    assert not any("suffices" in line for line in notes(rows[:1], "same"))


@pytest.mark.parametrize(
    ("figure", "value", "cell"),
    [
        (Figure("spare_Wh", float, len, ""), 2.0, "2.00 [1.00, 3.00]"),
        (Figure("spare_share", float, len, ""), 200.0, "200.0 [100.0, 300.0]"),
        (Figure("spare_Wh", float, len, "", over="total"), 4.0, "4.00"),
        (Figure("spare_Wh", float, len, "", over="most", digits=0), 3.0, "3"),
        (Figure("spare_Wh", float, len, "", over="least"), 1.0, "1.00"),
        (Figure("wait_s", float, len, "", over="average", unit="ms"), 2000.0, "2000"),
        (Figure("spare_uas", int, len, "", over="total"), 4, "4"),
        (Figure("spare_uas", int, len, "", over="median"), 2.0, "2.0"),
        (Figure("spare", bool, len, ""), 4, "4/2"),
    ],
)
def test_a_figure_is_summed_up_over_flights_as_it_says(figure, value, cell):
    class Flown:
        status = FLOWN

        def __init__(self, found):
            self.found = found

        def __getattr__(self, name):
            return self.found

    column = _of_figure(figure)
    rows = [[Flown(1.0), Flown(3.0)]]
    found = column.of(Flights(rows, rows, "seeds", "seeds", {}))
    assert getattr(found, "value", found) == value
    assert type(getattr(found, "value", found)) is type(value)
    assert column.cell(Scores("p", {column.name: found, "flights": 2})) == cell
