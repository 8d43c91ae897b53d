"""The store of a sweep: one SQLite file that is whole after any kill, at any moment.

A flight is one row, written in one transaction by the one process that owns the store; its key is
the primary key. The write-ahead log lets others read while a sweep is under way.
"""

import contextlib
import dataclasses
import json
import sqlite3
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from uas_coverage_env.files.output_dir import prepare_folder
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.leaderboard.row import COLUMNS, Row
from uas_coverage_env.leaderboard.sweep import difference

STORE = "flights.sqlite"
_LOCK = ".lock"
_SCHEMA_VERSION = 3
_SQL_TYPES = {str: "TEXT", int: "INTEGER", bool: "INTEGER", float: "REAL"}


class Store:
    """The flights of one sweep; made by `opened`."""

    def __init__(self, path: Path, connection: sqlite3.Connection) -> None:
        self.path = path
        self._connection = connection

    def keys(self) -> set[str]:
        """The keys of all flights it holds."""
        return {key for (key,) in self._connection.execute("SELECT key FROM flights")}

    def add(self, row: Row) -> None:
        """Keep a flight; on return it is on the disk.

        Raises:
            ValueError: It holds the flight already.
            InputError: The disk is full or gone.
        """
        places = ", ".join("?" * len(COLUMNS))
        try:
            with self._connection:
                self._connection.execute(
                    f"INSERT INTO flights ({', '.join(COLUMNS)}) VALUES ({places})",
                    dataclasses.astuple(row),
                )
        except sqlite3.IntegrityError as error:
            raise ValueError(f"flight {row.key} is in {self.path} already: {error}") from error
        except sqlite3.OperationalError as error:
            raise InputError(f"{self.path}: cannot be written ({error})") from error

    def rows(self) -> list[Row]:
        """All flights, in an order that does not depend on when they were flown."""
        columns = ", ".join(COLUMNS)
        found = self._connection.execute(
            f"SELECT {columns} FROM flights ORDER BY scenario, label, seed, key"
        )
        try:
            return [Row.checked(dict(zip(COLUMNS, values, strict=True))) for values in found]
        except ValueError as error:
            raise sqlite3.DatabaseError(str(error)) from error

    def description(self) -> dict[str, Any]:
        """The sweep that it was made for; empty where it is new."""
        found = self._connection.execute("SELECT description FROM sweep").fetchone()
        try:
            description = json.loads(found[0]) if found else {}
        except (ValueError, TypeError, RecursionError):
            description = None
        if not isinstance(description, dict):
            raise sqlite3.DatabaseError("what it says of its sweep cannot be read")
        if "players" in description:  # as older versions wrote it
            description["planners"] = description.pop("players")
        return description

    def begin(self, description: Mapping[str, Any]) -> None:
        """Say for which sweep the store is."""
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
    directory: Path, description: Mapping[str, Any], *, overwrite: bool = False
) -> Iterator[Store]:
    """Open the store of a sweep in a directory; one process at a time.

    Args:
        directory: Made where it does not exist.
        description: Of the sweep, plain data.
        overwrite: Forget the flights that it holds; foreign files are left alone.

    Raises:
        InputError: The directory holds another sweep or other things and `overwrite` is not set,
            is in use, was damaged, or cannot be written.
    """
    _make_folder(directory, overwrite=overwrite)
    path = directory / STORE
    with contextlib.closing(_locked(directory)):
        if overwrite:
            _remove(path)
        try:
            with Store(path, _connection(path)) as store:
                _make_sure_it_is(store, directory, description)
                yield store
        except sqlite3.DatabaseError as error:
            raise InputError(
                f"{path}: was damaged ({error}); "
                "give another --out, or add --overwrite to begin anew"
            ) from error


def flights_in(directory: Path) -> list[Row]:
    """The flights of a sweep that may still be under way; nothing there is changed.

    Raises:
        InputError: The directory holds no sweep, or a damaged one.
    """
    path = directory / STORE
    try:
        connection = sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)
        with Store(path, connection) as store:
            return store.rows()
    except sqlite3.DatabaseError as error:
        raise InputError(f"{directory}: holds no sweep that can be read ({error})") from error


def _make_sure_it_is(store: Store, directory: Path, description: Mapping[str, Any]) -> None:
    asked = json.loads(json.dumps(description))
    kept = store.description()
    if not kept:
        store.begin(asked)
    elif kept != asked:
        raise InputError(
            f"{directory}: holds another sweep: {difference(kept, asked)}; "
            "give another --out or add --overwrite"
        )


def _make_folder(directory: Path, *, overwrite: bool) -> None:
    foreign = prepare_folder(directory) - {_LOCK}
    if foreign and STORE not in foreign and not overwrite:
        raise InputError(
            f"{directory}: is not empty and holds no sweep; give another --out or add --overwrite"
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
        reason = "another compare is at work there" if "locked" in str(error) else str(error)
        raise InputError(f"{directory}: cannot be used: {reason}") from error
    return connection


def _connection(path: Path) -> sqlite3.Connection:
    """Open a store, make what is missing, check what is there."""
    connection = sqlite3.connect(path)
    with contextlib.ExitStack() as on_error:
        on_error.callback(connection.close)
        # the log makes a killed transaction vanish whole; FULL: what was added outlives a power cut
        connection.execute("PRAGMA journal_mode = WAL")
        connection.execute("PRAGMA synchronous = FULL")
        (version,) = connection.execute("PRAGMA user_version").fetchone()
        if version == 0:
            with connection:
                connection.execute("BEGIN")
                connection.execute("CREATE TABLE sweep (description TEXT NOT NULL)")
                connection.execute(f"CREATE TABLE flights ({_schema()})")
                connection.execute(f"PRAGMA user_version = {_SCHEMA_VERSION}")
        elif version != _SCHEMA_VERSION:
            raise sqlite3.DatabaseError(f"its schema is {version}, this is {_SCHEMA_VERSION}")
        (verdict,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
        if verdict != "ok":
            raise sqlite3.DatabaseError(" ".join(verdict.split()))
        on_error.pop_all()
    return connection


def _schema() -> str:
    return ", ".join(map(_column, COLUMNS))


def _column(name: str) -> str:
    kind, *optional = COLUMNS[name]
    key = " PRIMARY KEY" if name == "key" else ""
    return f"{name} {_SQL_TYPES[kind]}{'' if optional else ' NOT NULL'}{key}"


def _remove(path: Path) -> None:
    for suffix in ("", "-wal", "-shm"):
        path.with_name(path.name + suffix).unlink(missing_ok=True)
