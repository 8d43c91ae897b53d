"""Disturbances in scenario files, in flights that are kept, and what planners are told of them."""

import json
import pickle
from importlib.metadata import EntryPoint

import numpy as np
import pytest
from own_disturbances import gusts
from pydantic import Field
from small_worlds import meadow

from uas_coverage_env import MissionBrief, World, load_scenario, rollout
from uas_coverage_env.cli.app import main
from uas_coverage_env.features import disturbances_of
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.scenario import DisturbanceTable, Wind, disturbance_tables
from uas_coverage_env.world import Velocity

HIGH = ((100.0, 100.0, -25.0),)


class Gusts(DisturbanceTable):
    """The table of another package."""

    sigma_mps: float = Field(ge=0.0, le=20.0)
    correlation_s: float = Field(default=5.0, gt=0.0)

    def disturbance(self):
        return gusts(self.sigma_mps, self.correlation_s)


class Silent(DisturbanceTable):
    """A table that forgets to say what it makes."""


@pytest.fixture
def installed(monkeypatch):
    entries = [
        EntryPoint("gusts", f"{__name__}:Gusts", disturbance_tables.GROUP),
        EntryPoint("broken", "no_such_package_at_all:Table", disturbance_tables.GROUP),
        EntryPoint("number", "math:pi", disturbance_tables.GROUP),
        EntryPoint("silent", f"{__name__}:Silent", disturbance_tables.GROUP),
    ]
    monkeypatch.setattr(disturbance_tables, "entry_points", lambda group: entries)


@pytest.fixture
def file_with(tmp_path):
    """Writes a scenario file with more lines at its end, and returns its path."""

    def write(*lines):
        path = tmp_path / "windy.toml"
        meadow(HIGH).to_file(path)
        path.write_text("\n".join([path.read_text(), *lines]))
        return path

    return write


WIND = ("[wind]", "mean_mps = 4", "from_deg = 270")
GUSTS = ("[disturbances.gusts]", "sigma_mps = 1.5")


def test_a_scenario_file_says_where_the_wind_comes_from(file_with):
    scenario = load_scenario(file_with(*WIND))
    assert scenario.wind == Wind(mean_mps=4.0, from_deg=270.0)
    (wind,) = disturbances_of(scenario)
    np.testing.assert_allclose(wind.parameters, (0.0, 4.0, 0.0), atol=1e-12)


def test_a_table_of_another_package_is_read_checked_and_flown(installed, file_with, tmp_path):
    scenario = load_scenario(file_with(*WIND, *GUSTS))
    assert [each.name for each in disturbances_of(scenario)] == ["wind", "gusts"]
    assert disturbances_of(scenario)[1].parameters == (1.5, 5.0)
    assert hash(scenario) == hash(pickle.loads(pickle.dumps(scenario)))
    scenario.to_file(tmp_path / "again.toml")
    assert load_scenario(tmp_path / "again.toml") == scenario
    world, direct = World(scenario), World(meadow(HIGH), disturbances=disturbances_of(scenario))
    for each in (world, direct):
        each.step({"uas_1": Velocity(1.0, 0.0, 25.0)})
    np.testing.assert_array_equal(world.state.x, direct.state.x)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (("[wind]", "mean_mps = 4"), "wind.from_deg: is missing"),
        ((*WIND, "gust = 1"), "wind.gust: unknown key"),
        (("[wind]", "mean_mps = -1", "from_deg = 0"), "wind.mean_mps: should be greater"),
        (("[wind]", "mean_mps = nan", "from_deg = 0"), "wind.mean_mps: should be a finite number"),
        (("[wind]", "mean_mps = 1", "from_deg = 400"), "wind.from_deg: should be less"),
        (("[disturbances.fog]",), "disturbances: no disturbance 'fog' is installed; there are: "),
        (("[disturbances.gusts]",), "disturbances: gusts: sigma_mps: is missing; add it"),
        ((*GUSTS, "sigma = 1"), "disturbances: gusts: sigma: unknown key; did you mean sigma_mps"),
        (("[disturbances]", "gusts = 3"), "disturbances: gusts should be a table"),
        (
            ("[disturbances.broken]",),
            "disturbance 'broken' cannot be loaded: ModuleNotFoundError: No module",
        ),
        (("[disturbances.number]",), "disturbance 'number' is installed as 3.14"),
    ],
)
def test_a_mistake_in_a_table_is_one_line(installed, file_with, lines, message):
    with pytest.raises(InputError) as caught:
        load_scenario(file_with(*lines))
    assert message in str(caught.value)
    assert "windy.toml: " in str(caught.value)
    assert "\n" not in str(caught.value)


