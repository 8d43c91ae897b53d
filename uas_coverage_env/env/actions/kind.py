"""What a kind of action is: its numbers or choices, and the kernel that writes a command."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.blocks import check_parameters
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams

Range = tuple[float, float, float]
"""What -1, 0 and 1 mean for a number of an action."""


@dataclass(frozen=True)
class ActionKind:
    """One kind of action, made of numbers or a choice.

    Numbers, `Box(-1, 1)`: a kind has `numbers` and `ranges`. Finite numbers beyond ±1 are clipped;
    below and above 0 they are scaled linearly. A choice, `Discrete`: it has `choices`.

    Its kernel is `write(arena, state, tables, learners, i, parameters, values, command)`, compiled
    with `uas_coverage_env.compiled.kernels.kernel` and called in every step for each UAS that
    flies:

    - `arena`, the mission (`world.Arena`); `state`, the world (`world.WorldState`);
    - `tables` and `learners`, what the environment adds (`env.episode.memory`);
    - `i`, the index of the UAS that acts;
    - `parameters`, (P,) float64, those of the kind;
    - `values`, (A,) float64, the numbers of the action, scaled to their ranges; or the choice;
    - `command`, a record of `world.COMMAND_DTYPE`, zero; to be written: kind and finite values
      (`autopilot.write_command`), and `returning` if the UAS may land where it has not left.

    A command that cannot be flown ends in a ValueError; the UAS brakes in that step.

    Attributes:
        name: What `action=` calls it.
        meaning: What it is, in a sentence.
        write: The kernel.
        numbers: Names of the numbers, with units.
        ranges: (vehicle, scenario) -> the `Range` of each number.
        choices: How many there are; 0: it is made of numbers.
        mask: (..., K_WAYPOINTS) waypoints to choose from, -1 where there is none -> (..., choices)
            which choices exist; None: all of them.
        goes_to: Whether it writes commands of kind GO_TO: the step then has guidance.
        express: `express(arena, state, tables, learners, i, parameters, command)`, the values for
            which the kernel writes a planner's command; plain Python. It raises a ValueError that
            says why where there are none. Unless the kind `goes_to`, a GoTo arrives as the Velocity
            that guidance flies now. None: it expresses nothing.
        parameters: Finite numbers that the kernel is handed.

    Raises:
        ValueError: It has neither numbers with ranges nor choices, or both; or a parameter is not
            finite.
    """

    name: str
    meaning: str
    write: Any
    numbers: tuple[str, ...] = ()
    ranges: Callable[[VehicleParams, Scenario], Sequence[Range]] | None = None
    choices: int = 0
    mask: Callable[[NDArray[np.int64]], NDArray[np.bool_]] | None = None
    goes_to: bool = False
    express: Callable[..., Sequence[float]] | None = None
    parameters: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_parameters(f"action kind {self.name}", self.parameters)
        continuous = bool(self.numbers) and self.ranges is not None
        if self.choices < 0 or continuous == bool(self.choices):
            raise ValueError(f"action kind {self.name!r}: give numbers and ranges, or choices")

    @property
    def size(self) -> int:
        """Numbers per UAS; a choice is one."""
        return len(self.numbers) or 1

    def scaled_to(self, scenario: Scenario) -> NDArray[np.float64]:
        """The ranges of a fleet, (U, size, 3); zero where it is a choice.

        Raises:
            ValueError: There is not one range for each number, or one does not rise.
        """
        ranges = np.zeros((len(scenario.uas), self.size, 3))
        if self.ranges is None:
            return ranges
        for i, vehicle in enumerate(scenario.vehicles):
            given = np.asarray(self.ranges(vehicle, scenario), dtype=np.float64)
            if given.shape != (self.size, 3):
                raise ValueError(
                    f"action kind {self.name!r}: ranges have shape {given.shape}; give lowest, "
                    f"middle and highest of {self.size} numbers, shape ({self.size}, 3)"
                )
            if not np.isfinite(given).all() or not (np.diff(given) >= 0.0).all():
                raise ValueError(
                    f"action kind {self.name!r}: ranges of {scenario.uas[i].name} are "
                    f"{given.tolist()}; give finite numbers, lowest ≤ middle ≤ highest"
                )
            ranges[i] = given
        return ranges

    def masks(self, candidates: NDArray[np.int64]) -> NDArray[np.bool_]:
        """Which choices exist.

        Args:
            candidates: (..., K_WAYPOINTS) the waypoints to choose from; -1 where there is none.

        Returns:
            (..., choices).
        """
        if self.mask is None:
            return np.ones((*candidates.shape[:-1], self.choices), dtype=np.bool_)
        return self.mask(candidates)
