"""`run --settings FILE`: options from a file, as strictly read as any file."""

import json

import pytest

from uas_coverage_env.cli import main

HOVER = 'scenario = "open_field"\nplanner = "hover"\nsteps = 2\nquiet = true\n'


@pytest.fixture
def settings(tmp_path, monkeypatch):
    """Writes a file of settings, and is where commands run."""
    monkeypatch.chdir(tmp_path)

    def written(text):
        path = tmp_path / "settings.toml"
        path.write_text(text, encoding="utf-8")
        return path.name

    return written


def flown(folder, file="summary.json"):
    return json.loads((folder / file).read_text(encoding="utf-8"))


def test_options_come_from_the_file_and_typed_ones_win(settings, tmp_path, capsys):
    path = settings(HOVER + 'out = "first"\n[option]\nclimb_m = 3\n')
    assert main(["run", "--settings", path]) == 0
    assert capsys.readouterr().out == ""
    first = flown(tmp_path / "first")
    assert first["planner"] == {"name": "hover", "options": {"climb_m": 3.0}}
    assert first["steps"] == 2
    assert main(["run", "corridor", "--settings", path, "--steps", "1", "--out", "second"]) == 0
    assert flown(tmp_path / "second")["steps"] == 1
    assert flown(tmp_path / "second", "scenario.json")["name"] == "corridor"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("stepps = 2\n", "settings.toml: stepps: unknown key; did you mean steps?"),
        ('steps = "2"\n', 'settings.toml: steps: should be a whole number, not "2"'),
        ("watch = 1\n", "settings.toml: watch: should be true or false"),
        ('dynamics = "exact"\n', "settings.toml: dynamics: should be 'lpv' or 'nonlinear'"),
        ('option = ["climb_m=3"]\n', "settings.toml: option: should be a table"),
        ('settings = "other.toml"\n', "settings.toml: settings: unknown key"),
    ],
)
def test_mistakes_in_the_file_are_told_in_a_line(settings, capsys, text, message):
    assert main(["run", "open_field", "--settings", settings(text)]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1


def test_a_file_that_is_not_there_is_refused(settings, capsys):
    assert main(["run", "open_field", "--settings", "none.toml"]) == 2
    assert "none.toml: no such file" in capsys.readouterr().err
