"""Blocks and weights as options: from a file beside the command, an entry point, a number."""

import json
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from practice_missions import mission
from uas_coverage_baselines.milp_mpc import MilpMpc
from uas_coverage_baselines.milp_mpc.model import named_blocks
from uas_coverage_baselines.milp_mpc.model.problem import Weights
from uas_coverage_baselines.milp_mpc.moving_horizon import MovingHorizon

from uas_coverage_env.cli import main
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, load_planner

OWN = '''
"""Blocks of my own."""


class Low:
    """z(n) >= -9."""

    def add_to(self, milp, v, problem):
        milp.subject_to("low", (1.0, v.position[:, 1:, 2:]), lower=-9.0)


class Dear:
    """A price on being east."""

    def add_to(self, milp, v, problem):
        milp.minimize(0.001, v.position[:, 1:, 1])


class Sized:
    """Not to be made without an argument."""

    def __init__(self, size_m):
        self.size_m = size_m

    def add_to(self, milp, v, problem):
        pass


NUMBER = 3
'''


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    """A folder with a module and a mission, as a user has it."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(MovingHorizon, "warm_up", lambda planner, scenario: None)
    (tmp_path / "my_own_blocks.py").write_text(OWN, encoding="utf-8")
    (tmp_path / "my_broken_blocks.py").write_text("import nothing_of_the_kind\n", encoding="utf-8")
    places = [((80.0, 50.0, -18.0), 10.0), ((75.0, 90.0, -20.0), 12.0)]
    mission(places, [(50.0, 50.0, -1.0)]).to_file(tmp_path / "field.toml")
    return tmp_path


def run(*options, planner="milp-mpc", steps=8):
    words = ["run", "field.toml", "--planner", planner, "--steps", str(steps), "--out", "mine"]
    always = ("horizon=8", "teams=1")
    return main(
        [*words, *(word for option in (*always, *options) for word in ("--option", option))]
    )


@pytest.mark.parametrize("order", ["none", "search"])
def test_a_block_of_a_file_beside_the_command_is_flown(order):
    assert (
        run("blocks=my_own_blocks:Low, my_own_blocks:Dear", f"order={order}", "waypoint_sides=12")
        == 0
    )
    flight = Flight.load("mine")
    assert 5.0 < -flight.x[:, 0, 2].min() <= 9.0 + 1e-4
    assert flight.planner_options["blocks"] == ["my_own_blocks:Low", "my_own_blocks:Dear"]
    assert not any(decision.fallback for decision in flight.decisions)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("no_such_module:Low", "there is no module 'no_such_module'"),
        ("my_own_blocks:High", "has no 'High'"),
        ("my_own_blocks:", "should be MODULE:CLASS"),
        ("high", "unknown block 'high'"),
        ("my_own_blocks:NUMBER", "cannot be made"),
        ("my_own_blocks:Sized", "size_m"),
        ("my_broken_blocks:Low", "nothing_of_the_kind"),
    ],
)
def test_a_block_that_cannot_be_had_is_one_line(given, said, capsys):
    assert run(f"blocks={given}") == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert said in err
    assert "option blocks" in err


def test_a_block_is_found_by_the_name_under_which_a_package_announces_it(folder, monkeypatch):
    monkeypatch.syspath_prepend(folder)
    entry = EntryPoint("low", "my_own_blocks:Low", named_blocks.GROUP)
    monkeypatch.setattr(named_blocks, "entry_points", lambda group: [entry])
    assert named_blocks.block_names() == ("low",)
    planner = load_planner("milp-mpc", {"blocks": "low"})
    assert isinstance(planner, MilpMpc)
    assert type(planner.blocks[-1]).__name__ == "Low"
    with pytest.raises(InputError, match=r"unknown block 'hgih'.*low"):
        load_planner("milp-mpc", {"blocks": "hgih"})


@pytest.mark.parametrize("text", ["", "none"])
def test_no_block_is_added_where_none_is_named(text):
    planner = load_planner("milp-mpc", {"blocks": text})
    assert isinstance(planner, MilpMpc)
    assert planner.options.blocks == ()


def test_the_weights_are_options_and_what_is_not_given_stays():
    assert MilpMpc().options.weights == Weights()
    planner = load_planner("milp-mpc", {"weight_energy": "0.5", "weight_return_home": "4"})
    assert isinstance(planner, MilpMpc)
    assert planner.options.weights == Weights(energy=0.5, return_home=4.0)


@pytest.mark.parametrize("given", ["weight_lift=-1", "weight_lift=nan", "weight_lift=much"])
def test_a_weight_that_is_none_is_one_line(given, capsys):
    assert run(given) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert "weight_lift" in err


def test_a_flight_says_why_there_were_fallbacks(capsys):
    words = ["run", "field.toml", "--steps", "3", "--out", "late"]
    assert main([*words, "--option", "time_limit_s=0.000001"]) == 0
    assert "3 fallbacks (3 no time)" in capsys.readouterr().out
    run_json = json.loads(Path("late/run.json").read_text(encoding="utf-8"))
    assert [one["reason"] for one in run_json["decisions"]] == ["no time"] * 3
    assert [one.reason for one in Flight.load("late").decisions] == ["no time"] * 3


@pytest.mark.parametrize(
    ("given", "follows"),
    [
        ({"deterministic": "true"}, "every flight repeats"),
        ({"moving_acceleration_mps2": "3"}, "moving_margin_m"),
        ({"in_wind": "tube"}, "in_wind=guidance"),
    ],
)
@pytest.mark.parametrize("planner", ["milp-mpc", "milp-mpc-paper"])
def test_an_option_that_went_is_answered_with_what_follows_it(planner, given, follows):
    with pytest.raises(InputError, match=follows) as told:
        load_planner(planner, given)
    assert "\n" not in str(told.value)
