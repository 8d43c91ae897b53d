"""What a sweep flies, and by what its flights are known."""

import dataclasses
from itertools import combinations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, rollout
from uas_coverage_env.leaderboard import Sweep, planner_specs_of, scenarios_of
from uas_coverage_env.leaderboard.flying import fly, kept_as
from uas_coverage_env.leaderboard.hashing import content_hash, source_hash
from uas_coverage_env.leaderboard.planner_specs import PlannerSpec
from uas_coverage_env.leaderboard.row import TIMES
from uas_coverage_env.leaderboard.scenario_sets import SETS, scenario_hash
from uas_coverage_env.leaderboard.sweep import source_of
from uas_coverage_env.runner.store import difference
from uas_coverage_env.scenario import load_scenario

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=8,
)  # fmt: skip


def sweep(scenarios="village", planners="milp-mpc", options=(), seeds=range(1), **settings):
    return Sweep(
        scenarios_of([scenarios]), planner_specs_of([planners], options), seeds, **settings
    )


def keys(some: Sweep) -> list[str]:
    return [entry.key for entry in some.entries()]


@given(st.dictionaries(st.text(max_size=4), PLAIN, max_size=5))
@settings(max_examples=100, deadline=None, derandomize=True)
def test_the_order_of_keys_does_not_change_a_hash(data):
    assert content_hash(dict(reversed(data.items()))) == content_hash(data)


@given(PLAIN, PLAIN)
@settings(max_examples=100, deadline=None, derandomize=True)
def test_other_data_has_another_hash(one, other):
    same = repr(one) == repr(other) or (one == other and type(one) is type(other) is dict)
    assert (content_hash(one) == content_hash(other)) == same


def test_every_scenario_is_flown_by_every_planner_with_every_seed():
    some = sweep("village,corridor", "hover,lawnmower", seeds=range(3, 5))
    entries = list(some.entries())
    flown = [(e.seed, e.scenario.name, e.spec.label) for e in entries]
    assert len(set(keys(some))) == len(flown) == len(set(flown)) == 8
    assert {seed for seed, *_ in flown[:4]} == {3}, "seed by seed"


def test_whatever_changes_a_flight_changes_its_key():
    sweeps = {
        "as it is": sweep(),
        "option": sweep(options=["milp-mpc:horizon=12"]),
        "another option": sweep(options=["milp-mpc:horizon=13"]),
        "planner": sweep(planners="milp-mpc-paper"),
        "label": sweep(planners="mine=milp-mpc"),
        "scenario": sweep("corridor"),
        "seed": sweep(seeds=range(1, 2)),
        "dynamics": sweep(dynamics="nonlinear"),
        "filter": sweep(safety_filter=True),
    }
    for (one, first), (other, second) in combinations(sweeps.items(), 2):
        assert keys(first) != keys(second), f"{one} and {other}"
        assert difference(first.description(), second.description())


def test_an_option_that_is_spelt_out_is_the_default():
    (spec,) = planner_specs_of(["milp-mpc"], []).values()
    values = {
        key: ",".join(value) if isinstance(value, list) else value
        for key, value in spec.options.items()
    }
    spelt = [f"milp-mpc:{key}={value}" for key, value in values.items()]
    plain = [text for text in spelt if not text.endswith("=None")]
    assert keys(sweep(options=plain)) == keys(sweep())
    assert keys(sweep(options=plain[::-1])) == keys(sweep())


def test_a_scenario_is_its_content_not_its_file(tmp_path, village_text):
    elsewhere = tmp_path / "copy of the village.toml"
    elsewhere.write_text(village_text + "\n# a remark\n")
    assert keys(sweep(str(elsewhere))) == keys(sweep())
    elsewhere.write_text(village_text.replace("max_steps = 500", "max_steps = 499"))
    assert keys(sweep(str(elsewhere))) != keys(sweep())


def test_a_vehicle_that_changes_changes_the_scenario(tmp_path, village_text):
    from importlib.resources import files

    vehicle = files("uas_coverage_env.vehicle").joinpath("s500_v2.toml").read_text()
    (tmp_path / "mine.toml").write_text(vehicle)
    village = tmp_path / "village.toml"
    village.write_text(village_text.replace('"s500_v2"', '"mine.toml"'))
    before = scenario_hash(load_scenario(village))
    assert before == scenario_hash(load_scenario("village")), "the same machine"
    line = next(line for line in vehicle.splitlines() if line.startswith("mass_kg"))
    (tmp_path / "mine.toml").write_text(vehicle.replace(line, f"{line}  # weighed"))
    assert scenario_hash(load_scenario(village)) == before
    heavier = f"mass_kg = {1.01 * float(line.split('=')[1].split('#')[0])}"
    (tmp_path / "mine.toml").write_text(vehicle.replace(line, heavier))
    assert scenario_hash(load_scenario(village)) != before


