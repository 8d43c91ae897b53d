"""How the commands speak: plain lines and tables on stdout, warnings on stderr."""

import sys
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console

from uas_coverage_env.files.errors import InputError

if TYPE_CHECKING:
    from uas_coverage_env.scenario import Scenario

DONE, FAILED, REFUSED = 0, 1, 2


def console(*, quiet: bool = False) -> Console:
    """A console on stdout as it is now; numbers in our lines are not coloured.

    Args:
        quiet: It prints nothing.
    """
    return Console(highlight=False, soft_wrap=True, quiet=quiet)


def one_line(text: str) -> str:
    """The text without line breaks."""
    return " ".join(text.split())


def warn(lines: Iterable[str]) -> None:
    """Say on stderr what is doubtful, a line each."""
    for line in lines:
        sys.stderr.write(f"warning: {one_line(line)}\n")


@contextmanager
def extra(name: str, what: str, libraries: Collection[str]) -> Iterator[None]:
    """Say which extra is missing, where what is imported is not installed.

    Args:
        name: Of the extra.
        what: That needs it.
        libraries: Of the extra.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        library = (error.name or "").partition(".")[0]
        if library not in libraries:
            raise
        raise InputError(f'{what} {library}: pip install "uas-coverage-env[{name}]"') from error


def loaded(name_or_path: str) -> "Scenario":
    """Load a scenario; what is doubtful about it goes to stderr, a line each."""
    from uas_coverage_env.scenario import (  # a second that help need not take
        load_scenario,
        warnings,
    )

    scenario = load_scenario(name_or_path)
    warn(warnings(scenario))
    return scenario
