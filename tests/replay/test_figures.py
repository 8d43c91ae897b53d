"""Figures for print: what they hold, and that they are vector files."""

import dataclasses
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from drawn_lines import lines
from matplotlib.patches import Rectangle

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES
from uas_coverage_env.flight.record import DecisionRecord
from uas_coverage_env.replay.figure_kinds import KINDS, figure_of
from uas_coverage_env.replay.figures import (
    battery_figure,
    decision_time_figure,
    modes_figure,
    save_figure,
    training_figure,
)
from uas_coverage_env.replay.figures.battery import published_battery
from uas_coverage_env.replay.figures.style import WIDTH_IN, look
from uas_coverage_env.replay.figures.training import learning_curve, with_baselines


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_a_vector_file_that_repeats_to_the_byte(kind, flight, tmp_path):
    figures = [figure_of(kind)(flight) for _ in range(2)]
    for suffix, start in ((".pdf", b"%PDF"), (".svg", b"<?xml")):
        files = [tmp_path / f"{n}{suffix}" for n in (1, 2)]
        for figure, file in zip(figures, files, strict=True):
            save_figure(figure, file)
        assert files[0].read_bytes().startswith(start)
        assert files[0].read_bytes() == files[1].read_bytes()
        assert b"<image" not in files[0].read_bytes()


def test_figures_leave_the_settings_of_matplotlib_alone(flight, tmp_path):
    before = dict(mpl.rcParams)
    save_figure(modes_figure(flight), tmp_path / "modes.svg")
    assert dict(mpl.rcParams) == before


@pytest.mark.parametrize("kind", KINDS)
def test_figures_are_as_wide_as_asked_and_narrow_ones_hold_their_legends(kind, flight):
    with look(width_in=88 / 25.4):
        figure = figure_of(kind)(flight)
    assert figure.get_size_inches()[0] == pytest.approx(88 / 25.4)
    figure.canvas.draw()
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
    assert figure_of(kind)(flight).get_size_inches()[0] == pytest.approx(WIDTH_IN)


def test_a_style_wins_over_ours_and_only_where_it_is_asked_for(flight, tmp_path):
    path = tmp_path / "paper.mplstyle"
    path.write_text('# ours\nlines.linewidth: 3.25  # wide\naxes.edgecolor: "#112233"\n')
    for style, width in ((str(path), 3.25), (None, 1.1)):
        with look(style=style):
            soc, *_ = battery_figure(flight).axes
        assert soc.get_lines()[-2].get_linewidth() == width


@pytest.mark.parametrize(("style", "drawn"), [(None, True), ("grayscale", False), ("ggplot", True)])
def test_a_style_without_a_grid_has_none_behind_its_curves(flight, style, drawn):
    with look(style=style):
        axes = battery_figure(flight).axes[0]
    assert any(line.get_visible() for line in axes.get_xgridlines()) is drawn


@pytest.mark.parametrize(
    ("style", "message"),
    [
        ("ggplott", "unknown style 'ggplott'; did you mean ggplot"),
        ("missing.mplstyle", "missing.mplstyle: no such file"),
        ("broken.mplstyle", "broken.mplstyle, line 1, font.size: .*large and red"),
        (
            "typo.mplstyle",
            "typo.mplstyle, line 2: unknown key 'lines.linewdith'; .*lines.linewidth",
        ),
        ("colon.mplstyle", "colon.mplstyle, line 1: 'font.size 9' has no colon; write KEY: VALUE"),
        ("bytes.mplstyle", "bytes.mplstyle: is no style of matplotlib"),
    ],
)
def test_a_style_that_cannot_be_taken_is_told_in_a_line(style, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("broken.mplstyle").write_text("font.size: large and red\n")
    Path("typo.mplstyle").write_text("font.size: 9  # points\nlines.linewdith: 2\n")
    Path("colon.mplstyle").write_text("font.size 9\n")
    Path("bytes.mplstyle").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match=message) as refusal, look(style=style):
        pass
    assert "\n" not in str(refusal.value)


def test_the_first_decision_does_not_set_the_axis(plain):
    times_s = [30.0, *np.linspace(0.2, 0.4, plain.steps - 1)]
    decisions = tuple(DecisionRecord(time_s) for time_s in times_s)
    series, _ = decision_time_figure(dataclasses.replace(plain, decisions=decisions)).axes
    assert 0.4 < series.get_ylim()[1] < 0.5
    assert any("first: 30.0 s" in text.get_text() for text in series.texts)


