"""The command line imports a command when it is called."""

import subprocess
import sys

import pytest
import typer

from uas_coverage_env.cli import main
from uas_coverage_env.cli.app import COMMANDS, command_group

WORDS = [
    (name, *([part] if part else []))
    for name, entry in COMMANDS.items()
    for part in getattr(entry, "commands", [None])
]


def command_of(words):
    """The command as it is imported, and what imports it."""
    context, command = typer.Context(command_group()), command_group()
    for word in words:
        command = command.get_command(context, word)
    return command


def test_there_are_sixteen_commands():
    assert list(command_group().commands) == [
        *("demo", "run", "compare", "score", "show", "replay", "figure", "scenario", "vehicle"),
        *("planner", "import", "export", "stream", "log", "reproduce", "train"),
    ]


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_the_list_says_of_a_command_what_its_own_help_says_first(words):
    command = command_of(words)
    assert not hasattr(command, "entry"), "not imported"
    entry = COMMANDS[words[0]]
    entry = entry.commands[words[1]] if words[1:] else entry
    assert len(entry.summary()) > 20
    assert " ".join(command.help.partition("\n\n")[0].split()) == entry.summary()


@pytest.mark.parametrize("words", [(), *WORDS], ids=" ".join)
def test_every_command_has_help(words, capsys):
    assert main([*words, "--help"]) == 0
    assert f"Usage: {' '.join(['uas-coverage', *words])}" in capsys.readouterr().out


def test_a_list_of_commands_compiles_and_flies_nothing():
    code = (
        "import sys; from uas_coverage_env.cli import main; code = main(sys.argv[1:]);"
        "sys.exit(code or 10 * any(name in sys.modules for name in ('numba', 'scipy', 'PIL')))"
    )
    for words in (["--version"], ["--help"], ["runn", "village"], ["scenario"], ["front"]):
        ended = subprocess.run([sys.executable, "-c", code, *words], check=False)
        assert ended.returncode == (2 if words[0] in ("runn", "front") else 0), words


def test_a_misspelt_command_is_answered_with_the_right_one(capsys):
    assert main(["replya", "flight"]) == 2
    assert "Did you mean 'replay'?" in capsys.readouterr().err
