"""What signatures and docstrings say of observations, rewards, infos and settings."""

import inspect
import re
import textwrap
from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar, get_type_hints

from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, inside_name
from uas_coverage_env.env.observation import layout_table
from uas_coverage_env.env.report import InfoField
from uas_coverage_env.env.rewards import rewards_table
from uas_coverage_env.env.versions import Version

C = TypeVar("C", bound=type)
F = TypeVar("F", bound=Callable[..., Any])

_SETTING = re.compile(r"^( +)action: (?:.*\n)+?\1 +.*as in the version\.\n", re.MULTILINE)
"""The settings in a docstring: from the first of them to the end of the last."""


def settings_text() -> str:
    """What `MissionSettings` says of its attributes, under the names of the keyword arguments."""
    text = inspect.getdoc(MissionSettings) or ""
    listed = textwrap.dedent(text.partition("Attributes:\n")[2].partition("\n\n")[0])
    said = dict(each.split(":", 1) for each in re.split(r"^(?=\w)", listed, flags=re.M) if each)
    names = [(name, said[inside_name(name)].rstrip()) for name in MissionKeywords.__annotations__]
    return "".join(f"{name}:{meaning}\n" for name, meaning in names)


def with_settings_written_out(source: str) -> str:
    """Source code in which docstrings say of the settings what `MissionSettings` says."""
    return _SETTING.sub(lambda match: textwrap.indent(settings_text(), match[1]), source)


def takes_settings(function: F) -> F:
    """Show, for each of `**settings`, its name, type and default in the signature."""
    hints = get_type_hints(MissionKeywords)
    defaults = {field.name: field.default for field in fields(MissionSettings)}
    signature = inspect.signature(function)
    own = [each for each in signature.parameters.values() if each.kind != each.VAR_KEYWORD]
    named = [
        inspect.Parameter(
            name,
            inspect.Parameter.KEYWORD_ONLY,
            default=defaults[inside_name(name)],
            annotation=hints[name],
        )
        for name in MissionKeywords.__annotations__
    ]
    shown: Any = function
    shown.__signature__ = signature.replace(parameters=[*own, *named])
    return function


def infos_text(infos: tuple[InfoField, ...]) -> str:
    """The infos as a list in Markdown."""
    return "\n".join(f"- `{each.name}`: {each.meaning}" for each in infos)


def with_tables(environment: C) -> C:
    """Put the tables of its version into an environment's docstring."""
    version: Version = environment.version  # pyrefly: ignore[missing-attribute]
    if environment.__doc__ is not None:  # None under python -OO
        tables = {
            "{observations}": layout_table(version.observation),
            "{rewards}": rewards_table(version.reward),
            "{infos}": infos_text(version.infos),
        }
        for place, table in tables.items():
            indented = table.replace("\n", "\n        ")
            environment.__doc__ = environment.__doc__.replace(place, indented)
    return environment
