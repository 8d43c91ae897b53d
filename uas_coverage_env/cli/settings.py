"""Options of a command from a file of settings; what is typed wins over the file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, get_args, get_type_hints

import typer
from pydantic import BaseModel, create_model

from uas_coverage_env.files.strict_toml import StrictModel, read_toml

_ASKED_FOR_NOW = ("help", "settings", "json")
"""What a file does not say: options of the call."""

PlannerOption = str | bool | int | float | list[str]


def from_settings(context: typer.Context, path: Path | None) -> Path | None:
    """Take the options of a command that are not typed from a TOML file.

    Its keys are the names of the options without dashes, `scenario` for the argument; options of
    the planner are a table `[option]`.

    Raises:
        InputError: There is no such file, or a key or value in it that the command does not take.
    """
    if path is None:
        return None
    params = {_spelled(param): param.name for param in context.command.params}
    names = {name: params[name] for name in params if name not in _ASKED_FOR_NOW}
    types = get_type_hints(context.command.callback)
    fields: dict[str, Any] = {
        name: (_as_written(types[python_name]) | None, None) for name, python_name in names.items()
    }
    model: type[BaseModel] = create_model("Settings", __base__=StrictModel, **fields)
    given = read_toml(path, model).model_dump(exclude_none=True)
    found = {
        names[name]: _typed(value) if isinstance(value, Mapping) else value
        for name, value in given.items()
    }
    context.default_map = {**(context.default_map or {}), **found}
    return path


def _spelled(param: Any) -> str:
    """Its name as it is typed, without dashes."""
    spellings: list[str] = param.opts
    return max(spellings, key=len).lstrip("-").lower()


def _as_written(hint: Any) -> Any:
    """The type of an option as a file has it: paths as text, KEY=VALUE as a table."""
    kinds = [kind for kind in (get_args(hint) or (hint,)) if kind is not type(None)]
    if list[str] in kinds:
        return dict[str, PlannerOption]
    return str if Path in kinds else hint


def _typed(options: Mapping[str, Any]) -> list[str]:
    """KEY=VALUE each, as they are typed."""
    return [f"{key}={_as_text(value)}" for key, value in options.items()]


def _as_text(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    return ",".join(value) if isinstance(value, list) else str(value)
