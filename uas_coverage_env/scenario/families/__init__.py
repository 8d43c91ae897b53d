"""Families of scenarios, known by name: a file each, whose `FAMILIES` says what it draws.

A family of one's own is a function `draw(rng, size) -> Scenario`, wrapped as `Family(draw)`:
environments take it as `scenario=`; announced in the entry-point group `uas_coverage.families` it
is known by its name.
"""

from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import EntryPoint
from pkgutil import iter_modules

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described
from uas_coverage_env.scenario.families.family import Family, FamilyOfSeeds
from uas_coverage_env.scenario.families.site import (
    Rng,
    Site,
    Size,
    Wanted,
    outline,
    prism,
    spread_places,
)
from uas_coverage_env.scenario.model import Scenario

GROUP = "uas_coverage.families"


def _found() -> dict[str, Family | FamilyOfSeeds]:
    """Those of this folder."""
    families: dict[str, Family | FamilyOfSeeds] = {}
    for module in iter_modules(__path__, f"{__name__}."):
        families |= getattr(import_module(module.name), "FAMILIES", {})
    return families


BUILT_IN: Mapping[str, Family | FamilyOfSeeds] = _found()
"""Name -> family, of this package."""


def installed_families() -> dict[str, Family | FamilyOfSeeds]:
    """Name -> family: those of this package, and those that others have announced.

    One that cannot be loaded says so where a mission is drawn from it.
    """
    others = {entry.name: entry for entry in entry_points(group=GROUP)}
    return {**BUILT_IN, **{k: _loaded(entry) for k, entry in others.items() if k not in BUILT_IN}}


def _loaded(entry: EntryPoint) -> Family | FamilyOfSeeds:
    try:
        return entry.load()
    except Exception as error:  # whatever another package raises harms no other family
        reason = f"family {entry.name!r} cannot be loaded: {described(error)}"

    def refuse(rng: Rng, size: Size) -> Scenario:
        raise InputError(reason)

    return Family(refuse)


__all__ = ["Family", "Site", "Size", "Wanted", "outline", "prism", "spread_places"]
