"""The commands of `uas-coverage` and what becomes of their mistakes."""

import io
import os
import sys
import traceback
from collections.abc import Mapping, Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from uas_coverage_env.cli.lazy import HELP, MARKUP, CommandEntry, GroupOfCommands, LazyGroup, at
from uas_coverage_env.cli.output import DONE, REFUSED, one_line
from uas_coverage_env.cli.plugins import plugin_entries
from uas_coverage_env.cli.retired import follower
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.files.errors import InputError, PlannerError
from uas_coverage_env.interruptions import PROGRAM, STOPPED, signals_stop_a_command
from uas_coverage_env.plugins.users_code import described, place_of

_STOPPED = "stopped by hand; what was finished before is kept"

_TRACEBACK = "UAS_COVERAGE_TRACEBACK"
"""Environment variable; set, the traceback of an error comes before its line."""

_FEW = 6
"""Commands of a group that a message names; of more, the help."""


COMMANDS: Mapping[str, CommandEntry] = {
    "demo": at("demo:demo"),
    "run": at("run:run"),
    "compare": at("compare:compare"),
    "score": at("score:score_command"),
    "show": at("show:show"),
    "replay": at("replay:replay"),
    "figure": at("figure:figure"),
    "scenario": GroupOfCommands(
        "List scenarios, check one, make one, or go on with a mission that was broken off.",
        {
            "list": at("scenario:list_scenarios"),
            "check": at("scenario:check"),
            "new": at("scenario:new"),
            "resume": at("scenario:resume"),
        },
    ),
    "vehicle": GroupOfCommands(
        "List the shipped vehicles, check one, or make one.",
        {
            "list": at("vehicle:list_vehicles"),
            "check": at("vehicle:check"),
            "new": at("vehicle:new"),
        },
    ),
    "planner": GroupOfCommands(
        "List planners and their options, compile for them, or keep what they do.",
        {
            "list": at("planner:list_planners"),
            "warm-up": at("warm_up:warm_up"),
            "demonstrate": at("demonstrate:demonstrate_command"),
        },
    ),
    "import": at("operations:import_area"),
    "export": at("operations:export"),
    "stream": at("stream:stream"),
    "log": at("logs:log"),
}
"""The commands of the package; with those that are installed beside it, they are sixteen."""

app = typer.Typer(
    cls=LazyGroup,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=MARKUP,
    context_settings=HELP,
)


@app.callback()
def describe(
    context: typer.Context,
    show_version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.")
    ] = False,
) -> None:
    """Plan, fly and evaluate coverage missions of a swarm of multicopters.

    Exits 0 on success, 1 where a mission failed, 2 where the input is bad or a planner raised an
    exception (UAS_COVERAGE_TRACEBACK=1 shows its traceback), 130 after Ctrl-C, 143 after SIGTERM.
    """
    if show_version:
        typer.echo(f"{PROGRAM} {version('uas-coverage-env')}")
        raise typer.Exit()
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


def command_group() -> LazyGroup:
    """The command line with the commands of the package and those of others."""
    group = typer.main.get_command(app)
    assert isinstance(group, LazyGroup)
    group.add_entries({**COMMANDS, **plugin_entries()})
    return group


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; invalid input is reported in one line."""
    with signals_stop_a_command() as stopped:
        try:
            code = _run(argv)
        except Exception as error:
            # an interruption inside a library may come out as any error
            if stopped():
                code = _refuse(f"stopped by hand ({type(error).__name__})", STOPPED)
            elif isinstance(error, PlannerError):
                code = _told(error, str(error))
            # of a table, a family or a command from another package
            elif place_of(error):
                code = _told(error, described(error))
            else:
                raise
        except KeyboardInterrupt:
            code = _refuse(_STOPPED, STOPPED)
        # a command that was stopped may have ended in its own way, with all that it had
        return stopped() or code


def _run(argv: Sequence[str] | None) -> int:
    words = sys.argv[1:] if argv is None else argv
    try:
        command = command_group()
        _never_stop_at_a_letter()
        with compiling_for(" ".join([PROGRAM, *words[:1]])):
            code = command.main(args=argv, prog_name=PROGRAM, standalone_mode=False) or DONE
    except typer.TyperException as error:
        return _refuse(_of_the_command_line(error, words), error.exit_code)
    except InputError as error:
        return _told(error, str(error))
    except OSError as error:
        # a folder that is closed to us, a name that is too long, a full disk: a hundred places
        # may raise them, and which call it was is of no use to the user
        return _refuse(_of_a_file(error), REFUSED)
    if code == STOPPED:  # what typer makes of Ctrl-C that no command has caught
        return _refuse(_STOPPED, STOPPED)
    return code


def _never_stop_at_a_letter() -> None:
    r"""Names of files may hold what the terminal cannot show: it is written as `\xfc` then."""
    # the latter in the C locale
    stops = ("strict", "surrogateescape")
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors in stops:
        sys.stdout.reconfigure(errors="backslashreplace")


def _of_the_command_line(error: typer.TyperException, words: Sequence[str]) -> str:
    # what was typed once is not known now, whatever follows it
    said = follower(*words[:2]) or follower(*words[:1], getattr(error, "option_name", None) or "")
    if said:
        return said
    close = getattr(error, "possibilities", None)  # of an option that there is not, closest first
    if close:
        return f"No such option: {getattr(error, 'option_name', '')}. Did you mean {close[0]!r}?"
    message = error.format_message().replace("Value error, ", "")  # pydantic's word for its reason
    mistakes = getattr(error.__cause__, "errors", None)  # pydantic's, which does not say the value
    if mistakes:
        message = message.replace("Input should", f"{mistakes()[0]['input']!r} should")
    what = getattr(getattr(error, "param", None), "help", None)
    if message.startswith("Missing ") and message.endswith("'.") and what:
        return f"{message.removesuffix('.')}: {what}"
    if message.startswith("No such command") and "Did you mean" not in message:
        context = getattr(error, "ctx", None)
        known = list(getattr(context and context.command, "commands", ()))
        if len(known) > _FEW:
            return f"{message} See `{PROGRAM} --help`."
        return f"{message} Take {', '.join(known)}."
    return message


def _of_a_file(error: OSError) -> str:
    reason = (error.strerror or str(error)).lower()
    if error.filename is None:
        return f"a file or the terminal cannot be read or written ({reason})"
    return f"{error.filename}: cannot be read or written ({reason}); check the path and its rights"


def _told(error: Exception, message: str) -> int:
    if os.environ.get(_TRACEBACK):
        traceback.print_exception(error)
    return _refuse(message, REFUSED)


def _refuse(message: str, code: int) -> int:
    sys.stderr.write(f"error: {one_line(message)}\n")
    return code
