"""Scores: one formula, anchors that are published, a folder that a kill does not harm."""

import dataclasses

import numpy as np
import pytest
from leaderboard_rows import flights_in, row

from uas_coverage_env.cli import main
from uas_coverage_env.cli import score as command
from uas_coverage_env.files.errors import PlannerError
from uas_coverage_env.flight.metrics import available_Wh
from uas_coverage_env.leaderboard import flying
from uas_coverage_env.tasks import level_named, score, seeds_of
from uas_coverage_env.tasks import scoring as module
from uas_coverage_env.tasks.levels import level_names
from uas_coverage_env.tasks.scoring import MissionScore, anchors_of, scored
from uas_coverage_env.tasks.table import cells, markdown


def mission(seed, value, **changes):
    usual = {
        "episode_return": 1.0, "coverage": 1.0, "energy_share": 0.2, "lost": 0, "home": 1,
        "n_uas": 1, "steps": 9,
    }  # fmt: skip
    return MissionScore(seed, value, usual | changes)


def test_the_value_of_a_mission_is_its_formula():
    def value(**figures):
        return MissionScore.of(row(energy_share=0.4, **figures)).value

    assert value(coverage=0.5) == pytest.approx(0.5 * (1.0 - 0.2))
    assert value(coverage=0.0) == value(home=0) == 0.0
    assert MissionScore.of(row(n_uas=2, home=1, energy_share=7.0)).value == 0.25, (
        "energy counts for half at most"
    )


def test_what_batteries_may_give_is_what_they_give_in_flight():
    # one that hovers until it must land has drawn about that
    scenario = level_named("easy").scenario(seeds_of("test")[0])
    uas, vehicle = scenario.uas[0], scenario.vehicles[0]
    usable_Ah = (uas.soc_0 - 0.25) * vehicle.battery.capacity_Ah
    assert 3.5 * 4 * usable_Ah < available_Wh(scenario) < 4.2 * 4 * usable_Ah


def test_the_anchors_score_0_and_1():
    for level in level_names():
        anchors = anchors_of(level)
        if anchors is None:
            continue
        assert 0.0 <= anchors.random < anchors.best <= 1.0
        for value, expected in ((anchors.random, 0.0), (anchors.best, 1.0)):
            found = scored(level, [mission(k, value) for k in range(4)]).score
            assert found.value == pytest.approx(expected, abs=1e-12)


def test_a_score_is_the_interquartile_mean_with_an_interval(monkeypatch):
    monkeypatch.setattr(module, "anchors_of", lambda level: module.Anchors(0.2, 0.7, "tour", 4))
    values = [0.0, 0.3, 0.4, 0.9]
    found = scored("easy", [mission(k, value) for k, value in enumerate(values)]).score
    assert found.value == pytest.approx((np.mean([0.3, 0.4]) - 0.2) / 0.5)
    assert found.low <= found.value <= found.high


def test_the_interval_of_several_trainings_is_over_trainings(monkeypatch):
    monkeypatch.setattr(module, "anchors_of", lambda level: module.Anchors(0.0, 1.0, "tour", 4))
    trainings = [(0.2, 0.3, 0.2, 0.3), (0.7, 0.8, 0.7, 0.8)]
    flown = [mission(k, value) for values in trainings for k, value in enumerate(values)]
    found = scored("easy", flown).score
    assert found.value == pytest.approx(0.5)
    assert (found.low, found.high) == (pytest.approx(0.25), pytest.approx(0.75))


def test_a_policy_is_scored_and_each_mission_is_told():
    told = []
    found = score(lambda seen: 0, "easy", missions=1, split="validation", on_mission=told.append)
    assert [one.seed for one in told] == [seeds_of("validation")[0]]
    assert found.missions == tuple(told)
    assert (told[0].coverage, told[0].home) == (1.0, 1)


def test_what_a_policy_raises_reaches_who_scores_it():
    with pytest.raises(PlannerError, match=r"ZeroDivisionError.*test_score\.py"):
        score(lambda seen: 1 / 0, "easy", missions=1, split="validation")


def test_a_random_policy_repeats():
    assert score("random", "easy", missions=1) == score("random", "easy", missions=1)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"level": "none"}, "it is one of"),
        ({"missions": 0}, "missions is 0"),
        ({"missions": 51}, "missions is 51"),
        ({"split": "exam"}, "split is 'exam'"),
        ({"return_mode": False}, "says it itself"),
    ],
)
def test_what_cannot_be_scored_is_refused(arguments, reason):
    with pytest.raises(ValueError, match=reason):
        score(**{"planner": "hover", "level": "easy", **arguments})


