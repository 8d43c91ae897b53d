"""The page of levels: its lines learn, and its table is that of the code."""

from typing import Any

import pytest
from markdown_blocks import ROOT, blocks

from uas_coverage_env.tasks import LEVELS

PAGE = ROOT / "docs" / "levels.md"


def test_the_lines_for_newcomers_run():
    pytest.importorskip("stable_baselines3")
    (block,) = [block for block in blocks(PAGE) if "PPO(" in block.text]
    lines = [line for line in block.text.splitlines() if line.strip()]
    assert len(lines) <= 15
    text = block.text
    for usual, short in (
        ("100_000", "64"),
        ('device="cpu"', 'device="cpu", n_steps=64'),
        ("missions=10", "missions=1"),
    ):
        assert usual in text
        text = text.replace(usual, short)
    names: dict[str, Any] = {"__name__": "page"}
    exec(compile(text, str(PAGE), "exec"), names)
    assert names["model"].num_timesteps == 64


@pytest.mark.parametrize("task", LEVELS.values(), ids=LEVELS)
def test_the_table_says_what_a_level_is(task):
    (row,) = [
        line for line in PAGE.read_text("utf-8").splitlines() if line.startswith(f"| `{task.id}` |")
    ]
    _, missions, assistants, action, disturbances = row.strip("| ").split(" | ")
    size = task.families[0].size
    for family in task.families:
        assert family.size == size
        assert f"`{family.draw.__name__.replace('_', '-')}`" in missions
    assert missions.count("`") == 2 * len(task.families)
    if size.n_uas != (1, 1):
        assert missions.startswith(f"{size.n_uas[0]} to {size.n_uas[1]} UAS")
        assert f"{size.n_waypoints[0]} to {size.n_waypoints[1]} waypoints" in missions
    assert ("return mode" in assistants) == task.return_mode
    assert ("safety filter" in assistants) == task.safety_filter
    assert action == f"`{task.action}`"
    assert disturbances.startswith(task.disturbances or "none")
    assert ("both vehicles" in missions) == (len(size.vehicles) == 2)
