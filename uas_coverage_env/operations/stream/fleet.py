"""The vehicles of a stream, heard and asked together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.clock import Clock
from uas_coverage_env.operations.stream.link import VehicleLink

FloatArray = NDArray[np.float64]

TICK_S = 0.1
AGAIN_S = 1.0
"""So often a request is repeated until it is seen to be followed."""


class GivenUpError(Exception):
    """The stream cannot go on."""


class Fleet:
    """Vehicles that are heard ten times per second, and told that we are here.

    Attributes:
        links: By name of the UAS.
        held_m: (3,) targets that are sent at each tick, by name: for vehicles that have to hear
            them before they fly by them [m].
        rows: What was heard while armed: time [s], UAS, north, east, down [m].
        reasons: What each vehicle warned of last.

    Args:
        links: By name of the UAS.
        clock: What tells the time.
        tell: Called with lines for the user.
    """

    def __init__(
        self, links: Mapping[str, VehicleLink], clock: Clock, tell: Callable[[str], None]
    ) -> None:
        self.links, self.tell, self._clock = links, tell, clock
        self.held_m: dict[str, FloatArray] = {}
        self.rows: list[tuple[float, str, float, float, float]] = []
        self.reasons: dict[str, str] = {}
        self._beat_s = -math.inf
        self._told: set[tuple[str, str]] = set()

    def now_s(self) -> float:
        """Time by the clock [s]."""
        return self._clock.now_s()

    def __iter__(self) -> Iterator[VehicleLink]:
        return iter(self.links.values())

    def ticks(self) -> Iterator[float]:
        """Time [s] after each pause, in which all are heard and told that we are here."""
        while True:
            now_s = self._clock.now_s()
            if now_s >= self._beat_s + AGAIN_S:
                self._beat_s = now_s
                for link in self:
                    link.beat()
            self._clock.wait(TICK_S)
            now_s = self._clock.now_s()
            for link in self:
                link.hear(now_s)
                self._pass_on(link)
                if link.armed and link.place_m is not None:
                    north_m, east_m, down_m = link.place_m.tolist()
                    self.rows.append((now_s, link.name, north_m, east_m, down_m))
            for name, place_m in self.held_m.items():
                self.links[name].go(place_m, np.zeros(3))
            yield now_s

    def _pass_on(self, link: VehicleLink) -> None:
        """Show what a vehicle warns of, each of its lines once."""
        for text in link.texts:
            self.reasons[link.name] = text
            if (link.name, text) not in self._told:
                self._told.add((link.name, text))
                self.tell(f"{link.name} says: {text}")
        link.texts.clear()

    def let_pass(self, seconds: float) -> None:
        """Let some time pass."""
        until_s = self.now_s() + seconds
        for now_s in self.ticks():
            if now_s >= until_s:
                return

    def until(
        self,
        is_so: Callable[[VehicleLink], bool],
        ask: Callable[[VehicleLink], None],
        patience_s: float,
        otherwise: str,
        of: Iterable[VehicleLink] | None = None,
    ) -> None:
        """Ask vehicles until something holds of each.

        Args:
            is_so: What.
            ask: Called for those of which it does not hold, once a second.
            patience_s: For so long [s].
            otherwise: What to say of one of which it does not hold then.
            of: Which vehicles; None: all.

        Raises:
            GivenUpError: It does not hold of one.
        """
        asked = list(self) if of is None else list(of)
        began_s, asked_s = self.now_s(), -math.inf
        for now_s in self.ticks():
            missing = [link for link in asked if not is_so(link)]
            if not missing:
                return
            if now_s > began_s + patience_s:
                raise self.given_up(missing[0], otherwise)
            if now_s >= asked_s + AGAIN_S:
                asked_s = now_s
                for link in missing:
                    ask(link)

    def given_up(self, link: VehicleLink, what: str) -> GivenUpError:
        """That a vehicle does not do something, with its own reason."""
        what = what.format(targets=link.autopilot.targets_name)
        reason = self.reasons.get(link.name)
        said = f": {reason}" if reason else ""
        return GivenUpError(f"{link.name} {what} ({link.address}){said}")

    def others_m(self, name: str) -> dict[str, FloatArray]:
        """(3,) where the other vehicles are that fly, by name [m]."""
        return {
            link.name: link.place_m
            for link in self
            if link.name != name and link.armed and link.place_m is not None
        }
