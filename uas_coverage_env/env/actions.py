"""What a learner may do: the four kinds of action, their spaces, and the commands they become.

velocity, `Box(-1, 1, (3,))`:
    North and east velocity in units of the vehicle's limit, and an altitude to hold: -1 is the
    lowest and 1 the highest that lies `ALTITUDE_MARGIN_M` inside of the fence's margin. A
    horizontal velocity longer than the limit is shortened by the inner loop.
acceleration, `Box(-1, 1, (3,))`:
    North and east acceleration in units of g · tilt limit; down acceleration, -1 at the largest
    lift, 0 at hover, 1 at the smallest.
wrench, `Box(-1, 1, (4,))`:
    Lift, -1 the smallest, 0 the weight alone, 1 the largest; three torques in units of the limits.
waypoint, `Discrete(K_WAYPOINTS + 1)`:
    Fly to that one of the nearest open waypoints, in the order of the observation; the last choice
    is home. A choice that does not exist now keeps the former target; before the first, and with
    none, a UAS stays where it is.

Finite numbers beyond ±1 are clipped.
"""

import math
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams, Z
from uas_coverage_env.world import HOME
from uas_coverage_env.world.commands import ACCELERATION, GO_TO, VELOCITY, WRENCH

ALTITUDE_MARGIN_M = 1.0
"""Altitudes of the velocity action keep this much more than the fence's margin [m]."""

HOME_CHOICE = K_WAYPOINTS
"""The waypoint action that flies home."""

_REAL = (np.dtype(np.float32), np.dtype(np.float64))

ACTION_NAMES = ("velocity", "acceleration", "wrench", "waypoint")

RANGES_DTYPE = np.dtype(
    (
        np.record,
        np.dtype(
            [("lowest", "f8", (4,)), ("middle", "f8", (4,)), ("highest", "f8", (4,))], align=True
        ),
    )
)
"""What -1, 0 and 1 mean for the numbers of a command."""


