from importlib.metadata import EntryPoint
from typing import Literal

import pytest
from pydantic import Field

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import (
    PlannerOptions,
    describe_planners,
    load_planner,
    planner_names,
    registry,
)


class TunedOptions(PlannerOptions):
    """What can be tuned."""

    horizon: int = Field(default=18, ge=2, description="steps to look ahead")
    time_limit_s: float = Field(default=1.0, gt=0.0, description="per decision [s]")
    deterministic: bool = Field(default=False, description="same result on every machine")
    solver: Literal["highs", "scip"] = Field(default="highs", description="who solves")
    seed_s: float | None = Field(default=None, description="or none")


class Tuned:
    """Somebody else's planner.

    With more to say about it.
    """

    Options = TunedOptions

    def __init__(self, options):
        self.options = options

    def reset(self, scenario, seed):
        pass

    def act(self, swarm):
        return {}


@pytest.fixture
def tuned(monkeypatch):
    """A planner that another package has announced, and one whose package is broken."""
    entries = [
        EntryPoint("tuned", f"{__name__}:Tuned", registry.GROUP),
        EntryPoint("broken", "no_such_package_at_all:Planner", registry.GROUP),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda group: entries)


def test_the_simple_planners_are_installed():
    assert {"nearest-waypoint", "lawnmower", "hover", "random-walk"} <= set(planner_names())


def test_an_unknown_planner_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"unknown planner 'teleport'; allowed: .*hover, "):
        load_planner("teleport")


@pytest.mark.usefixtures("tuned")
def test_options_are_read_from_text():
    given = {"horizon": "12", "time_limit_s": "0.5", "deterministic": "true", "solver": "scip"}
    planner = load_planner("tuned", given)
    assert isinstance(planner, Tuned)
    assert planner.options == TunedOptions(
        horizon=12, time_limit_s=0.5, deterministic=True, solver="scip"
    )
    assert registry.name_of(planner) == "tuned"
    assert registry.options_of(planner) == {
        **{"horizon": 12, "time_limit_s": 0.5, "deterministic": True},
        **{"solver": "scip", "seed_s": None},
    }


@pytest.mark.usefixtures("tuned")
@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"horizont": "12"}, ["horizont", "did you mean horizon?"]),
        ({"wings": "2"}, ["wings", "horizon, time_limit_s, deterministic, solver"]),
        ({"horizon": "many"}, ["horizon = 'many'", "int", "default 18"]),
        ({"horizon": "1"}, ["horizon = '1'", "greater than or equal to 2"]),
        ({"horizon": "1.5"}, ["horizon = '1.5'"]),
        ({"time_limit_s": "nan"}, ["time_limit_s = 'nan'", "finite"]),
        ({"time_limit_s": "inf"}, ["time_limit_s = 'inf'", "finite"]),
        ({"deterministic": "perhaps"}, ["deterministic = 'perhaps'", "true|false"]),
        ({"solver": "abacus"}, ["solver = 'abacus'", "highs|scip"]),
    ],
)
def test_an_option_that_does_not_fit_is_refused_in_one_line(given, words):
    with pytest.raises(InputError) as error:
        load_planner("tuned", given)
    assert "\n" not in str(error.value)
    assert all(word in str(error.value) for word in ["'tuned'", *words])


@pytest.mark.usefixtures("tuned")
def test_planners_are_described_as_a_person_types_them():
    broken, described = describe_planners()
    assert described.summary == "Somebody else's planner."
    assert [(option.name, option.values, option.default) for option in described.options] == [
        ("horizon", "int", "18"),
        ("time_limit_s", "float", "1.0"),
        ("deterministic", "true|false", "false"),
        ("solver", "highs|scip", "highs"),
        ("seed_s", "float|none", "none"),
    ]
    assert described.options[0].description == "steps to look ahead"
    assert broken.name == "broken"
    assert "no_such_package_at_all" in broken.missing


@pytest.mark.usefixtures("tuned")
def test_a_planner_whose_package_is_missing_is_refused_in_one_line():
    with pytest.raises(InputError, match="'broken' cannot be loaded: No module named"):
        load_planner("broken")


def test_a_planner_that_was_not_announced_goes_by_the_name_of_its_class():
    assert registry.name_of(Tuned(TunedOptions())) == "Tuned"
    assert registry.options_of(object()) == {}
