"""`uas-coverage reproduce`, with flights of a few steps."""

import csv
import json

import pytest
import typer
from leaderboard_rows import flights_in
from typer.testing import CliRunner
from uas_coverage_baselines.reproduction import command, sizes, sweeps
from uas_coverage_baselines.reproduction.published import paper_named

from uas_coverage_env import Flight
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario.families.flood_village import flood_village

SOON = {"horizon": 8, "teams": 1, "threads": 1, "return_rule": "vehicle"}


@pytest.fixture(autouse=True)
def little(monkeypatch):
    """The paper's planner on a short horizon, and a single program to solve."""
    paper = paper_named("gasche2025")
    planner = paper.planner.model_copy(update={"options": SOON})
    soon = paper.model_copy(update={"planner": planner})
    monkeypatch.setattr(
        "uas_coverage_baselines.reproduction.published.paper_named", lambda name: soon
    )
    monkeypatch.setattr(sizes, "LEFT_OUT", {"all waypoints": sizes.LEFT_OUT["all waypoints"]})
    monkeypatch.setattr(sweeps, "QUICK", {"N": (8,)})
    monkeypatch.setattr(command, "_QUICK_CAP_S", 0.2)


def reproduce(*arguments):
    app = typer.Typer()
    app.command()(command.reproduce)
    return CliRunner().invoke(app, ["gasche2025", "--jobs", "1", *map(str, arguments)])


def test_flights_of_three_steps_are_written_beside_the_paper_and_leave_every_tolerance(tmp_path):
    out = tmp_path / "out"
    order = ("--quick", "--steps", 3, "--seeds", "5:7", "--out", out)
    result = reproduce(*order)
    assert result.exit_code == 1, result.output
    assert "out of tolerance: steps of uas_1: 3 is -99% of the paper's 247" in result.stderr
    assert "forest area is covered first" in result.stderr

    data = json.loads((out / "reproduction.json").read_text())
    kept = {path.name: Flight.load(path) for path in (out / "flights").iterdir()}
    names = ["gasche2025", "flood-village-5"]
    assert set(kept) == {f"{name}-milp-mpc-0" for name in names}
    assert kept["flood-village-5-milp-mpc-0"].scenario.waypoints == flood_village(5).waypoints
    ours = kept["gasche2025-milp-mpc-0"]
    with (out / "reproduction.csv").open() as file:
        rows = {(row["figure"], row["uas"]): row for row in csv.DictReader(file)}
    assert float(rows["steps", "uas_2"]["paper"]) == 147
    assert float(rows["steps", "uas_2"]["ours"]) == 3
    power_W = ours.voltage_V[:3, 0] * ours.current_A[:3, 0]
    assert float(rows["mean_power_W", "uas_1"]["ours"]) == pytest.approx(power_W.mean())
    assert data["figures"][0]["ours"] == 3
    assert [list(event["flights"]) for event in data["events"]] == [names] * len(data["events"])
    assert {one["symbol"] for one in data["settings"] if not one["within"]} >= {"N", "N_step,max"}
    assert sum(one["rows"] for one in data["sizes"]) > 1000

    page = (out / "reproduction.md").read_text()
    for text in (*data["failures"], "mean power, W", "![fig_1_step_3.png]", "N_step,max"):
        assert text in page
    for picture in ("fig_1_step_3.png", "fig_2_step_3.png", "fig_3_battery.png"):
        assert (out / picture).read_bytes().startswith(b"\x89PNG")

    # the same command flies nothing again; another one does not touch what is there
    flown = flights_in(out)
    again = reproduce(*order)
    assert again.exit_code == 1
    assert "2 of 2 flights are there" in again.output
    assert flights_in(out) == flown
    other = reproduce("--quick", "--steps", 4, "--seeds", "5:7", "--out", out)
    assert isinstance(other.exception, InputError)
    assert "holds the flights of another command" in str(other.exception)


def test_seeds_that_are_none_are_refused_before_anything_is_flown(tmp_path):
    result = reproduce("--seeds", "3", "--out", tmp_path / "out")
    assert isinstance(result.exception, InputError)
    assert "--seeds" in str(result.exception)
    assert not (tmp_path / "out").exists()
