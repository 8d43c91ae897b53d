"""The benchmark of reliability: what it keeps, what it makes again, and what its page says."""

from dataclasses import replace

import numpy as np
import pytest
import robustness
from robustness_rows import (
    ROWS,
    attacks,
    batteries,
    decisions,
    exported,
    faults,
    fuzz,
    judge,
    kills,
    missions,
    mutants,
)
from robustness_rows.page import page
from robustness_rows.row import Finding, Row, Trial
from robustness_rows.store import Store

from uas_coverage_env.files.strict_toml import InputError


def row_of(trials):
    """A row whose trials give what they are asked to give."""
    return Row(
        "R1", "Nothing", "things", "nothing", lambda quick: trials,
        lambda results: Finding(len(results), sum("error" in r for r in results.values())),
        lambda quick: "none", "Everything.",
    )  # fmt: skip


def test_what_was_made_is_kept_and_not_made_again(tmp_path):
    first = Trial("first", dict, ({"x": 1},))
    robustness.make([row_of([first])], True, 1, None, tmp_path)
    changed = [Trial("first", dict, ({"x": 2},)), Trial("second", dict, ({"x": 3},))]
    robustness.make([row_of(changed)], True, 1, None, tmp_path)
    kept = Store(tmp_path, "R1").entries
    assert {key: entry["result"]["x"] for key, entry in kept.items()} == {"first": 1, "second": 3}


def test_after_its_minutes_no_trial_begins(tmp_path):
    stores = robustness.make([row_of([Trial("a", dict, ({},))])], True, 1, 0.0, tmp_path)
    assert not stores["R1"].entries


def test_rows_are_made_side_by_side_so_that_an_end_leaves_each_the_same_share(tmp_path, capsys):
    """Two trials of one row come between the halves of another."""
    few = row_of([Trial(f"few {n}", dict, ({},)) for n in range(2)])
    many = replace(row_of([Trial(f"many {n}", dict, ({},)) for n in range(4)]), name="R2")
    robustness.make([few, many], True, 1, None, tmp_path)
    made = [line.split(" ", 1)[1] for line in capsys.readouterr().err.splitlines()]
    assert made == [
        f"{key}: done" for key in ("few 0", "many 0", "many 1", "few 1", "many 2", "many 3")
    ]


def test_an_exception_is_a_result():
    assert robustness.tried(Trial("a", int, ("x",)))["error"].startswith("ValueError: ")


def test_a_line_that_a_kill_cut_off_is_dropped(tmp_path):
    Store(tmp_path, "R1").add("a", {"x": 1}, "source", "2026-01-01")
    path = tmp_path / "R1.jsonl"
    whole = path.read_text(encoding="utf-8")
    path.write_text(whole + whole[:20], encoding="utf-8")
    assert list(Store(tmp_path, "R1").entries) == ["a"]
    assert path.read_text(encoding="utf-8") == whole


@pytest.mark.parametrize("line", ["[]", "{}", "nonsense", '{"key": "a"}'])
def test_what_is_no_result_is_refused_with_its_line(tmp_path, line):
    (tmp_path / "R1.jsonl").write_text(line + "\n", encoding="utf-8")
    with pytest.raises(InputError, match=r"R1\.jsonl:1: is no result"):
        Store(tmp_path, "R1")


def test_the_page_has_every_row_and_says_what_was_not_made(tmp_path):
    stores = {name: Store(tmp_path, name) for name in ROWS}
    text, failed = page(stores, True)
    assert not failed
    assert text.count("Not made in this run.") == len(ROWS)
    assert set(ROWS) == {f"R{number}" for number in range(1, 14)}
    for name in ROWS:
        assert text.count(f"\n## {name}: ") == 1


def test_the_page_counts_failures_with_their_exact_bound(tmp_path):
    stores = {name: Store(tmp_path, name) for name in ROWS}
    for number in range(10):
        hashes = {"here": "a", "process": "b" if number == 0 else "a"}
        stores["R5"].add(str(number), {"what": "tour", "hashes": hashes}, "abc", "2026-01-01")
    text, failed = page(stores, True)
    assert failed
    # 1 - 0.05 is the chance of more than one in ten at this share
    assert "| R5 | The same seed flies the same | 10 missions | 1 | 39.42% |" in text
    assert "| tour | 10 | 20 | 1 |" in text
    stores["R5"].add("broken", {"error": "RuntimeError: gone"}, "abc", "2026-01-01")
    assert "- `broken`: RuntimeError: gone" in page(stores, True)[0]


