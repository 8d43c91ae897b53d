import shutil
import sys
from pathlib import Path

import numpy as np
import pytest
from tiny_policies import write
from uas_coverage_agents.policy import load_policy
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.checkpoint import CurvePoint
from uas_coverage_agents.training.score import MEASURES

from uas_coverage_env import generate_scenario

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import end_to_end
import learners


@pytest.fixture
def readme(tmp_path, monkeypatch) -> Path:
    path = tmp_path / "README.md"
    path.write_text("before\n<!-- ppo -->\nold\n<!-- end of ppo -->\nafter\n")
    monkeypatch.setattr(learners, "README", path)
    monkeypatch.setattr(learners, "PICTURES", tmp_path / "pictures")
    return path


def test_a_report_takes_the_place_of_the_former_one(readme):
    learners.put("ppo", "new")
    learners.put("ppo", "newer")
    text = readme.read_text()
    assert text == "before\n<!-- ppo -->\n\nnewer\n\n<!-- end of ppo -->\nafter\n"
    with pytest.raises(ValueError, match="has no <!-- dqn -->"):
        learners.put("dqn", "new")
    assert readme.read_text() == text


def test_what_is_published_has_its_place_on_its_page():
    text = learners.README.read_text(encoding="utf-8")
    assert text.count(f"<!-- {learners.NAME} -->") == 1
    assert text.count(f"<!-- end of {learners.NAME} -->") == 1


def test_a_report_tells_what_was_flown_with_and_without_the_assistants(readme, tmp_path):
    directory = tmp_path / "learned-velocity-0"
    shutil.copytree(learners.SHIPPED, directory / "policy")
    point = CurvePoint(
        steps=0, process_s=0, wall_s=0, coverage=0, all_home=1, violations=0,
        energy_Wh=1, flight_steps=9,
    )  # fmt: skip
    later = point.model_copy(update={"steps": 100, "coverage": 0.5})
    curve.write([point, later], directory)
    assert curve.read(directory) == [point, later]
    towns = [generate_scenario(900_600, n_uas=1, n_waypoints=2, n_obstacles=1)]
    reference = learners.flown_by("nearest-waypoint", towns)
    assert reference[0, MEASURES.index("coverage")] == 1.0
    text = learners.report([directory], towns, reference)
    assert "`nearest-waypoint` | " in text
    assert "| before training | " in text
    assert "| seed 0 = `learned-velocity` |" in text
    assert "| seed 0, filter off |" in text
    assert "| seed 0, filter and return mode off |" in text
    assert (tmp_path / "pictures" / "learning-route-velocity.png").exists()


def test_means_stand_with_their_intervals_and_differences_in_percent(tmp_path):
    write(tmp_path / "policy")
    reference = np.tile([1.0, 1.0, 0.0, 20.0, 100.0, 0.125], (4, 1))
    result = reference.copy()
    result[:, MEASURES.index("energy_Wh")] = [18.0, 22.0, 16.0, 16.0]
    row = learners.table_row("seed 0", load_policy(tmp_path / "policy"), result, reference)
    cells = [cell.strip() for cell in row.strip("|").split("|")]
    assert len(cells) == learners.table_head().splitlines()[1].count("|") - 1
    assert cells[2] == "100.00"
    assert cells[5] == "12.5"
    assert cells[6].startswith("18.00 [16.")
    assert cells[8].startswith("-10.0 [-2")
    assert cells[9] == "0.0"


def test_what_flies_alone_is_told_for_ever_more_obstacles():
    assert not end_to_end.towns_of("none", 1)[0].obstacles
    assert 5 <= len(end_to_end.towns_of("5 to 20", 1)[0].obstacles) <= 20
    town = generate_scenario(900_600, n_uas=1, n_waypoints=2, n_obstacles=0)
    result = end_to_end.flown([town])
    assert result[0, :3].tolist() == [100.0, 100.0, 0.0]
    cells = end_to_end.row("none", result).strip("|").split("|")
    assert len(cells) == len(end_to_end.HEAD)
