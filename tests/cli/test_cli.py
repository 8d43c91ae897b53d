"""The commands in this process: what they say, write and return."""

import io
import json
import os
import re
import subprocess
import sys
from contextlib import ExitStack
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from PIL import Image
from rich.console import Console

from uas_coverage_env.cli import main
from uas_coverage_env.cli.ascii_map import AsciiMap
from uas_coverage_env.cli.progress import shown
from uas_coverage_env.flight import Decision, Flight, load_planner, rollout
from uas_coverage_env.scenario import load_scenario, scenario_names
from uas_coverage_env.simulation import World

pytestmark = pytest.mark.usefixtures("elsewhere")


def village(tmp_path, **changes):
    """The village with some texts replaced, as a file."""
    text = files("uas_coverage_env.scenario").joinpath("village.toml").read_text(encoding="utf-8")
    for old, new in changes.items():
        text = text.replace(old, new)
    path = tmp_path / "mine.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_run_writes_a_flight_directory_and_says_where(elsewhere, capsys):
    assert main(["run", "open_field", "--planner", "nearest-waypoint", "--out", "mine"]) == 0
    flight = Flight.load("mine")
    assert flight.planner == "nearest-waypoint"
    assert json.loads((elsewhere / "mine" / "summary.json").read_text())["coverage"] == 1.0
    out, err = capsys.readouterr()
    assert re.sub(r"^uas_coverage_env: compiling .*\n", "", err) == ""
    assert "flight in mine" in out
    assert f"covered 100% in {flight.steps} steps; all home" in out
    assert all(name in out for name in flight.names)


def test_a_run_that_was_limited_succeeds_and_one_that_failed_does_not(elsewhere, capsys):
    hover = ["run", "open_field", "--planner", "hover"]
    assert main([*hover, "--steps", "3", "--out", "short"]) == 0
    assert Flight.load("short").steps == 3
    assert "in 3 steps, limit of steps reached; not all home" in capsys.readouterr().out
    # a limit that the scenario undercuts is no success
    assert main([*hover, "--steps", "1000000", "--out", "long"]) == 1


def test_runs_without_out_never_meet(elsewhere, capsys):
    command = ["run", "village", "--planner", "hover", "--steps", "1", "--seed", "4"]
    for _ in range(3):
        assert main(command) == 0
    assert sorted(path.name for path in (elsewhere / "flights").iterdir()) == [
        "village-hover-4",
        "village-hover-4-2",
        "village-hover-4-3",
    ]
    assert "flights/village-hover-4-3" in capsys.readouterr().out


def test_an_out_that_holds_something_is_refused_unless_overwritten(elsewhere, capsys):
    command = ["run", "village", "--planner", "hover", "--steps", "1", "--out", "mine"]
    assert main(command) == 0
    (elsewhere / "mine" / "notes.txt").write_text("keep")
    first = Flight.load("mine")
    assert main([*command, "--seed", "9"]) == 2
    assert Flight.load("mine") == first
    assert main([*command, "--seed", "9", "--overwrite"]) == 0
    assert Flight.load("mine").seed == 9
    assert (elsewhere / "mine" / "notes.txt").read_text() == "keep"


def test_options_seed_dynamics_and_filter_reach_the_flight(capsys):
    code = main(
        [
            *("run", "village", "--planner", "random-walk", "--seed", "5", "--steps", "2"),
            *("--option", "hold_s=3", "--option", "filter=false", "--option", "return_mode=no"),
            *("--dynamics", "nonlinear", "--out", "mine"),
        ]
    )
    assert code == 0
    flight = Flight.load("mine")
    assert (flight.seed, flight.dynamics) == (5, "nonlinear")
    assert flight.planner_options["hold_s"] == 3.0
    assert (flight.return_mode, flight.safety_filter) == (False, False)
    assert "safety filter" not in capsys.readouterr().out
    main(["run", "village", "--planner", "hover", "--steps", "1", "--filter", "--out", "safe"])
    assert Flight.load("safe").safety_filter
    assert "the safety filter replaced 0.0% of the commands" in capsys.readouterr().out


def test_ctrl_c_keeps_the_flight_and_is_told_by_the_exit_code(elsewhere, monkeypatch, capsys):
    from uas_coverage_baselines.hover import Hover

    act = Hover.act

    def interrupted(planner, swarm):
        if swarm.step == 3:
            raise KeyboardInterrupt
        return act(planner, swarm)

    monkeypatch.setattr(Hover, "act", interrupted)
    assert main(["run", "village", "--planner", "hover", "--out", "mine"]) == 130
    assert Flight.load("mine").steps == 3
    assert "in 3 steps, stopped;" in capsys.readouterr().out


