"""The output directory of a command: checked before the work, written all or nothing."""

import os
import tempfile
from collections.abc import Mapping
from pathlib import Path

from uas_coverage_env.files.strict_toml import InputError


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
    """Write every file beside its place first, then move them all: no half of them stays behind.

    Raises:
        InputError: One cannot be written.
    """
    written: list[tuple[Path, Path]] = []
    try:
        for name, content in contents.items():
            temporary = directory / f".{name}.{os.getpid()}"
            written.append((temporary, directory / name))
            temporary.write_bytes(content)
        for temporary, final in written:
            temporary.replace(final)
    except OSError as error:
        raise InputError(f"{directory}: cannot be written ({error.strerror})") from error
    finally:
        for temporary, _ in written:
            temporary.unlink(missing_ok=True)
