"""What docstrings say of the observations, rewards and infos of a version."""

from typing import Any, ClassVar

from uas_coverage_env.env.observation.layout import layout_table
from uas_coverage_env.env.report import InfoField
from uas_coverage_env.env.rewards.terms import rewards_table
from uas_coverage_env.env.versions import V0, Version


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
            before, found, after = cls.__doc__.partition(place)
            if found:  # as far in as its place is: from Python 3.13 on docstrings are not indented
                indent = " " * (len(before) - len(before.rstrip(" ")))
                cls.__doc__ = before + table.replace("\n", f"\n{indent}") + after
