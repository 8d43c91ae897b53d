"""Where the flights were flown: times mean nothing without it."""

import os
import platform
from importlib.metadata import version
from pathlib import Path

from uas_coverage_env.leaderboard.sweep import PACKAGE


def machine() -> str:
    """Processor, cores and system in one line."""
    return f"{_processor()}, {os.cpu_count()} cores, {platform.system()}"


def versions() -> str:
    """This package, Python and what figures depend on, in one line."""
    packages = (PACKAGE, "numpy", "scipy", "numba", "highspy")
    parts = [f"{name} {version(name)}" for name in packages]
    return ", ".join([*parts, f"Python {platform.python_version()}"])


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:  # not Linux
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(iter(names), "") or platform.processor() or platform.machine()
