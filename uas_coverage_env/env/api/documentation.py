"""What signatures and docstrings say of observations, rewards, infos and settings."""

import inspect
import re
import textwrap
from typing import Any, ClassVar

from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, inside_name
from uas_coverage_env.env.observation.layout import layout_table
from uas_coverage_env.env.report import InfoField
from uas_coverage_env.env.rewards.terms import rewards_table
from uas_coverage_env.env.versions import V0, Version

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


def infos_text(infos: tuple[InfoField, ...]) -> str:
    """The infos as a list in Markdown."""
    return "\n".join(f"- `{each.name}`: {each.meaning}" for each in infos)


class Versioned:
    """An environment of one version; a subclass with another `version` is that of this version.

    What a docstring says of observations, rewards and infos comes from the tuples of the version.
    """

    version: ClassVar[Version] = V0
    metadata: dict[str, Any]
    _described: ClassVar[str | None] = None

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        if "name" in cls.metadata:
            cls.metadata = {**cls.metadata, "name": f"uas_coverage_{cls.version.name}"}
        cls._described = cls.__doc__ or cls._described
        if cls._described is None:  # under python -OO
            return
        tables = {
            "{observations}": layout_table(cls.version.observation),
            "{rewards}": rewards_table(cls.version.reward),
            "{infos}": infos_text(cls.version.infos),
        }
        cls.__doc__ = cls._described
        for place, table in tables.items():
            cls.__doc__ = cls.__doc__.replace(place, table.replace("\n", "\n        "))