def test_disturbances_have_to_be_tables():
    with pytest.raises(ValueError, match=r"should be tables \[disturbances.NAME\]"):
        meadow(HIGH).model_copy(update={"disturbances": 3})


def test_a_table_that_makes_no_disturbance_says_so(installed, file_with):
    scenario = load_scenario(file_with("[disturbances.silent]"))
    with pytest.raises(NotImplementedError, match="Silent has no method"):
        disturbances_of(scenario)


def test_a_scenario_without_tables_is_written_as_before_there_were_any():
    still = meadow(HIGH)
    for data in (still.content(), still.model_dump(mode="json", by_alias=True)):
        assert not {"wind", "disturbances"} & set(data)
    windy = still.model_copy(update={"wind": Wind(mean_mps=4.0, from_deg=270.0)})
    told = {"mean_mps": 4.0, "from_deg": 270.0, "up_mps": 0.0}
    assert windy.content() == still.content() | {"wind": told}
    assert windy.model_copy(update={"wind": None}) == still


def test_no_planner_is_told_of_disturbances_but_for_the_bounds_that_are_stated():
    tables = {"wind": Wind(mean_mps=4.0, from_deg=270.0), "disturbances": {"g": Gusts(sigma_mps=1)}}
    windy = meadow(HIGH).model_copy(update=tables)
    brief = MissionBrief.of(windy)
    told = brief.model_dump() | {"conditions": None}
    assert told == MissionBrief.of(meadow(HIGH)).model_dump()
    other = windy.model_copy(update={"wind": Wind(mean_mps=1.3, from_deg=20.0)})
    assert MissionBrief.of(other) == brief
    assert disturbances_of(brief.as_scenario()) == ()


def test_a_flight_in_wind_is_another_and_is_kept_with_its_wind(tmp_path):
    windy = meadow(HIGH).model_copy(update={"wind": Wind(mean_mps=4.0, from_deg=270.0)})
    flight, still = (
        rollout(scenario, "nearest-waypoint", max_steps=20) for scenario in (windy, meadow(HIGH))
    )
    assert flight.disturbances == ("wind",)
    assert (flight.x[-1] != still.x[-1]).any()
    flight.save(tmp_path / "windy")
    assert json.loads((tmp_path / "windy" / "scenario.json").read_text())["wind"]["mean_mps"] == 4.0
    assert Flight.load(tmp_path / "windy") == flight
    still.save(tmp_path / "still")
    assert "disturbances" not in (tmp_path / "still" / "run.json").read_text()
    assert Flight.load(tmp_path / "still") == still
    calm = rollout(windy, "nearest-waypoint", max_steps=20, disturbances=())
    np.testing.assert_array_equal(calm.x, still.x)


def test_the_seed_of_a_rollout_is_that_of_what_disturbances_draw():
    flights = [
        rollout(meadow(HIGH), "hover", seed, max_steps=8, disturbances=(gusts(),))
        for seed in (1, 1, 2)
    ]
    np.testing.assert_array_equal(flights[0].x, flights[1].x)
    assert (flights[0].x != flights[2].x).any()
    assert flights[0].disturbances == ("gusts",)


def test_the_check_of_a_scenario_says_what_disturbs(installed, file_with, tmp_path, capsys):
    picture = str(tmp_path / "drawn.png")
    assert main(["scenario", "check", str(file_with(*WIND, *GUSTS)), "--picture", picture]) == 0
    told = capsys.readouterr().out
    assert "disturbed  wind of 4 m/s from 270 degrees\n" in told
    assert "disturbed  gusts\n" in told
    assert main(["scenario", "check", "village", "--picture", f"{picture}.png"]) == 0
    assert "disturbed" not in capsys.readouterr().out