def test_the_page_says_how_many_trials_each_source_has_made(tmp_path):
    stores = {name: Store(tmp_path, name) for name in ROWS}
    for number, source in enumerate(("bcd", "abc", "bcd")):
        result = {"what": "tour", "hashes": {"here": "a"}}
        stores["R5"].add(str(number), result, source, "2026-01-01")
    text, _ = page(stores, True)
    assert " 2026-01-01, source abc (1), bcd (2). " in text


def test_a_row_of_which_nothing_is_kept_stays_as_the_page_has_it(tmp_path):
    stores = {name: Store(tmp_path / "first", name) for name in ROWS}
    stores["R5"].add("1", {"what": "tour", "hashes": {"here": "a"}}, "abc", "2026-01-01")
    text, _ = page(stores, True)
    others = {name: Store(tmp_path / "second", name) for name in ROWS}
    assert page(others, True, text)[0] == text
    assert page(others, True)[0] != text


def test_trials_of_a_row_have_keys_of_their_own_and_quick_ones_are_fewer():
    for row in ROWS.values():
        quick, full = ([trial.key for trial in row.trials(size)] for size in (True, False))
        assert len(set(full)) == len(full) > len(quick) == len(set(quick))


@pytest.mark.parametrize("kind", list(faults.KINDS))
def test_a_fault_is_drawn_with_its_seed_and_happens_in_the_mission(kind):
    for seed in range(faults.FIRST_SEED, faults.FIRST_SEED + 3):
        drawn = faults.mission(kind, seed)
        assert drawn == faults.mission(kind, seed)
        assert [event.kind for event in drawn.events] == [kind]


def test_several_events_of_one_mission_are_of_different_kinds_and_come_in_wind():
    for seed in range(faults.FIRST_SEED, faults.FIRST_SEED + 8):
        drawn = faults.mission(faults.SEVERAL, seed)
        assert drawn == faults.mission(faults.SEVERAL, seed)
        kinds = {event.kind for event in drawn.events}
        assert len(kinds) == len(drawn.events) in (2, 3)
        assert drawn.wind is not None
    for seed in (7001, 7009):  # the planner is lost too; and one UAS and the planner
        result = faults.fly(faults.SEVERAL, "nearest-waypoint", seed)
        assert result["as_defined"]
    found = faults.ROW.finding({"a": result, "b": {**result, "as_defined": False}})
    assert (found.trials, found.failures) == (2, 1)
    assert f"| {faults.SEVERAL} | all land that no event takes | 1 of 2 |" in found.table


def test_a_mission_is_counted_by_what_happened_in_it():
    result = missions.fly("nearest-waypoint", "light", 3001, True)
    assert result["accomplished"]
    assert result["coverage"] == 1.0
    assert result["home"] == result["uas"]
    found = missions.ROW.finding({"a": result, "b": {"error": "gone"}})
    assert (found.trials, found.failures) == (2, 1)
    assert "| small | light | `nearest-waypoint` | 1 | 1 | 100.0 |" in found.table


def test_judge_and_checker_agree_on_segments_and_a_difference_would_be_seen():
    for shape in ("hull", "cylinder", "UAS"):
        found = judge.compare(shape, judge.FIRST_SEED)
        assert 0 < found["contacts"] < found["segments"]
        assert found["apart"] == 0
        assert found["worst_m"] < 1e-9
    off = {"a": {**found, "apart": 2}}
    assert judge.ROW.finding(off).failures == 2


def test_the_battery_of_a_flight_is_that_of_its_equations():
    found = batteries.replay("LPV model", batteries.FIRST_SEED)
    assert found["steps"] > 50
    assert found["dod"] < 1e-9
    assert found["V"] < 1e-3
    assert batteries.ROW.finding({"a": found, "b": {**found, "V": 1.0}}).failures == 1


