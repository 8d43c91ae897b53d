"""A program of `benchmarks/` run in this process, which has imported what it needs already."""

import runpy
import sys
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from unittest.mock import patch


def refusal(program: Path, *arguments: str) -> tuple[object, str, str]:
    """What a program ends with, and says, where it is started wrongly.

    Returns:
        Exit code, standard output, errors.
    """
    said, wrong, code = StringIO(), StringIO(), None
    with (
        patch.object(sys, "argv", [str(program), *arguments]),
        patch.object(sys, "path", [str(program.parent), *sys.path]),
        redirect_stdout(said),
        redirect_stderr(wrong),
    ):
        try:
            runpy.run_path(str(program), run_name="__main__")
        except SystemExit as ended:
            code = ended.code
    return code, said.getvalue(), wrong.getvalue()
