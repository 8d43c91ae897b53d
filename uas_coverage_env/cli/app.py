"""The commands of `uas-coverage` and what becomes of their mistakes."""

import io
import sys
from collections.abc import Sequence
from importlib.metadata import version
from typing import Annotated

import typer

from uas_coverage_env.cli import (
    compare,
    figure,
    operations,
    planners,
    replay,
    run,
    scenarios,
    vehicle,
    warm_up,
)
from uas_coverage_env.cli.output import DONE, FAILED, one_line
from uas_coverage_env.cli.plugins import add_plugin_commands
from uas_coverage_env.cli.termination import terminated_as_by_hand
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import PlannerError

PROGRAM = "uas-coverage"

# what typer makes of Ctrl-C that no command has caught
_CTRL_C = 130

app = typer.Typer(
    add_completion=False,
    invoke_without_command=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
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

    Exits 0 on success, 1 where a mission failed, 2 where the input is bad.
    """
    if show_version:
        typer.echo(f"{PROGRAM} {version('uas-coverage-env')}")
        raise typer.Exit()
    if context.invoked_subcommand is None:
        typer.echo(context.get_help())


app.command("run")(run.run)
app.command("compare")(compare.compare)
app.command("warm-up")(warm_up.warm_up)
app.command("planners")(planners.planners)
app.command("replay")(replay.replay)
app.command("figure")(figure.figure)
app.command("import")(operations.import_area)
app.command("export")(operations.export)
app.add_typer(scenarios.app, name="scenarios")
app.add_typer(vehicle.app, name="vehicle")
add_plugin_commands(app)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command and return the exit code; invalid input is reported in one line."""
    command = typer.main.get_command(app)
    _never_stop_at_a_letter()
    try:
        with terminated_as_by_hand():
            code = command.main(args=argv, prog_name=PROGRAM, standalone_mode=False) or DONE
    except typer.TyperException as error:
        return _refuse(error.format_message(), error.exit_code)
    except InputError as error:
        return _refuse(str(error), 2)
    except PlannerError as error:
        return _refuse(str(error), FAILED)
    except OSError as error:
        # a folder that is closed to us, a name that is too long, a full disk: a hundred places
        # may raise them, and which call it was is of no use to the user
        return _refuse(_of_a_file(error), 2)
    if code == _CTRL_C:
        return _refuse("stopped by hand before there was anything to keep", FAILED)
    return code


def _never_stop_at_a_letter() -> None:
    r"""Names of files may hold what the terminal cannot show: it is written as `\xfc` then."""
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")


def _of_a_file(error: OSError) -> str:
    reason = (error.strerror or str(error)).lower()
    if error.filename is None:
        return f"a file or the terminal cannot be read or written ({reason})"
    return f"{error.filename}: cannot be read or written ({reason}); check the path and its rights"


def _refuse(message: str, code: int) -> int:
    sys.stderr.write(f"error: {one_line(message)}\n")
    return code