def test_a_table_has_the_best_planner_first():
    scores = {
        "worse": scored("easy", [mission(1, 0.1, home=0)]),
        "better": scored("easy", [mission(1, 0.6)]),
    }
    assert [row[0] for row in cells(scores)] == ["better", "worse"]
    assert "| 1 of 1 |" in markdown(scores)


def asked(out, *more, planners="hover"):
    words = ["score", "--level", "easy", "--planners", planners, "--split", "validation"]
    return [*words, "--missions", "2", "--jobs", "1", "--out", str(out), *more]


def test_the_command_prints_a_table_and_flies_nothing_twice(tmp_path, capsys, monkeypatch):
    assert main(asked(tmp_path)) == 0
    first = capsys.readouterr().out.partition("UASCoverage")[2]
    assert first.startswith("/Easy-v0, validation missions")
    assert "| hover |" in first
    monkeypatch.setattr(flying, "rollout", lambda *args, **more: 1 / 0)
    assert main(asked(tmp_path)) == 0
    assert capsys.readouterr().out.partition("UASCoverage")[2] == first


def test_planners_levels_and_missions_are_added_to_a_folder(tmp_path, capsys):
    assert main(asked(tmp_path)) == 0
    before = flights_in(tmp_path)
    assert main(asked(tmp_path, planners="random,hover")) == 0
    assert "2 of 4 flights are there" in capsys.readouterr().out
    after = flights_in(tmp_path)
    assert [one for one in after if one.label == "hover"] == before
    assert {(one.level, one.label) for one in after} == {("easy", "hover"), ("easy", "random")}
    mine = [one.episode_return for one in after if one.label == "random"]
    alone = score("random", "easy", missions=2, split="validation").missions
    assert mine == [one.episode_return for one in alone]


def test_a_planner_that_has_changed_is_not_mixed_with_the_one_of_before(
    tmp_path, capsys, monkeypatch
):
    assert main(asked(tmp_path)) == 0
    capsys.readouterr()
    changed = command.spec_of("hover", level_named("easy"))
    changed = dataclasses.replace(changed, options={"climb_m": 7.0})
    monkeypatch.setattr(command, "spec_of", lambda name, task: changed)
    assert main(asked(tmp_path)) == 2
    said = capsys.readouterr().err
    assert "flown with another scenario, options, weights or version; give another --out" in said
    assert main(asked(tmp_path, "--overwrite")) == 0


def test_a_mission_that_cannot_be_flown_is_worth_nothing_and_said(tmp_path, capsys, monkeypatch):
    (tmp_path / "refusing_planner.py").write_text(
        "class Refuses:\n"
        "    def reset(self, brief, seed):\n"
        "        raise ValueError('no map of this place')\n\n"
        "    def act(self, swarm):\n"
        "        return {}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert main(asked(tmp_path / "out", planners="refusing_planner:Refuses")) == 1
    out, err = capsys.readouterr()
    assert "no map of this place" in err
    assert "| refusing_planner:Refuses |" in out
    assert "| 0.000 | 0.0 | 2 of 2 |" in out


def test_the_folder_of_another_command_and_scores_of_0_3_0_are_refused(tmp_path, capsys):
    (tmp_path / "old" / "test").mkdir(parents=True)
    (tmp_path / "old" / "test" / "scores.jsonl").write_text("{}")
    assert main(asked(tmp_path / "old")) == 2
    assert "holds test/scores.jsonl of version 0.3.0 or older" in capsys.readouterr().err
    assert (
        main(
            [
                "planner",
                "demonstrate",
                "open_field",
                "--planner",
                "hover",
                "--jobs",
                "1",
                "--out",
                str(tmp_path / "shown"),
            ]
        )
        == 0
    )
    capsys.readouterr()
    assert main(asked(tmp_path / "shown")) == 2
    assert "holds the flights of another command" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("--level", "none"), "--level 'none'"),
        (("--level", ""), "--level '': names none"),
        (("--planners", ","), "--planners ',': names none"),
        (("--planners", "nobody"), "unknown planner 'nobody'"),
        (("--split", "training"), "--split 'training'"),
        (("--missions", "51"), "--missions 51"),
    ],
)
def test_mistakes_are_answered_in_one_line(tmp_path, capsys, arguments, reason):
    assert main(["score", "--out", str(tmp_path), *arguments]) == 2
    told = capsys.readouterr().err
    assert reason in told
    assert len(told.splitlines()) == 1