def test_decisions_are_timed_one_by_one_and_late_ones_counted():
    found = decisions.decide("nearest-waypoint", decisions.FIRST_SEED)
    assert len(found["cpu_s"]) > 50
    late = {"planner": "milp-mpc", "cpu_s": [0.1, 1.4, 1.6]}
    row = decisions.ROW.finding({"a": found, "b": late})
    assert (row.trials, row.failures) == (3, 1)
    assert f"| `nearest-waypoint` | {len(found['cpu_s'])} |" in row.table


def test_an_export_that_is_off_has_failed():
    good, bad = [30.0, 0.001, 0.002], [20.0, 0.001, 0.02]
    assert exported.ROW.finding({"a": {"missions": [good, bad]}}).failures == 1
    assert (
        "| .plan, by MAVSDK | 2 | 50 | 0.10 |"
        in exported.ROW.finding({"a": {"missions": [good, bad]}}).table
    )


@pytest.mark.parametrize("seed", range(4))
def test_hostile_calls_are_refused_and_leave_no_trace(seed):
    found = attacks.attack(attacks.FIRST_SEED + seed)
    tally = found["tally"]
    assert tally["refused"] == tally["calls"] > 5
    assert tally["traces"] == tally["not finite"] == tally["episodes failed"] == 0
    row = attacks.attacks_found({"a": found, "b": {"error": "gone"}})
    assert (row.trials, row.failures) == (20, 10)
    assert f"| {found['action']} | 10 |" in row.table


def test_flights_that_are_ended_leave_nothing_or_a_whole_flight(monkeypatch):
    monkeypatch.setattr(kills, "KILLS_OF_A_TRIAL", 2)
    found = kills.killed("SIGTERM", kills.FIRST_SEED)
    whole = kills.ROW.finding({"a": found})
    assert (whole.trials, whole.failures) == (2, 0), whole.table
    found["kills"][0] |= {"crashed": True, "code": -11, "said": "Fatal error"}
    found["kills"][1]["left"] = "damaged"
    broken = kills.ROW.finding({"a": found})
    assert (broken.trials, broken.failures) == (2, 2)
    assert "flight 0: code -11" in broken.table


def test_damaged_files_differ_from_the_whole_one_and_repeat_with_their_seed():
    text = b"[table]\nkey = 1.5\nother = [1, 2]\n" * 5
    first, again, other = (
        [fuzz.damaged(np.random.default_rng(seed), text) for _ in range(1)] for seed in (1, 1, 2)
    )
    assert first == again != other
    assert first != [text]
    for kind in ("vehicle", "training configuration"):
        result = fuzz.try_files(kind, 1)
        assert sum(result["tally"].values()) == fuzz.FILES_OF_A_TRIAL
        assert not result["failures"]


def test_the_files_that_are_mutated_and_the_tests_named_for_them_exist():
    for each in mutants.TABLE["files"]:
        assert (mutants.ROOT / each["path"]).is_file(), each["path"]
        assert each["tests"], each["path"]
        for test in each["tests"]:
            assert (mutants.ROOT / test.partition("::")[0]).is_file(), test
    of_files = [each["path"] for each in mutants.TABLE["files"]]
    assert len(set(of_files)) == len(of_files)
    for each in mutants.TABLE["equivalent"]:
        assert each["mutant"].partition(":")[0] in of_files
        assert each["why"]


def test_a_mutant_is_caught_or_the_same_or_counts_against_the_row():
    same = mutants.TABLE["equivalent"][0]["mutant"]
    path = same.partition(":")[0]
    results = {
        "as it is": {"path": path, "mutant": None},
        "a": {"path": path, "mutant": "a", "caught": True},
        "b": {"path": path, "mutant": "b", "caught": False},
        "c": {"path": path, "mutant": same, "caught": False},
        "d": {"error": "RuntimeError: its tests fail without a mutant"},
    }
    found = mutants.finding(results)
    assert (found.trials, found.failures) == (4, 2)
    assert f"| `{path}` | 3 | 1 | 1 | 1 | 50% |" in found.table
    assert "- not caught: b" in found.table
