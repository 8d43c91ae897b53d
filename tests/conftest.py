"""Options of the whole test suite, and its quick part."""

from pathlib import Path

import pytest
from quick_files import QUICK

TESTS = Path(__file__).parent


def pytest_addoption(parser):
    parser.addoption(
        "--update-golden",
        action="store_true",
        help="write the golden files of tests/golden anew instead of comparing with them",
    )


def pytest_ignore_collect(collection_path, config):
    """Files without quick tests are not even imported for `-m quick`."""
    if config.option.markexpr == "quick" and collection_path.name.startswith("test_"):
        return True if _name(collection_path) not in QUICK else None
    return None


def pytest_collection_modifyitems(items):
    for item in items:
        left_out = QUICK.get(_name(item.path))
        if left_out is None or item.originalname in left_out or item.get_closest_marker("slow"):
            continue
        item.add_marker(pytest.mark.quick)


def _name(path):
    return path.relative_to(TESTS).as_posix() if path.is_relative_to(TESTS) else ""