def test_a_planner_that_gives_nonsense_fails_in_one_line(elsewhere, monkeypatch, capsys):
    from uas_coverage_baselines.hover import Hover

    monkeypatch.setattr(Hover, "act", lambda planner, swarm: {})
    assert main(["run", "village", "--planner", "hover", "--out", "mine"]) == 2
    err = capsys.readouterr().err
    assert re.fullmatch(r"error: planner 'hover' at step 0 \(t = 0 s\): .*\n", err)
    assert not (elsewhere / "mine").exists(), "no empty folder is left behind"


def test_the_shipped_scenarios_are_listed(capsys):
    assert main(["scenario", "list"]) == 0
    out = capsys.readouterr().out
    assert set(scenario_names()) <= set(out.split())
    assert "500 x 500 x 50" in out


def test_a_check_describes_and_draws_a_scenario(elsewhere, capsys):
    path = village(elsewhere)
    assert main(["scenario", "check", str(path)]) == 0
    out = capsys.readouterr().out
    assert "village is valid" in out
    assert "49, sum of weights" in out
    assert "10 fixed, 1 moving" in out
    assert (elsewhere / "village.png").read_bytes().startswith(b"\x89PNG")


def test_a_check_says_what_waypoints_ask_for_and_which_uas_carry_it(elsewhere, capsys):
    assert main(["scenario", "check", "mixed_fleet"]) == 0
    out = capsys.readouterr().out
    assert "15 for camera: mapper" in out
    assert "usable to 25%, carries thermal, gas" in out


def test_a_check_replaces_a_picture_only_where_it_was_asked_to(elsewhere, capsys):
    picture = elsewhere / "drawn.png"
    picture.write_bytes(b"precious")
    command = ["scenario", "check", "village", "--picture", "drawn.png"]
    assert main(command) == 2
    assert picture.read_bytes() == b"precious"
    assert main([*command, "--overwrite"]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["scenario", "check", "village", "--picture", "no/such/folder.png"]) == 2
    assert capsys.readouterr().err.count("\n") == 2


def test_a_check_may_be_repeated(elsewhere, capsys):
    for _ in range(2):
        assert main(["scenario", "check", "open_field"]) == 0
    picture = elsewhere / "open_field.png"
    drawn = picture.read_bytes()
    # a picture of somebody else is left alone, also where it is a good one
    Image.open(picture).copy().save(picture)
    assert main(["scenario", "check", "open_field"]) == 2
    assert "add --overwrite" in capsys.readouterr().err
    assert picture.read_bytes() != drawn


def test_a_mission_that_its_batteries_cannot_finish_is_valid_with_a_warning(elsewhere, capsys):
    path = village(elsewhere, **{"soc_0 = 1.0": "soc_0 = 0.27", "soc_0 = 0.433": "soc_0 = 0.27"})
    assert main(["scenario", "check", str(path)]) == 0
    err = capsys.readouterr().err
    assert err.startswith("warning: ")
    assert err.count("\n") == 1


def test_the_planners_are_listed_with_their_options(capsys):
    assert main(["planner", "list"]) == 0
    out = capsys.readouterr().out
    for words in ("hover", "climb_m", "default 5.0", "random-walk", "hold_s", "true|false"):
        assert words in out


def test_planners_are_listed_for_machines(capsys):
    assert main(["planner", "list", "--json"]) == 0
    listed = {planner["name"]: planner for planner in json.loads(capsys.readouterr().out)}
    assert {"hover", "milp-mpc", "trajectory"} <= listed.keys()
    (climb,) = (one for one in listed["hover"]["options"] if one["name"] == "climb_m")
    assert (climb["default"], climb["values"]) == ("5.0", "float")
    assert main(["planner", "list", "tour", "--json"]) == 0
    assert [one["name"] for one in json.loads(capsys.readouterr().out)] == ["tour"]


def test_a_new_scenario_begins_as_one_that_there_is(elsewhere, capsys):
    assert main(["scenario", "new", "town:7", "--out", "my town.toml"]) == 0
    made = load_scenario(elsewhere / "my town.toml")
    assert made == load_scenario("town:7").model_copy(update={"name": "my_town"})
    assert main(["scenario", "new", "village", "--out", "my town.toml"]) == 2
    assert "my town.toml: exists; give another file or add --overwrite" in capsys.readouterr().err
    assert main(["scenario", "new", "village", "--out", "my town.toml", "--overwrite"]) == 0
    assert main(["scenario", "new", "village", "--out", "mine.json"]) == 2
    assert "mine.json: should end in .toml" in capsys.readouterr().err


