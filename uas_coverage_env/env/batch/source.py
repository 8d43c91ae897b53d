"""Where the missions of a batch come from, and from which seeds."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.env.actions.given import Actions
from uas_coverage_env.env.batch.memory import MissionPool, SubEnvironments
from uas_coverage_env.env.episode.memory import Tables
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.world.arena import Arena


class DrawnMission(NamedTuple):
    """What a lane flies."""

    lane: int
    scenario: Scenario
    before: NDArray[np.uint64]
    """(6,) the state of the generator before it drew the mission; 0: it was given."""
    rng: np.random.Generator
    """Draws the next one."""


class LaneMissions(Protocol):
    """The missions that the lanes of a batch fly.

    Attributes:
        settings: How missions are flown and paid.
        actions: The kind of action; kind and size are those of all.
        sizes: The largest of every named size.
        features: One of each kind that any mission may have.
        goes_home: Whether an event of any of them may send a UAS home.
        changes: Whether the scene of any of them may change.
        draws: Whether Python draws a mission when it begins; else kernels do.
    """

    settings: MissionSettings
    actions: Actions
    sizes: dict[str, int]
    features: tuple[MissionFeature, ...]
    goes_home: bool
    changes: bool
    draws: bool

    @property
    def scenarios(self) -> Sequence[Scenario]:
        """What `lanes.scenario` counts."""
        ...

    @property
    def arrays(self) -> MissionPool:
        """For kernels; to be taken anew after a mission has begun or its scene has changed."""
        ...

    def chosen(self, given: Any, num_envs: int) -> Any:
        """What lanes are told to fly, for `orders`; None: all draw.

        Raises:
            ValueError: There are no such scenarios, or not one for each lane.
        """
        ...

    def orders(
        self, begins: NDArray[np.bool_], lanes: SubEnvironments, chosen: Any
    ) -> NDArray[np.int64]:
        """(L,) what lanes do in which missions are to begin; the others rest.

        Raises:
            ValueError: A mission does not fit, or none was drawn; nothing has changed.
        """
        ...

    def scene_of(self, scene: int) -> Scenario:
        """The scenario that is flown now where `lanes.scene` is this."""
        ...

    def put_scene(self, lane: int, known: Scenario, arena: Arena, tables: Tables) -> int:
        """Install what the scene of a lane has become, and say which it is.

        Args:
            lane: Which.
            known: The scenario from now on.
            arena: Its arrays, see `scene_arrays`.
            tables: Likewise.
        """
        ...

    def kept(self) -> dict[str, NDArray[Any]]:
        """Arrays that belong to a checkpoint, by name.

        Raises:
            ValueError: A mission cannot be found again by them.
        """
        ...

    def redrawn(
        self, state: Mapping[str, NDArray[Any]], begun: NDArray[np.bool_]
    ) -> list[DrawnMission]:
        """The missions of a checkpoint, for `install`; empty where they need none.

        Raises:
            ValueError: There are none like this.
        """
        ...

    def install(self, missions: Sequence[DrawnMission]) -> None:
        """Put missions into their lanes."""
        ...

    def limits(self, begun: NDArray[np.bool_]) -> dict[str, Any]:
        """What `lanes.scenario` may be, see `check_values`; empty: any."""
        ...


def lane_seeds(seed: Any, num_envs: int) -> list[int | None]:
    """The seed of each environment, see `CoverageBatch.seed`.

    Raises:
        ValueError: A seed is negative or too large, or their number is wrong.
    """
    if isinstance(seed, int | np.integer):
        seeds: list[int | None] = [int(seed) + lane for lane in range(num_envs)]
    elif isinstance(seed, Sequence | np.ndarray) and not isinstance(seed, str | bytes):
        seeds = list(seed)
    else:
        raise ValueError(f"seed is {seed!r}; give a whole number, or one for each environment")
    if len(seeds) != num_envs:
        raise ValueError(f"{len(seeds)} seeds for {num_envs} environments; give one for each")
    for lane, value in enumerate(seeds):
        whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
        if value is not None and (not whole or not 0 <= value < SEEDS):
            raise ValueError(
                f"seed of environment {lane} is {value!r}; give a whole number from 0 to 2**64 - 1"
            )
    return seeds
