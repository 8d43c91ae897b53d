"""What a reward is made of: terms, each with a name, a weight and a kernel that computes it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.blocks import check_parameters

LARGEST_WEIGHT = 1e9
"""No reward weight is larger: the sum of a mission stays far from the end of the numbers."""


@dataclass(frozen=True)
class RewardTerm:
    """One term of the reward.

    Its kernel is `value(arena, state, tables, learners, scratch, i, parameters)`, compiled with
    `uas_coverage_env.compiled.kernels.kernel`. It is called after every step for each UAS i that
    flew in it, with the state after the step, and returns a finite float; `scratch` has the
    commands and what came of them (`env.memory`), `parameters` is (P,) float64.

    Attributes:
        name: Its name in `reward_weights` and `reward_terms`.
        weight: Unless `reward_weights` says otherwise.
        meaning: What is multiplied by the weight, per UAS and step.
        value: The kernel.
        parameters: Finite numbers that it is handed.

    Raises:
        ValueError: A parameter is not finite.
    """

    name: str
    weight: float
    meaning: str
    value: Any
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_parameters(f"reward term {self.name}", self.parameters)

    @property
    def size(self) -> int:
        """It is one number."""
        return 1

    @property
    def kernels(self) -> tuple[Any, ...]:
        """What computes it."""
        return (self.value,)


def weights_of(
    terms: Sequence[RewardTerm], given: Mapping[str, float] | None
) -> NDArray[np.float64]:
    """All weights: those given, and the defaults of the others.

    Args:
        terms: Of the reward.
        given: Name -> weight.

    Returns:
        (R,) in the order of the terms.

    Raises:
        ValueError: A name is no term, or a weight is no number, or beyond ±LARGEST_WEIGHT.
    """
    weights: dict[str, Any] = {term.name: term.weight for term in terms}
    if given is not None and not isinstance(given, Mapping):
        raise ValueError(f"reward_weights is {given!r}; give a mapping from term to weight")
    for name, weight in (given or {}).items():
        if name not in weights:
            raise ValueError(f"there is no reward term {name!r}; there are {', '.join(weights)}")
        number = isinstance(weight, Real) and not isinstance(weight, bool)
        # NaN is not below any bound
        if not number or not abs(weight) <= LARGEST_WEIGHT:  # pyrefly: ignore[unsupported-operation]
            shown = repr(weight)[:80]
            raise ValueError(
                f"reward_weights: {name} is {shown}; give a finite number, at most "
                f"{LARGEST_WEIGHT:g} in size"
            )
        weights[name] = weight
    return np.array(list(weights.values()), dtype=np.float64)
