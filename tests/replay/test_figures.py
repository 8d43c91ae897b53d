"""Figures for print: what they hold, and that they are vector files."""

import dataclasses
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.patches import Rectangle

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES, DecisionRecord, load_planner, rollout
from uas_coverage_env.replay.figures import (
    KINDS,
    WIDTH_IN,
    battery_figure,
    decision_time_figure,
    learning_curve,
    look,
    map_figure,
    modes_figure,
    save_figure,
    training_figure,
    with_baselines,
)
from uas_coverage_env.replay.figures.battery import published_battery
from uas_coverage_env.scenario import Sensor, generate_scenario


def lines(axes) -> list[np.ndarray]:
    return [line.get_xydata() for line in axes.get_lines()]


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_is_a_vector_file_that_repeats_to_the_byte(kind, flight, tmp_path):
    figures = [KINDS[kind](flight) for _ in range(2)]
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


def test_the_map_shows_what_was_flown_and_predicted_until_a_step(flight):
    (axes,) = map_figure(flight, step=25).axes
    drawn = lines(axes)
    for i in range(2):
        path = flight.x[:26, i, [1, 0]]
        assert any(line.shape == path.shape and (line == path).all() for line in drawn)
        rows = flight.plan[(flight.plan["step"] == 25) & (flight.plan["uas"] == i)]
        predicted = rows["position_m"][:, [1, 0]]
        assert any(line.shape == predicted.shape and (line == predicted).all() for line in drawn)
    assert f"{flight.covered[25]} of 49" in axes.get_title()
    assert {"uas_1", "uas_2"} <= {text.get_text() for text in axes.texts}


def test_the_map_shows_the_last_sample_by_default(flight):
    (axes,) = map_figure(flight).axes
    assert f"{flight.time_s[-1]:g} s" in axes.get_title()


def test_the_map_shows_the_ground_that_a_camera_has_seen(flight):
    assert "seen by" not in str([text.get_text() for text in map_figure(flight).legends[0].texts])
    camera = Sensor(name="camera", field_of_view_deg=(60.0, 45.0))
    fleet = tuple(
        uas.model_copy(update={"sensors": (camera,)} if i == 0 else {})
        for i, uas in enumerate(flight.scenario.uas)
    )
    seen = dataclasses.replace(flight, scenario=flight.scenario.model_copy(update={"uas": fleet}))
    texts = [text.get_text() for text in map_figure(seen).legends[0].texts]
    assert any(text.startswith("seen by camera, ") for text in texts)


def test_the_map_has_north_heights_and_a_legend_of_all_that_is_on_it(flight):
    figure = map_figure(flight, step=25)
    texts = [text.get_text() for text in figure.axes[0].texts]
    heights = {f"{np.ptp(hull.vertices_m[:, 2]):.0f} m" for hull in flight.scenario.hulls}
    assert "N" in texts
    assert heights <= set(texts)
    entries = [text.get_text() for text in figure.legends[0].texts]
    kinds = {item.kind.replace("_", " ") for item in flight.scenario.obstacles}
    assert {"waypoint", "weighs more", "covered", "flown", "predicted", "water"} | kinds <= {
        *entries
    }
    assert len(entries) == len(set(entries))


def entries_at(flight, step):
    return {text.get_text() for text in map_figure(flight, step=step).legends[0].texts}


def test_the_legend_says_only_what_is_on_the_map_at_its_sample(flight):
    charge = {"charged", "medium", "discharged"}
    assert charge | {"geofence", "height", "predicted"} <= entries_at(flight, 25)
    elsewhere = dataclasses.replace(flight, plan=flight.plan[flight.plan["step"] != 25])
    assert "predicted" not in entries_at(elsewhere, 25)
    mode = np.full_like(flight.mode, MODES.index("landed"))
    mode[:, 1] = MODES.index("lost")
    over = entries_at(dataclasses.replace(flight, mode=mode), 25)
    assert not charge & over
    assert {"landed", "lost"} <= over


def test_the_path_of_a_moving_obstacle_is_drawn_once_it_has_moved(flight):
    moved_m = flight.moving_position_m.copy()
    moved_m[10:, 0, 0] += 50.0
    moved = dataclasses.replace(flight, moving_position_m=moved_m)
    assert "its path" not in entries_at(moved, 5)
    assert "its path" in entries_at(moved, 25)
    drawn = lines(map_figure(moved, step=25).axes[0])
    assert any(np.array_equal(line, moved_m[:26, 0, [1, 0]]) for line in drawn)


