"""What a test calls in a process of its own, which has compiled nothing yet.

Such processes are forked from one that has imported numba, where the system can do so: to import
it takes longer than to compile these kernels.
"""

import multiprocessing
import sys
from importlib import import_module

_FORKED = "forkserver" in multiprocessing.get_all_start_methods()
_PROCESSES = multiprocessing.get_context("forkserver" if _FORKED else "spawn")
_PROCESSES.set_forkserver_preload(["uas_coverage_env.compiled.kernels"])


def in_new_process(folder: str, module: str, name: str, number: float) -> tuple[float, int]:
    """What a kernel returns, and how many versions of it came from the cache.

    Args:
        folder: Where its module lies, or the package that holds it.
        module: Its name.
        name: Of the kernel.
        number: What it is called with.
    """
    with _PROCESSES.Pool(1) as pool:
        return pool.apply(_call, (folder, module, name, number))


def _call(folder: str, module: str, name: str, number: float) -> tuple[float, int]:
    from numba import config

    config.CACHE_DIR = ""  # not that of whoever runs the tests
    sys.dont_write_bytecode = True  # files are edited faster than their times can tell
    sys.path.insert(0, folder)
    function = getattr(import_module(module), name)
    value = function(number)
    stats = getattr(getattr(function, "for_python", None), "stats", None)
    return value, len(stats.cache_hits) if stats else 0