def test_the_battery_figure_holds_our_curves_and_the_published_ones(flight):
    soc, voltage, current = battery_figure(flight).axes
    table = published_battery()
    airborne = int(np.count_nonzero(table["current_uas2_A"]))
    for axes, ours, name, scale in (
        (soc, flight.soc, "soc_uas2", 100.0),
        (voltage, flight.voltage_V, "voltage_uas2_V", 1.0),
        (current, flight.current_A, "current_uas2_A", 1.0),
    ):
        series = [line[:, 1] for line in lines(axes)]
        # the last sample has no current: nothing is decided there
        assert any(np.array_equal(line, scale * ours[:-1, 1]) for line in series)
        assert any(np.array_equal(line, scale * table[name][:airborne]) for line in series)
    assert soc.get_ylabel() == "State of charge, %"


def test_of_many_uas_the_battery_figure_shows_least_median_and_span(swarm):
    soc, voltage, _ = battery_figure(swarm).axes
    least, median = (line[:, 1] for line in lines(soc)[:2])
    airborne = np.arange(4)[:, None] < swarm.last_sample
    flown = np.where(airborne, 100.0 * swarm.soc[:4], np.nan)
    assert np.array_equal(least, np.nanmin(flown, axis=1))
    assert median == pytest.approx(np.nanmedian(flown, axis=1))
    assert len(voltage.get_lines()) == 2


def test_of_many_uas_the_modes_figure_counts_how_many_do_what(swarm):
    _, counts = modes_figure(swarm).axes
    landed = counts.collections[MODES.index("landed")]
    heights = [np.ptp(np.asarray(path.vertices)[:, 1]) for path in landed.get_paths()]
    assert max(heights) == 15.0
    assert counts.get_ylabel() == "UAS"
    assert modes_figure(swarm).get_size_inches()[1] < 6.0


def test_the_published_curves_are_drawn_beside_the_village_alone(flight):
    elsewhere = dataclasses.replace(
        flight, scenario=flight.scenario.model_copy(update={"name": "meadow"})
    )

    def count(figure):
        return len(figure.axes[1].get_lines())

    assert count(battery_figure(flight)) == 4
    assert count(battery_figure(elsewhere)) == 2
    assert count(battery_figure(elsewhere, published=True)) == 4
    assert count(battery_figure(flight, published=False)) == 2


def test_the_published_curves_are_those_that_the_battery_is_tested_against():
    tests = Path(__file__).parents[1] / "paper" / "fig3_battery_reference.csv"
    table = np.genfromtxt(tests, delimiter=",", names=True)
    assert table.dtype.names is not None
    assert {name: table[name].tolist() for name in table.dtype.names} == {
        name: values.tolist() for name, values in published_battery().items()
    }


def test_the_modes_fill_the_time_of_every_uas(flight):
    mode = flight.mode.copy()
    mode[40:, 0] = MODES.index("return")
    mode[50:, 0] = MODES.index("lost")
    coverage, bars = modes_figure(dataclasses.replace(flight, mode=mode)).axes
    widths = {0.0: [], 1.0: []}
    for patch in bars.patches:
        assert isinstance(patch, Rectangle)
        widths[round(patch.get_y() + patch.get_height() / 2)].append(patch.get_width())
    assert widths == {0.0: [40.0, 10.0, 10.0], 1.0: [60.0]}
    assert np.asarray(coverage.get_lines()[0].get_ydata()).tolist() == flight.covered.tolist()


def test_decision_times_are_drawn_with_fallbacks_and_the_limit(flight):
    decisions = [DecisionRecord(0.5 + 0.01 * k, fallback=k in (7, 9)) for k in range(60)]
    figure = decision_time_figure(
        dataclasses.replace(
            flight, decisions=tuple(decisions), planner_options={"time_limit_s": 1.0}
        )
    )
    series, shares = figure.axes
    durations = [decision.duration_s for decision in decisions]
    assert any(np.array_equal(line[:, 1], durations) for line in lines(series))
    assert any(line[:, 0].tolist() == [7, 9] for line in lines(series)), "the fallbacks"
    assert any((line[:, 1] == 1.0).all() for line in lines(series)), "the limit"
    assert series.get_ylabel() == "Decision time, s"
    assert "50 %: 0.795" in {text.get_text() for text in shares.texts}


@pytest.mark.parametrize("width_in", [6.3, 3.4])
def test_panels_of_decision_times_are_wide_enough_for_their_words(plain, width_in):
    decisions = tuple(DecisionRecord(3.7e-5 + 1e-6 * k) for k in range(plain.steps))
    with look(width_in=width_in):
        figure = decision_time_figure(dataclasses.replace(plain, decisions=decisions))
        figure.draw_without_rendering()
    _, shares = figure.axes
    panel = shares.get_window_extent()
    assert len(shares.texts) == 2
    for text in shares.texts:
        assert panel.x0 <= text.get_window_extent().x0, text.get_text()


def test_fast_decisions_are_counted_in_milliseconds(plain):
    # as on an idle machine
    decisions = tuple(DecisionRecord(0.002) for _ in plain.decisions)
    series, _ = decision_time_figure(dataclasses.replace(plain, decisions=decisions)).axes
    assert series.get_ylabel() == "Decision time, ms"


