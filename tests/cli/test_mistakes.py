"""Mistakes that people make, each answered by one line on stderr and exit code 2."""

import io
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from uas_coverage_env.cli import main
from uas_coverage_env.compiled.random import SEEDS

VILLAGE = files("uas_coverage_env.scenario").joinpath("village.toml").read_text(encoding="utf-8")
FIRST_WAYPOINT = "position_m = [48.0, 68.0, -26.0]"

SCENARIO_MISTAKES = {
    "nan": (FIRST_WAYPOINT, "position_m = [nan, 68.0, -26.0]", "waypoints[0].position_m"),
    "unknown key": ("max_steps = 500", "max_steps = 500\nmax_stops = 5", "max_stops"),
    "waypoint inside an obstacle": (
        FIRST_WAYPOINT,
        "position_m = [60.0, 120.0, -5.0]",
        "forest_southwest",
    ),
    "waypoint outside the fence": (FIRST_WAYPOINT, "position_m = [-48.0, 68.0, -26.0]", "-48"),
    "starts too close": (
        "start_m = [230.0, 10.0, -1.0]",
        "start_m = [249.5, 10.0, -1.0]",
        "uas[1]",
    ),
    "missing section": ("[geofence]\nmargin_m = 0.5", "[fence]\nmargin_m = 0.5", "fence"),
    "syntax error": ("max_steps = 500", "max_steps = = 500", "TOML"),
    "text for a number": ("max_steps = 500", 'max_steps = "500"', "max_steps"),
    "coordinates beyond reason": (
        FIRST_WAYPOINT,
        "position_m = [4.8e9, 68.0, -26.0]",
        "position_m",
    ),
    "unknown vehicle": ('vehicle = "s500_v2"', 'vehicle = "s600"', "s600"),
    "negative radius": ("radius_m = 15.0", "radius_m = -15.0", "radius_m"),
}


def refused(capsys, *command: str) -> str:
    """Run a command that must be refused; returns its line."""
    assert main(list(command)) == 2
    out, err = capsys.readouterr()
    assert out == "", "nothing is said to have begun"
    assert err.startswith("error: ")
    assert err.endswith("\n")
    assert err.count("\n") == 1, err
    return err


pytestmark = pytest.mark.usefixtures("elsewhere")


@pytest.mark.parametrize("mistake", SCENARIO_MISTAKES)
def test_a_mistake_in_a_scenario_is_named(mistake, elsewhere, capsys):
    old, new, word = SCENARIO_MISTAKES[mistake]
    assert old in VILLAGE
    path = elsewhere / "mine.toml"
    path.write_text(VILLAGE.replace(old, new), encoding="utf-8")
    line = refused(capsys, "run", str(path), "--planner", "hover")
    assert word in line
    assert "mine.toml" in line
    assert refused(capsys, "scenario", "check", str(path)) == line
    assert [entry.name for entry in elsewhere.iterdir()] == ["mine.toml"]


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["run"], "Name of a shipped scenario"),
        (["export", "flown", "--out", "plans"], "--format': qgc (.plan)"),
        (["run", "atlantis"], "atlantis"),
        (["run", "no/such/file.toml"], "no/such/file.toml"),
        (["scenario", "check", "no/such/file.toml"], "no/such/file.toml"),
        (["run", "."], "."),
        (["run", "village", "--planner", "teleport"], "teleport"),
        (["run", "village", "--planner", "hover", "--option", "climb=3"], "climb_m"),
        (["run", "village", "--planner", "hover", "--option", "climb_m=high"], "climb_m"),
        (["run", "village", "--planner", "hover", "--option", "climb_m=nan"], "climb_m"),
        (["run", "village", "--planner", "hover", "--option", "climb_m"], "KEY=VALUE"),
        (
            [
                *("run", "village", "--planner", "hover"),
                *("--option", "climb_m=3", "--option", "climb_m=4"),
            ],
            "twice",
        ),
        (["run", "village", "--dynamics", "magic"], "nonlinear"),
        (["run", "village", "--steps", "0"], "--steps"),
        (["run", "village", "--steps", "many"], "--steps"),
        (["run", "village", "--seed", "-1"], "--seed"),
        (["run", "village", "--seed", str(SEEDS)], "--seed"),
        (["planner", "demonstrate", "village", "--seed", str(SEEDS), "--out", "shown"], "--seed"),
        (
            [
                *("compare", "--scenarios", "village", "--planners", "hover"),
                *("--vary", "climb=3,4", "--out", "front"),
            ],
            "'climb'; did you mean climb_m?",
        ),
        (["train", "ppo", "--seed", str(2**32)], "--seed"),
        (["run", "village", "--speed", "9"], "--speed"),
        (["run"], "SCENARIO"),
        (["fly", "village"], "fly"),
        (["scenario", "chek", "village"], "chek"),
        (["run", "village", "--planner", "hover", "--out", "taken"], "taken"),
        (["run", "village", "--planner", "hover", "--out", "taken/note"], "taken/note"),
        (["run", "village", "--planner", "hover", "--out", "taken/note/deeper"], "deeper"),
    ],
)
def test_a_mistake_on_the_command_line_is_named(arguments, word, elsewhere, capsys):
    (elsewhere / "taken").mkdir()
    (elsewhere / "taken" / "note").write_text("mine")
    assert word in refused(capsys, *arguments)
    assert (elsewhere / "taken" / "note").read_text() == "mine"
    assert [entry.name for entry in elsewhere.iterdir()] == ["taken"]


