"""The script that publishes a comparison in the READMEs."""

import importlib.util
from pathlib import Path

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.leaderboard import Comparison, write

ROOT = Path(__file__).parents[2]


@pytest.fixture
def put_table(tmp_path, monkeypatch):
    spec = importlib.util.spec_from_file_location("put_table", ROOT / "benchmarks/put_table.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    for name in ("README.md", "baselines/README.md"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(f"before\n{module.BEGIN}old\n{module.END}after\n")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    monkeypatch.setattr(module, "PICTURE", tmp_path / "picture.png")
    return module


def test_tables_and_picture_go_between_the_marks_as_often_as_one_likes(put_table, tmp_path):
    rows = [row(s, "base") for s in "ab"] + [row(s, "p", steps=90) for s in "ab"]
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    write(Comparison.of([*rows, failed_row("a", "q")], 5, "base", "a command", "1"), sweep)
    for _ in range(2):
        assert put_table.main(str(sweep)) == 0
    short = (tmp_path / "README.md").read_text()
    assert short.startswith("before\n")
    assert short.endswith("after\n")
    assert "old" not in short
    assert short.count("`a command`") == 1
    assert "| `p` | 2/2 | 0 | 1 | +0.0 [+0.0, +0.0] | -10.0 [-10.0, -10.0] |" in short
    assert "| `q` | 0/1 | 0 | – | – | – |" in short
    assert (sweep / "table.md").read_text().strip() in (
        tmp_path / "baselines/README.md"
    ).read_text()
    assert (tmp_path / "picture.png").read_bytes() == (sweep / "coverage-energy.png").read_bytes()


def test_a_readme_without_marks_is_left_alone(put_table, tmp_path, capsys):
    (tmp_path / "baselines/README.md").write_text("mine")
    sweep = tmp_path / "sweep"
    sweep.mkdir()
    write(Comparison.of([row()], 1, "p", "a command", "1"), sweep)
    assert put_table.main(str(sweep)) == 2
    assert "has no <!-- leaderboard -->" in capsys.readouterr().err
    assert (tmp_path / "baselines/README.md").read_text() == "mine"
    assert put_table.main(str(tmp_path / "nowhere")) == 2
