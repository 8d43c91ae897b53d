"""What a feature is: something that few missions have, in a file of its own.

Wind, sensors with errors, a fault, battery packs: a feature has records that do not change during a
mission, a memory for each UAS, and kernels at named points of the step. Only a mission that has it
compiles and calls these.
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted
from uas_coverage_env.compiled.views import record_view
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.files.blocks import check_parameters, checked_blocks

DISTURBANCE_MEMORY = 16
"""Numbers that a disturbance may keep for each UAS from step to step."""

_WORD = 8
"""Bytes of a word of memory."""


class Point(IntEnum):
    """When a step calls the kernels of its features."""

    BEGIN = 0
    """A mission begins: draw what it needs. `(arena, state, f, seed)`, seed being a uint64 that
    follows from the mission's seed and number, and from the feature's name; at all other points
    `(arena, state, outcome, f)`."""
    COMMAND = 1
    """The commands are given in `outcome[i].applied_command`; what assists has not seen them."""
    ACT = 2
    """The inputs `outcome[i].u` are known, no UAS has moved: add to the wind and the forces that
    act over the step, or change the inputs."""
    MOVED = 3
    """All UAS have moved, contacts are not judged yet: contacts and charge may be added to."""
    JUDGED = 4
    """The step is over: coverage, landings and losses are known, `state.step` is the new sample."""
    SENSED = 5
    """Last of all: write what is estimated, measured and observed of the state."""


FEATURE_DTYPE = record_dtype(
    [
        # the mission has it; in a batch, others may have features that this one has not
        ("acts", "?"),
        # tells its random numbers from those of other features
        ("key", "u8"),
        # its records: first word in `Arena.feature_words`, and how many
        ("first", "i8"),
        ("n", "i8"),
        # first word of its records for the UAS in `WorldState.memory`
        ("memory", "i8"),
    ]
)


@dataclass(frozen=True, eq=False)
class MissionFeature:
    """Something that few missions have.

    A kernel is compiled with `uas_coverage_env.compiled.kernels.rare_kernel`, takes what `Point`
    says, and finds what is its own by its number f: `arena.features[f]` says where its records lie
    in `arena.feature_words` and `state.memory` (`record_view`).

    Attributes:
        name: Its name, which also tells its random numbers from those of others.
        kernels: What it does, and when.
        records: (n,) what it knows, the same in all steps.
        memory: Type of the record that it keeps for each UAS, zero at t = 0; None: it keeps none.
        key: In place of the number that follows from the name, for random numbers.
        perturbs: It makes vehicles others than is believed; the state has room for that then.
    """

    name: str
    kernels: Mapping[Point, Any]
    records: NDArray[Any] = field(default_factory=lambda: np.zeros(0))
    memory: np.dtype | None = None
    key: int | None = None
    perturbs: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"a feature is named {self.name!r}; give it a name")

    @property
    def disturbs(self) -> bool:
        """Whether it acts on how UAS fly."""
        return Point.ACT in self.kernels


MEMORY_DTYPE = record_dtype([("numbers", "f8", (DISTURBANCE_MEMORY,)), ("random", "u8", (1,))])

_parameters_of = record_view(np.dtype(np.float64))
_memory_of = record_view(MEMORY_DTYPE)


@dataclass(frozen=True)
class Disturbance(MissionFeature):
    """A feature that acts on each UAS by itself, and that no planner is told of.

    Its kernel is `act(arena, state, outcome, i, parameters, memory, random)`, compiled with
    `uas_coverage_env.compiled.kernels.kernel`. It is called in every step for each UAS i that
    flies, when all inputs are known and before any UAS moves. It adds to `outcome[i].wind_mps`,
    the velocity of the air at the UAS over the step (NED), or to `outcome[i].force_N`, another
    force on it (NED), or changes `outcome[i].u`, the inputs that the inner loop asks for, which
    are then cut off at the vehicle's limits; or it makes the vehicle of UAS i another with
    `uas_coverage_env.features.perturb`. All else is to be read only. `parameters` is (P,)
    float64; `memory` is (DISTURBANCE_MEMORY,) float64 of UAS i, zero at t = 0 and kept from step to
    step; `random` is what `uniform` and `normal` of `uas_coverage_env.features` draw from.

    Attributes:
        name: Its name, which also tells its random numbers from those of others.
        act: The kernel.
        parameters: Finite numbers that it is handed.
        common: All UAS draw the same random numbers, instead of each its own.
        perturbs: It makes vehicles others than is believed.

    Raises:
        ValueError: A parameter is not finite, or the name is empty.
    """

    kernels: Mapping[Point, Any] = field(init=False, compare=False, repr=False)
    records: NDArray[Any] = field(init=False, compare=False, repr=False)
    memory: np.dtype | None = field(init=False, compare=False, repr=False)
    key: int | None = field(init=False, compare=False, repr=False, default=None)
    perturbs: bool = field(default=False, kw_only=True)
    act: Any
    parameters: tuple[float, ...] = ()
    common: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        check_parameters(f"disturbance {self.name}", self.parameters)
        begin = _begin_common if self.common else _begin_each
        kernels = {Point.BEGIN: begin, Point.ACT: _on_each(self.act)}
        records = np.array(self.parameters, dtype=np.float64)
        # frozen, as all features are
        self.__dict__.update(kernels=kernels, records=records, memory=MEMORY_DTYPE)


@cache
def _on_each(act: Any) -> Any:
    """The kernel of a disturbance at the point ACT."""

    def act_on_each(arena, state, outcome, f):
        own = arena.features[f]
        parameters = _parameters_of(arena.feature_words, own.first, own.n)
        memory = _memory_of(state.memory, own.memory, state.uas.shape[0])
        for i in range(state.uas.shape[0]):
            if state.uas[i].status == FLYING:
                act(
                    arena, state, outcome, i, parameters, memory[i].numbers[:],
                    memory[i].random[:],
                )  # fmt: skip

    act_on_each.__name__ = getattr(act, "__name__", repr(act))  # in messages
    return kernel(act_on_each)


@kernel
def _begin_each(arena, state, f, seed):
    memory = _memory_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(memory.shape[0]):
        memory[i].random[0] = counted(seed, i + 1)


@kernel
def _begin_common(arena, state, f, seed):
    memory = _memory_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(memory.shape[0]):
        memory[i].random[0] = counted(seed, 0)


def checked_features(features: Any) -> tuple[MissionFeature, ...]:
    """The features of a mission.

    Raises:
        ValueError: They are no features, or two have one name.
    """
    return checked_blocks("disturbances", "disturbances", features, MissionFeature, least=0)


def in_slots(
    missions: Sequence[Sequence[MissionFeature]],
) -> tuple[tuple[MissionFeature, ...], list[tuple[MissionFeature | None, ...]]]:
    """The features of many missions side by side, so that one table of kernels is for all.

    Args:
        missions: Of each, what it has.

    Returns:
        One feature of each name; and for each mission, in the same order, its own, None where it
        has none of that name.

    Raises:
        ValueError: Two of one name have different kernels.
    """
    of_name: dict[str, MissionFeature] = {}
    for features in missions:
        for feature in features:
            first = of_name.setdefault(feature.name, feature)
            if first.kernels != feature.kernels or first.memory != feature.memory:
                raise ValueError(f"two features that differ are named {feature.name!r}; rename one")
    slots = []
    for features in missions:
        own = {feature.name: feature for feature in features}
        slots.append(tuple(own.get(name) for name in of_name))
    return tuple(of_name.values()), slots


def fitted_to(
    kinds: Sequence[MissionFeature], own: Sequence[MissionFeature]
) -> tuple[MissionFeature | None, ...]:
    """The features of one more mission, in the slots of `in_slots`.

    Args:
        kinds: One feature of each name, as `in_slots` returns them.
        own: What the mission has.

    Raises:
        ValueError: It has one that the others do not have.
    """
    found, (_, slots) = in_slots([kinds, own])
    if len(found) > len(kinds):
        new = ", ".join(feature.name for feature in found[len(kinds) :])
        known = ", ".join(feature.name for feature in kinds) or "none"
        raise ValueError(f"{new} is new among missions that fly side by side; known: {known}")
    return slots


def feature_tables(
    slots: Sequence[MissionFeature | None], n_uas: int
) -> tuple[NDArray[np.void], NDArray[np.uint64]]:
    """Features for kernels.

    Returns:
        (F,) of FEATURE_DTYPE, and the words in which their records lie.
    """
    rows = np.zeros(len(slots), dtype=FEATURE_DTYPE)
    words: list[NDArray[np.uint64]] = []
    n_words = n_memory = 0
    for row, feature in zip(rows, slots, strict=True):
        if feature is None:
            continue
        row["acts"] = True
        row["key"] = feature.key or int.from_bytes(
            hashlib.sha256(feature.name.encode()).digest()[:8], "little"
        )
        row["first"], row["n"] = n_words, len(feature.records)
        row["memory"] = n_memory
        own = np.zeros(_words(feature.records.nbytes), dtype=np.uint64)
        own.view(np.uint8)[: feature.records.nbytes] = np.frombuffer(
            feature.records.tobytes(), np.uint8
        )
        words.append(own)
        n_words += len(own)
        n_memory += memory_words([feature], n_uas)
    return rows, np.concatenate([np.zeros(0, np.uint64), *words])


def memory_words(features: Sequence[MissionFeature | None], n_uas: int) -> int:
    """How many words the memory of features takes for a fleet."""
    kept = [feature.memory for feature in features if feature is not None]
    return sum(_words(n_uas * dtype.itemsize) for dtype in kept if dtype is not None)


def memory_of(
    features: Sequence[MissionFeature | None], n_uas: int, words: NDArray[np.uint64]
) -> dict[str, NDArray[np.void]]:
    """What features have kept in the memory of a mission, by their names: views of it.

    Args:
        features: In the order of `Arena.features`.
        n_uas: Size of the fleet.
        words: `WorldState.memory`.
    """
    kept, first = {}, 0
    for feature in features:
        if feature is not None and feature.memory is not None:
            n_bytes = n_uas * feature.memory.itemsize
            kept[feature.name] = words[first:].view(np.uint8)[:n_bytes].view(feature.memory)
            first += memory_words([feature], n_uas)
    return kept


def _words(n_bytes: int) -> int:
    return -(-n_bytes // _WORD)
