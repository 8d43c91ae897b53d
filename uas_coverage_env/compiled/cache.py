"""Compiled kernels on disk, by the contents of all sources that they are made from.

Numba's own cache compares the file of a function alone: where a function that it calls is edited,
it goes on to load the old code. Here each file's name says what it was compiled from, so that an
edit anywhere below is noticed and what is unaffected stays. The place is the one that numba would
take: `__pycache__`, `NUMBA_CACHE_DIR`, or the user's cache folder where the package cannot be
written to.
"""

import contextlib
import glob
import hashlib
import os
import pickle
import re
import uuid
from collections.abc import Callable, Iterator
from functools import cache
from typing import Any

import numba
from numba.core.caching import CacheImpl, CompileResultCacheImpl, FunctionCache, NullCache
from numba.core.dispatcher import Dispatcher
from numba.core.serialize import dumps

from uas_coverage_env.compiled.source_digest import source_digest

_MOST_VERSIONS = 64
"""Of one function that are kept: one that is built around numbers has a version for each."""

_NAME = re.compile(r"-\w+\.py\w+\.(?P<stamp>[0-9a-f]{16})\.[0-9a-f]{16}\.nbc$")


def keep_on_disk(dispatcher: Any) -> None:
    """Give a dispatcher that has compiled nothing yet a cache keyed by contents.

    Where its source cannot be read (typed into a prompt) or no folder can be written to, it is
    compiled anew in each process.

    Args:
        dispatcher: What numba makes of a function.
    """
    function = dispatcher.py_func
    try:
        digest = source_digest(function.__code__.co_filename)
        dispatcher._cache = _KernelCache(function, CompileResultCacheImpl, digest)
    except (OSError, RuntimeError):
        dispatcher._cache = NullCache()


def keep_as(form: type[CacheImpl], dispatcher: Any, kernel: Any) -> None:
    """Keep what else a function is compiled to where its kernel is kept, if that is.

    Args:
        form: How compiled versions are written and read; forms have files of their own.
        dispatcher: What compiles the other form; it has compiled nothing yet.
        kernel: Known by the sources that it was imported from, though they may be edited by now.
    """
    kept = kernel._cache
    if isinstance(kept, _KernelCache):
        dispatcher._cache = _KernelCache(dispatcher.py_func, form, kept.digest)


class _KernelCache(FunctionCache):
    """Numba's cache of a function with other files, and a key that lasts where kernels are built.

    A function built around kernels (a closure) is known by the sources of these, not by how they
    are pickled, which differs in each process.
    """

    def __init__(self, function: Callable[..., Any], form: type[CacheImpl], digest: str) -> None:
        self.digest = digest
        # another form, and other files, than those that numba's type checks know
        self._impl_class = form  # pyrefly: ignore[bad-assignment]
        super().__init__(function)
        files = _Files(self.cache_path, self._impl.filename_base, digest)
        self._cache_file = files  # pyrefly: ignore[bad-assignment]

    def _index_key(self, sig: Any, codegen: Any) -> Any:
        return sig, codegen.magic_tuple(), self._impl_class.__name__, _function_key(self._py_func)

    @contextlib.contextmanager
    def _guard_against_spurious_io_errors(self) -> Iterator[None]:
        # a full disk costs the next process a compilation, not this one its flight
        with contextlib.suppress(OSError):
            yield


def _function_key(function: Any) -> tuple[object, ...]:
    """What tells functions of one place in a file apart."""
    cells = function.__closure__ or ()
    return function.__code__.co_code.hex(), *(_cell_key(cell.cell_contents) for cell in cells)


def _cell_key(content: Any) -> object:
    cache = getattr(content, "_cache", None)
    if not isinstance(content, Dispatcher) or not isinstance(cache, _KernelCache):
        return hashlib.sha256(dumps(content)).hexdigest()
    function = content.py_func
    return function.__qualname__, cache.digest, _function_key(function)


class _Files:
    """The compiled versions of one function, a file each; as numba's `IndexDataCacheFile`.

    A name is made from all that a file depends on, so it needs no index, and files that processes
    write at the same time never mix.
    """

    def __init__(self, folder: str, base: str, digest: str) -> None:
        self._stamp = _hash(f"{numba.__version__} {digest}")
        self._stem = os.path.join(folder, f"{base}.{self._stamp}")

    def flush(self) -> None:
        for path in self._versions():
            _remove(path)

    def _versions(self) -> list[str]:
        return glob.glob(f"{glob.escape(self._stem)}.*.nbc")

    def load(self, key: Any) -> Any:
        try:
            with open(self._path(key), "rb") as file:
                return pickle.load(file)
        except Exception:  # not there, or cut off: compiled anew and replaced
            return None

    def save(self, key: Any, data: Any) -> None:
        if " at 0x" in repr(key):  # an argument that only this process knows by its address
            return
        path = self._path(key)
        unfinished = f"{path}.tmp.{uuid.uuid4().hex[:16]}"
        try:
            with open(unfinished, "wb") as file:
                file.write(dumps(data))
            os.replace(unfinished, path)
        except BaseException:
            _remove(unfinished)
            raise
        folder, name = os.path.split(path)
        _remove_outdated(folder, name.partition(".")[0], self._stamp)
        for surplus in sorted(self._versions(), key=_written_ns)[:-_MOST_VERSIONS]:
            _remove(surplus)

    def _path(self, key: Any) -> str:
        return f"{self._stem}.{_hash(repr(key))}.nbc"


def _hash(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:16]


@cache  # once in a process: after the first kernel of a module no outdated one is left
def _remove_outdated(folder: str, module: str, stamp: str) -> None:
    """Delete what was compiled from other sources of a module."""
    for path in glob.glob(os.path.join(glob.escape(folder), f"{glob.escape(module)}.*.nbc")):
        name = _NAME.search(path)
        if name is not None and name["stamp"] != stamp:
            _remove(path)


def _written_ns(path: str) -> int:
    try:
        return os.stat(path).st_mtime_ns
    except OSError:  # another process has removed it
        return 0


def _remove(path: str) -> None:
    with contextlib.suppress(OSError):
        os.remove(path)
