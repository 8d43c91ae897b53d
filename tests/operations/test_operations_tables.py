"""Tables of the docs on what is read, written and done are whole, and say what decides."""

import sys
from pathlib import Path

import pytest

pytest.importorskip("pyproj")
sys.path.insert(0, str(Path(__file__).parents[2] / "docs"))
import operations_tables as tables
from tables import OPERATIONS

from uas_coverage_env.operations.area_import.readers.qgc_plan import ITEMS
from uas_coverage_env.operations.stream import giving_up


@pytest.mark.parametrize("name", OPERATIONS)
def test_every_row_of_a_table_has_a_cell_for_each_heading(name):
    head, rows = getattr(tables, name)()
    assert rows
    assert {len(row) for row in rows} == {len(head)}


def test_all_that_a_stream_that_is_given_up_may_end_in_is_listed():
    _, rows = tables.stream_reactions()
    assert [row[0] for row in rows] == [f"`{name}`" for name in giving_up.REACTIONS]


def test_all_items_of_a_plan_that_are_read_are_listed():
    _, rows = tables.plan_items()
    assert [row[0] for row in rows] == [f"`{kind}`" for kind in ITEMS]
