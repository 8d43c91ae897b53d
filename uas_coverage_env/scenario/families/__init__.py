"""Families of scenarios: one function each, from random numbers and a size to a scenario.

A family of one's own is a function `draw(rng, size) -> Scenario`, wrapped as `Family(draw)`:
environments take it as `scenario=`; announced in the entry-point group `uas_coverage.families` it
is known by its name.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import EntryPoint
from typing import Any

import numpy as np

from uas_coverage_env.files.errors import InputError
from uas_coverage_env.plugins.installed import entry_points
from uas_coverage_env.plugins.users_code import described
from uas_coverage_env.scenario.families.courtyards import courtyards
from uas_coverage_env.scenario.families.irregular import irregular
from uas_coverage_env.scenario.families.low_charge import low_charge, with_charge_for
from uas_coverage_env.scenario.families.open_field import open_field
from uas_coverage_env.scenario.families.river import river
from uas_coverage_env.scenario.families.site import Rng, Site, Size, Wanted, grid, outline, prism
from uas_coverage_env.scenario.families.streets import streets
from uas_coverage_env.scenario.families.traffic import MOST_MOVING, traffic
from uas_coverage_env.scenario.families.walls import walls
from uas_coverage_env.scenario.levels import check_level, with_disturbances
from uas_coverage_env.scenario.model import Scenario

GROUP = "uas_coverage.families"

_SEEDS = 2**31


@dataclass(frozen=True)
class Family:
    """Draws scenarios of one kind: what environments take as `scenario=`.

    Attributes:
        draw: (rng, size) -> a scenario that it draws with this generator alone.
        size: How large the missions are.
        n_moving: The most moving obstacles that it draws.
        disturbances: Level of wind and wrong models, see `LEVELS`; None: still air.

    Raises:
        ValueError: There is no such level.
    """

    draw: Callable[[Rng, Size], Scenario]
    size: Size = field(default_factory=Size)
    n_moving: int = 0
    disturbances: str | None = None

    def __post_init__(self) -> None:
        check_level(self.disturbances)

    def __call__(self, rng: Rng) -> Scenario:
        """Draw a scenario."""
        scenario = self.draw(rng, self.size)
        return with_disturbances(scenario, self.disturbances, int(rng.integers(_SEEDS)))

    def of_seed(self, seed: int) -> Scenario:
        """The scenario of a seed: the one that an environment draws after `reset(seed=seed)`."""
        return self(np.random.default_rng(seed))

    def sized(self, **size: Any) -> "Family":
        """The same family with missions of another size, see `Size`."""
        return replace(self, size=replace(self.size, **size))


BUILT_IN: Mapping[str, Family] = {
    "open-field": Family(open_field),
    "streets": Family(streets),
    "courtyards": Family(courtyards),
    "walls": Family(walls),
    "river": Family(river),
    "irregular": Family(irregular),
    "traffic": Family(traffic, n_moving=MOST_MOVING),
    "low-charge": Family(low_charge),
}
"""Name -> family, of this package."""


def installed_families() -> dict[str, Family]:
    """Name -> family: those of this package, and those that others have announced.

    One that cannot be loaded says so where a mission is drawn from it.
    """
    others = {entry.name: entry for entry in entry_points(group=GROUP)}
    return {**{name: _loaded(entry) for name, entry in others.items()}, **BUILT_IN}


def _loaded(entry: EntryPoint) -> Family:
    try:
        return entry.load()
    except Exception as error:  # whatever another package raises harms no other family
        reason = f"family {entry.name!r} cannot be loaded: {described(error)}"

    def refuse(rng: Rng, size: Size) -> Scenario:
        raise InputError(reason)

    return Family(refuse)


__all__ = [
    "BUILT_IN",
    "GROUP",
    "Family",
    "Site",
    "Size",
    "Wanted",
    "grid",
    "installed_families",
    "outline",
    "prism",
    "with_charge_for",
]
