"""Planners by name: whatever announces itself in one of two entry-point groups.

`uas_coverage.planners`: a name is one planner, a class made as `PlannerClass(options)`.
`uas_coverage.planner_kinds`: a name is a kind of which there are many, flown as `KIND:ARGUMENT`;
    a class made as `PlannerClass(options, argument)`, with a text `argument` on the class that
    names its argument and on the planner that holds it.
"""

import inspect
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.metadata import EntryPoint
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from uas_coverage_env.files.installed import entry_points
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import did_you_mean
from uas_coverage_env.flight.planner import Planner

GROUP = "uas_coverage.planners"
KINDS = "uas_coverage.planner_kinds"

_SECTION = re.compile(r"^(?:Args|Attributes|Raises):$", re.MULTILINE)


@dataclass(frozen=True)
class OptionDescription:
    """One option of a planner, as a person reads it."""

    name: str
    values: str
    default: str
    description: str


@dataclass(frozen=True)
class PlannerDescription:
    """One planner, as a person reads it.

    Attributes:
        name: As it is asked for.
        summary: What it does, in a line.
        options: How it can be set.
        missing: Why it cannot be used here, if so.
        text: What else there is to know about it; may be empty.
    """

    name: str
    summary: str
    options: tuple[OptionDescription, ...] = ()
    missing: str = ""
    text: str = ""


def planner_names() -> tuple[str, ...]:
    """The names of all planners that are installed; kinds, which need an argument, not."""
    return tuple(sorted(_installed(GROUP)))


def load_planner(name: str, options: Mapping[str, Any] | None = None) -> Planner:
    """Make a planner by name.

    Args:
        name: One of `planner_names()`, or KIND:ARGUMENT.
        options: Option -> value; text is read as the type of the option.

    Raises:
        InputError: Unknown name, unknown option, a value that does not fit, or an argument that
            the kind refuses; one line.
    """
    kind, colon, argument = name.partition(":")
    installed = _installed(KINDS if colon else GROUP)
    if kind not in installed or (colon and not argument):
        raise _unknown(name)
    try:
        planner_class = installed[kind].load()
    except (ImportError, AttributeError) as error:
        raise InputError(f"planner {name!r} cannot be loaded: {error}") from error
    checked = _checked_options(name, planner_class.Options, options or {})
    return planner_class(checked, argument) if colon else planner_class(checked)


def describe_planners() -> tuple[PlannerDescription, ...]:
    """All planners with their options, in the order of their names; then the kinds."""
    return tuple(
        _description(name, entry)
        for group in (GROUP, KINDS)
        for name, entry in sorted(_installed(group).items())
    )


def describe_planner(name: str) -> PlannerDescription:
    """One planner with its options.

    Args:
        name: One of `planner_names()`, or a kind with or without its argument.

    Raises:
        InputError: Unknown name; one line.
    """
    kind, _, _ = name.partition(":")
    for group in (GROUP, KINDS):
        entry = _installed(group).get(kind)
        if entry is not None and (group == KINDS or kind == name):
            return _description(kind, entry)
    raise _unknown(name)


def name_of(planner: Planner) -> str:
    """The name under which the class of a planner is installed, else the name of the class."""
    for group in (GROUP, KINDS):
        for name, entry in _installed(group).items():
            # a planner at hand has its module loaded; loading the others would be a waste
            if getattr(sys.modules.get(entry.module), entry.attr, None) is type(planner):
                return f"{name}:{getattr(planner, 'argument', '')}" if group == KINDS else name
    return type(planner).__name__


def options_of(planner: Planner) -> dict[str, Any]:
    """The options of a planner as plain data; empty where it keeps none."""
    options = getattr(planner, "options", None)
    return options.model_dump(mode="json") if isinstance(options, BaseModel) else {}


def _unknown(name: str) -> InputError:
    argument = name.partition(":")[2][:80] or "..."
    known = (*planner_names(), *(f"{kind}:{argument}" for kind in sorted(_installed(KINDS))))
    instead = did_you_mean(name, known, f"allowed: {', '.join(known)}")
    return InputError(f"unknown planner {name!r}; {instead}")


def _installed(group: str) -> dict[str, EntryPoint]:
    return {entry.name: entry for entry in entry_points(group=group) if entry.group == group}


def _checked_options(name: str, model: type[BaseModel], given: Mapping[str, Any]) -> BaseModel:
    allowed = ", ".join(model.model_fields) or "none"
    for key in given:
        if key not in model.model_fields:
            instead = did_you_mean(key, model.model_fields, f"allowed: {allowed}")
            raise InputError(f"planner {name!r} has no option {key!r}; {instead}")
    try:
        return model.model_validate(dict(given))
    except ValidationError as error:
        mistake = error.errors(include_url=False)[0]
    key = str(mistake["loc"][0]) if mistake["loc"] else ""
    reason = mistake["msg"].removeprefix("Input ").removeprefix("Value error, ")
    if key not in model.model_fields:
        raise InputError(f"planner {name!r}: {reason}")
    option = _option(key, model.model_fields[key])
    raise InputError(
        f"planner {name!r}: option {key} = {given.get(key)!r}: {reason[:1].lower()}{reason[1:]}; "
        f"allowed: {option.values} (default {option.default})"
    )


def _description(name: str, entry: EntryPoint) -> PlannerDescription:
    try:
        planner_class = entry.load()
    except (ImportError, AttributeError) as error:
        return PlannerDescription(name, "", missing=" ".join(str(error).split()))
    if entry.group == KINDS:
        name = f"{name}:{planner_class.argument}"
    summary, _, rest = (inspect.getdoc(planner_class) or "").partition("\n")
    text = _SECTION.split(rest)[0].strip()
    options = tuple(
        _option(key, field) for key, field in planner_class.Options.model_fields.items()
    )
    return PlannerDescription(name, summary, options, text=text)


def _option(name: str, field: FieldInfo) -> OptionDescription:
    default = field.get_default(call_default_factory=True)
    return OptionDescription(
        name, _values(field.annotation), _plain(default), field.description or ""
    )


def _values(annotation: Any) -> str:
    """The values of a type as a person types them: `true|false`, `lpv|nonlinear`, `float`."""
    if annotation is bool:
        return "true|false"
    if get_origin(annotation) is Literal:
        return "|".join(_plain(value) for value in get_args(annotation))
    if get_origin(annotation) is tuple:
        return ",".join((_values(get_args(annotation)[0]), "..."))
    if get_origin(annotation) in (Union, UnionType):
        return "|".join(_values(argument) for argument in get_args(annotation))
    if annotation is type(None):
        return "none"
    return getattr(annotation, "__name__", str(annotation))


def _plain(value: Any) -> str:
    if isinstance(value, tuple):
        return ",".join(map(_plain, value)) or "none"
    return str(value).lower() if value is None or isinstance(value, bool) else str(value)
