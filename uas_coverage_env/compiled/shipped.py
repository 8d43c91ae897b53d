"""Kernels that a wheel brings, compiled for every processor of a level: a cache that is only read.

`hatch_build.py` puts them beside this file. What is read is unpickled, as everything that numba
keeps: it is code like the rest of the package, and is read from nowhere else.
"""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from pathlib import Path
from zipfile import BadZipFile, ZipFile

ARCHIVE = Path(__file__).with_name("kernels.zip")

Processor = tuple[str, str, str]
"""What numba compiles for: the system (an LLVM triple), name and features of a processor."""

LEVEL = "x86-64-v3"
_FEATURES = (
    "avx", "avx2", "bmi", "bmi2", "cx16", "f16c", "fma", "lzcnt", "movbe", "popcnt", "sahf",
    "sse3", "sse4.1", "sse4.2", "ssse3", "xsave",
)  # fmt: skip
"""What a processor of the level has that not every x86-64 has (x86-64 psABI, table 3.1)."""

_passed_over = False


def at_level(processor: Processor) -> Processor | None:
    """The level as numba knows it, on the same system; None: the processor lacks features of it.

    Args:
        processor: The one that kernels are compiled for, which is this machine's unless
            NUMBA_CPU_FEATURES says otherwise.
    """
    system, _, features = processor
    has_all = {f"+{name}" for name in _FEATURES} <= set(features.split(","))
    return (system, LEVEL, "") if has_all and system.startswith("x86_64-") else None


def shipped(name: str) -> bytes | None:
    """The entry of the archive with this name; None: there is none."""
    archive = None if _passed_over else _archive()
    return archive.read(name) if archive and name in archive.NameToInfo else None


@contextmanager
def compiling_for_this_processor() -> Iterator[None]:
    """Have kernels compiled for this processor, for which they are a little faster."""
    global _passed_over
    before, _passed_over = _passed_over, True
    try:
        yield
    finally:
        _passed_over = before


@cache
def _archive() -> ZipFile | None:
    try:
        # from memory: processes that are forked share the place in an open file
        return ZipFile(BytesIO(ARCHIVE.read_bytes()))
    except FileNotFoundError:
        return None
    except (OSError, BadZipFile) as error:
        logging.getLogger("uas_coverage_env").warning(
            "%s cannot be read (%s): kernels are compiled; install the package again",
            ARCHIVE,
            error,
        )
        return None
