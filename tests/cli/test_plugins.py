from importlib.metadata import EntryPoint

import pytest
import typer

from uas_coverage_env.cli import main, plugins


def greet(name: str) -> None:
    """Say something."""
    typer.echo(f"hello {name}")


@pytest.fixture(autouse=True)
def others(tmp_path, monkeypatch):
    """A command of another package, one whose package is missing, and one whose package fails."""
    (tmp_path / "failing_commands.py").write_text('raise RuntimeError("no licence")')
    monkeypatch.syspath_prepend(tmp_path)
    entries = [
        EntryPoint("greet", f"{__name__}:greet", plugins.GROUP),
        EntryPoint("broken", "no_such_package_at_all:command", plugins.GROUP),
        EntryPoint("failing", "failing_commands:command", plugins.GROUP),
    ]
    monkeypatch.setattr(plugins, "entry_points", lambda group: entries)


def test_another_package_adds_a_command(capsys):
    assert main(["greet", "swarm"]) == 0
    assert capsys.readouterr().out == "hello swarm\n"


def test_a_broken_command_says_so_when_it_is_called_and_harms_no_other(capsys):
    assert main(["broken"]) == 2
    said = (
        "error: command 'broken' cannot be loaded: ModuleNotFoundError: "
        "No module named 'no_such_package_at_all'\n"
    )
    assert capsys.readouterr().err == said


def test_a_command_whose_module_raises_is_one_line_with_its_place(capsys):
    assert main(["failing"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: command 'failing' cannot be loaded: RuntimeError: no licence (")
    assert said.endswith("failing_commands.py:1)\n")


def test_commands_of_other_packages_are_listed_with_what_they_say(capsys):
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert "Say something." in listed
    assert "Not available here." in listed
