"""Commands that are imported when they run: to list them, none of the package's is imported."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

MARKUP = "markdown"
HELP = {"help_option_names": ["-h", "--help"]}


def without_type_of_flags(params: Sequence[Any]) -> list[Any]:
    """Options as they are, but that a flag, which takes no value, is shown with none."""
    for param in params:
        if getattr(param, "is_flag", False):
            param.metavar = ""
    return list(params)


class Located(NamedTuple):
    """A command that is not imported before it is called."""

    place: str
    """MODULE:NAME of a function as typer takes it."""
    load: Callable[[], Any]
    """Imports it."""

    def summary(self) -> str:
        """The first paragraph of its docstring, read from its file; empty where there is none."""
        module, _, name = self.place.partition(":")
        with suppress(Exception):  # whatever is wrong is told when it is called
            spec = find_spec(module)
            source = Path(str(spec and spec.origin)).read_text("utf-8")
            for node in ast.parse(source).body:
                if isinstance(node, ast.FunctionDef) and node.name == name:
                    return " ".join((ast.get_docstring(node) or "").partition("\n\n")[0].split())
        return ""


class GroupOfCommands(NamedTuple):
    """Commands that are typed behind a common word."""

    meaning: str
    commands: Mapping[str, Located]

    def summary(self) -> str:
        """Its line in the list of commands."""
        return self.meaning


CommandEntry = Located | GroupOfCommands


def at(location: str) -> Located:
    """The command MODULE:NAME of this package."""
    module, _, name = location.partition(":")
    module = f"{__package__}.{module}"
    return Located(f"{module}:{name}", lambda: getattr(import_module(module), name))


class _NotImported(TyperCommand):
    """What stands for a command in a list."""

    def __init__(self, name: str, entry: CommandEntry) -> None:
        super().__init__(name=name)
        self.entry = entry


class LazyGroup(TyperGroup):
    """A group of commands that are imported when they are called."""

    _lists = False

    def add_entries(self, entries: Mapping[str, CommandEntry]) -> None:
        """Add commands, by name."""
        for name, entry in entries.items():
            self.add_command(_NotImported(name, entry))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; where commands are only listed, what stands for it."""
        command = super().get_command(ctx, cmd_name)
        if not isinstance(command, _NotImported):
            return command
        if self._lists:
            command.help = command.entry.summary()
            if command.help:
                return command
        command = _command_of(cmd_name, command.entry)
        without_type_of_flags(command.get_params(ctx))
        return command

    def get_params(self, ctx: Any) -> list[Any]:
        """The options of the group."""
        return without_type_of_flags(super().get_params(ctx))

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """What a shell offers to complete a command with: like the help, it imports none."""
        self._lists = True
        try:
            return super().shell_complete(ctx, incomplete)
        finally:
            self._lists = False

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help."""
        self._lists = True
        try:
            super().format_help(ctx, formatter)
        finally:
            self._lists = False


def _command_of(name: str, entry: CommandEntry) -> Any:
    if isinstance(entry, Located):
        app = typer.Typer(add_completion=False, rich_markup_mode=MARKUP)
        app.command(name)(entry.load())
        command = typer.main.get_command(app)
    else:
        app = typer.Typer(
            cls=LazyGroup,
            invoke_without_command=True,
            add_completion=False,
            rich_markup_mode=MARKUP,
        )
        app.callback(help=entry.meaning, context_settings=HELP)(_help_unless_called)
        command = typer.main.get_command(app)
        assert isinstance(command, LazyGroup)
        command.add_entries(entry.commands)
    command.name = name
    return command


def _help_unless_called(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