def test_a_policy_is_its_weights_not_its_folder():
    (hover,) = planner_specs_of(["hover"], []).values()
    one = type(hover)("p", "policy:here", {}, "weights 1", "package")
    moved = type(hover)("p", "policy:there", {}, "weights 1", "package")
    trained = type(hover)("p", "policy:here", {}, "weights 2", "package")
    assert one.identity() == moved.identity() != trained.identity()


def test_sets_are_twenty_scenarios_each_and_have_none_in_common():
    dev, test = scenarios_of(["dev"]), scenarios_of(["test"])
    assert len(dev) == len(test) == 20
    assert not {scenario_hash(s) for s in dev.values()} & {scenario_hash(s) for s in test.values()}
    assert scenarios_of(["generated:2000:2020"]) == dev
    assert scenarios_of(["generated:2003"]).items() <= dev.items()
    assert not set(SETS["dev"]) & set(SETS["test"])


def test_what_is_asked_for_twice_is_flown_once():
    assert list(scenarios_of(["village corridor,village", "corridor"])) == ["village", "corridor"]


def test_a_list_may_be_longer_than_the_name_of_a_file():
    assert list(scenarios_of([",".join(["corridor"] * 40)])) == ["corridor"]


def test_two_different_scenarios_of_one_name_are_refused(tmp_path, village_text):
    mine = tmp_path / "mine.toml"
    mine.write_text(village_text.replace("max_steps = 500", "max_steps = 400"))
    with pytest.raises(InputError, match="two different ones are named 'village'"):
        scenarios_of(["village", str(mine)])


def test_a_planner_can_fly_twice_under_labels():
    specs = planner_specs_of(["hover,still=hover"], [])
    assert {label: spec.planner for label, spec in specs.items()} == {
        "hover": "hover",
        "still": "hover",
    }


def test_the_source_is_that_of_the_world_and_of_the_planner():
    hover = list(sweep("corridor", "hover").entries())
    assert source_of(hover) == source_of(hover) != source_of([])


def test_a_flight_is_kept_where_that_is_asked_for(tmp_path):
    some = sweep("corridor", "hover")
    short = next(iter(some.scenarios.values())).model_copy(update={"max_steps": 2})
    (entry,) = Sweep({"corridor": short}, some.planners, range(7, 8)).entries()
    row, files = fly(entry, "")
    assert files == {}
    found = fly(entry, "", "flight")
    same = dict.fromkeys(TIMES)
    assert dataclasses.replace(found.row, **same) == dataclasses.replace(row, **same)
    assert kept_as(entry) == kept_as(row) == "flights/corridor-hover-7"
    found.write(tmp_path)
    kept = Flight.load(tmp_path / kept_as(entry))
    assert (kept.x == rollout(short, "hover", seed=7).x).all()


def test_the_source_of_a_single_module_counts_as_that_of_a_package_does(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    module = tmp_path / "my_single_planner.py"
    hashes = set()
    for text in ("SPEED = 1\n", "SPEED = 2\n", "SPEED = 2\n"):
        module.write_text(text, encoding="utf-8")
        hashes.add(source_hash(["my_single_planner"]))
    assert len(hashes) == 2
    assert source_hash(["my_single_planner"]) != source_hash(["no_such_planner_at_all"])


def test_an_edited_block_of_ones_own_makes_another_planner(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    file = tmp_path / "own_ceiling.py"
    file.write_text("class Ceiling:\n    def add_to(self, milp, v, problem):\n        pass\n")
    options = {"blocks": "own_ceiling:Ceiling"}
    first, same = (PlannerSpec.named("low", "milp-mpc", options) for _ in range(2))
    file.write_text(file.read_text() + "# lower\n")
    edited = PlannerSpec.named("low", "milp-mpc", options)
    assert first.identity() == same.identity() != edited.identity()
    assert "own_sha256" not in PlannerSpec.named("low", "milp-mpc", {}).identity()
    with pytest.raises(InputError, match="have changed"):
        first.load()
