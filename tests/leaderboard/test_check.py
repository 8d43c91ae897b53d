"""`uas-coverage compare --check`: each flight is judged by the independent checker."""

import dataclasses

import numpy as np
import pytest

from uas_coverage_env.cli import main
from uas_coverage_env.flight import Flight, rollout
from uas_coverage_env.leaderboard import Row, flying
from uas_coverage_env.leaderboard.check import verdict_on
from uas_coverage_env.runner.store import rows_in
from uas_coverage_env.scenario import load_scenario
from uas_coverage_env.world import Velocity


class Outwards:
    """Flies through the fence."""

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return {name: Velocity(-10.0, 0.0, 5.0) for name in swarm.active}


@pytest.fixture
def flight(yard) -> Flight:
    return rollout(load_scenario(yard), "lawnmower")


def test_the_checker_agrees_with_a_flight_as_it_was_flown(flight):
    assert verdict_on(flight) == "agrees"


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (lambda f: {"breaches": f.breaches + 1}, "breaches is 0, the summary says 1"),
        (lambda f: {"covered": f.covered - 1}, "coverage is 1.0, the summary says 0.5"),
        (lambda f: {"voltage_V": f.voltage_V * 2, "current_A": f.current_A * 2}, "violations are"),
        (lambda f: {"x": f.x + np.eye(14)[0] * 5.0}, "left does not begin at its start"),
    ],
)
def test_it_says_in_what_it_disagrees(flight, changes, said):
    assert said in verdict_on(dataclasses.replace(flight, **changes(flight)))


def test_files_that_do_not_fit_together_are_a_disagreement(flight, tmp_path):
    folder = flight.save(tmp_path / "flight")
    (folder / "plan.csv").write_text("t_s,uas,n,x_m,y_m,z_m\n0,nobody,0,1,1,1\n")
    verdict = verdict_on(flight, folder)
    assert verdict.startswith("cannot be judged: ")
    assert "unknown UAS 'nobody'" in verdict


def test_a_contact_is_no_disagreement_and_events_are_not_judged(flight):
    lost = rollout(flight.scenario, Outwards())
    assert lost.violations
    assert verdict_on(lost) == "agrees"
    scenario = flight.scenario
    data = scenario.model_dump(mode="json", by_alias=True)
    data["events"] = [{"kind": "uas_lost", "uas": "left", "at_s": 5.0}]
    eventful = rollout(type(scenario).model_validate(data), "hover", max_steps=8)
    assert verdict_on(eventful).startswith("not judged: events happen in it")


def test_a_sweep_is_judged_flight_by_flight_also_when_it_was_flown_before(
    yard, tmp_path, capsys, monkeypatch
):
    words = ["compare", "--scenarios", str(yard), "--planners", "lawnmower,hover", "--no-bounds"]
    words += ["--seeds", "0:1", "--jobs", "1", "--out", str(tmp_path / "sweep")]
    assert main(words) == 0
    assert [row.verdict for row in rows_in(tmp_path / "sweep", Row)] == [None, None]
    assert "check disagrees" not in capsys.readouterr().out
    judged = iter(("agrees", "energy_Wh is 1.0, the summary says 2.0"))
    monkeypatch.setattr(flying, "verdict_on", lambda flight: next(judged))
    assert main([*words, "--check"]) == 1
    out, err = capsys.readouterr()
    assert "disagrees with the independent checker on 1 flight (first: yard" in err
    assert "energy_Wh is 1.0, the summary says 2.0" in err
    assert "check disagrees" in out
    rows = rows_in(tmp_path / "sweep", Row)
    (other,) = [row for row in rows if row.disagrees]
    kept = tmp_path / "sweep" / "flights" / f"yard-{other.label}-0"
    assert Flight.load(kept).planner == other.planner
    assert "disagrees with the independent checker" in (tmp_path / "sweep/table.md").read_text()
    assert main([*words, "--check"]) == 1, "what was judged is not flown again"
    assert "2 of 2 flights are there" in capsys.readouterr().out