class Actions(Protocol):
    """One kind of action."""

    @property
    def kind(self) -> int:
        """The kind of command that it becomes."""
        ...

    @property
    def size(self) -> int:
        """Numbers per UAS."""
        ...

    @property
    def ranges(self) -> NDArray[np.void]:
        """(U,) of RANGES_DTYPE; not used by the waypoint action."""
        ...

    def space(self) -> spaces.Space[Any]:
        """A new space of one UAS."""
        ...

    def joint_space(self, n_uas: int) -> spaces.Space[Any]:
        """A new space of the whole swarm."""
        ...

    def accept(self, name: str, action: Any, asked: NDArray[np.float64], i: int) -> None:
        """Write an action into row i of `asked` (U, size), not yet known to be finite.

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

    kind: int
    size: int
    ranges: NDArray[np.void]

    def space(self) -> spaces.Box:
        """Box(-1, 1) of float32."""
        return spaces.Box(-1.0, 1.0, (self.size,), np.float32)

    def joint_space(self, n_uas: int) -> spaces.Box:
        """The boxes of all UAS, one after the other."""
        return spaces.Box(-1.0, 1.0, (n_uas * self.size,), np.float32)

    def accept(self, name: str, action: Any, asked: NDArray[np.float64], i: int) -> None:
        """Write the numbers; any real numbers in the right shape will do."""
        if type(action) is not np.ndarray:
            action = as_array(name, action)
        if action.dtype in _REAL and action.shape == (self.size,):
            # what learners give; all others are looked at more closely
            asked[i] = action
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
        asked[i] = action

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
    """Which of the nearest open waypoints next, or home."""

    ranges: NDArray[np.void]
    kind: int = GO_TO
    size: int = 1

    def space(self) -> spaces.Discrete:
        """One of the waypoints, or home."""
        return spaces.Discrete(HOME_CHOICE + 1)

    def joint_space(self, n_uas: int) -> spaces.MultiDiscrete:
        """One choice for each UAS."""
        return spaces.MultiDiscrete([HOME_CHOICE + 1] * n_uas)

    def accept(self, name: str, action: Any, asked: NDArray[np.float64], i: int) -> None:
        """Write the choice; any whole number in range will do, also as an array without axes."""
        if isinstance(action, np.ndarray) and action.shape == ():
            action = action[()]
        whole = isinstance(action, int | np.integer) and not isinstance(action, bool)
        if not whole or not 0 <= action <= HOME_CHOICE:
            raise ValueError(
                f"action of {name} is {_shown(action)} of type {type(action).__name__}; "
                f"give a whole number from 0 to {HOME_CHOICE} (home)"
            )
        asked[i] = action

    def joint_rows(self, action: Any, n_uas: int) -> NDArray[Any]:
        """One choice for each UAS."""
        action = as_array("the swarm", action)
        if action.shape != (n_uas,):
            raise ValueError(
                f"action of the swarm has shape {action.shape}: {_shown(action)}; "
                f"give one choice for each of {n_uas} UAS, shape ({n_uas},)"
            )
        return action


def actions_of(name: str, scenario: Scenario) -> Actions:
    """The kind of action of this name, scaled to the fleet of a scenario.

    Raises:
        ValueError: There is no such kind.
    """
    if name not in ACTION_NAMES:
        raise ValueError(f"action is {name!r}; it is one of {', '.join(ACTION_NAMES)}")
    ranges = np.zeros(len(scenario.uas), dtype=RANGES_DTYPE)
    if name == "waypoint":
        return Choice(ranges)
    altitudes_m = _altitude_range(scenario)
    for entry, vehicle in zip(ranges, scenario.vehicles, strict=True):
        rows = {
            "velocity": _velocity_range,
            "acceleration": _acceleration_range,
            "wrench": _wrench_range,
        }[name](vehicle, altitudes_m)
        for field, row in zip(
            ("lowest", "middle", "highest"), zip(*rows, strict=True), strict=True
        ):
            entry[field][: len(row)] = row
    kind = {"velocity": VELOCITY, "acceleration": ACCELERATION, "wrench": WRENCH}[name]
    return Continuous(kind, 4 if name == "wrench" else 3, ranges)


Range = tuple[float, float, float]


def _altitude_range(scenario: Scenario) -> Range:
    altitudes_m = -scenario.fence.vertices_m[:, 2]
    lowest, highest = float(altitudes_m.min()), float(altitudes_m.max())
    middle = (lowest + highest) / 2
    keep_m = min(scenario.geofence.margin_m + ALTITUDE_MARGIN_M, (highest - lowest) / 2)
    return lowest + keep_m, middle, highest - keep_m


def _velocity_range(vehicle: VehicleParams, altitudes_m: Range) -> tuple[Range, ...]:
    speed_mps = vehicle.limits.v_xy_max_mps
    return (-speed_mps, 0.0, speed_mps), (-speed_mps, 0.0, speed_mps), altitudes_m


def _acceleration_range(vehicle: VehicleParams, _: Range) -> tuple[Range, ...]:
    airframe, limits = vehicle.airframe, vehicle.limits
    level = airframe.gravity_mps2 * limits.tilt_max_rad
    up, down = limits.lift_max_N / airframe.mass_kg, -limits.lift_min_N / airframe.mass_kg
    return (-level, 0.0, level), (-level, 0.0, level), (-up, 0.0, down)


def _wrench_range(vehicle: VehicleParams, _: Range) -> tuple[Range, ...]:
    limits = vehicle.limits
    xy_radps2 = limits.angular_acceleration_xy_max_radps2
    fastest_radps2 = (xy_radps2, xy_radps2, limits.angular_acceleration_z_max_radps2)
    torques = [
        inertia * radps2
        for inertia, radps2 in zip(vehicle.airframe.inertia_kgm2, fastest_radps2, strict=True)
    ]
    lift = (limits.lift_min_N, 0.0, limits.lift_max_N)
    return lift, *((-torque, 0.0, torque) for torque in torques)


@inlined_kernel
def first_not_finite(asked):
    """Index of the first UAS that was asked for something not finite; -1 if none was."""
    for i in range(asked.shape[0]):
        for k in range(asked.shape[1]):
            if not math.isfinite(asked[i, k]):
                return i
    return -1


@inlined_kernel
def write_commands(state, kind, ranges, asked, candidates, targets, commands):
    """Turn what was asked into commands.

    Args:
        state: The state of the world.
        kind: Kind of command.
        ranges: (U,) of RANGES_DTYPE.
        asked: (U, size) the actions, finite.
        candidates: (U, K_WAYPOINTS) waypoints to choose from; -1 where there is none.
        targets: (U,) where each is flying to; updated by the waypoint action.
        commands: (U,) of COMMAND_DTYPE; written.
    """
    for i in range(commands.shape[0]):
        command = commands[i]
        command.kind = kind
        command.returning = False
        for k in range(4):
            command.values[k] = 0.0
        if kind != GO_TO:
            for k in range(asked.shape[1]):
                share = min(max(asked[i, k], -1.0), 1.0)
                middle = ranges[i].middle[k]
                reach = ranges[i].highest[k] - middle
                if share < 0.0:
                    reach = middle - ranges[i].lowest[k]
                command.values[k] = middle + share * reach
            continue
        choice = int(asked[i, 0])
        if choice == HOME_CHOICE:
            targets[i] = HOME
        elif candidates[i, choice] >= 0:
            targets[i] = candidates[i, choice]
        command.values[0] = targets[i]
        command.returning = targets[i] == HOME
        if targets[i] == NO_TARGET:
            # nowhere to go yet: hover
            command.kind = VELOCITY
            command.values[0] = 0.0
            command.values[2] = -state.x[i, Z]


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
