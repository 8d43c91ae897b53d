"""The command line imports a command when it is called."""

import subprocess
import sys

import pytest
import typer
from typer.core import TyperGroup

from uas_coverage_env.cli import main
from uas_coverage_env.cli.app import COMMANDS, command_group


@pytest.mark.parametrize("entry", COMMANDS, ids=lambda entry: entry.name)
def test_the_list_says_of_a_command_what_its_own_help_says_first(entry):
    group = command_group()
    context = typer.Context(group)
    command = group.get_command(context, entry.name)
    assert not hasattr(command, "entry"), "not imported"
    help_ = entry.load().info.help if isinstance(command, TyperGroup) else command.help
    assert " ".join(help_.partition("\n\n")[0].split()) == entry.summary


def test_a_list_of_commands_compiles_and_flies_nothing():
    code = (
        "import sys; from uas_coverage_env.cli import main; code = main(sys.argv[1:]);"
        "sys.exit(code or 10 * any(name in sys.modules for name in ('numba', 'scipy', 'PIL')))"
    )
    for words in (["--version"], ["--help"], ["runn", "village"]):
        ended = subprocess.run([sys.executable, "-c", code, *words], check=False)
        assert ended.returncode == (2 if words[0] == "runn" else 0), words


def test_a_misspelt_command_is_answered_with_the_right_one(capsys):
    assert main(["replya", "flight"]) == 2
    assert "Did you mean 'replay'?" in capsys.readouterr().err
