from importlib.metadata import EntryPoint

import pytest
import typer

from uas_coverage_env.cli import main, plugins


def greet(name: str) -> None:
    """Say something."""
    typer.echo(f"hello {name}")


@pytest.fixture(autouse=True)
def others(monkeypatch):
    """A command of another package, and one whose package is broken."""
    entries = [
        EntryPoint("greet", f"{__name__}:greet", plugins.GROUP),
        EntryPoint("broken", "no_such_package_at_all:command", plugins.GROUP),
    ]
    monkeypatch.setattr(plugins, "entry_points", lambda group: entries)


def test_another_package_adds_a_command(capsys):
    assert main(["greet", "swarm"]) == 0
    assert capsys.readouterr().out == "hello swarm\n"


def test_a_broken_command_says_so_when_it_is_called_and_harms_no_other(capsys):
    assert main(["broken"]) == 2
    said = "error: command 'broken' cannot be loaded: No module named 'no_such_package_at_all'\n"
    assert capsys.readouterr().err == said


def test_commands_of_other_packages_are_listed_with_what_they_say(capsys):
    assert main(["--help"]) == 0
    listed = capsys.readouterr().out
    assert "Say something." in listed
    assert "Not available here." in listed
