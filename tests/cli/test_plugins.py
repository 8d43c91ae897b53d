from importlib.metadata import EntryPoint

import pytest
import typer
from typer.testing import CliRunner

from uas_coverage_env.cli import plugins
from uas_coverage_env.files.strict_toml import InputError


def greet(name: str) -> None:
    """Say something."""
    typer.echo(f"hello {name}")


@pytest.fixture
def app(monkeypatch) -> typer.Typer:
    """A command line with a command of another package, and one whose package is broken."""
    entries = [
        EntryPoint("greet", f"{__name__}:greet", plugins.GROUP),
        EntryPoint("broken", "no_such_package_at_all:command", plugins.GROUP),
    ]
    monkeypatch.setattr(plugins, "entry_points", lambda group: entries)
    app = typer.Typer()
    plugins.add_plugin_commands(app)
    return app


def test_another_package_adds_a_command(app):
    result = CliRunner().invoke(app, ["greet", "swarm"])
    assert (result.exit_code, result.stdout) == (0, "hello swarm\n")


def test_a_broken_command_says_so_when_it_is_called_and_harms_no_other(app):
    result = CliRunner().invoke(app, ["broken"])
    assert isinstance(result.exception, InputError)
    assert "'broken' cannot be loaded: No module named 'no_such_package_at_all'" in str(
        result.exception
    )