def test_a_flight_without_decisions_has_no_decision_times(plain):
    with pytest.raises(InputError, match="no decision"):
        decision_time_figure(dataclasses.replace(plain, decisions=()))


CURVE = """steps,process_s,wall_s,coverage,all_home,violations,energy_Wh,flight_steps
0,0.1,0.2,0.25,0.5,1.5,60.0,400.0
1000000,9.0,9.0,1.0,1.0,0.0,30.0,200.0
"""


def curve_in(directory, text=CURVE):
    directory.mkdir(exist_ok=True)
    (directory / "learning_curve.csv").write_text(text)
    return directory


def test_trainings_are_drawn_side_by_side_in_panels_of_their_own(tmp_path):
    later = CURVE.replace("30.0", "25.0")
    runs = {
        "seed 0": learning_curve(curve_in(tmp_path / "a")),
        "seed 1": learning_curve(curve_in(tmp_path / "b", later)),
    }
    figure = training_figure(runs)
    coverage, violations, energy, duration = figure.axes
    for axes, first, second in (
        (coverage, [25.0, 100.0], [25.0, 100.0]),
        (violations, [1.5, 0.0], [1.5, 0.0]),
        (energy, [60.0, 30.0], [60.0, 25.0]),
        (duration, [400.0, 200.0], [400.0, 200.0]),
    ):
        assert [line[:, 0].tolist() for line in lines(axes)] == [[0.0, 1.0]] * 2
        assert [line[:, 1].tolist() for line in lines(axes)] == [first, second]
    (legend,) = figure.legends
    assert [text.get_text() for text in legend.get_texts()] == ["seed 0", "seed 1"]
    styles = {line.get_linestyle() for line in coverage.get_lines()}
    assert len(styles) == 2, "told apart without colour"


def test_the_return_has_a_panel_where_all_tables_have_it_and_planners_are_level_lines(tmp_path):
    head, *rows = CURVE.splitlines()
    paid = "\n".join([f"{head},return", *(f"{row},{k}.5" for k, row in enumerate(rows))]) + "\n"
    once = "\n".join(paid.splitlines()[:2]) + "\n"
    runs = {
        "seed 0": learning_curve(curve_in(tmp_path / "a", paid)),
        "tour": learning_curve(curve_in(tmp_path / "b", once)),
    }
    figure = training_figure(runs)
    returns = figure.axes[4]
    assert returns.get_ylabel() == "Return"
    learned, level = returns.get_lines()
    assert list(learned.get_ydata()) == [0.5, 1.5]
    assert list(level.get_ydata()) == [0.5, 0.5]
    without = training_figure({**runs, "old": learning_curve(curve_in(tmp_path / "c"))})
    assert "Return" not in [axis.get_ylabel() for axis in without.axes]


def test_baselines_beside_trainings_are_drawn_once_unless_they_flew_other_missions(tmp_path):
    once = "\n".join(CURVE.splitlines()[:2])
    for name in "abc":
        curve_in(tmp_path / name)
        folder = tmp_path / name / "baselines"
        folder.mkdir()
        curve_in(folder / "tour", once if name < "c" else once.replace("60.0", "61.0"))
    runs = with_baselines({name: tmp_path / name for name in "abc"})
    assert list(runs) == ["a", "b", "c", "tour", "tour, c"]
    assert [len(curve["coverage"]) for curve in runs.values()] == [2, 2, 2, 1, 1]
    assert list(with_baselines({"": tmp_path / "a"})) == ["a", "tour"]
    assert list(with_baselines({"": curve_in(tmp_path / "d")})) == [""]


def test_the_steps_of_a_short_training_are_counted_in_thousands(tmp_path):
    curve = learning_curve(curve_in(tmp_path))
    short = {**curve, "steps": [0.0, 4_160.0]}
    for run, last, unit in ((curve, 1.0, "million"), (short, 4.16, "thousand")):
        axes = training_figure({"": run}).axes[-1]
        assert lines(axes)[0][-1, 0] == pytest.approx(last)
        assert axes.get_xlabel() == f"Flown steps learned from, {unit}"


def test_a_training_alone_needs_no_legend(tmp_path):
    assert not training_figure({"": learning_curve(curve_in(tmp_path))}).legends


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (CURVE.replace("60.0", "nan"), "line 2, energy_Wh: 'nan' should be a finite number"),
        (CURVE.replace("60.0", "much"), "line 2, energy_Wh: 'much'"),
        ("\n".join([*CURVE.splitlines()[:2], "5"]), "line 3, coverage: None"),
        (CURVE.replace("coverage", "cover"), "no column coverage"),
        (CURVE.splitlines()[0], "no row"),
        ("", "no row"),
    ],
)
def test_a_curve_that_is_none_is_refused(text, message, tmp_path):
    with pytest.raises(InputError, match=message):
        learning_curve(curve_in(tmp_path, text))
