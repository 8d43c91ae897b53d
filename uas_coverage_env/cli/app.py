"""The commands of `uas-coverage` and what becomes of their mistakes."""

import io
import os
import sys
import traceback
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from uas_coverage_env.cli.lazy import MARKUP, CommandEntry, LazyGroup, at
from uas_coverage_env.cli.output import DONE, FAILED, one_line
from uas_coverage_env.cli.plugins import plugin_entries
from uas_coverage_env.cli.termination import terminated_as_by_hand
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.files.errors import InputError, PlannerError
from uas_coverage_env.plugins.users_code import described, place_of

PROGRAM = "uas-coverage"

# what typer makes of Ctrl-C that no command has caught
_CTRL_C = 130
_STOPPED = "stopped by hand; what was finished before is kept"

_TRACEBACK = "UAS_COVERAGE_TRACEBACK"
"""Environment variable; set, the traceback of an error comes before its line."""

_FEW = 6
"""Commands of a group that a message names; of more, the help."""

_CLI = "uas_coverage_env.cli"

COMMANDS = (
    CommandEntry(
        "demo",
        at(f"{_CLI}.demo:demo"),
        "Show a recorded flight, fly a first one, and open the page of each in a browser.",
    ),
    CommandEntry("run", at(f"{_CLI}.run:run"), "Fly one mission and write a flight directory."),
    CommandEntry(
        "compare",
        at(f"{_CLI}.compare:compare"),
        "Fly every planner on every scenario with every seed, and compare them.",
    ),
    CommandEntry(
        "demonstrate",
        at(f"{_CLI}.demonstrate:demonstrate_command"),
        "Fly missions and keep observations and what was done, for imitation.",
    ),
    CommandEntry(
        "score",
        at(f"{_CLI}.score:score_command"),
        "Fly the missions of a level and print the scores (docs/levels.md).",
    ),
    CommandEntry(
        "warm-up",
        at(f"{_CLI}.warm_up:warm_up"),
        "Compile the simulation for this machine, so that the first flight begins at once.",
    ),
    CommandEntry(
        "planners",
        at(f"{_CLI}.planners:planners"),
        "List the planners and their options (set them with `run --option key=value`).",
    ),
    CommandEntry(
        "show",
        at(f"{_CLI}.show:show"),
        "Show the figures of a flight, or of two side by side.",
    ),
    CommandEntry(
        "replay",
        at(f"{_CLI}.replay:replay"),
        "Write DIR/replay.html, a page that opens from disk and needs no network.",
    ),
    CommandEntry(
        "figure",
        at(f"{_CLI}.figure:figure"),
        "Draw a figure as a vector file (needs the extra `view`).",
    ),
    CommandEntry(
        "import",
        at(f"{_CLI}.operations:import_area"),
        "Make a scenario from drawn areas, no-fly zones and take-off places (extra `ops`).",
    ),
    CommandEntry(
        "export",
        at(f"{_CLI}.operations:export"),
        "Write a file for each sortie, few straight checked legs, and a report (extra `ops`).",
    ),
    CommandEntry(
        "stream",
        at(f"{_CLI}.stream:stream"),
        "Fly a plan in time on ArduPilot or PX4, by MAVLink position targets (extra `ops`).",
    ),
    CommandEntry(
        "import-log",
        at(f"{_CLI}.logs:import_log"),
        "Make a flight directory from logs of UAS that flew, judged by the rules (extra `ops`).",
    ),
    CommandEntry(
        "resume",
        at(f"{_CLI}.resume:resume"),
        "Write the scenario of what a flight has left to cover.",
    ),
    CommandEntry(
        "scenarios", at(f"{_CLI}.scenarios:app"), "List the shipped scenarios, or check one."
    ),
    CommandEntry(
        "vehicle", at(f"{_CLI}.vehicle:app"), "List the shipped vehicles, check one, or make one."
    ),
    CommandEntry("vehicles", at(f"{_CLI}.vehicle:list_vehicles"), "List the shipped vehicles."),
)
"""The commands of the package; each says in its first line what stands here."""

app = typer.Typer(
    cls=LazyGroup,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=MARKUP,
    context_settings={"help_option_names": ["-h", "--help"]},
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
    exception (UAS_COVERAGE_TRACEBACK=1 shows its traceback).
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
    group.add_entries([*COMMANDS, *plugin_entries()])
    return group


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; invalid input is reported in one line."""
    with terminated_as_by_hand() as was_stopped:
        try:
            return _run(argv)
        except Exception as error:
            # an interruption inside a library may come out as any error
            if was_stopped():
                return _refuse(f"stopped by hand ({type(error).__name__})", FAILED)
            if isinstance(error, PlannerError):
                return _told(error, str(error))
            # of a table, a family or a command from another package
            if place_of(error):
                return _told(error, described(error))
            raise
        except KeyboardInterrupt:
            return _refuse(_STOPPED, FAILED)


def _run(argv: Sequence[str] | None) -> int:
    words = sys.argv[1:] if argv is None else argv
    try:
        command = command_group()
        _never_stop_at_a_letter()
        with compiling_for(" ".join([PROGRAM, *words[:1]])):
            code = command.main(args=argv, prog_name=PROGRAM, standalone_mode=False) or DONE
    except typer.TyperException as error:
        return _refuse(_of_the_command_line(error), error.exit_code)
    except InputError as error:
        return _told(error, str(error))
    except OSError as error:
        # a folder that is closed to us, a name that is too long, a full disk: a hundred places
        # may raise them, and which call it was is of no use to the user
        return _refuse(_of_a_file(error), 2)
    if code == _CTRL_C:
        return _refuse(_STOPPED, FAILED)
    return code


def _never_stop_at_a_letter() -> None:
    r"""Names of files may hold what the terminal cannot show: it is written as `\xfc` then."""
    # the latter in the C locale
    stops = ("strict", "surrogateescape")
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors in stops:
        sys.stdout.reconfigure(errors="backslashreplace")


def _of_the_command_line(error: typer.TyperException) -> str:
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
    return _refuse(message, 2)


def _refuse(message: str, code: int) -> int:
    sys.stderr.write(f"error: {one_line(message)}\n")
    return code
