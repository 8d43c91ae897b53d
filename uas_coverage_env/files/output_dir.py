"""The output directory of a command: checked before the work, written all or nothing."""

import glob
import tempfile
from collections.abc import Mapping
from pathlib import Path

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import sync_folder, write_beside


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


def write_files(directory: Path, contents: Mapping[str, bytes]) -> None:
    """Write files that belong together, so that no mixture of old and new is ever taken for whole.

    All are written beside their places first. The last one seals the others: an older one is taken
    away before any of them is moved, and the new one is moved after them. Links are replaced, not
    followed.

    Raises:
        InputError: One cannot be written.
    """
    *parts, seal = contents
    written: dict[str, Path] = {}
    try:
        for name, content in contents.items():
            for left in directory.glob(f".{glob.escape(name)}.*.part"):
                left.unlink(missing_ok=True)  # of a process that was killed
            written[name] = write_beside(directory / name, content)
        if parts:
            (directory / seal).unlink(missing_ok=True)
            sync_folder(directory)
        for name, temporary in written.items():
            temporary.replace(directory / name)
        sync_folder(directory)
    except OSError as error:
        raise InputError(f"{directory}: cannot be written ({error.strerror})") from error
    finally:
        for temporary in written.values():
            temporary.unlink(missing_ok=True)
