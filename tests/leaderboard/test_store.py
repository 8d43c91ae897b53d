"""The store: nothing lost, nothing twice, nothing mixed up."""

import dataclasses
import sqlite3

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import STORE, Row, flights_in, opened

SWEEP = {"version": "1", "seeds": "0:2"}


def test_what_was_added_is_there_when_it_is_opened_again(tmp_path):
    rows = [row("a", "p"), failed_row("a", "q"), row("b", "p", 1, safety_filter=True)]
    with opened(tmp_path / "sweep", SWEEP) as store:
        for one in rows:
            store.add(one)
    with opened(tmp_path / "sweep", SWEEP) as store:
        assert store.rows() == rows
        assert store.keys() == {one.key for one in rows}
        assert store.description() == SWEEP
        assert [type(value) for value in dataclasses.astuple(store.rows()[2])] == [
            type(value) for value in dataclasses.astuple(rows[2])
        ]


def test_a_flight_cannot_be_added_twice(tmp_path):
    with opened(tmp_path, SWEEP) as store:
        store.add(row(energy_Wh=1.0))
        with pytest.raises(ValueError, match="already"):
            store.add(row(energy_Wh=2.0))
        assert [one.energy_Wh for one in store.rows()] == [1.0]


def test_the_order_of_rows_is_that_of_the_sweep_not_of_the_clock(tmp_path):
    rows = [row(s, p, k) for s in "ab" for p in "pq" for k in range(3)]
    with opened(tmp_path, SWEEP) as store:
        for one in reversed(rows):
            store.add(one)
        assert store.rows() == rows


def test_others_can_read_while_it_is_written(tmp_path):
    with opened(tmp_path, SWEEP) as store:
        store.add(row())
        reader = sqlite3.connect(f"file:{tmp_path / STORE}?mode=ro", uri=True)
        assert reader.execute("PRAGMA journal_mode").fetchone() == ("wal",)
        assert reader.execute("SELECT count(*) FROM flights").fetchone() == (1,)
        store.add(row(seed=1))
        assert reader.execute("SELECT count(*) FROM flights").fetchone() == (2,)
        reader.close()


def test_only_one_sweep_at_a_time_works_in_a_directory(tmp_path):
    with (
        opened(tmp_path, SWEEP),
        pytest.raises(InputError, match="another compare is at work"),
        opened(tmp_path, SWEEP),
    ):
        pass
    with opened(tmp_path, SWEEP) as store:
        assert store.rows() == []


def test_another_sweep_is_refused_and_told_apart_unless_overwritten(tmp_path):
    with opened(tmp_path, SWEEP) as store:
        store.add(row())
    (tmp_path / "notes.txt").write_text("keep")
    other = {**SWEEP, "seeds": "0:3"}
    with (
        pytest.raises(InputError, match="another sweep: seeds is 0:2 there, 0:3 asked for"),
        opened(tmp_path, other),
    ):
        pass
    with opened(tmp_path, other, overwrite=True) as store:
        assert store.rows() == []
        assert store.description() == other
    assert (tmp_path / "notes.txt").read_text() == "keep"


def test_a_folder_of_other_things_is_refused_unless_overwritten(tmp_path):
    (tmp_path / "notes.txt").write_text("keep")
    with (
        pytest.raises(InputError, match="is not empty and holds no sweep"),
        opened(tmp_path, SWEEP),
    ):
        pass
    with opened(tmp_path, SWEEP, overwrite=True) as store:
        store.add(row())
    with pytest.raises(InputError, match="is a file"), opened(tmp_path / "notes.txt", SWEEP):
        pass