@pytest.mark.parametrize("command", [[], ["run"], ["scenario"], ["scenario", "check"], ["planner"]])
def test_every_command_has_help(command, capsys):
    assert main([*command, "--help"]) == 0
    assert "Usage: uas-coverage" in capsys.readouterr().out


def test_no_command_at_all_is_answered_with_help(capsys):
    assert main([]) == 0
    assert "planner" in capsys.readouterr().out


def test_the_planner_of_the_paper_flies_by_default_and_leaves_its_predictions(elsewhere):
    assert main(["run", "open_field", "--steps", "2", "--out", "mine"]) == 0
    flight = Flight.load("mine")
    assert flight.planner == "milp-mpc"
    # how far it looks ahead in its time depends on the machine; it always begins where it is
    now = flight.plan[flight.plan["n"] == 0]
    assert now["step"].tolist() == [0, 0, 1, 1]
    np.testing.assert_allclose(now["position_m"], flight.x[now["step"], now["uas"], :3])


@pytest.fixture
def no_display(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER", "SDL_VIDEO_DRIVER"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("sys.platform", "linux")


def terminal(rows=60):
    return Console(file=io.StringIO(), force_terminal=True, width=120, height=rows)


@pytest.mark.parametrize("watch", [True, False])
def test_a_terminal_shows_a_line_that_changes_and_a_map_where_it_is_watched(watch, no_display):
    scenario = load_scenario("open_field")
    screen = terminal()
    planner = load_planner("hover")
    with shown(screen, scenario, watch=planner if watch else None) as on_step:
        rollout(scenario, planner, max_steps=3, on_step=on_step)
    assert isinstance(screen.file, io.StringIO)
    text = screen.file.getvalue()
    assert "step 3/3" in text
    assert "100%" in text
    assert ("moving obstacle" in text) is watch
    assert ("a map of letters instead" in text) is watch


def test_a_watched_flight_is_shown_in_a_window_with_what_is_planned(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    scenario = load_scenario("open_field")
    planner: Any = load_planner("hover")
    screen = terminal()
    pictures = []

    def look(progress):
        if progress.swarm.step == 2:
            ahead_m = progress.swarm.x[:1, :3] + np.linspace([0, 20, 0], [0, 90, 0], 12)
            planner.last_decision = Decision({progress.swarm.names[0]: ahead_m})
        on_step(progress)
        pictures.append(pygame.surfarray.array3d(pygame.display.get_surface()))

    with shown(screen, scenario, watch=planner) as on_step:
        flight = rollout(scenario, planner, max_steps=2, on_step=look)
    assert flight.steps == 2
    assert [picture.shape for picture in pictures] == [(720, 720, 3)] * 3
    blue = (pictures[2] == [0, 114, 178]).all(axis=2).sum()
    assert blue > (pictures[1] == [0, 114, 178]).all(axis=2).sum() + 60, "the plan is drawn"
    assert pygame.display.get_surface() is None
    assert isinstance(screen.file, io.StringIO)
    assert "map of letters" not in screen.file.getvalue()


def test_the_end_of_a_watched_flight_is_shown_until_the_flight_was_told_of(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    scenario = load_scenario("open_field")
    planner = load_planner("hover")
    with ExitStack() as after:
        with shown(terminal(), scenario, watch=planner, after=after) as on_step:
            rollout(scenario, planner, max_steps=2, on_step=on_step)
        assert pygame.display.get_surface() is not None
        pygame.event.post(pygame.event.Event(pygame.KEYDOWN, key=pygame.K_SPACE))
    assert pygame.display.get_surface() is None


@pytest.mark.parametrize("display", [True, False])
def test_what_an_event_adds_is_in_the_window_or_on_the_map_of_letters(
    display, monkeypatch, request
):
    if display:
        pytest.importorskip("pygame")
        monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    else:
        request.getfixturevalue("no_display")
    added: Any = {
        "kind": "waypoint_added", "at_s": 1.0, "position_m": (30.0, 30.0, -20.0), "radius_m": 6.0,
    }  # fmt: skip
    scenario = load_scenario("open_field").model_copy(update={"events": (added,)})
    planner = load_planner("hover")
    with shown(terminal(), scenario, watch=planner) as on_step:
        flight = rollout(scenario, planner, max_steps=3, on_step=on_step)
    assert flight.steps == 3
    assert flight.open_waypoints == len(scenario.waypoints) + 1


def test_a_flight_goes_on_where_a_person_closes_the_window(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    scenario = load_scenario("open_field")
    planner = load_planner("hover")

    def close(progress):
        if progress.swarm.step == 1:
            pygame.event.post(pygame.event.Event(pygame.QUIT))
        on_step(progress)

    with shown(terminal(), scenario, watch=planner) as on_step:
        flight = rollout(scenario, planner, max_steps=4, on_step=close)
    assert flight.steps == 4


def test_a_log_gets_few_lines(elsewhere, capsys):
    assert main(["run", "open_field", "--planner", "nearest-waypoint", "--out", "mine"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert sum(line.startswith("step ") for line in lines) <= 3
    assert not any("\x1b" in line for line in lines)


def test_a_map_of_letters_shows_what_is_where():
    scenario = load_scenario("village")
    world = World(scenario)
    lines = AsciiMap(scenario, 120, 60).drawn(world.swarm_state()).plain.splitlines()
    cells = np.array([list(line) for line in lines[1:-2]])
    assert {"1", "2", "o", "#", "@"} <= set(cells.ravel())
    row, column = np.argwhere(cells == "1")[0]
    # in the middle of the west: half way up, at the left edge
    assert column <= 3
    assert abs(row - len(cells) / 2) <= 2
    # the helicopter is in the east
    assert np.argwhere(cells == "@")[0][1] > 0.8 * cells.shape[1]


@pytest.mark.parametrize(("columns", "rows"), [(80, 24), (200, 50), (40, 60), (20, 10)])
@pytest.mark.parametrize("name", ["village", "open_field"])
def test_the_map_and_the_line_below_it_fit_into_the_terminal(name, columns, rows):
    scenario = load_scenario(name)
    *drawn, legend = (
        AsciiMap(scenario, columns, rows).drawn(World(scenario).swarm_state()).plain.splitlines()
    )
    assert legend.startswith("1.. UAS")
    assert len(drawn) + 2 <= rows
    assert len({len(line) for line in drawn}) == 1
    assert len(drawn[0]) <= columns


def test_the_version_is_told_also_to_python_dash_m(capsys):
    assert main(["--version"]) == 0
    told = capsys.readouterr().out
    assert told == f"uas-coverage {version('uas-coverage-env')}\n"
    command = [sys.executable, "-m", "uas_coverage_env", "--version"]
    assert subprocess.run(command, capture_output=True, text=True).stdout == told
    wrong = subprocess.run([*command[:-1], "fly"], capture_output=True, text=True)
    assert wrong.returncode == 2
    assert "fly" in wrong.stderr


@pytest.mark.skipif(os.name != "posix", reason="links of POSIX")
def test_a_flight_directory_of_somebody_else_overwrites_nothing_outside(elsewhere):
    precious = elsewhere / "precious.txt"
    precious.write_text("kept")
    fly = ["run", "open_field", "--planner", "hover", "--steps", "2", "--out", "mine"]
    assert main(fly) == 0
    for name in ("replay.html", "map.pdf", "map.png", "flight.csv", "summary.json"):
        (elsewhere / "mine" / name).unlink(missing_ok=True)
        (elsewhere / "mine" / name).symlink_to(precious)
    assert main([*fly, "--overwrite"]) == 0
    assert main(["replay", "mine"]) == 0
    figure = ["figure", "mine", "--kind", "map", "--out", "mine/map.pdf", "--overwrite"]
    assert main(figure) == 0
    assert precious.read_text() == "kept"
    assert Flight.load("mine").steps == 2


@pytest.mark.skipif(os.name != "posix", reason="pipes and devices of POSIX")
@pytest.mark.parametrize("command", ["run", "scenario check"])
def test_a_scenario_that_is_a_pipe_or_a_device_is_refused(elsewhere, capsys, command):
    os.mkfifo(elsewhere / "pipe.toml")
    (elsewhere / "zeros.toml").symlink_to("/dev/zero")
    for name in ("pipe.toml", "zeros.toml"):
        assert main([*command.split(), name]) == 2
        assert f"error: {name}: is not a plain file" in capsys.readouterr().err


def test_the_map_of_a_planner_with_any_name_is_drawn(elsewhere):
    assert main(["run", "open_field", "--planner", "hover", "--steps", "2", "--out", "mine"]) == 0
    path = elsewhere / "mine" / "summary.json"
    summary = json.loads(path.read_text())
    summary["planner"]["name"] = r"$\frac{x$"
    path.write_text(json.dumps(summary))
    assert main(["figure", "mine", "--kind", "map", "--out", "map.png"]) == 0
    assert (elsewhere / "map.png").stat().st_size > 10_000
