"""What a disturbance is: a name, numbers, and a kernel that pushes back at every step."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.files.blocks import check_parameters, checked_blocks

DISTURBANCE_MEMORY = 16
"""Numbers that a disturbance may keep for each UAS from step to step."""

DISTURBANCE_DTYPE = record_dtype(
    [
        # it is part of the scenario; in a batch, others may have disturbances that this
        # one has not
        ("acts", "?"),
        # all UAS draw the same random numbers
        ("common", "?"),
        # tells its random numbers from those of other disturbances
        ("key", "u8"),
        # of `Arena.disturbance_parameters`
        ("first", "i8"),
        ("n", "i8"),
    ]
)


@dataclass(frozen=True)
class Disturbance:
    """Something that acts on the UAS and that no planner is told of.

    Its kernel is `act(arena, state, outcome, i, parameters, memory, random)`, compiled with
    `uas_coverage_env.compiled.kernels.kernel`. It is called in every step for each UAS i that
    flies, when all inputs are known and before any UAS moves. It adds to `outcome[i].wind_mps`,
    the velocity of the air at the UAS over the step (NED), or to `outcome[i].force_N`, another
    force on it (NED), or changes `outcome[i].u`, the inputs that the inner loop asks for, which
    are then cut off at the vehicle's limits. All else is to be read only. `parameters` is (P,)
    float64; `memory` is (DISTURBANCE_MEMORY,) float64 of UAS i, zero at t = 0 and kept from step to
    step; `random` is what `uniform` and `normal` of `uas_coverage_env.disturbances` draw from.

    Attributes:
        name: Its name, which also tells its random numbers from those of others.
        act: The kernel.
        parameters: Finite numbers that it is handed.
        common: All UAS draw the same random numbers, instead of each its own.
        of_event: Its parameters hold the number of an event: it acts in scenarios that have it,
            and is refused in others, where the kernel would read beside its array.

    Raises:
        ValueError: A parameter is not finite, or the name is empty.
    """

    name: str
    act: Any
    parameters: tuple[float, ...] = ()
    common: bool = False
    of_event: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.name, str) or not self.name:
            raise ValueError(f"a disturbance is named {self.name!r}; give it a name")
        check_parameters(f"disturbance {self.name}", self.parameters)


def checked_disturbances(disturbances: Any) -> tuple[Disturbance, ...]:
    """The disturbances of a mission.

    Raises:
        ValueError: They are no disturbances, or two have one name.
    """
    return checked_blocks("disturbances", "disturbances", disturbances, Disturbance, least=0)


def in_slots(
    missions: Sequence[Sequence[Disturbance]],
) -> tuple[tuple[Disturbance, ...], list[tuple[Disturbance | None, ...]]]:
    """The disturbances of many missions side by side, so that one table of kernels is for all.

    Args:
        missions: Of each, what acts in it.

    Returns:
        One disturbance of each name; and for each mission, in the same order, its own, None where
        it has none of that name.

    Raises:
        ValueError: Two of one name have different kernels.
    """
    of_name: dict[str, Disturbance] = {}
    for disturbances in missions:
        for disturbance in disturbances:
            first = of_name.setdefault(disturbance.name, disturbance)
            if first.act is not disturbance.act:
                raise ValueError(
                    f"two disturbances that differ are named {disturbance.name!r}; rename one"
                )
    slots = []
    for disturbances in missions:
        own = {disturbance.name: disturbance for disturbance in disturbances}
        slots.append(tuple(own.get(name) for name in of_name))
    return tuple(of_name.values()), slots


def fitted_to(
    kinds: Sequence[Disturbance], own: Sequence[Disturbance]
) -> tuple[Disturbance | None, ...]:
    """The disturbances of one more mission, in the slots of `in_slots`.

    Args:
        kinds: One disturbance of each name, as `in_slots` returns them.
        own: What acts in the mission.

    Raises:
        ValueError: It has one that the others do not have.
    """
    found, (_, slots) = in_slots([kinds, own])
    if len(found) > len(kinds):
        new = ", ".join(disturbance.name for disturbance in found[len(kinds) :])
        known = ", ".join(disturbance.name for disturbance in kinds) or "none"
        raise ValueError(
            f"disturbance {new} is new among missions that fly side by side; known: {known}"
        )
    return slots


def disturbance_tables(
    slots: Sequence[Disturbance | None],
) -> tuple[NDArray[np.void], NDArray[np.float64]]:
    """Disturbances for kernels.

    Returns:
        (D,) of DISTURBANCE_DTYPE, and (P,) the parameters of all.
    """
    records = np.zeros(len(slots), dtype=DISTURBANCE_DTYPE)
    parameters: list[float] = []
    for record, disturbance in zip(records, slots, strict=True):
        if disturbance is not None:
            name = hashlib.sha256(disturbance.name.encode()).digest()
            record["acts"] = True
            record["common"] = disturbance.common
            record["key"] = int.from_bytes(name[:8], "little")
            record["first"], record["n"] = len(parameters), len(disturbance.parameters)
            parameters.extend(disturbance.parameters)
    return records, np.array(parameters, dtype=np.float64)
