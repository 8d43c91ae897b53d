"""Commands that are imported when they run: to list them, none of the package's is imported."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from importlib import import_module
from typing import Any, NamedTuple

import typer
from typer.core import TyperCommand, TyperGroup

from uas_coverage_env.cli.retired import follower
from uas_coverage_env.files.errors import InputError

MARKUP = "markdown"
HELP = {"help_option_names": ["-h", "--help"]}


def without_type_of_flags(params: Sequence[Any]) -> list[Any]:
    """Options as they are, but that a flag, which takes no value, is shown with none."""
    for param in params:
        if getattr(param, "is_flag", False):
            param.metavar = ""
    return list(params)


class CommandEntry(NamedTuple):
    """A command of the command line, or a group of further ones."""

    name: str
    summary: str = ""
    """Its line in the list of commands; without one, it is imported for its own."""
    load: Callable[[], Any] | None = None
    """Imports it: a function as typer takes it. None: a group."""
    commands: tuple[CommandEntry, ...] = ()
    """Of a group."""


def at(location: str) -> Callable[[], Any]:
    """What imports MODULE:NAME."""

    def load() -> Any:
        module, _, name = location.partition(":")
        return getattr(import_module(module), name)

    return load


class _NotImported(TyperCommand):
    """What stands for a command in a list."""

    def __init__(self, entry: CommandEntry) -> None:
        super().__init__(name=entry.name, help=entry.summary)
        self.entry = entry


class LazyGroup(TyperGroup):
    """A group of commands that are imported when they are called."""

    _lists = False

    def add_entries(self, entries: Sequence[CommandEntry]) -> None:
        """Add commands; of two that have one name, the later one counts."""
        for entry in entries:
            self.add_command(_NotImported(entry))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """The command of a name; where commands are only listed, what stands for it."""
        command = super().get_command(ctx, cmd_name)
        if not isinstance(command, _NotImported) or (self._lists and command.entry.summary):
            return command
        command = _command_of(command.entry)
        without_type_of_flags(command.get_params(ctx))
        return command

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """The command that is called; what was one once is answered with what follows it."""
        if ctx.parent is None and args[0] not in self.commands:
            said = follower(*args[:2])
            if said:
                raise InputError(said)
        return super().resolve_command(ctx, args)

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


def _command_of(entry: CommandEntry) -> Any:
    if entry.load is None:
        app = typer.Typer(
            cls=LazyGroup,
            invoke_without_command=True,
            add_completion=False,
            rich_markup_mode=MARKUP,
        )
        app.callback(help=entry.summary, context_settings=HELP)(_help_unless_called)
        group = typer.main.get_command(app)
        assert isinstance(group, LazyGroup)
        group.add_entries(entry.commands)
        command: Any = group
    else:
        app = typer.Typer(add_completion=False, rich_markup_mode=MARKUP)
        app.command(entry.name)(entry.load())
        command = typer.main.get_command(app)
    command.name = entry.name
    return command


def _help_unless_called(context: typer.Context) -> None:
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())
