"""Strict reading of TOML and JSON: every mistake is one line with file, field, value and fix."""

import datetime
import json
import math
import re
import tomllib
import types
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.files.plain_files import read_text
from uas_coverage_env.files.suggestions import did_you_mean

M = TypeVar("M", bound=BaseModel)

_LONGEST_VALUE = 60
_MOST_BYTES = 2**24
_MOST_KEYS = 32

# the parser takes a time that grows with the square of the keys in a row; a number has one point
_KEYS_IN_A_ROW = re.compile(
    rf"""(?<![\w"'-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')\s*+\.\s*+){{{_MOST_KEYS},}}"""
)

# pydantic speaks of JSON where our readers look at TOML
_PLAIN = {
    "model_type": "a table",
    "model_attributes_type": "a table",
    "dict_type": "a table",
    "tuple_type": "a list",
    "list_type": "a list",
    "int_type": "a whole number",
    "bool_type": "true or false",
    "string_type": "text in quotes",
    "float_type": "a number",
}


class StrictModel(BaseModel):
    """A frozen record whose numbers are finite, whose keys are known, whose types are exact.

    Whole numbers are valid where a float is asked; strings and booleans are not numbers.
    """

    model_config = ConfigDict(
        strict=True,
        frozen=True,
        extra="forbid",
        allow_inf_nan=False,
        validate_default=True,
    )

    def __getstate__(self) -> dict[Any, Any]:
        # cached properties can be computed again: they do not travel to worker processes
        state = super().__getstate__()
        fields = type(self).model_fields
        state["__dict__"] = {name: self.__dict__[name] for name in fields}
        return state

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with some fields changed, checked like a new record (pydantic does not check).

        Args:
            update: New values by field name.
            deep: Without meaning here: a frozen record may be shared.
        """
        changes = dict(update or {})
        unknown = sorted(set(changes) - set(type(self).model_fields))
        if unknown:
            known = ", ".join(type(self).model_fields)
            raise ValueError(f"unknown field {unknown[0]!r}; {type(self).__name__} has {known}")
        return type(self)(
            **{
                field.alias or name: changes.get(name, getattr(self, name))
                for name, field in type(self).model_fields.items()
            }
        )


def read_toml(path: str | Path, model: type[M], *, context: Any = None) -> M:
    """Read a TOML file into a pydantic model.

    Args:
        path: The file.
        model: The pydantic model; it should forbid unknown keys (see `StrictModel`).
        context: Handed to the model's validators.

    Raises:
        InputError: The file is missing, is not TOML, is larger than 16 MiB, or does not fit the
            model; one line.
    """

    def loads(text: str) -> dict[str, Any]:
        if found := _KEYS_IN_A_ROW.search(text):
            line = text.count("\n", 0, found.start()) + 1
            raise InputError(
                f"{path}: line {line}: names keys more than {_MOST_KEYS} deep; flatten the tables"
            )
        return tomllib.loads(text)

    return parse(_loaded(Path(path), loads, "TOML"), model, str(path), context=context)


def read_json(path: str | Path, model: type[M], *, context: Any = None) -> M:
    """Read a file of one JSON object into a pydantic model; as `read_toml`."""

    def loads(text: str) -> dict[str, Any]:
        data = json.loads(text)
        if not isinstance(data, dict):
            raise ValueError("it should hold one object, { ... }")
        return data

    return parse(_loaded(Path(path), loads, "JSON"), model, str(path), context=context)


def _loaded(path: Path, loads: Callable[[str], dict[str, Any]], kind: str) -> dict[str, Any]:
    source = str(path)
    try:
        return loads(read_text(path, _MOST_BYTES))
    except InputError:
        raise
    except FileNotFoundError:
        raise _error(source, "no such file; check the path") from None
    except IsADirectoryError:
        raise _error(source, f"is a folder; give the path of a {kind} file") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise _error(source, f"cannot be read ({reason}); check the path and its rights") from None
    except UnicodeDecodeError as error:
        fix = "save the file as UTF-8 text"
        raise _error(source, f"byte {error.start} is not UTF-8; {fix}") from None
    except RecursionError:
        raise _error(source, "brackets are nested too deeply; flatten the arrays") from None
    except ValueError as error:
        raise _error(source, f"is not valid {kind}: {error}; correct the syntax there") from None


def parse(data: Mapping[str, Any], model: type[M], source: str, *, context: Any = None) -> M:
    """Check data already in memory as strictly as a file.

    Args:
        data: Nested mappings, sequences and plain values, as a TOML or JSON parser returns them.
        model: The pydantic model.
        source: Where the data comes from; the first words of every message.
        context: Handed to the model's validators.

    Raises:
        InputError: The data do not fit the model; one line.
    """
    try:
        problems = list(_values_no_field_takes(data, ()))
        if problems:
            raise _first_of(problems, source)
        # JSON, because pydantic's strict mode takes a JSON array for a tuple, but no Python list
        complete = getattr(model, "completed", None)
        text = json.dumps(complete(data) if complete else data, default=dict)
        return model.model_validate_json(text, strict=True, context=context)
    except RecursionError:
        raise _error(source, "keys are nested too deeply; flatten the tables") from None
    except ValidationError as error:
        mistakes = _without_echoes(error.errors(include_url=False))
    # an unknown key is usually the misspelling that causes the "missing" ones: it comes first
    mistakes.sort(key=lambda mistake: mistake["type"] != "extra_forbidden")
    raise _first_of([_line(mistake, model) for mistake in mistakes], source)


def _error(source: str, text: str) -> InputError:
    return InputError(" ".join(f"{source}: {text}".split()))


def _first_of(problems: list[str], source: str) -> InputError:
    more = f" (+{len(problems) - 1} more)" if len(problems) > 1 else ""
    return _error(source, problems[0] + more)


def _values_no_field_takes(value: Any, location: tuple[str | int, ...]) -> Iterator[str]:
    """One line for each value that no field of ours can hold: NaN, infinity, dates."""
    if isinstance(value, Mapping):
        for key, item in value.items():
            yield from _values_no_field_takes(item, (*location, key))
    elif isinstance(value, list | tuple):
        for index, item in enumerate(value):
            yield from _values_no_field_takes(item, (*location, index))
    elif isinstance(value, float) and not math.isfinite(value):
        yield f"{_field(location)}: should be a finite number, not {value}"
    elif isinstance(value, datetime.date | datetime.time):
        yield f"{_field(location)}: should not be a date or time ({value}); quote text"
    elif value is not None and not isinstance(value, str | int | float):
        yield f"{_field(location)}: should be plain data, not {type(value).__name__}"


def _without_echoes(mistakes: Iterable[Mapping[str, Any]]) -> list[Mapping[str, Any]]:
    """Drop "too few entries" where it only says that an entry of the list was rejected."""
    mistakes = list(mistakes)
    locations = [mistake["loc"] for mistake in mistakes]
    return [
        mistake
        for mistake, own in zip(mistakes, locations, strict=True)
        if mistake["type"] != "too_short"
        or not any(len(other) > len(own) and other[: len(own)] == own for other in locations)
    ]


def _line(mistake: Mapping[str, Any], model: type[BaseModel]) -> str:
    location, kind = mistake["loc"], mistake["type"]
    at = _along(location, model)
    field = _field(at.keys)
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        tag, known = mistake["ctx"]["discriminator"].strip("'"), ", ".join(at.choices)
        if kind == "union_tag_not_found":
            return f"{field}.{tag}: is missing; take one of {known}"
        return f"{field}.{tag}: there is no {mistake['ctx']['tag'][:40]!r}; take one of {known}"
    if kind == "extra_forbidden":
        return f"{field}: unknown key; {_instead(location, model)}"
    if kind == "missing":
        return f"{field}: is missing; add it"
    if kind == "too_short":
        least, given = (mistake["ctx"][key] for key in ("min_length", "actual_length"))
        return f"{field}: needs at least {least} of them, not {given}; add what is missing"
    if kind == "too_long":
        most, given = (mistake["ctx"][key] for key in ("max_length", "actual_length"))
        return f"{field}: takes at most {most} of them, not {given}; take some away"
    message = mistake["msg"]
    if kind in ("value_error", "assertion_error"):
        # our own validators name value and fix themselves
        message = message.partition(", ")[2]
        return f"{field}: {message}" if field else message
    message = message.removeprefix("Input ")
    message = message[:1].lower() + message[1:]
    if kind in _PLAIN:
        message = f"should be {_PLAIN[kind]}"
    message += f", not {_shown(mistake['input'])}"
    return f"{field}: {message}" if field else message


def _field(location: Iterable[str | int]) -> str:
    """`("waypoints", 12, "position_m")` as `waypoints[12].position_m`."""
    parts = [f"[{part}]" if isinstance(part, int) else f".{part}" for part in location]
    return "".join(parts).removeprefix(".")


def _shown(value: Any) -> str:
    text = json.dumps(value, default=str, ensure_ascii=False)
    return text if len(text) <= _LONGEST_VALUE else text[: _LONGEST_VALUE - 1] + "…"


def _instead(location: tuple[str | int, ...], model: type[BaseModel]) -> str:
    """What to write in place of the unknown key at this location."""
    keys = _keys_at(location[:-1], model)
    allowed = f"allowed here: {', '.join(keys)}" if keys else "remove it"
    return did_you_mean(str(location[-1]), keys, allowed)


def _keys_at(location: tuple[str | int, ...], model: type[BaseModel]) -> list[str]:
    current = _along(location, model).model
    if current is None:
        return []
    return [field.alias or name for name, field in current.model_fields.items()]


@dataclass(frozen=True)
class _Place:
    """Where a location leads to."""

    keys: tuple[str | int, ...]
    """The location as it is written in the file: without the names of kinds of tables."""
    model: type[BaseModel] | None
    """What is there, if it is a table."""
    choices: Mapping[str, type[BaseModel]]
    """Instead: the kinds of tables that may be there."""


def _along(location: tuple[str | int, ...], model: type[BaseModel]) -> _Place:
    current: type[BaseModel] | None = model
    choices: Mapping[str, type[BaseModel]] = {}
    keys: list[str | int] = []
    for part in location:
        if isinstance(part, int):
            keys.append(part)
            continue
        if part in choices:  # pydantic names the kind, which is no key
            current, choices = choices[part], {}
            continue
        keys.append(part)
        fields = {field.alias or name: field for name, field in _fields_of(current).items()}
        found = _models_in(fields[part].annotation) if part in fields else []
        current = found[0] if len(found) == 1 else None
        choices = {_kind_of(each): each for each in found} if len(found) > 1 else {}
    return _Place(tuple(keys), current, choices)


def _fields_of(model: type[BaseModel] | None) -> Mapping[str, Any]:
    return {} if model is None else model.model_fields


def _kind_of(model: type[BaseModel]) -> str:
    """The value of the field `kind`, by which tables of several kinds are told apart."""
    field = model.model_fields.get("kind")
    return str(get_args(field.annotation)[0]) if field is not None else model.__name__


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    """The models inside `Model`, `tuple[Model, ...]`, `Model | None`, `dict[str, Model]`."""
    if isinstance(annotation, type) and not isinstance(annotation, types.GenericAlias):
        return [annotation] if issubclass(annotation, BaseModel) else []
    if get_origin(annotation) is Annotated:
        return _models_in(get_args(annotation)[0])
    if get_origin(annotation) in (Union, types.UnionType, tuple, list, dict):
        return [inner for argument in get_args(annotation) for inner in _models_in(argument)]
    return []
