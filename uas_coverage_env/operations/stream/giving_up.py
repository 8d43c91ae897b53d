"""How a stream is given up: what every vehicle that still flies by it is told, and its end."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.failsafes import PATIENCE_S
from uas_coverage_env.operations.stream.fleet import AGAIN_S, Fleet
from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.preflight import stands
from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings
from uas_coverage_env.operations.stream.vehicle_limits import Limits

FloatArray = NDArray[np.float64]

_ANSWERS_S = 6.0
_TRIES = 2
_HOME_S = 900.0
_BRAKES_S = 4.0
_HEARD_S = 2.0


class Reaction(NamedTuple):
    """What vehicles do where a stream is given up.

    Attributes:
        words: "was told to ...".
        modes: Attributes of `Autopilot`, the first of which that is there and clear is taken.
        ends: How that ends.
    """

    words: str
    modes: tuple[str, ...]
    ends: str


NOTHING_TOLD = "no vehicle was told anything"
_ENDS_HOME = "lands at home; the command ends when all have landed"
REACTIONS = {
    "home": Reaction(
        "fly home the way it came",
        ("way_back", "rtl", "land", "hold"),
        f"{_ENDS_HOME}. PX4 knows no way back: it goes as with `rtl`",
    ),
    "rtl": Reaction(
        "fly straight home",
        ("rtl", "way_back", "land", "hold"),
        f"{_ENDS_HOME}. Only where the way at its return height is clear of zones, obstacles and "
        "fence; otherwise as with `home`",
    ),
    "land": Reaction(
        "land where it is",
        ("land", "way_back", "rtl", "hold"),
        "lands there; only where the way down is clear of zones, obstacles and other UAS; "
        "otherwise as with `home`",
    ),
    "hold": Reaction(
        "hold",
        ("hold",),
        f"brakes and hovers, and the command ends. If no pilot takes it, its failsafe brings an "
        f"ArduPilot home the way it came after {PATIENCE_S:g} s; PX4 hovers until its pilot or its "
        "low battery brings it down",
    ),
}
"""What `--on-abort` may be."""
WORDS = {
    "way_back": REACTIONS["home"].words,
    "rtl": REACTIONS["rtl"].words,
    "land": REACTIONS["land"].words,
    "hold": REACTIONS["hold"].words,
}


class GivingUp:
    """Tells vehicles what to do, and sees that they do it.

    Args:
        fleet: The vehicles.
        around: What they have to be clear of.
        limits: Of each, by name; those of which it is not known yet do not fly.
        homes_m: (3,) likewise, where each lands [m].
        reaction: One of `REACTIONS`.
    """

    def __init__(
        self,
        fleet: Fleet,
        around: SwarmSurroundings,
        limits: Mapping[str, Limits],
        homes_m: Mapping[str, FloatArray],
        reaction: str,
    ) -> None:
        self._fleet, self._around, self._limits = fleet, around, limits
        self._homes_m, self._reaction = homes_m, reaction
        self._tries: dict[str, int] = {}
        self._told: dict[str, str] = {}

    def react(self, landing: set[str]) -> str:
        """Give every vehicle that flies by targets its mode; return what was done.

        Args:
            landing: Those that land already.
        """
        flying = [
            link
            for link in self._fleet
            if link.armed and link.name not in landing and (link.takes_targets or link.mode is None)
        ]
        self._fleet.held_m = {}
        # before they are heard again, which may be what has failed
        for link in flying:
            self._tell_mode(link)
        try:
            self._see_to_it(flying)
        except KeyboardInterrupt:
            self._fleet.tell("stopped at once: vehicles fly on as they were told last")
        return self._in_words()

    def _in_words(self) -> str:
        if not self._told:
            return NOTHING_TOLD
        groups: dict[str, list[str]] = {}
        for name, words in self._told.items():
            groups.setdefault(words, []).append(name)
        return "; ".join(f"{', '.join(names)}: told to {words}" for words, names in groups.items())

    def _see_to_it(self, flying: list[VehicleLink]) -> None:
        waited_s, asked_s, began_s = _ANSWERS_S, self._fleet.now_s(), self._fleet.now_s()
        for now_s in self._fleet.ticks():
            deaf = [link for link in flying if link.armed and link.takes_targets]
            if not deaf:
                break
            if now_s > began_s + waited_s:
                for link in deaf:
                    self._fleet.tell(
                        f"{link.name} does not answer: it was told to {self._told[link.name]}; "
                        "alone it does what its failsafe says"
                    )
                break
            if now_s >= asked_s + AGAIN_S:
                asked_s = now_s
                for link in deaf:
                    self._tell_mode(link)
        if any(words == WORDS["hold"] for words in self._told.values()):
            self._let_failsafe_act(flying)
        self._wait_until_down(flying)

    def _tell_mode(self, link: VehicleLink) -> None:
        if stands(link):
            link.disarm()
            self._told[link.name] = "disarm"
            return
        ways = self._ways(link)
        tries = self._tries.get(link.name, 0)
        is_heard = link.heard_s is not None and self._fleet.now_s() < link.heard_s + _HEARD_S
        self._tries[link.name] = tries + is_heard  # else it may well have taken the first one
        mode = ways[min(tries // _TRIES, len(ways) - 1)]
        number = getattr(link.autopilot, mode)
        link.set_mode(number)
        if self._told.get(link.name) != WORDS[mode]:
            if mode != REACTIONS[self._reaction].modes[0]:
                asked = REACTIONS[self._reaction].words
                self._fleet.tell(f"{link.name} cannot {asked} from there: {WORDS[mode]}")
            self._told[link.name] = WORDS[mode]

    def _ways(self, link: VehicleLink) -> list[str]:
        """Modes that are there and clear, the one asked for first."""
        clear = {"way_back": link.autopilot.way_back is not None, "hold": True}
        if link.place_m is not None and link.name in self._limits:
            others_m = self._fleet.others_m(link.name)
            clear["land"] = self._around.may_land(link.name, link.place_m, others_m)
            clear["rtl"] = self._around.goes_straight_home(
                link.name, link.place_m, self._homes_m[link.name], self._limits[link.name].return_m
            )
        return [mode for mode in REACTIONS[self._reaction].modes if clear.get(mode)]

    def _let_failsafe_act(self, flying: list[VehicleLink]) -> None:
        """Out of BRAKE, in which ArduPilot takes itself for flown by a pilot."""
        held = [
            link
            for link in flying
            if not link.autopilot.is_streamed_to and self._told.get(link.name) == WORDS["hold"]
        ]
        if held:
            self._fleet.let_pass(_BRAKES_S)
        for _ in range(_TRIES):
            for link in held:
                if link.mode == link.autopilot.hold:
                    link.set_mode(link.autopilot.targets)
            if held:
                self._fleet.let_pass(AGAIN_S)

    def _wait_until_down(self, flying: list[VehicleLink]) -> None:
        """As long as we are heard, no failsafe interrupts a way home."""
        landing = [link for link in flying if self._told.get(link.name) != WORDS["hold"]]
        began_s = self._fleet.now_s()
        for now_s in self._fleet.ticks():
            up = [
                link
                for link in landing
                if link.armed and link.heard_s is not None and now_s < link.heard_s + _HEARD_S
            ]
            if not up or now_s > began_s + _HOME_S:
                return
