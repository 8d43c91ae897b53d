"""What a planner may tell a UAS to do in one step, and its form in an array."""

import math
import numbers
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, Literal, NoReturn, get_args

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.entities.codes import CommandKind

Mode = Literal["covering", "transit", "return"]

VELOCITY, ACCELERATION, WRENCH, GO_TO, CLIMB = map(int, CommandKind)

KIND_NAMES = tuple(kind.name.lower().replace("_", "") for kind in CommandKind)

HOME = -1
"""The GO_TO index of a UAS's own start."""

N_VALUES = 4

COMMAND_DTYPE = record_dtype([("kind", "i8"), ("values", "f8", (N_VALUES,)), ("returning", "?")])
"""One command: its kind, up to four numbers in the order of the dataclass, whether it returns."""

_MODES = get_args(Mode)


@dataclass(frozen=True, slots=True)
class Velocity:
    """A horizontal velocity and an altitude to hold, flown by the vehicle's inner loop.

    Attributes:
        north_mps: [m/s].
        east_mps: [m/s].
        altitude_m: [m] positive up.
        mode: What the planner is doing; "return" lets the UAS land without having left.
    """

    north_mps: float
    east_mps: float
    altitude_m: float
    mode: Mode = "covering"


@dataclass(frozen=True, slots=True)
class Acceleration:
    """An acceleration held over the step, within the vehicle's limits.

    Attributes:
        north_mps2: [m/s²].
        east_mps2: [m/s²].
        down_mps2: [m/s²] positive down.
        mode: As in `Velocity`.
    """

    north_mps2: float
    east_mps2: float
    down_mps2: float
    mode: Mode = "covering"


@dataclass(frozen=True, slots=True)
class Wrench:
    """The paper's lift and torques held over the step (Gasche et al., Sec. II), clipped to limits.

    Attributes:
        lift_N: [N] vertical force in excess of the weight, positive up.
        tau_x_Nm: [N m].
        tau_y_Nm: [N m].
        tau_z_Nm: [N m].
        mode: As in `Velocity`.
    """

    lift_N: float
    tau_x_Nm: float
    tau_y_Nm: float
    tau_z_Nm: float
    mode: Mode = "covering"


@dataclass(frozen=True, slots=True)
class GoTo:
    """Fly to a waypoint or home, past the fixed obstacles.

    Attributes:
        waypoint: Index in the scenario's waypoints; None is the UAS's own start.
        mode: As in `Velocity`; None means "return" for home and "transit" for a waypoint.
        climb_m: [m] by how much to climb above where it is now, as far as the fence allows; 0: it
            flies at the height of the way. Given again and again, it passes over what is ahead.
    """

    waypoint: int | None
    mode: Mode | None = None
    climb_m: float = 0.0


Command = Velocity | Acceleration | Wrench | GoTo

_KINDS: dict[type, int] = {Velocity: VELOCITY, Acceleration: ACCELERATION, Wrench: WRENCH}
_NUMBERS: dict[type, tuple[str, ...]] = {
    kind: tuple(field.name for field in fields(kind))[:-1] for kind in _KINDS
}


def command_mode(command: Command) -> Mode:
    """The operation mode that a command claims."""
    if command.mode is not None:
        return command.mode
    return "return" if isinstance(command, GoTo) and command.waypoint is None else "transit"


def pack(
    commands: Mapping[str, Command],
    names: Sequence[str],
    active: Collection[str],
    n_waypoints: int,
) -> NDArray[np.void]:
    """The commands of a step as an array, checked.

    Args:
        commands: One command for each active UAS, by name.
        names: All UAS of the scenario, in order.
        active: Names of the UAS that fly.
        n_waypoints: Number of waypoints of the scenario.

    Returns:
        (U,) of COMMAND_DTYPE; rows of UAS that do not fly are zero.

    Raises:
        ValueError: A command is missing, surplus, of no known kind, or holds a value that is not
            a finite number, a known mode or an existing waypoint.
    """
    if not isinstance(commands, Mapping):
        raise ValueError(
            f"commands are {commands!r} of type {type(commands).__name__}; "
            f"give a mapping from UAS name to command"
        )
    if len(commands) > len(active) or any(name not in active for name in commands):
        _refuse_surplus(commands, names, active)
    rows: list[tuple[int, tuple[float, ...], bool]] = []
    for name in names:
        if name in commands:
            rows.append(_row(name, commands[name], n_waypoints))
        elif name in active:
            raise ValueError(f"{name} has no command; give one for each active UAS")
        else:
            rows.append((VELOCITY, (0.0,) * N_VALUES, False))
    return np.array(rows, dtype=COMMAND_DTYPE)


def _refuse_surplus(
    commands: Mapping[str, Command], names: Sequence[str], active: Collection[str]
) -> NoReturn:
    for name in commands:
        if name not in names:
            raise ValueError(f"there is no UAS {name!r}; the scenario has {', '.join(names)}")
        if name not in active:
            raise ValueError(f"{name} does not fly; remove its command {commands[name]}")
    raise ValueError(f"{len(commands)} commands for {len(active)} active UAS; give one for each")


def _row(name: str, command: Any, n_waypoints: int) -> tuple[int, tuple[float, ...], bool]:
    kind = _KINDS.get(type(command))
    if kind is None and type(command) is not GoTo:
        raise ValueError(
            f"command of {name} is {command!r}; give a Velocity, Acceleration, Wrench or GoTo"
        )
    if command.mode not in _MODES and not (kind is None and command.mode is None):
        raise ValueError(
            f"command of {name}: mode is {command.mode!r}; it is one of {', '.join(_MODES)}"
        )
    returning = command_mode(command) == "return"
    if kind is None:
        climb_m = _number(name, "climb_m", command.climb_m)
        if climb_m < 0.0:
            raise ValueError(f"command of {name}: climb_m is {climb_m:g}; give 0 or more")
        return GO_TO, (_target(name, command.waypoint, n_waypoints), climb_m, 0.0, 0.0), returning
    values = tuple(
        _number(name, field, getattr(command, field)) for field in _NUMBERS[type(command)]
    )
    return kind, values + (0.0,) * (N_VALUES - len(values)), returning


def _number(name: str, field: str, value: Any) -> float:
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
        if math.isfinite(number):
            return number
    raise ValueError(f"command of {name}: {field} is {value!r}; give a finite number")


def _target(name: str, waypoint: Any, n_waypoints: int) -> float:
    if waypoint is None:
        return float(HOME)
    whole = isinstance(waypoint, int | np.integer) and not isinstance(waypoint, bool)
    if whole and 0 <= int(waypoint) < n_waypoints:
        return float(waypoint)
    raise ValueError(
        f"command of {name}: waypoint is {waypoint!r}; "
        f"give a whole number from 0 to {n_waypoints - 1}, or None for home"
    )
