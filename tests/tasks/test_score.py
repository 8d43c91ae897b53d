"""Scores: one formula, anchors that are published, a folder that a kill does not harm."""

import json
import math

import numpy as np
import pytest
from uas_coverage_env.tasks.store import FILE, ScoreStore

from uas_coverage_env import InputError
from uas_coverage_env.cli import main
from uas_coverage_env.flight.evaluation import Episode
from uas_coverage_env.flight.metrics import available_Wh
from uas_coverage_env.tasks import LEVELS, anchors_of, level_named, mission_value, score, seeds_of
from uas_coverage_env.tasks import scoring as module
from uas_coverage_env.tasks.scoring import MissionScore, scored
from uas_coverage_env.tasks.table import cells, markdown


def mission(seed, value, **changes):
    usual = {
        "episode_return": 1.0, "coverage": 1.0, "energy_share": 0.2, "lost": 0, "home": 1,
        "n_uas": 1, "steps": 9,
    }  # fmt: skip
    return MissionScore(seed, value, usual | changes)


def episode(**changes):
    usual = {"coverage": 1.0, "energy_share": 0.0, "n_uas": 1, "home": 1, "lost": 0}
    return Episode(0, "", {}, usual | changes)


def test_the_value_of_a_mission_is_its_formula():
    value = mission_value(episode(coverage=0.5, energy_share=0.4))
    assert value == pytest.approx(0.5 * (1.0 - 0.2))
    assert mission_value(episode(home=0, lost=1)) == 0.0
    assert mission_value(episode(coverage=0.0)) == 0.0


def test_what_batteries_may_give_is_what_they_give_in_flight():
    # one that hovers until it must land has drawn about that
    scenario = level_named("easy").scenario(seeds_of("test")[0])
    uas, vehicle = scenario.uas[0], scenario.vehicles[0]
    usable_Ah = (uas.soc_0 - 0.25) * vehicle.battery.capacity_Ah
    assert 3.5 * 4 * usable_Ah < available_Wh(scenario) < 4.2 * 4 * usable_Ah


def test_the_anchors_score_0_and_1():
    for level in LEVELS:
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


def test_a_policy_is_scored_and_what_is_known_is_not_flown_again():
    flown = []
    first = score(lambda seen: 0, "easy", missions=1, split="validation", on_mission=flown.append)
    assert [one.seed for one in flown] == [seeds_of("validation")[0]]
    assert first.missions[0].coverage == 1.0
    assert first.missions[0].home == 1
    again = score(lambda seen: 1 / 0, "easy", missions=1, split="validation", known=first.missions)
    assert again == first


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


def test_a_folder_of_scores_goes_on_after_a_kill(tmp_path):
    store = ScoreStore(tmp_path)
    seeds = seeds_of("test")
    for seed in seeds[:2]:
        store.add("easy", "mine", mission(seed, 0.5))
    path = tmp_path / FILE
    path.write_text(path.read_text() + '{"level": "ea')  # a kill in the middle of a line
    again = ScoreStore(tmp_path)
    assert again.missions("easy", "mine") == store.missions("easy", "mine")
    again.add("easy", "mine", mission(seeds[2], 0.25))
    assert len(path.read_text().splitlines()) == 3
    assert ScoreStore(tmp_path).missions("easy", "mine")[2].value == 0.25
    assert ScoreStore(tmp_path).planners("easy") == ("mine",)


def test_scores_of_a_version_that_said_player_are_read(tmp_path):
    flown = mission(seeds_of("test")[0], 0.5)
    ScoreStore(tmp_path).add("easy", "mine", flown)
    path = tmp_path / FILE
    path.write_text(path.read_text().replace('"planner"', '"player"'))
    assert ScoreStore(tmp_path).missions("easy", "mine") == (flown,)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"value": "much"}, "value is 'much'"),
        ({"value": math.nan}, "value is nan"),
        ({"seed": -1}, "mission -1 of easy is another one"),
        ({"level": "none"}, "level is 'none'"),
        ({"scenario_sha256": "0"}, "is another one now"),
        ({"surplus": 1}, "no scored mission"),
    ],
)
def test_a_damaged_line_is_refused_by_its_number(tmp_path, change, reason):
    ScoreStore(tmp_path).add("easy", "mine", mission(seeds_of("test")[0], 0.5))
    path = tmp_path / FILE
    path.write_text(json.dumps(json.loads(path.read_text()) | change) + "\n")
    with pytest.raises(InputError, match=f"line 1.*{reason}"):
        ScoreStore(tmp_path)


def test_a_table_has_the_best_planner_first():
    scores = {
        "worse": scored("easy", [mission(1, 0.1, home=0)]),
        "better": scored("easy", [mission(1, 0.6)]),
    }
    assert [row[0] for row in cells(scores)] == ["better", "worse"]
    assert "| 1 of 1 |" in markdown(scores)


def test_the_command_prints_a_table_and_flies_nothing_twice(tmp_path, capsys, monkeypatch):
    asked = ["score", "--level", "easy", "--planners", "hover", "--missions", "1"]
    asked += ["--split", "validation", "--out", str(tmp_path)]
    assert main(asked) == 0
    first = capsys.readouterr().out
    assert "UASCoverage/Easy-v0, validation missions" in first
    assert "| hover |" in first
    monkeypatch.setattr(module, "evaluate", lambda *args, **more: 1 / 0)
    assert main(asked) == 0
    assert capsys.readouterr().out == first


def test_the_former_name_of_the_option_says_what_it_is_called_now(tmp_path, capsys):
    asked = ["score", "--level", "easy", "--missions", "1", "--split", "validation"]
    assert main([*asked, "--players", "hover", "--out", str(tmp_path)]) == 0
    told = capsys.readouterr()
    assert "--players is called --planners now" in told.err
    assert "| hover |" in told.out


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
