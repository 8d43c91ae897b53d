"""Walls with doors become boxes and lintels when a file is read."""

from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env import scenario as room
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.scenario.walls import Door, Wall
from uas_coverage_env.simulation import World

TEXT = (Path(room.__file__).parent / "open_field.toml").read_text(encoding="utf-8")
WALL = """
[[walls]]
from_m = [20.0, 100.0]
to_m = [120.0, 100.0]
thickness_m = 2.0
height_m = 30.0
safe_distance_m = 1.0
doors = [
  { at_m = 60.0, width_m = 20.0, height_m = 12.0 },
  { at_m = 20.0, width_m = 10.0 },
]
"""


def read(tmp_path, text):
    path = tmp_path / "mission.toml"
    path.write_text(TEXT + text, encoding="utf-8")
    return load_scenario(path)


def test_a_wall_is_a_box_beside_each_door_and_a_lintel_above_it(tmp_path):
    scenario = read(tmp_path, WALL)
    spans = {
        obstacle.name: (np.min(obstacle.vertices_m, axis=0), np.max(obstacle.vertices_m, axis=0))
        for obstacle in scenario.obstacles
    }
    expected = {
        # north from, to, height from, to; the doors are numbered along the wall
        "wall_1_before_door_1": (20.0, 35.0, 0.0, 30.0),
        "wall_1_after_door_1": (45.0, 70.0, 0.0, 30.0),
        "wall_1_above_door_2": (70.0, 90.0, 12.0, 30.0),
        "wall_1_after_door_2": (90.0, 120.0, 0.0, 30.0),
    }
    assert {name: (lo[0], hi[0], -hi[2], -lo[2]) for name, (lo, hi) in spans.items()} == expected
    assert {(lo[1], hi[1]) for lo, hi in spans.values()} == {(99.0, 101.0)}
    assert {obstacle.safe_distance_m for obstacle in scenario.obstacles} == {1.0}
    assert scenario.walls == ()


def test_a_wall_at_an_angle_is_as_long_and_as_thick_as_it_says():
    wall = Wall(
        from_m=(0.0, 0.0), to_m=(30.0, 40.0), thickness_m=2.0, height_m=3.0, safe_distance_m=0.0
    )
    (box,) = wall.obstacles("w")
    assert box.name == "w"
    along, across = np.array([0.6, 0.8, 0.0]), np.array([-0.8, 0.6, 0.0])
    assert np.ptp(box.vertices_m @ along) == pytest.approx(50.0)
    assert np.ptp(box.vertices_m @ across) == pytest.approx(2.0)
    assert box.hull.signed_distance([15.0, 20.0, -1.0]) == pytest.approx(-1.0)


def test_a_door_at_the_end_of_a_wall_leaves_no_piece_without_length():
    wall = Wall(
        name="hall", from_m=(0.0, 0.0), to_m=(4.0, 0.0), thickness_m=0.1, height_m=2.5,
        safe_distance_m=0.1, doors=(Door(at_m=0.5, width_m=1.0, height_m=2.5),),
    )  # fmt: skip
    assert [box.name for box in wall.obstacles("wall_7")] == ["hall_after_door_1"]


def test_the_file_that_is_written_has_boxes_and_reads_back_as_the_same_mission(tmp_path):
    scenario = read(tmp_path, WALL)
    scenario.to_file(tmp_path / "again.toml")
    text = (tmp_path / "again.toml").read_text(encoding="utf-8")
    assert "[[walls]]" not in text
    assert load_scenario(tmp_path / "again.toml") == scenario
    assert scenario.model_copy(update={"name": "other"}).obstacles == scenario.obstacles
    data = scenario.model_dump(mode="json", by_alias=True)
    assert len(data["obstacles"]) == 4
    assert Scenario.model_validate_json(scenario.model_dump_json(by_alias=True)) == scenario


def test_routes_turn_in_the_middle_of_a_door(tmp_path):
    scenario = read(tmp_path, WALL)
    assert scenario.doors_m == ((80.0, 100.0), (40.0, 100.0))
    nodes_m = World(scenario).arena.nodes_m.tolist()
    assert [40.0, 100.0] in nodes_m
    assert [60.0, 100.0] not in nodes_m


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("at_m = 60.0", "at_m = 95.0", "doors[0] goes from 85 to 105 m along a wall that is 100 m"),
        ("at_m = 20.0", "at_m = 4.0", "doors[1] goes from -1 to 9 m"),
        ("at_m = 20.0", "at_m = 48.0", "doors[0] begins at 50 m, before doors[1] ends at 53 m"),
        ("height_m = 12.0", "height_m = 31.0", "doors[0].height_m 31 is more than the wall's"),
        ("thickness_m = 2.0", "thickness_m = 0.0", "thickness_m: should be greater than or equal"),
        ("width_m = 10.0", "width_m = 0", "doors[1].width_m: should be greater than or equal"),
        ("to_m = [120.0, 100.0]", "to_m = [21.0, 100.0]", "from_m and to_m are 1 m apart"),
        ("to_m = [120.0, 100.0]", "to_m = [120.0]", "to_m"),
        ("at_m = 20.0", "at = 20.0", "doors[1].at: unknown key; did you mean at_m?"),
    ],
)
def test_what_is_wrong_with_a_wall_is_one_line_that_names_it(tmp_path, old, new, expected):
    assert old in WALL
    with pytest.raises(InputError) as caught:
        read(tmp_path, WALL.replace(old, new))
    line = str(caught.value)
    assert len(line.splitlines()) == 1
    assert "walls[0]" in line
    assert expected in line


def test_a_wall_that_ends_where_the_next_one_of_the_same_name_begins_is_refused(tmp_path):
    named = WALL.replace("[[walls]]", '[[walls]]\nname = "north"')
    with pytest.raises(InputError, match="'north_before_door_1' is used twice"):
        read(tmp_path, named + named)