@pytest.mark.parametrize("damage", ["header", "page", "schema", "empty"])
def test_a_damaged_store_is_refused_in_one_line_or_begun_anew(tmp_path, damage):
    with opened(tmp_path, SWEEP) as store:
        for k in range(200):
            store.add(row(seed=k))
    path = tmp_path / STORE
    content = bytearray(path.read_bytes())
    if damage == "header":
        content[:16] = b"not a database.."
    elif damage == "page":
        content[4096 * 3 : 4096 * 12] = b"\xff" * (4096 * 9)
    elif damage == "empty":
        content = bytearray()  # as a kill right after its making leaves it
    path.write_bytes(content)
    if damage == "schema":
        with sqlite3.connect(path) as connection:
            connection.execute("PRAGMA user_version = 99")
        connection.close()
    if damage == "empty":
        with opened(tmp_path, SWEEP) as store:
            assert store.rows() == []
        return
    with pytest.raises(InputError, match=r"flights\.sqlite: was damaged") as caught:  # noqa: SIM117
        with opened(tmp_path, SWEEP) as store:
            store.rows()
    assert "\n" not in str(caught.value)
    with opened(tmp_path, SWEEP, overwrite=True) as store:
        assert store.rows() == []


@pytest.mark.parametrize(
    ("column", "value"),
    [
        *(("label", b"\xff"), ("seed", "many"), ("seed", -1), ("status", "landed")),
        *(("accomplished", "yes"), ("coverage", "all"), ("coverage", float("inf"))),
        *(("violations", 1e300), ("steps", -3), ("energy_Wh", "none"), ("decision_p50_s", b"")),
    ],
)
def test_a_value_that_we_do_not_write_is_named_by_its_column(tmp_path, column, value):
    with opened(tmp_path, SWEEP) as store:
        store.add(row())
    with sqlite3.connect(tmp_path / STORE) as connection:
        connection.execute(f"UPDATE flights SET {column} = ?", (value,))
    connection.close()
    with pytest.raises(InputError, match="was damaged") as caught:  # noqa: SIM117
        with opened(tmp_path, SWEEP) as store:
            store.rows()
    assert f"{column} of a flight is " in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="holds no sweep that can be read"):
        flights_in(tmp_path)


@pytest.mark.parametrize("description", ["3", "[1]", "null", "sweep", b"\xff", "[" * 100_000])
def test_a_store_that_does_not_say_what_it_is_for_is_damaged(tmp_path, description):
    with opened(tmp_path, SWEEP):
        pass
    with sqlite3.connect(tmp_path / STORE) as connection:
        connection.execute("UPDATE sweep SET description = ?", (description,))
    connection.close()
    with pytest.raises(InputError, match="was damaged"), opened(tmp_path, SWEEP):
        pass


def test_every_column_of_a_row_is_a_column_of_the_store(tmp_path):
    with opened(tmp_path, SWEEP):
        reader = sqlite3.connect(tmp_path / STORE)
        columns = [name for _, name, *_ in reader.execute("PRAGMA table_info(flights)")]
        reader.close()
    assert columns == [field.name for field in dataclasses.fields(Row)]


def older(path):
    """Make the store one of a version that kept no returns."""
    with sqlite3.connect(path) as connection:
        connection.execute("ALTER TABLE flights DROP COLUMN episode_return")
    connection.close()


def test_a_store_of_a_version_that_called_labels_players_is_read_and_gone_on_with(tmp_path):
    asked = {"seeds": "0:2", "planners": {"p": {"options": {}}}}
    with opened(tmp_path, {"seeds": "0:2", "players": asked["planners"]}) as store:
        store.add(row())
    with sqlite3.connect(tmp_path / STORE) as connection:
        connection.execute("ALTER TABLE flights RENAME COLUMN label TO player")
    connection.close()
    assert flights_in(tmp_path) == [row()], "and reading changes nothing"
    assert flights_in(tmp_path) == [row()]
    with opened(tmp_path, asked) as store:
        store.add(row(seed=1))
        assert store.rows() == [row(), row(seed=1)]
    assert flights_in(tmp_path) == [row(), row(seed=1)]


def test_a_store_of_a_version_without_returns_is_read_and_gone_on_with(tmp_path):
    with opened(tmp_path, SWEEP) as store:
        store.add(row())
    older(tmp_path / STORE)
    before = dataclasses.replace(row(), episode_return=None)
    assert flights_in(tmp_path) == [before], "and reading changes nothing"
    assert flights_in(tmp_path) == [before]
    with opened(tmp_path, SWEEP) as store:
        store.add(row(seed=1))
        assert store.rows() == [before, row(seed=1)]
