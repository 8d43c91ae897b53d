"""The store: nothing lost, nothing twice, nothing mixed up."""

import dataclasses
import sqlite3

import pytest
from leaderboard_rows import failed_row, row

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard import Row
from uas_coverage_env.runner.store import STORE, difference, rows_in
from uas_coverage_env.runner.store import opened as opened_for

SWEEP = {"version": "1", "seeds": "0:2"}


def opened(directory, description, **options):
    return opened_for(directory, description, Row, **options)


def changed(path, statement, *values):
    with sqlite3.connect(path) as connection:
        connection.execute(statement, values)
    connection.close()


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
        pytest.raises(InputError, match="another command is at work"),
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
        pytest.raises(InputError, match="another command: seeds is 0:2 there, 0:3 asked for"),
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
        pytest.raises(InputError, match="is not empty and holds no flights"),
        opened(tmp_path, SWEEP),
    ):
        pass
    with opened(tmp_path, SWEEP, overwrite=True) as store:
        store.add(row())
    with pytest.raises(InputError, match="is a file"), opened(tmp_path / "notes.txt", SWEEP):
        pass


@pytest.mark.parametrize("damage", ["header", "page", "empty"])
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
    changed(tmp_path / STORE, f"UPDATE flights SET {column} = ?", value)
    with pytest.raises(InputError, match="was damaged") as caught:  # noqa: SIM117
        with opened(tmp_path, SWEEP) as store:
            store.rows()
    assert f"{column} of a flight is " in str(caught.value)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match="holds no flights that can be read"):
        rows_in(tmp_path, Row)


@pytest.mark.parametrize("description", ["3", "[1]", "null", "sweep", b"\xff", "[" * 100_000])
def test_a_store_that_does_not_say_what_it_is_for_is_damaged(tmp_path, description):
    with opened(tmp_path, SWEEP):
        pass
    changed(tmp_path / STORE, "UPDATE sweep SET description = ?", description)
    with pytest.raises(InputError, match="was damaged"), opened(tmp_path, SWEEP):
        pass


def test_every_column_of_a_row_is_a_column_of_the_store(tmp_path):
    with opened(tmp_path, SWEEP):
        reader = sqlite3.connect(tmp_path / STORE)
        columns = [name for _, name, *_ in reader.execute("PRAGMA table_info(flights)")]
        reader.close()
    assert columns == [field.name for field in dataclasses.fields(Row)]


@pytest.mark.parametrize("change", ["PRAGMA user_version = 2", "ALTER TABLE flights ADD COLUMN x"])
def test_a_store_of_another_version_is_refused_in_a_line_that_says_what_to_do(tmp_path, change):
    with opened(tmp_path, SWEEP) as store:
        store.add(row())
    changed(tmp_path / STORE, change)
    said = r"flights\.sqlite: was written by another version of this package; give another --out"
    if "COLUMN" in change:
        said = "has other figures of a flight than are installed now: x; give another --out"
    with pytest.raises(InputError, match=said), opened(tmp_path, SWEEP):
        pass
    if "version" in change:
        with pytest.raises(InputError, match="another version of this package; fly them anew"):
            rows_in(tmp_path, Row)
    with opened(tmp_path, SWEEP, overwrite=True) as store:
        assert store.rows() == []


@pytest.mark.parametrize("name", ["test/scores.jsonl", "demonstrations.json"])
def test_a_folder_of_version_0_3_is_refused_by_the_name_of_its_file(tmp_path, name):
    (tmp_path / name).parent.mkdir(exist_ok=True)
    (tmp_path / name).touch()
    said = f"holds {name} of version 0.3.0 or older; give another --out, or add --overwrite"
    with pytest.raises(InputError, match=said), opened(tmp_path, SWEEP):
        pass
    assert not (tmp_path / STORE).exists()


def test_a_flight_that_is_flown_again_replaces_the_one_of_before(tmp_path):
    with opened(tmp_path, SWEEP) as store:
        store.add(row(energy_Wh=1.0))
        store.add(row(energy_Wh=2.0), replace=True)
        assert [one.energy_Wh for one in store.rows()] == [2.0]


@pytest.mark.parametrize(("column", "value"), [("energy_Wh", float("nan")), ("coverage", None)])
def test_what_could_not_be_read_again_is_not_kept(tmp_path, column, value):
    with opened(tmp_path, SWEEP) as store:
        with pytest.raises(ValueError, match=f"{column} of a flight is"):
            store.add(row(**{column: value}))
        assert store.rows() == []


def test_a_part_of_the_columns_can_be_read(tmp_path):
    @dataclasses.dataclass(frozen=True)
    class Steps:
        key: str
        steps: int | None

    with opened(tmp_path, SWEEP) as store:
        store.add(row(steps=7))
    assert rows_in(tmp_path, Steps) == [Steps("a/p/0", 7)]


def test_a_difference_is_named_where_it_lies():
    kept = {"seeds": "0:2", "planners": {"tour": {"options": {"time_s": 1.0}}, "hover": {}}}
    asked = {"seeds": "0:2", "planners": {"tour": {"options": {"time_s": 2.0}}, "hover": {}}}
    assert difference(kept, kept) == ""
    assert difference(kept, asked) == "planners: tour: options: time_s is 1.0 there, 2.0 asked for"
    assert difference(kept, {"seeds": "0:2"}) == "it has planners, which is not asked for"
    assert difference({"seeds": "0:2"}, kept) == "it has no planners"
