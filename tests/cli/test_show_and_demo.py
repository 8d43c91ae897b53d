"""A first flight with its page, and the figures of flights."""

import json
import webbrowser
from pathlib import Path

import pytest

from uas_coverage_env.bound import MissionBound
from uas_coverage_env.cli import demo as demo_command
from uas_coverage_env.cli import main
from uas_coverage_env.cli.figures_of_flight import verdict
from uas_coverage_env.flight import Flight, load_planner, rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import generate_scenario

pytestmark = pytest.mark.usefixtures("elsewhere")
PAGES = ("recorded", "replay")


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Two flights: one that accomplishes its mission, and one that does not."""
    folder = tmp_path_factory.mktemp("flown")
    fly = ["run", "open_field", "--quiet"]
    good, bad = str(folder / "good"), str(folder / "bad")
    assert main([*fly, "--planner", "nearest-waypoint", "--out", good]) == 0
    assert main([*fly, "--planner", "hover", "--steps", "3", "--out", bad]) == 0
    return good, bad


def row(out: str, name: str) -> list[str]:
    """The cells of a row of a table, without its name."""
    (line,) = (line for line in out.splitlines() if line.strip().startswith(f"{name}  "))
    return line.strip().removeprefix(name).split()


def test_show_prints_the_figures_of_a_flight(flown, capsys):
    assert main(["show", flown[0]]) == 0
    out = capsys.readouterr().out
    flight = Flight.load(flown[0])
    assert row(out, "energy, Wh") == [f"{summary(flight)['energy_Wh']:.2f}"]
    assert row(out, "steps") == [str(flight.steps)]
    assert row(out, "accomplished") == ["yes"]
    assert all(name in out for name in flight.names)
    assert "mission accomplished" in out


def test_show_puts_a_second_flight_beside_the_first(flown, capsys):
    assert main(["show", *flown]) == 0
    out = capsys.readouterr().out
    assert row(out, "planner") == ["nearest-waypoint", "hover"]
    assert row(out, "accomplished") == ["yes", "no"]
    assert row(out, "steps") == [str(Flight.load(path).steps) for path in flown]
    assert "mission not accomplished: limit of steps reached; 0% covered; not home: uas_1" in out


def test_of_many_uas_that_are_not_home_the_first_are_named():
    town = generate_scenario(seed=5, n_uas=30, n_waypoints=30, n_obstacles=0)
    said = verdict(rollout(town, load_planner("hover"), max_steps=1))
    assert said.endswith(
        "not home: uas_1, uas_2, uas_3, uas_4, uas_5, uas_6, uas_7, uas_8 and 22 more"
    )


def test_show_gives_machines_what_the_summary_says(flown, capsys):
    assert main(["show", flown[0], "--json"]) == 0
    one = json.loads(capsys.readouterr().out)
    kept = json.loads(Path(flown[0], "summary.json").read_text())
    assert {name: one[name] for name in kept} == kept
    assert one["accomplished"] is True
    assert one["scenario"] == "open_field"
    assert main(["show", *flown, "--json"]) == 0
    assert [entry["accomplished"] for entry in json.loads(capsys.readouterr().out)] == [True, False]


def test_show_puts_the_least_energy_beside_a_flight_that_has_one(
    elsewhere, capsys, bounds_found_soon
):
    scenario = generate_scenario(1, n_uas=1, n_waypoints=4, n_obstacles=2)
    scenario.to_file("area.toml")
    fly = ["run", "area.toml", "--quiet"]
    assert main([*fly, "--planner", "nearest-waypoint", "--out", "good"]) == 0
    assert main([*fly, "--planner", "hover", "--steps", "3", "--out", "bad"]) == 0
    assert main(["show", "good", "bad", "--bound", "--json"]) == 0
    good, bad = (entry["bound"] for entry in json.loads(capsys.readouterr().out))
    flight = Flight.load("good")
    least_Wh = MissionBound(scenario).energy_Wh(flight.steps)
    assert good["energy_Wh"] == pytest.approx(least_Wh)
    assert good["above"] == pytest.approx(summary(flight)["energy_Wh"] / least_Wh - 1.0)
    assert good["above"] > 0.0
    assert bad["above"] is None, "of a mission that is not accomplished"
    assert main(["show", "good", "bad", "--bound"]) == 0
    out, err = capsys.readouterr()
    assert f"computing the least energy of {scenario.name} in {flight.steps} steps ..." in err
    assert row(out, "least energy, Wh")[0] == f"{least_Wh:.2f}"
    assert row(out, "above it")[0] == f"{good['above']:.1%}"


def test_show_names_what_is_no_flight(elsewhere, capsys):
    assert main(["show", "nowhere"]) == 2
    assert "nowhere" in capsys.readouterr().err


def test_a_quiet_run_prints_nothing_and_one_for_machines_json_alone(elsewhere, capsys):
    fly = ["run", "open_field", "--planner", "hover", "--steps", "2"]
    assert main([*fly, "--quiet", "--out", "quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert Flight.load("quiet").steps == 2
    assert main([*fly, "--json", "--out", "json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert (result["directory"], result["steps"], result["accomplished"]) == ("json", 2, False)


def test_a_run_ends_with_whether_it_is_good_and_where_to_look(elsewhere, capsys):
    assert main(["run", "open_field", "--planner", "nearest-waypoint", "--out", "mine"]) == 0
    out = capsys.readouterr().out
    assert "mission accomplished: everything covered, every UAS home, no violation" in out
    for command in ("replay mine", "show mine --bound", "figure mine --kind map"):
        assert f"uas-coverage {command}" in out


def test_the_demo_flies_and_opens_its_page_where_there_is_a_browser(elsewhere, capsys, monkeypatch):
    opened = []
    monkeypatch.setattr(webbrowser, "open", lambda address: opened.append(address) or True)
    monkeypatch.setattr(demo_command.sys, "platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert main(["demo"]) == 0
    page = elsewhere / "flights" / "demo" / "replay.html"
    assert page.stat().st_size > 500_000
    flight = Flight.load(page.parent)
    assert flight.scenario.name == "corridor"
    assert accomplished(flight)
    assert summary(flight)["breaches"] == 0
    assert opened == [], "there is no screen"
    out = capsys.readouterr().out
    recorded, flown = (out.index(f"to look at it, open flights/demo/{name}.html") for name in PAGES)
    assert out.index("recorded flight of trajectory in the village") < recorded < flown
    assert "trajectory (recorded)" in (page.parent / "recorded.html").read_text()

    monkeypatch.setenv("DISPLAY", ":9")
    assert main(["demo", "--no-open"]) == 0
    assert opened == []
    assert main(["demo", "--out", "mine"]) == 0
    assert opened == [(elsewhere / "mine" / f"{name}.html").as_uri() for name in PAGES]