@pytest.mark.parametrize("kind", KINDS)
def test_figures_are_as_wide_as_asked_and_narrow_ones_hold_their_legends(kind, flight):
    with look(width_in=88 / 25.4):
        figure = KINDS[kind](flight)
    assert figure.get_size_inches()[0] == pytest.approx(88 / 25.4)
    figure.canvas.draw()
    for legend in figure.legends:
        box = legend.get_window_extent()
        assert box.x0 >= 0
        assert box.x1 <= figure.bbox.x1
    assert KINDS[kind](flight).get_size_inches()[0] == pytest.approx(WIDTH_IN)


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


def test_a_step_that_was_not_flown_is_refused(flight):
    with pytest.raises(InputError, match="samples 0 to 60"):
        map_figure(flight, step=61)


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


@pytest.fixture(scope="module")
def swarm():
    """Thirty UAS, the second half of which has landed after two steps."""
    town = generate_scenario(seed=5, n_uas=30, n_waypoints=60, n_obstacles=5)
    flown = rollout(town, load_planner("hover"), max_steps=4)
    mode = flown.mode.copy()
    mode[2:, 15:] = MODES.index("landed")
    return dataclasses.replace(flown, mode=mode)


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


def test_of_many_uas_no_name_lies_on_another_on_the_map(swarm):
    x = swarm.x.copy()
    x[:, :, :2] = 0.2 * x[:, :, :2]
    figure = map_figure(dataclasses.replace(swarm, x=x))
    figure.draw_without_rendering()
    names = [text for text in figure.axes[0].texts if text.get_text().isdigit()]
    assert 5 < len(names) < 30, "those without a place are left out"
    boxes = [name.get_window_extent() for name in names]
    for i, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[:i]), names[i].get_text()


def test_of_many_uas_each_name_stands_beside_its_uas(swarm):
    figure = map_figure(swarm)
    figure.draw_without_rendering()
    (axes,) = figure.axes
    most_px = 20.0 / 72.0 * figure.dpi
    for text in axes.texts:
        if text.get_text().isdigit():
            (i,) = (i for i, name in enumerate(swarm.names) if name == f"uas_{text.get_text()}")
            place_px = axes.transData.transform(swarm.x[-1, i, [1, 0]])
            box = text.get_window_extent()
            nearest_px = np.clip(place_px, box.min, box.max)
            assert np.hypot(*(nearest_px - place_px)) < most_px, text.get_text()


def test_ticks_are_no_larger_than_the_waypoints_that_they_are_in(swarm):
    x = swarm.x.copy()
    for i, waypoint in enumerate(swarm.scenario.waypoints[:15]):
        x[2, i, :3] = waypoint.position_m
    (axes,) = map_figure(dataclasses.replace(swarm, x=x)).axes
    axes.figure.draw_without_rendering()
    radius_m = min(waypoint.radius_m for waypoint in swarm.scenario.waypoints)
    px = np.diff(axes.transData.transform([(0.0, 0.0), (2 * radius_m, 0.0)])[:, 0]).item()
    ticks_pt = [
        line.get_markersize() for line in axes.get_lines() if str(line.get_marker()) == "$✓$"
    ]
    assert len(ticks_pt) >= 15
    assert max(ticks_pt) < 72.0 / axes.figure.dpi * px


def test_a_long_title_has_as_many_lines_as_the_width_asks_for(swarm):
    widest = {}
    for width_in in (3.4, 6.3):
        with look(width_in):
            lines = map_figure(swarm).axes[0].get_title().split("\n")
        widest[len(lines)] = max(map(len, lines))
    assert set(widest) == {1, 2}
    assert widest[2] < 0.75 * widest[1]


@pytest.mark.parametrize("edge", ["upper", "lower"])
def test_of_many_uas_no_name_stands_outside_the_frame(swarm, edge):
    """Three rows of them along an edge of the fence, where names would fit outside only."""
    north_m = swarm.scenario.fence.vertices_m[:, 0]
    x = swarm.x.copy()
    rows_m = np.linspace(0.0, 10.0, x.shape[1])
    x[:, :, 0] = north_m.max() - rows_m if edge == "upper" else north_m.min() + rows_m
    figure = map_figure(dataclasses.replace(swarm, x=x))
    figure.draw_without_rendering()
    frame = figure.axes[0].get_window_extent()
    names = [text for text in figure.axes[0].texts if text.get_text().isdigit()]
    assert names
    for name in names:
        box = name.get_window_extent()
        halo = 2.0
        assert box.y0 > frame.y0 - halo, name.get_text()
        assert box.y1 < frame.y1 + halo, name.get_text()


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
