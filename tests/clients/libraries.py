"""What the tests of this folder share."""

import warnings
from typing import Any

import pytest

from uas_coverage_env import generate_scenario

SHORT: dict[str, Any] = {
    "scenario": generate_scenario(0, n_uas=2, n_waypoints=6, n_obstacles=1),
    "max_cycles": 12,
}
"""Two UAS, fewer waypoints than choices; a mission is over in 12 steps."""


def library(name: str) -> Any:
    """A module of a library that may be missing; the tests of the file are skipped then."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return pytest.importorskip(
            name,
            reason=f"{name} is not installed: docs/works_with.md says how",
            exc_type=ImportError,
        )
