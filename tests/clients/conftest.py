"""Other people's learning libraries, untouched. Where one is not installed its tests are skipped.

Their deprecations are not ours: warnings are no errors here.
"""

from pathlib import Path

import pytest

_HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    for item in items:
        if item.path.is_relative_to(_HERE):
            item.add_marker(pytest.mark.filterwarnings("ignore"))
