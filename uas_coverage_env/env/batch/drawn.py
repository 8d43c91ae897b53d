"""Missions of a batch that are drawn one by one: every lane has a slot for its own."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium.utils import seeding
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import Memory
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.batch.memory import REST, MissionPool, SubEnvironments
from uas_coverage_env.env.batch.pool import ScenarioPool
from uas_coverage_env.env.batch.slots import Slots
from uas_coverage_env.env.batch.source import DrawnMission, LaneMissions
from uas_coverage_env.env.batch.state_dict import check_values
from uas_coverage_env.env.episode.memory import FIRST_OBSERVATION, LEARNERS, TABLES, Tables
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.features.feature import fitted_to, in_slots, memory_words
from uas_coverage_env.scenario import MissionSource, Scenario
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.simulation.scenes import changes_scene
from uas_coverage_env.world.arena import ARENA, Arena, has_true_vehicles
from uas_coverage_env.world.events import goes_home
from uas_coverage_env.world.packs import swaps_alone
from uas_coverage_env.world.sensing import senses

_MEMORIES: tuple[Memory[Any], ...] = (ARENA, STATE, TABLES, LEARNERS, FIRST_OBSERVATION)
_WORDS = 6
_WORD = 2**64 - 1


class DrawnPool:
    """What the lanes of a batch fly where `scenario=` draws: slot i holds the mission of lane i.

    Lane i draws with a generator of its own, seeded as a single environment's `reset(seed=...)`
    seeds it, so both fly the same missions.

    Args:
        source: Draws them.
        settings: How missions are flown and paid.
        num_envs: Number of lanes.

    Attributes:
        settings: As given.
        scenarios: (L,) what the lanes fly, as it is now; before their first missions an example.
        actions: The kind of action.
        sizes: The largest that the arrays of a lane may need.
        features: One of each kind that there may be: of those in `source.examples`.
        goes_home: Whether an event may send a UAS home, in any of `source.examples`.
        changes: Whether the scene of any of `source.examples` may change.
        draws: True: they are drawn in Python, one when it begins.
        drawn_from: (L, 6) states of the generators from which the missions now flown were drawn;
            zero where none was drawn.
    """

    def __init__(self, source: MissionSource, settings: MissionSettings, num_envs: int) -> None:
        self.settings = settings
        self.draws = True
        self._source = source
        self.features, _ = in_slots([settings.features_in(each) for each in source.examples])
        self.goes_home = any(goes_home(scenario) for scenario in source.examples)
        example = ScenarioPool(source.example, settings, self.features)
        self.scenarios = [example.scenarios[0]] * num_envs
        self.actions = example.actions
        self.sizes = {**example.sizes, "U": source.room.n_uas, "W": source.room.n_waypoints}
        self.sizes["E"] = max(len(scenario.events) for scenario in source.examples)
        sensed = any(senses(scenario) for scenario in source.examples)
        self.sizes["S"] = source.room.n_uas if sensed else 0
        self.sizes["memory words"] = memory_words(self.features, source.room.n_uas)
        swaps = any(swaps_alone(scenario) for scenario in source.examples)
        self.sizes["B"] = source.room.n_uas if swaps else 0
        differ = any(
            has_true_vehicles(each, settings.features_in(each)) for each in source.examples
        )
        self.sizes["true vehicles"] = source.room.n_uas if differ else 0
        repeats = any(scenario.asks_again for scenario in source.examples)
        self.sizes["repeats"] = self.sizes["W"] if repeats else 0
        self.changes = any(changes_scene(scenario) for scenario in source.examples)
        self.sizes["changes"] = self.sizes["E"] + self.sizes["repeats"] if self.changes else 0
        self._slots: list[Slots[Any]] = [Slots(memory, num_envs) for memory in _MEMORIES]
        self._rngs: list[np.random.Generator | None] = [None] * num_envs
        self.drawn_from = np.zeros((num_envs, _WORDS), dtype=np.uint64)

    def __len__(self) -> int:
        return len(self.scenarios)

    @property
    def arrays(self) -> MissionPool:
        """For kernels; to be taken anew after `begin`."""
        return MissionPool(*(slots.pool for slots in self._slots))

    def chosen(self, given: Any, num_envs: int) -> Sequence[Scenario | None] | None:
        """(L,) what lanes are to fly, None where they draw; None: all draw.

        Raises:
            ValueError: A scenario does not fit, or there is not one for each lane.
        """
        if given is None:
            return None
        if isinstance(given, str | Path | Scenario | Mapping):
            return [self._source.fitted(given)] * num_envs
        if not isinstance(given, Sequence) or len(given) != num_envs:
            raise ValueError(
                f"scenario is {given!r}; give a scenario, its name or its file, or a sequence of "
                f"{num_envs} of these, None where one is drawn"
            )
        return [None if each is None else self._source.fitted(each) for each in given]

    def orders(
        self, begins: NDArray[np.bool_], lanes: SubEnvironments, chosen: Any
    ) -> NDArray[np.int64]:
        """Put the next missions of some lanes into their slots, see `LaneMissions`.

        Args:
            begins: (L,) which; where no mission was flown yet, the generator begins from its seed.
            lanes: Of the batch.
            chosen: (L,) what to fly instead of drawing, None where to draw; None: draw them all.

        Raises:
            ValueError: A mission does not fit, or the generator returned none. No slot has changed.
        """
        missions: list[DrawnMission] = []
        for lane in np.flatnonzero(begins).tolist():
            rng = self._rngs[lane]
            if lanes.mission[lane] < 0 or rng is None:
                rng = self._rngs[lane] = seeding.np_random(int(lanes.seed[lane]))[0]
            scenario = chosen[lane] if chosen else None
            before = np.zeros(_WORDS, np.uint64) if scenario else _words_of(rng)
            scenario = scenario or self._source.draw(rng)
            own = self.settings.features_in(scenario)
            fitted_to(self.features, own)
            self._check_events(scenario, has_true_vehicles(scenario, own))
            missions.append(DrawnMission(lane, scenario, before, rng))
        self.install(missions)
        return np.where(begins, np.arange(len(self)), REST)

    def _check_events(self, scenario: Scenario, differs: bool) -> None:
        """Refuse more events, or others, than there is room for."""
        n_events, n_sensed = len(scenario.events), len(scenario.uas) * senses(scenario)
        if (
            n_events > self.sizes["E"]
            or n_sensed > self.sizes["S"]
            or goes_home(scenario) > self.goes_home
            or swaps_alone(scenario) > (self.sizes["B"] > 0)
            or scenario.asks_again > (self.sizes["repeats"] > 0)
            or differs > (self.sizes["true vehicles"] > 0)
            or changes_scene(scenario) > self.changes
        ):
            raise ValueError(
                f"scenario {scenario.name!r} has more events, [sensing], [sorties] or "
                f"again_after_s than the {len(self._source.examples)} examples that this batch "
                f"was made for"
            )

    def scene_of(self, scene: int) -> Scenario:
        """The scenario that is flown now where `lanes.scene` is this."""
        return self.scenarios[scene]

    def put_scene(self, lane: int, known: Scenario, arena: Arena, tables: Tables) -> int:
        """Install what the scene of a lane has become, see `ScenarioPool`: in its own slot."""
        self._slots[_MEMORIES.index(ARENA)].put(lane, arena)
        self._slots[_MEMORIES.index(TABLES)].put(lane, tables)
        self.scenarios[lane] = known
        return lane

    def kept(self) -> dict[str, NDArray[Any]]:
        """The states of the generators that drew the missions.

        Raises:
            ValueError: A mission was given to `reset`, not drawn.
        """
        for lane, rng in enumerate(self._rngs):
            if rng is not None and not self.drawn_from[lane].any():
                raise ValueError(
                    f"the mission of environment {lane} was given to reset(): only missions that "
                    f"were drawn can be kept in a checkpoint"
                )
        return {"drawn_from": self.drawn_from}

    def redrawn(
        self, state: Mapping[str, NDArray[Any]], begun: NDArray[np.bool_]
    ) -> list[DrawnMission]:
        """The missions of `drawn_from` once more, for `install`.

        Raises:
            ValueError: These are no states of generators.
        """
        drawn_from = state["drawn_from"]
        last = np.array([_WORD, _WORD, _WORD, _WORD, 1, 2**32 - 1], dtype=np.uint64)
        check_values({"drawn_from": drawn_from}, {"drawn_from": (0, last)})
        missions: list[DrawnMission] = []
        for lane in np.flatnonzero(begun).tolist():
            before = drawn_from[lane]
            if not before.any():
                raise ValueError(f"drawn_from[{lane}] is zero: of a mission that was not drawn")
            rng = _generator_of(before)
            missions.append(DrawnMission(lane, self._source.draw(rng), before.copy(), rng))
        return missions

    def limits(self, begun: NDArray[np.bool_]) -> dict[str, Any]:
        """A lane flies its own slot."""
        slots = np.where(begun, np.arange(len(self)), 0)
        return {"scenario": (slots, slots)}

    def install(self, missions: Sequence[DrawnMission]) -> None:
        """Put missions into the slots of their lanes."""
        for lane, scenario, before, rng in missions:
            pool = ScenarioPool(scenario, self.settings, self.features)
            for memory, slots, arrays in zip(_MEMORIES, self._slots, pool.arrays, strict=True):
                slots.put(lane, memory.mission(arrays, 0))
            self.scenarios[lane] = pool.scenarios[0]
            self.drawn_from[lane] = before
            self._rngs[lane] = rng


def pool_of(
    scenario: ScenarioLike | Sequence[str | Path | Scenario],
    settings: MissionSettings,
    num_envs: int,
) -> LaneMissions:
    """What a batch flies: the pool of scenarios that do not change, or of those that are drawn.

    Raises:
        ValueError: `scenario` is none of what is allowed.
    """
    if isinstance(scenario, Sequence) and not isinstance(scenario, str):
        return ScenarioPool(scenario, settings, lanes=num_envs)
    source = MissionSource.of(scenario)
    if source.fixed:
        return ScenarioPool(source.example, settings, lanes=num_envs)
    return DrawnPool(source, settings, num_envs)


def _words_of(rng: np.random.Generator) -> NDArray[np.uint64]:
    """The state of a generator as numbers of 64 bits."""
    state: Any = rng.bit_generator.state
    inner = [state["state"][name] for name in ("state", "inc")]
    words = [part for number in inner for part in (number & _WORD, number >> 64)]
    return np.array([*words, state["has_uint32"], state["uinteger"]], dtype=np.uint64)


def _generator_of(words: NDArray[np.uint64]) -> np.random.Generator:
    """A generator in this state."""
    low, high, inc_low, inc_high, has_uint32, uinteger = words.tolist()
    bits = np.random.PCG64(0)
    bits.state = {
        "bit_generator": "PCG64",
        "state": {"state": low | high << 64, "inc": inc_low | inc_high << 64},
        "has_uint32": has_uint32,
        "uinteger": uinteger,
    }
    return np.random.Generator(bits)