LONG = "n" * 300


@pytest.mark.parametrize(
    "arguments",
    [
        ["run", "village", "--planner", "hover", "--out", LONG],
        ["run", f"{LONG}.toml"],
        ["run", "village", "--planner", f"policy:{LONG}"],
        ["scenario", "check", "village", "--picture", f"{LONG}.png"],
        ["compare", "--scenarios", "village", "--planners", "hover", "--out", LONG],
        ["compare", "--scenarios", f"{LONG}.toml", "--planners", "hover", "--out", "here"],
        ["compare", "--scenarios", LONG, "--planners", "hover", "--out", "here"],
        ["train", "ppo", "--out", LONG],
        ["replay", LONG],
        ["replay", "taken", "--gif", f"{LONG}.gif"],
        ["figure", LONG, "--kind", "map"],
        ["figure", "taken", "--kind", "map", "--out", f"{LONG}.pdf"],
    ],
)
def test_a_path_that_no_file_can_have_is_named(arguments, elsewhere, capsys):
    (elsewhere / "taken").mkdir()
    assert "nnn" in refused(capsys, *arguments)
    assert [entry.name for entry in elsewhere.iterdir()] == ["taken"]


def test_a_folder_that_is_closed_to_us_is_named(elsewhere, capsys, monkeypatch):
    def closed(path, *_, **__):
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr(Path, "is_dir", closed)
    line = refused(capsys, "figure", "shut", "--kind", "map")
    assert "shut: cannot be read or written (permission denied)" in line


def test_a_terminal_that_is_full_or_gone_is_one_line(elsewhere, capsys, monkeypatch):
    class Full(io.StringIO):
        def write(self, text):
            raise OSError(28, "No space left on device")

    monkeypatch.setattr(sys, "stdout", Full())
    assert main(["planner", "list"]) == 2
    monkeypatch.undo()
    err = capsys.readouterr().err
    assert err.startswith("error: ")
    assert "no space left on device" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize("errors", ["strict", "surrogateescape"])  # the latter in the C locale
def test_a_name_that_the_terminal_cannot_show_is_shown_as_it_can(elsewhere, monkeypatch, errors):
    terminal = io.BytesIO()
    stream = io.TextIOWrapper(terminal, encoding="ascii", errors=errors)
    monkeypatch.setattr(sys, "stdout", stream)
    assert main(["scenario", "check", "village", "--picture", "dörfer.png"]) == 0
    sys.stdout.flush()
    assert b"drawn in d\\xf6rfer.png" in terminal.getvalue()


def test_the_installed_command_answers_like_this_process(elsewhere, user_environment):
    program = Path(sys.executable).with_name("uas-coverage")
    (elsewhere / "bad.toml").write_text("schema = 1\nname = ")
    for arguments in (["run", "bad.toml"], ["run", "village", "--wind", "3"]):
        result = subprocess.run(
            [program, *arguments],
            cwd=elsewhere,
            env=user_environment,
            capture_output=True,
            text=True,
            timeout=120,
        )
        assert result.returncode == 2
        assert result.stderr.startswith("error: ")
        assert result.stderr.count("\n") == 1
        assert "Traceback" not in result.stderr
    result = subprocess.run(
        [program, "run", "village", "--planner", "hover", "--steps", "2", "--out", "mine"],
        cwd=elsewhere,
        capture_output=True,
        text=True,
        timeout=300,
    )
    # nothing is wrong, but that kernels are compiled may be said
    said = [line for line in result.stderr.splitlines() if "compiling for planner" not in line]
    assert (result.returncode, said) == (0, [])
    assert (elsewhere / "mine" / "flight.csv").exists()
