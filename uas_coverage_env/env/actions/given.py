"""How actions are given: spaces, and what is accepted as an action."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.env.actions.in_plane import kind_in
from uas_coverage_env.env.actions.kind import ActionKind
from uas_coverage_env.scenario import Scenario

_REAL = (np.dtype(np.float32), np.dtype(np.float64))
_ARRAY = np.ndarray


class Actions(Protocol):
    """The actions of a fleet."""

    @property
    def kind(self) -> ActionKind:
        """Their kind."""
        ...

    @property
    def size(self) -> int:
        """Numbers per UAS."""
        ...

    @property
    def ranges(self) -> NDArray[np.float64]:
        """(U, size, 3) what -1, 0 and 1 mean; zero where it is a choice."""
        ...

    def space(self) -> spaces.Space[Any]:
        """A new space of one UAS."""
        ...

    def joint_space(self, n_uas: int) -> spaces.Space[Any]:
        """A new space of the whole swarm."""
        ...

    def accept(self, name: str, action: Any, asked: NDArray[np.float64]) -> None:
        """Write an action into `asked` (size,), not yet known to be finite.

        Raises:
            ValueError: It has a wrong type or shape; names UAS and value.
        """
        ...

    def joint_rows(self, action: Any, n_uas: int) -> Any:
        """The action of the whole swarm as one action for each UAS.

        Raises:
            ValueError: It has a wrong type or shape; names the value.
        """
        ...


@dataclass(frozen=True, eq=False)
class Continuous:
    """Numbers from -1 to 1, scaled to what the vehicle can do."""

    kind: ActionKind
    ranges: NDArray[np.float64]
    size: int

    def space(self) -> spaces.Box:
        """Box(-1, 1) of float32."""
        return spaces.Box(-1.0, 1.0, (self.size,), np.float32)

    def joint_space(self, n_uas: int) -> spaces.Box:
        """The boxes of all UAS, one after the other."""
        return spaces.Box(-1.0, 1.0, (n_uas * self.size,), np.float32)

    def accept(self, name: str, action: Any, asked: NDArray[np.float64]) -> None:
        """Write the numbers; any real numbers in the right shape will do."""
        if type(action) is not _ARRAY:
            action = as_array(name, action)
        if action.dtype in _REAL and action.shape == (self.size,):
            # what learners give; all others are looked at more closely
            asked[...] = action
            return
        if action.dtype.kind not in "fiu":
            raise ValueError(
                f"action of {name} has dtype {action.dtype}: {_shown(action)}; give real numbers"
            )
        if action.shape != (self.size,):
            raise ValueError(
                f"action of {name} has shape {action.shape}: {_shown(action)}; "
                f"give {self.size} numbers, shape ({self.size},)"
            )
        asked[...] = action

    def joint_rows(self, action: Any, n_uas: int) -> NDArray[Any]:
        """One row of numbers for each UAS."""
        action = as_array("the swarm", action)
        if action.shape != (n_uas * self.size,):
            raise ValueError(
                f"action of the swarm has shape {action.shape}: {_shown(action)}; "
                f"give {self.size} numbers for each of {n_uas} UAS, shape ({n_uas * self.size},)"
            )
        return action.reshape(n_uas, self.size)


@dataclass(frozen=True, eq=False)
class Choice:
    """One of some choices."""

    kind: ActionKind
    ranges: NDArray[np.float64]
    size: int = 1

    def space(self) -> spaces.Discrete:
        """One choice."""
        return spaces.Discrete(self.kind.choices)

    def joint_space(self, n_uas: int) -> spaces.MultiDiscrete:
        """One choice for each UAS."""
        return spaces.MultiDiscrete([self.kind.choices] * n_uas)

    def accept(self, name: str, action: Any, asked: NDArray[np.float64]) -> None:
        """Write the choice; any whole number in range will do, also as an array without axes."""
        if isinstance(action, np.ndarray) and action.shape == ():
            action = action[()]
        whole = isinstance(action, int | np.integer) and not isinstance(action, bool)
        if not whole or not 0 <= action < self.kind.choices:
            raise ValueError(
                f"action of {name} is {_shown(action)} of type {type(action).__name__}; "
                f"give a whole number from 0 to {self.kind.choices - 1}"
            )
        asked[...] = action

    def joint_rows(self, action: Any, n_uas: int) -> NDArray[Any]:
        """One choice for each UAS."""
        action = as_array("the swarm", action)
        if action.shape != (n_uas,):
            raise ValueError(
                f"action of the swarm has shape {action.shape}: {_shown(action)}; "
                f"give one choice for each of {n_uas} UAS, shape ({n_uas},)"
            )
        return action


def actions_of(kind: ActionKind, scenario: Scenario) -> Actions:
    """The actions of a kind, scaled to the fleet of a scenario; in the plane, those of `kind_in`.

    Raises:
        ValueError: Its ranges are not what they should be.
    """
    kind = kind_in(kind, scenario)
    ranges = kind.scaled_to(scenario)
    return Choice(kind, ranges) if kind.choices else Continuous(kind, ranges, kind.size)


def accept_of_lanes(actions: Actions, given: Any, asked: NDArray[np.float64]) -> None:
    """Write the actions of many swarms side by side, not yet known to be finite.

    Args:
        actions: Their kind.
        given: (L, U, size) numbers, or (L, U) choices; as (L, -1) too.
        asked: (L, U, size); written.

    Raises:
        ValueError: They have a wrong type or shape, or a choice is none; names the value.
    """
    given = as_array("the swarms", given)
    n_lanes, n_uas, size = asked.shape
    if len(given.shape) < 2 or len(given) != n_lanes or given.size != asked.size:
        raise ValueError(
            f"actions have shape {given.shape}; give {size} for each of {n_uas} UAS in each of "
            f"{n_lanes} environments"
        )
    choices = actions.kind.choices
    if given.dtype.kind not in ("iu" if choices else "fiu"):
        numbers = "whole numbers" if choices else "real numbers"
        raise ValueError(f"actions have dtype {given.dtype}; give {numbers}")
    if choices and (given.min() < 0 or given.max() >= choices):
        raise ValueError(
            f"actions go from {given.min()} to {given.max()}; "
            f"give whole numbers from 0 to {choices - 1}"
        )
    asked[:] = given.reshape(asked.shape)


def as_array(name: str, action: Any) -> NDArray[Any]:
    """What somebody gives as an action, as an array of whatever it holds.

    Raises:
        ValueError: It cannot be one; names the value.
    """
    try:
        return np.asarray(action)
    except (TypeError, ValueError, RuntimeError) as error:
        raise ValueError(
            f"action of {name} is {_shown(action)} of type {type(action).__name__}; "
            f"give an array of numbers"
        ) from error


def _shown(action: Any) -> str:
    text = " ".join(repr(action).split())
    return text if len(text) <= 80 else text[:79] + "…"
