"""What many missions came to: one SQLite file that is whole after any kill, at any moment.

A flight is one row, written in one transaction by the one process that owns the store; its key is
the primary key. The write-ahead log lets others read while missions are flown. The columns are the
fields of the record, a dataclass: strings, whole numbers, truths and numbers, some of which may be
None; the first is the key.
"""

import contextlib
import dataclasses
import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from functools import cache
from math import isfinite
from pathlib import Path
from types import TracebackType
from typing import Any, Generic, Self, TypeVar, get_args, get_type_hints

from uas_coverage_env.files.output_dir import prepare_folder
from uas_coverage_env.files.strict_toml import InputError

STORE = "flights.sqlite"
_LOCK = ".lock"
_SCHEMA_VERSION = 3
_SQL_TYPES = {str: "TEXT", int: "INTEGER", bool: "INTEGER", float: "REAL"}
_FORMER = ("test/scores.jsonl", "validation/scores.jsonl", "demonstrations.json")
_ANEW = "give another --out, or add --overwrite to begin anew"

Record = TypeVar("Record")


class OtherVersionError(sqlite3.DatabaseError):
    """A store of another version of this package, or of what adds figures to it."""


class Store(Generic[Record]):
    """The flights of one folder; made by `opened`.

    Args:
        path: The file.
        connection: To it.
        record: The class of its rows.
    """

    def __init__(self, path: Path, connection: sqlite3.Connection, record: type[Record]) -> None:
        self.path, self._connection, self._record = path, connection, record

    def keys(self) -> set[str]:
        """The keys of all flights it holds."""
        return {key for (key,) in self._connection.execute("SELECT key FROM flights")}

    def add(self, row: Record, *, replace: bool = False) -> None:
        """Keep a flight; on return it is on the disk.

        Args:
            row: The flight.
            replace: Forget the one of the same key.

        Raises:
            ValueError: It holds the flight and `replace` is not set, or a value cannot be kept.
            InputError: The disk is full or gone.
        """
        names = list(columns_of(self._record))
        values = [getattr(row, name) for name in names]
        _checked(self._record, values)
        places, verb = ", ".join("?" * len(values)), "REPLACE" if replace else "INSERT"
        try:
            with self._connection:
                self._connection.execute(
                    f"{verb} INTO flights ({_listed(names)}) VALUES ({places})", values
                )
        except sqlite3.IntegrityError as error:
            raise ValueError(f"flight {values[0]} is in {self.path} already: {error}") from error
        except sqlite3.OperationalError as error:
            raise InputError(f"{self.path}: cannot be written ({error})") from error

    def rows(self) -> list[Record]:
        """All flights, in an order that does not depend on when they were flown."""
        names = list(columns_of(self._record))
        order = ", ".join([*(n for n in ("scenario", "label", "seed") if n in names), "key"])
        found = self._connection.execute(f"SELECT {_listed(names)} FROM flights ORDER BY {order}")
        try:
            return [_checked(self._record, values) for values in found]
        except ValueError as error:
            raise sqlite3.DatabaseError(str(error)) from error

    def description(self) -> dict[str, Any]:
        """What it was made for; empty where it is new."""
        found = self._connection.execute("SELECT description FROM sweep").fetchone()
        try:
            description = json.loads(found[0]) if found else {}
        except (ValueError, TypeError, RecursionError):
            description = None
        if not isinstance(description, dict):
            raise sqlite3.DatabaseError("what it says of its flights cannot be read")
        return description

    def begin(self, description: Mapping[str, Any]) -> None:
        """Say what the store is for."""
        with self._connection:
            self._connection.execute("INSERT INTO sweep VALUES (?)", (json.dumps(description),))

    def __enter__(self) -> Self:
        """The store itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close the file."""
        self._connection.close()


@contextlib.contextmanager
def opened(
    directory: Path,
    description: Mapping[str, Any],
    record: type[Record],
    *,
    overwrite: bool = False,
) -> Iterator[Store[Record]]:
    """Open the store of a folder; one process at a time.

    Args:
        directory: Made where it does not exist.
        description: What is asked for, plain data: the same goes on with what is there.
        record: The class of its rows, see above.
        overwrite: Forget the flights that it holds; foreign files are left alone.

    Raises:
        InputError: The directory holds something else and `overwrite` is not set, is in use, was
            damaged, is of another version, or cannot be written.
    """
    _make_folder(directory, overwrite=overwrite)
    path = directory / STORE
    with contextlib.closing(_locked(directory)):
        if overwrite:
            _remove(path)
        try:
            with Store(path, _connection(path, record), record) as store:
                _make_sure_it_is(store, directory, description)
                yield store
        except OtherVersionError as error:
            raise InputError(f"{path}: {error}; {_ANEW}") from error
        except sqlite3.DatabaseError as error:
            raise InputError(f"{path}: was damaged ({error}); {_ANEW}") from error


def rows_in(directory: Path, record: type[Record]) -> list[Record]:
    """The flights of a folder in which others may still fly; nothing there is changed.

    Args:
        directory: The folder.
        record: The class of its rows, or one that has some of its fields.

    Raises:
        InputError: The directory holds no flights, those of another version, or damaged ones.
    """
    path = directory / STORE
    try:
        connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)
        with Store(path, connection, record) as store:
            _make_sure_of_version(connection, columns_of(record).keys() - _there(connection))
            return store.rows()
    except OtherVersionError as error:
        raise InputError(f"{path}: {error}; fly them anew") from error
    except sqlite3.DatabaseError as error:
        raise InputError(f"{directory}: holds no flights that can be read ({error})") from error


