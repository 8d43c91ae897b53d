"""The folder that somebody names for results: there, and open to us, before the work begins."""

import tempfile
from pathlib import Path

from uas_coverage_env.strict_toml import InputError


def prepare_folder(directory: Path) -> set[str]:
    """Make a folder where there is none, and see that files can be written to it.

    Returns:
        The names of what it holds.

    Raises:
        InputError: It is a file, or cannot be written.
    """
    try:
        if directory.exists() and not directory.is_dir():
            raise InputError(f"{directory}: is a file; give a folder")
        directory.mkdir(parents=True, exist_ok=True)
        names = {path.name for path in directory.iterdir()}
        with tempfile.TemporaryFile(dir=directory):
            return names
    except OSError as error:
        raise InputError(f"{directory}: cannot be written ({error.strerror})") from error
