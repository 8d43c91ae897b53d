"""Plain files, read and written whole; files from others are opened with care.

A pipe would be waited for, a device never ends, and a link would be written through: only plain
files are read, up to a size, and a file is written beside its place and then put there.
"""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from uas_coverage_env.files.errors import InputError

MOST_BYTES = 2**30
"""The default bound of what is read: flights of a day have less."""


def read_bytes(path: Path, most_bytes: int = MOST_BYTES) -> bytes:
    """The content of a plain file.

    Args:
        path: The file, or a link to it.
        most_bytes: A larger one is refused, and not read.

    Raises:
        InputError: It is a pipe, a device or something else that is no plain file, or too large.
        OSError: It cannot be read.
    """
    # without O_NONBLOCK, opening a pipe waits for its other end
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0))
    with os.fdopen(descriptor, "rb") as file:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise InputError(f"{path}: is not a plain file; give the file itself")
        content = file.read(most_bytes + 1)
    if len(content) > most_bytes:
        raise InputError(f"{path}: is larger than {most_bytes / 1e6:.3g} MB; give a smaller file")
    return content


def read_text(path: Path, most_bytes: int = MOST_BYTES) -> str:
    """The text of a plain file, see `read_bytes` and `decoded`."""
    return decoded(read_bytes(path, most_bytes))


def decoded(content: bytes) -> str:
    """The text of a file in UTF-8.

    Windows' editors and spreadsheets begin it with a byte order mark, which is no part of it.

    Raises:
        UnicodeDecodeError: It is not UTF-8.
    """
    return content.decode("utf-8-sig").replace("\r\n", "\n")


def write_beside(path: Path, content: bytes) -> Path:
    """Write what is to become a file into a new one beside it, complete on the disk.

    Returns:
        The new file, for `Path.replace`. Where `path` is a link, that replaces the link, and what
        it points to stays as it is.

    Raises:
        OSError: It cannot be written; nothing is left.
    """
    try:
        descriptor, name = tempfile.mkstemp(".part", f".{path.name}.", path.parent)
    except OSError as error:  # the name of the file that was asked for, not of the one beside it
        raise OSError(error.errno, error.strerror, str(path)) from None
    written = Path(name)
    try:
        with os.fdopen(descriptor, "wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        written.chmod(0o666 & ~_umask())
    except BaseException:
        written.unlink(missing_ok=True)
        raise
    return written


def write_atomically(path: Path, content: bytes) -> None:
    """Write a file so that it is there in full or, as before, not at all.

    Raises:
        OSError: It cannot be written.
    """
    written = write_beside(path, content)
    try:
        written.replace(path)
    finally:
        written.unlink(missing_ok=True)
    sync_folder(path.parent)


@contextmanager
def written_by(path: Path) -> Iterator[Path]:
    """For what writes a file itself, by its name: a place beside it, moved there at the end.

    Yields:
        Where to write; it has the suffix of `path`.

    Raises:
        OSError: It cannot be written.
    """
    with tempfile.TemporaryDirectory(".part", f".{path.name}.", path.parent) as folder:
        place = Path(folder) / path.name
        yield place
        place.replace(path)


def sync_folder(folder: Path) -> None:
    """Have the names in a folder, too, reach the disk; where the system cannot, do nothing."""
    try:
        descriptor = os.open(folder, os.O_RDONLY)
    except OSError:  # Windows opens no folders
        return
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def _umask() -> int:
    # the only way to read it is to set it
    mask = os.umask(0o077)
    os.umask(mask)
    return mask
