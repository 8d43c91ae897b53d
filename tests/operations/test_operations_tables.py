"""Tables of the docs on what is read, written and done are whole, and say what decides."""

import pytest

pytest.importorskip("pyproj")

from uas_coverage_env.operations.area_import import tables as areas
from uas_coverage_env.operations.logs import tables as logs
from uas_coverage_env.operations.mission_export import tables as exports
from uas_coverage_env.operations.stream import giving_up
from uas_coverage_env.operations.stream import tables as streams

TABLES = (
    *(areas.area_roles, areas.area_words, areas.plan_items, areas.town_kinds, areas.town_not_read),
    *(exports.exported_files, exports.autopilot_parameters, exports.autopilot_failures),
    *(streams.stream_troubles, streams.stream_failsafes, streams.stream_reactions),
    *(streams.stream_limits, logs.log_formats, logs.log_rules),
)


@pytest.mark.parametrize("made", TABLES)
def test_every_row_of_a_table_has_a_cell_for_each_heading(made):
    head, rows = made()
    assert rows
    assert {len(row) for row in rows} == {len(head)}


def test_all_that_a_stream_that_is_given_up_may_end_in_is_listed():
    _, rows = streams.stream_reactions()
    assert [row[0] for row in rows] == [f"`{name}`" for name in giving_up.REACTIONS]