def difference(kept: Mapping[str, Any], asked: Mapping[str, Any]) -> str:
    """The first thing in which two descriptions differ, in words; empty where nothing does."""
    for key in [*kept, *(key for key in asked if key not in kept)]:
        if key not in asked:
            return f"it has {key}, which is not asked for"
        if key not in kept:
            return f"it has no {key}"
        mine, theirs = kept[key], asked[key]
        if isinstance(mine, Mapping) and isinstance(theirs, Mapping):
            inner = difference(mine, theirs)
            if inner:
                return f"{key}: {inner}"
        elif mine != theirs:
            return f"{key} is {_short(mine)} there, {_short(theirs)} asked for"
    return ""


@cache
def columns_of(record: type) -> dict[str, tuple[type, ...]]:
    """What a row holds: name -> the types of its values, None's last."""
    hints = get_type_hints(record)
    names = [field.name for field in dataclasses.fields(record)]
    return {name: get_args(hints[name]) or (hints[name],) for name in names}


def _checked(record: type[Record], values: Sequence[Any]) -> Record:
    """The row that a file holds.

    Raises:
        ValueError: A value is none that we write; names the column.
    """
    found = []
    for (name, kinds), value in zip(columns_of(record).items(), values, strict=True):
        if bool in kinds and value in (0, 1):  # SQLite knows no others
            value = bool(value)
        elif float in kinds and type(value) is int:
            value = float(value)
        bounded = not isinstance(value, float) or isfinite(value)
        if type(value) not in kinds or not bounded or (type(value) is int and value < 0):
            raise ValueError(f"{name} of a flight is {repr(value)[:40]}")
        found.append(value)
    return record(*found)


def _make_sure_it_is(store: Store[Any], directory: Path, description: Mapping[str, Any]) -> None:
    asked = json.loads(json.dumps(description))
    kept = store.description()
    if not kept:
        store.begin(asked)
    elif kept != asked:
        raise InputError(
            f"{directory}: holds the flights of another command: {difference(kept, asked)}; "
            "give another --out or add --overwrite"
        )


def _make_folder(directory: Path, *, overwrite: bool) -> None:
    foreign = prepare_folder(directory) - {_LOCK}
    if not foreign or STORE in foreign or overwrite:
        return
    for name in _FORMER:
        if (directory / name).exists():
            raise InputError(f"{directory}: holds {name} of version 0.3.0 or older; {_ANEW}")
    raise InputError(
        f"{directory}: is not empty and holds no flights; give another --out or add --overwrite"
    )


def _locked(directory: Path) -> sqlite3.Connection:
    """Hold the directory: the lock of an empty database, which dies with its process."""
    try:
        connection = sqlite3.connect(directory / _LOCK, timeout=0.0, isolation_level=None)
        with contextlib.ExitStack() as on_error:
            on_error.callback(connection.close)
            connection.execute("BEGIN EXCLUSIVE")
            on_error.pop_all()
    except sqlite3.DatabaseError as error:
        reason = "another command is at work there" if "locked" in str(error) else str(error)
        raise InputError(f"{directory}: cannot be used: {reason}") from error
    return connection


def _connection(path: Path, record: type) -> sqlite3.Connection:
    """Open a store, make what is missing, check what is there."""
    connection = sqlite3.connect(path)
    with contextlib.ExitStack() as on_error:
        on_error.callback(connection.close)
        # the log makes a killed transaction vanish whole; FULL: what was added outlives a power cut
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        if connection.execute("PRAGMA user_version").fetchone() == (0,):
            with connection:
                connection.execute("BEGIN")
                connection.execute("CREATE TABLE sweep (description TEXT NOT NULL)")
                connection.execute(f"CREATE TABLE flights ({_schema(record)})")
                connection.execute(f"PRAGMA user_version = {_SCHEMA_VERSION}")
        _make_sure_of_version(connection, columns_of(record).keys() ^ _there(connection))
        (verdict,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
        if verdict != "ok":
            raise sqlite3.DatabaseError(" ".join(verdict.split()))
        on_error.pop_all()
    return connection


def _make_sure_of_version(connection: sqlite3.Connection, other_columns: Set[str]) -> None:
    (version,) = connection.execute("PRAGMA user_version").fetchone()
    if version != _SCHEMA_VERSION:
        raise OtherVersionError("was written by another version of this package")
    if other_columns:
        names = ", ".join(sorted(other_columns))
        raise OtherVersionError(f"has other figures of a flight than are installed now: {names}")


def _there(connection: sqlite3.Connection) -> set[str]:
    return {name for _, name, *_ in connection.execute("PRAGMA table_info(flights)")}


def _schema(record: type) -> str:
    columns = []
    for name, (kind, *optional) in columns_of(record).items():
        null = "" if optional else " NOT NULL"
        columns.append(
            f"{_listed([name])} {_SQL_TYPES[kind]}{null}{'' if columns else ' PRIMARY KEY'}"
        )
    return ", ".join(columns)


def _listed(names: Iterable[str]) -> str:
    """Names of columns in a query: one may be a word of SQL, too."""
    return ", ".join(f'"{name}"' for name in names)


def _short(value: Any) -> str:
    text = str(value)
    return text if len(text) <= 16 else f"{text[:12]}..."


def _remove(path: Path) -> None:
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
