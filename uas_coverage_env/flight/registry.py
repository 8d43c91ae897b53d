"""Planners by name: whatever announces itself in one of two entry-point groups, or MODULE:CLASS.

`uas_coverage.planners`: a name is one planner, a class made as `PlannerClass(options)`, or
    without arguments where it has no `Options`; names of this package are not taken by others.
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

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.files.suggestions import did_you_mean, meant
from uas_coverage_env.flight.planner import Planner, PlannerOptions, check_planner
from uas_coverage_env.flight.retired import follower
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.named_objects import object_named
from uas_coverage_env.plugins.users_code import described

GROUP = "uas_coverage.planners"
KINDS = "uas_coverage.planner_kinds"

_OURS = "uas_coverage_"

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
        name: One of `planner_names()`, KIND:ARGUMENT, or MODULE:CLASS with a module that is
            installed or lies in the current folder; a class without `Options` is made without
            arguments.
        options: Option -> value; text is read as the type of the option.

    Raises:
        InputError: Unknown name, unknown option, a value that does not fit, an argument that the
            kind refuses, or a class that makes no planner; one line.
    """
    kind, colon, argument = name.partition(":")
    installed = _installed(KINDS if colon else GROUP)
    if kind not in installed and argument:
        return _made(name, _own_class(name), options or {})
    if kind not in installed or (colon and not argument):
        raise _unknown(name)
    try:
        planner_class = installed[kind].load()
    except Exception as error:  # whatever another package raises is one line
        raise InputError(f"planner {name!r} cannot be loaded: {described(error)}") from error
    if not colon:
        return _made(name, planner_class, options or {})
    return planner_class(_checked_options(name, planner_class.Options, options or {}), argument)


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
        name: One of `planner_names()`, a kind with or without its argument, or MODULE:CLASS.

    Raises:
        InputError: Unknown name; one line.
    """
    kind, _, argument = name.partition(":")
    for group in (GROUP, KINDS):
        entry = _installed(group).get(kind)
        if entry is not None and (group == KINDS or kind == name):
            return _description(kind, entry)
    if argument:
        return _described(name, _own_class(name))
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


def _made(name: str, planner_class: Any, options: Mapping[str, Any]) -> Planner:
    """A planner of a class, which takes its options, if it has any."""
    model = getattr(planner_class, "Options", None)
    checked = _checked_options(name, model or PlannerOptions, options)
    try:
        planner = planner_class(checked) if model else planner_class()
    except InputError:
        raise
    except Exception as error:  # whatever a user's class raises is one line
        raise _not_made(name, error) from error
    check_planner(planner, name)
    return planner


def _own_class(name: str) -> Any:
    """The class that MODULE:CLASS stands for."""
    module, _, attribute = name.partition(":")
    try:
        found = object_named("planner", name)
    except InputError as error:
        if close := meant(module, _installed(KINDS)):
            raise InputError(f"{error}; did you mean {close}:{attribute}?") from error
        raise
    except Exception as error:  # whatever a user's module raises is one line
        raise _not_made(name, error) from error
    if not isinstance(found, type):
        raise InputError(f"planner {name!r}: {attribute!r} is no class; name the planner's class")
    return found


def _not_made(name: str, error: Exception) -> InputError:
    return InputError(f"planner {name!r} cannot be made: {described(error)}")


def _unknown(name: str) -> InputError:
    argument = name.partition(":")[2][:80] or "..."
    known = (*planner_names(), *(f"{kind}:{argument}" for kind in sorted(_installed(KINDS))))
    instead = follower(name) or did_you_mean(
        name, known, f"allowed: {', '.join(known)}, or MODULE:CLASS"
    )
    return InputError(f"unknown planner {name!r}; {instead}")


def _installed(group: str) -> dict[str, EntryPoint]:
    """Name -> planner; a name of this package stays that of its planner, whoever else takes it."""
    announced = [entry for entry in entry_points(group=group) if entry.group == group]
    announced.sort(key=lambda entry: entry.module.startswith(_OURS))
    return {entry.name: entry for entry in announced}


def _checked_options(name: str, model: type[BaseModel], given: Mapping[str, Any]) -> BaseModel:
    allowed = ", ".join(model.model_fields) or "none"
    for key in given:
        if key not in model.model_fields:
            gone = getattr(model, "GONE", {}).get(key)  # options of earlier versions
            instead = gone or did_you_mean(key, model.model_fields, f"allowed: {allowed}")
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
    except Exception as error:  # whatever another package raises harms no other planner
        return PlannerDescription(name, "", missing=described(error))
    return _described(
        f"{name}:{planner_class.argument}" if entry.group == KINDS else name, planner_class
    )


def _described(name: str, planner_class: Any) -> PlannerDescription:
    model = getattr(planner_class, "Options", PlannerOptions)
    summary, _, rest = (inspect.getdoc(planner_class) or "").partition("\n")
    text = _SECTION.split(rest)[0].strip()
    options = tuple(_option(key, field) for key, field in model.model_fields.items())
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
