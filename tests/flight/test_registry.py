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
    retired,
    rollout,
)
from uas_coverage_env.plugins.installed import entry_points


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


@pytest.mark.parametrize("name", retired.FOLLOWERS)
def test_a_planner_that_went_is_answered_with_one_that_flies(name):
    with pytest.raises(InputError) as told:
        load_planner(name)
    assert str(told.value).startswith(f"unknown planner {name!r}; it went")
    follows = str(told.value).partition("; fly ")[2].split()[0].rstrip(",")
    assert follows in planner_names()
    assert name not in planner_names()


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
    with pytest.raises(InputError, match=r"'broken' cannot be loaded: .*No module named"):
        load_planner("broken")


class Bare:
    """Has no options."""

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return {}


@pytest.fixture
def announced(tmp_path, monkeypatch):
    """What another package announces beside the planners of this one, which come before it."""
    (tmp_path / "failing_planners.py").write_text('raise RuntimeError("no licence")')
    monkeypatch.syspath_prepend(tmp_path)
    ours = [entry for entry in entry_points(registry.GROUP) if entry.name == "hover"]
    others = [
        EntryPoint("bare", f"{__name__}:Bare", registry.GROUP),
        EntryPoint("failing", "failing_planners:Planner", registry.GROUP),
        EntryPoint("hover", f"{__name__}:Bare", registry.GROUP),
    ]
    monkeypatch.setattr(registry, "entry_points", lambda group: [*ours, *others])


@pytest.mark.usefixtures("announced")
def test_an_announced_planner_needs_no_options():
    assert isinstance(load_planner("bare"), Bare)
    with pytest.raises(InputError, match="'bare' has no option 'speed'; allowed: none"):
        load_planner("bare", {"speed": 1})


@pytest.mark.usefixtures("announced")
def test_a_package_that_fails_is_one_line_and_harms_no_other_planner():
    with pytest.raises(InputError, match="'failing' cannot be loaded: RuntimeError: no licence"):
        load_planner("failing")
    missing = {planner.name: planner.missing for planner in describe_planners()}
    assert missing["failing"].startswith("RuntimeError: no licence")
    assert not missing["bare"]


@pytest.mark.usefixtures("announced")
def test_a_planner_of_this_package_keeps_its_name():
    assert type(load_planner("hover")).__name__ == "Hover"


def test_a_planner_that_was_not_announced_goes_by_the_name_of_its_class():
    assert registry.name_of(Tuned(TunedOptions())) == "Tuned"
    assert registry.options_of(object()) == {}


OWN = """
from pydantic import Field

from uas_coverage_env import GoTo
from uas_coverage_env.flight import PlannerOptions


class Plain:
    \"\"\"All UAS to the first waypoint.\"\"\"

    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return {name: GoTo(0) for name in swarm.active}


class Settings(PlannerOptions):
    waypoint: int = Field(default=1, description="flown to")


class Set(Plain):
    Options = Settings

    def __init__(self, options):
        self.options = options


class Sized(Plain):
    def __init__(self, size_m):
        pass


class Mute:
    def reset(self, brief, seed):
        pass


def function(swarm):
    return {}
"""


@pytest.fixture
def own(tmp_path, monkeypatch):
    """A user's folder with modules, one of them broken."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my_own_planners.py").write_text(OWN, encoding="utf-8")
    (tmp_path / "my_broken_planners.py").write_text("import nothing_at_all\n", encoding="utf-8")


@pytest.mark.usefixtures("own")
def test_a_class_beside_the_command_is_a_planner_with_or_without_options():
    flight = rollout("open_field", "my_own_planners:Plain", max_steps=2)
    assert (flight.planner, flight.steps) == ("Plain", 2)
    planner = load_planner("my_own_planners:Set", {"waypoint": "3"})
    assert registry.options_of(planner) == {"waypoint": 3}
    described = registry.describe_planner("my_own_planners:Set")
    assert described.name == "my_own_planners:Set"
    assert [option.name for option in described.options] == ["waypoint"]
    assert registry.describe_planner("my_own_planners:Plain").summary.startswith("All UAS")


@pytest.mark.usefixtures("own")
@pytest.mark.parametrize(
    ("name", "options", "said"),
    [
        ("my_own_planner:Plain", {}, "there is no module 'my_own_planner'"),
        ("polcy:mine", {}, "did you mean policy:mine?"),
        ("my_own_planners:Plane", {}, "has no 'Plane'"),
        ("my_own_planners:", {}, "or MODULE:CLASS"),
        ("my_own_planners:function", {}, "is no class"),
        ("my_own_planners:Sized", {}, "size_m"),
        ("my_own_planners:Mute", {}, "has no method act"),
        ("my_own_planners:Plain", {"speed": "3"}, "has no option 'speed'; allowed: none"),
        ("my_own_planners:Set", {"waypoint": "no"}, "default 1"),
        ("my_broken_planners:Plain", {}, "nothing_at_all"),
    ],
)
def test_a_class_that_makes_no_planner_is_refused_in_one_line(name, options, said):
    with pytest.raises(InputError) as error:
        load_planner(name, options)
    assert said in str(error.value)
    assert name in str(error.value)
    assert "\n" not in str(error.value)


def test_what_is_no_planner_is_refused_before_it_flies():
    def choose(swarm):
        return {}

    with pytest.raises(InputError, match=r"'choose' has no method reset\(brief, seed\)"):
        rollout("open_field", choose)
    with pytest.raises(InputError, match=r"'Tuned' is a class; make one, as in Tuned\(\)"):
        rollout("open_field", Tuned)
