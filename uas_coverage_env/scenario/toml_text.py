"""The text of a scenario or vehicle file: one point per line, as a person would write it."""

from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.items import AoT, Array, InlineTable, Table

# Longer lists of points are easier to read, and to compare, with one point per line.
_ONE_LINE = 3


def toml_text(data: Mapping[str, Any]) -> str:
    """TOML of nested plain data; null and empty lists of tables are left out.

    Args:
        data: What `model_dump(mode="json", by_alias=True)` of a scenario or a vehicle returns.
    """
    document = tomlkit.document()
    for key, value in data.items():
        if isinstance(value, Mapping):
            document.add(key, _table(value))
        elif isinstance(value, list):
            if value:
                tables = isinstance(value[0], Mapping)
                document.add(key, _tables(value) if tables else _array(value))
        elif value is not None:
            document.add(key, value)
    return tomlkit.dumps(document)


def _tables(entries: list[Mapping[str, Any]]) -> AoT:
    tables = tomlkit.aot()
    for entry in entries:
        tables.append(_table(entry))
    return tables


def _table(entry: Mapping[str, Any]) -> Table:
    table = tomlkit.table()
    for key, value in entry.items():
        if value is not None:
            table.add(key, _array(value) if isinstance(value, list) else value)
    return table


def _array(values: list[Any]) -> Array:
    array = tomlkit.array()
    for value in values:
        array.append(_inline(value) if isinstance(value, Mapping) else value)
    nested = any(isinstance(value, list | Mapping) for value in values)
    return array.multiline(nested or len(values) > _ONE_LINE)


def _inline(entry: Mapping[str, Any]) -> InlineTable:
    table = tomlkit.inline_table()
    table.update(entry)
    return table
