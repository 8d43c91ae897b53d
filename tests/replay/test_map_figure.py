"""The map for print: what it holds, and that it is legible with many UAS."""

import dataclasses

import numpy as np
import pytest
from drawn_lines import lines

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import MODES
from uas_coverage_env.replay.figures import map_figure
from uas_coverage_env.replay.figures.style import look
from uas_coverage_env.scenario import Sensor


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


def test_a_step_that_was_not_flown_is_refused(flight):
    with pytest.raises(InputError, match="samples 0 to 60"):
        map_figure(flight, step=61)


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
    x = swarm.x.copy()
    x[:, :, :2] = 0.4 * x[:, :, :2]
    figure = map_figure(dataclasses.replace(swarm, x=x))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    most_px = 20.0 / 72.0 * figure.dpi
    names = [text for text in axes.texts if text.get_text().isdigit()]
    assert len(names) > 5
    for name in names:
        i = swarm.names.index(f"uas_{name.get_text()}")
        place_px = axes.transData.transform(x[-1, i, [1, 0]])
        box = name.get_window_extent()
        off_px = np.clip(place_px, box.min, box.max) - place_px
        assert np.hypot(*off_px) < most_px, name.get_text()


def test_ticks_are_no_larger_than_the_waypoints_that_they_are_in(swarm):
    x = swarm.x.copy()
    for i, waypoint in enumerate(swarm.scenario.waypoints[:15]):
        x[2, i, :3] = waypoint.position_m
    figure = map_figure(dataclasses.replace(swarm, x=x))
    figure.draw_without_rendering()
    (axes,) = figure.axes
    radius_m = min(waypoint.radius_m for waypoint in swarm.scenario.waypoints)
    px = np.diff(axes.transData.transform([(0.0, 0.0), (2 * radius_m, 0.0)])[:, 0]).item()
    ticks_pt = [
        line.get_markersize() for line in axes.get_lines() if str(line.get_marker()) == "$✓$"
    ]
    assert len(ticks_pt) >= 15
    assert max(ticks_pt) < 72.0 / figure.dpi * px


def test_a_long_title_has_as_many_lines_as_the_width_asks_for(swarm):
    widest = {}
    for width_in in (3.4, 6.3):
        with look(width_in):
            title = map_figure(swarm).axes[0].get_title().split("\n")
        widest[len(title)] = max(map(len, title))
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
