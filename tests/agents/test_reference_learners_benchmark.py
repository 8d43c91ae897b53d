"""The benchmark of learners and their variants: what is trained, and what is published."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("torch")

from uas_coverage_agents.training import curve
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.packed import PackedPpo
from uas_coverage_agents.training.settings import settings_of

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

import reference_learners

PAGE = "before\n<!-- {0} -->\nold\n<!-- end of {0} -->\nafter\n"
MINE = """
algorithm = "packed-ppo"
num_envs = 2
total_timesteps = 320
rounds = 1
environment = { version = "v1", action = "waypoint" }
learning = { n_steps = 8, hidden = [8], missions = 2 }
"""


@pytest.fixture
def page(tmp_path, monkeypatch):
    monkeypatch.setattr(curve, "write", curve.write_table)
    monkeypatch.setattr(reference_learners, "DOCS", tmp_path)
    monkeypatch.chdir(tmp_path)
    Path("mine.toml").write_text(MINE)
    return tmp_path / "page.md"


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["reference_learners.py", *words])
    return reference_learners.main()


@pytest.mark.parametrize("learner", reference_learners.VARIANTS)
def test_each_variant_can_be_trained_and_is_another_one(learner):
    shipped = settings_of(learner)
    found = [shipped]
    for meaning, *changes in reference_learners.VARIANTS[learner].values():
        assert meaning
        settings = settings_of(learner, changes=changes)
        assert settings not in found
        PackedPpo(settings, Missions.of(settings), 0)
        found.append(settings)


def test_learners_and_their_variants_are_trained_scored_and_published(page, monkeypatch, capsys):
    page.write_text(PAGE.format("mine: easy"))
    cautious = "it is paid for coming home alone", "environment.reward_weights={coverage=0.0}"
    monkeypatch.setitem(reference_learners.VARIANTS, "mine", {"cautious": cautious})
    asked = ["--learners", "mine.toml", "--share", "0.1", "--seeds", "2", "--missions", "3"]
    more = ["--variants", "all", "--publish", "mine: {}", "--out", str(page.parent / "here")]
    assert run(monkeypatch, *asked, *more) == 0
    text = page.read_text()
    assert text.startswith("before\n")
    assert text.endswith("after\n")
    assert "old" not in text
    command, _, head, _, *rows = text.splitlines()[3:-3]
    wanted = "--learners mine.toml --variants all --seeds 2 --share 0.1 --missions 3 --out here"
    assert command == f"`python benchmarks/reference_learners.py {wanted}`"
    names = [cell.strip() for cell in head.split("|")[1:-1]]
    assert tuple(names) == reference_learners.HEAD
    shipped, variant = (
        dict(zip(names, (cell.strip() for cell in row.split("|")[1:-1]), strict=True))
        for row in rows
    )
    assert variant["learner"] == "`mine-cautious`: it is paid for coming home alone"
    for row in (shipped, variant):
        assert (row["trainings"], row["missions"]) == ("2", "6")
        assert 32 <= int(row["flown steps"]) < 64
        assert float(row["home, %"]) == 100.0  # return mode is on
    capsys.readouterr()


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (["--levels", "hardest"], "--levels hardest: is none of easy, medium"),
        (["--learners", "ppo", "--variants", "no-scorer"], "--variants no-scorer: ppo has none"),
        (["--publish", "nowhere"], "no page of docs has <!-- nowhere -->"),
    ],
)
def test_what_there_is_not_is_said_before_anything_is_trained(
    page, monkeypatch, capsys, words, line
):
    assert run(monkeypatch, *words) == 2
    said = capsys.readouterr().err
    assert line in said
    assert said.count("\n") == 1
    assert not Path("reference").exists()


def test_what_is_published_has_its_place_on_a_page_of_the_docs():
    for level in ("easy", "medium", "hard", "extreme"):
        assert reference_learners.page_of(f"reference learners: {level}").name == "level_scores.md"
    for mark in ("ppo-waypoint scores", "ppo-waypoint ablation", "ppo-velocity scores"):
        page = reference_learners.page_of(mark)
        assert page.name == "reference_learners.md"
        assert page.read_text("utf-8").count(f"<!-- end of {mark} -->") == 1
