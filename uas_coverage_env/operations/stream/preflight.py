"""Before a stream: vehicles are heard, know their failsafes, pass their checks, arm, take off."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.autopilots import Name
from uas_coverage_env.operations.stream.failsafes import BLIND_S, SETTINGS, Setting
from uas_coverage_env.operations.stream.fleet import AGAIN_S, Fleet, GivenUpError
from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.vehicle_limits import Limits

FloatArray = NDArray[np.float64]

_READS_S = 8.0
_READY_FIRST_S = 3.0
"""So long a vehicle may take to say whether its checks pass; old ones never do."""
_TOGETHER_S = 6.0
"""All have to arm within so long: one that waits on the ground disarms after 10 s."""
_STREAM_FIRST_S = 1.5
"""So long targets are streamed before a mode is entered that needs them."""
_AT_START_M = 8.0
_ON_GROUND_M = 2.0
_UP_WITHIN_M = 0.7
_LOW_M = 1.0


def meet(fleet: Fleet, starts_m: Mapping[str, FloatArray], patience_s: float) -> None:
    """Hear all vehicles, disarmed on the ground at their starts.

    Raises:
        GivenUpError: One is not.
    """
    fleet.until(
        lambda link: link.place_m is not None and link.mode is not None,
        lambda link: None,
        patience_s,
        "is not heard from",
    )
    for link in fleet:
        assert link.place_m is not None
        away_m = math.hypot(*(link.place_m - starts_m[link.name])[:2])
        if away_m > _AT_START_M:
            raise GivenUpError(f"{link.name} is {away_m:.0f} m from its start; put it there")
        if link.armed or -link.place_m[2] > _ON_GROUND_M:
            raise GivenUpError(f"{link.name} is flying or armed; stream begins on the ground")


def read_limits(fleet: Fleet) -> dict[str, Limits]:
    """What each vehicle can follow, by its own parameters; where it does not say, the defaults.

    Raises:
        GivenUpError: It does not say what its failsafes are.
    """

    def asked(link: VehicleLink) -> list[tuple[Name, ...]]:
        names = [*link.autopilot.limits.values()]
        return names + [setting.names for setting in settings_of(link) if setting.must]

    def missing(link: VehicleLink) -> list[tuple[Name, ...]]:
        return [names for names in asked(link) if _known(link, names) is None]

    began_s, asked_s = fleet.now_s(), -math.inf
    for now_s in fleet.ticks():
        lacking = {link.name: missing(link) for link in fleet}
        if not any(lacking.values()) or now_s > began_s + _READS_S:
            break
        if now_s >= asked_s + AGAIN_S:
            asked_s = now_s
            for name, slots in lacking.items():
                maybe = [s.names for s in settings_of(fleet.links[name]) if not s.must]
                for parameter in (one for names in [*slots, *maybe] for one in names):
                    fleet.links[name].ask_for(parameter)
    for link in fleet:
        for setting in settings_of(link):
            if setting.must and _known(link, setting.names) is None:
                names = " or ".join(one.name for one in setting.names)
                raise GivenUpError(f"{link.name} does not say what its {names} is ({link.address})")
    return {link.name: _limits_of(fleet, link) for link in fleet}


def settings_of(link: VehicleLink) -> list[Setting]:
    """The failsafes of a vehicle."""
    return [setting for setting in SETTINGS if setting.autopilot == link.autopilot.name]


def _known(link: VehicleLink, names: tuple[Name, ...]) -> Name | None:
    return next((one for one in names if one.name in link.parameters), None)


def _limits_of(fleet: Fleet, link: VehicleLink) -> Limits:
    said: dict[str, float] = {}
    for attribute, names in link.autopilot.limits.items():
        known = _known(link, names)
        if known is None:
            default = getattr(Limits(), attribute)
            fleet.tell(f"{link.name} has no {names[0].name}: {default:g} is assumed")
        else:
            said[attribute] = link.parameters[known.name] * known.unit
    return Limits(**said, blind_s=BLIND_S)


class Failsafes:
    """Parameters that are set before vehicles arm, and put back once all have landed."""

    def __init__(self, fleet: Fleet) -> None:
        self._fleet = fleet
        self._before: list[tuple[VehicleLink, Name, float]] = []

    def set(self, straight: Mapping[str, bool], patience_s: float) -> None:
        """Set them.

        Args:
            straight: Whether a vehicle may fly straight home from anywhere, by name.
            patience_s: So long a vehicle may take [s].

        Raises:
            GivenUpError: A vehicle does not take one.
        """
        for link in self._fleet:
            changed = []
            for setting in settings_of(link):
                name = _known(link, setting.names)
                if name is None:
                    continue
                value = setting.value if straight[link.name] else setting.otherwise
                had = link.parameters[name.name]
                if had != value:
                    self._before.append((link, name, had))
                    changed.append(f"{name.name} {had:g} -> {value:g}")
                    self._set(link, name, value, patience_s)
            if changed:
                line = f"{link.name}: {', '.join(changed)}, until it has landed"
                self._fleet.tell(line)

    def put_back(self) -> None:
        """Set them to what they were, in vehicles that are disarmed."""
        for link, name, had in self._before:
            if not link.armed:
                link.set(name, had)
        self._before.clear()

    def _set(self, link: VehicleLink, name: Name, value: float, patience_s: float) -> None:
        self._fleet.until(
            lambda one: math.isclose(one.parameters[name.name], value, abs_tol=1e-6),
            lambda one: one.set(name, value),
            patience_s,
            f"does not take {name.name} = {value:g}",
            [link],
        )


def take_off(fleet: Fleet, starts_m: Mapping[str, FloatArray], patience_s: float) -> None:
    """Enter the mode of targets, pass checks, arm, climb.

    Raises:
        GivenUpError: One does not.
    """
    # these take off by targets, which they have to hear for a while before they fly by them
    fleet.held_m = {
        link.name: starts_m[link.name] for link in fleet if link.autopilot.is_streamed_to
    }
    if fleet.held_m:
        fleet.let_pass(_STREAM_FIRST_S)
    fleet.until(
        lambda link: link.takes_targets,
        lambda link: link.set_mode(link.autopilot.targets),
        patience_s,
        "does not enter {targets}",
    )
    asks_since_s = fleet.now_s()
    fleet.until(
        lambda link: (
            link.is_ready is True
            or (link.is_ready is None and fleet.now_s() > asks_since_s + _READY_FIRST_S)
        ),
        lambda link: link.check_arming(),
        patience_s,
        "does not pass its checks before arming",
    )
    _arm(fleet, patience_s)
    fleet.until(
        lambda link: _height_m(link) > -float(starts_m[link.name][2]) - _UP_WITHIN_M,
        lambda link: (
            None if link.autopilot.is_streamed_to else link.take_off(-float(starts_m[link.name][2]))
        ),
        patience_s,
        "does not take off",
    )
    fleet.held_m = {}


def stands(link: VehicleLink) -> bool:
    """Whether a vehicle is on the ground."""
    return _height_m(link) < _LOW_M


def _height_m(link: VehicleLink) -> float:
    return -math.inf if link.place_m is None else -float(link.place_m[2])


def _arm(fleet: Fleet, patience_s: float) -> None:
    """Arm all, or none for long: what has armed once is not armed again."""
    began_s, asked_s, until_s = fleet.now_s(), -math.inf, math.inf
    once: set[str] = set()
    for now_s in fleet.ticks():
        again = [link for link in fleet if link.name in once and not link.armed]
        if again:
            raise fleet.given_up(again[0], "has disarmed on the ground")
        once |= {link.name for link in fleet if link.armed}
        missing = [link for link in fleet if not link.armed]
        if not missing:
            return
        if once and until_s == math.inf:
            until_s = now_s + _TOGETHER_S
        if now_s > min(began_s + patience_s, until_s):
            raise fleet.given_up(missing[0], "does not arm")
        if now_s >= asked_s + AGAIN_S:
            asked_s = now_s
            for link in missing:
                link.arm()
