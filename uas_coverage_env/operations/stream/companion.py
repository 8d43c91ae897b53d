"""The companion: one time for all vehicles, which passes no faster than the slowest can follow.

In a plan, time keeps UAS apart. So there is one plan time for all of them: it passes more slowly as
one falls behind, and stops where one is too far behind, is not heard, or is flown by somebody else;
then all hold. If that lasts, or on Ctrl-C, the stream is given up in a defined way: every vehicle
that it still flies brakes and holds, or returns, or lands.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from uas_coverage_env.operations.stream.clock import Clock
from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.timeline import Timeline

REACTIONS = ("hold", "rtl", "land")
"""What becomes of vehicles where the stream is given up: the mode of `Autopilot` that they get."""

_TICK_S = 0.1
_STREAM_FIRST_S = 1.5
"""So long targets are streamed before a mode is entered that needs them."""

_AGAIN_S = 1.0
"""So often a request is repeated until it is seen to be followed."""

_DELAY_S = 0.5
"""What is reported may be so old: whoever is where it had to be since then is in time."""

_RATE_PER_S = 0.5
"""How fast time gathers speed again, so that vehicles can."""

_AT_START_M = 8.0
_ON_GROUND_M = 2.0
_UP_WITHIN_M = 0.7
_TELL_EVERY_S = 10.0
_LANDING_S = 180.0


@dataclass(frozen=True)
class StreamOptions:
    """How a plan is streamed.

    Attributes:
        lag_m: Behind by so much, time stops for all [m].
        patience_s: So long it may stand still, and a vehicle may take to be ready [s].
        silent_s: Not heard for so long, a vehicle counts as lost, and time stops [s].
        reaction: One of `REACTIONS`.
    """

    lag_m: float = 5.0
    patience_s: float = 60.0
    silent_s: float = 3.0
    reaction: str = "hold"


class Ended(NamedTuple):
    """How a stream has ended.

    Attributes:
        reason: Why it was given up; empty: all have landed.
        late_s: How much longer streaming took than planned, for vehicles that were behind [s].
    """

    reason: str
    late_s: float


class _GivenUpError(Exception):
    """The stream cannot go on."""


class Companion:
    """Flies plans by streaming targets.

    Args:
        plans: By name of the UAS.
        links: Likewise.
        options: How.
        clock: What tells the time.
        tell: Called with lines for the user.
    """

    def __init__(
        self,
        plans: Mapping[str, Timeline],
        links: Mapping[str, VehicleLink],
        options: StreamOptions,
        clock: Clock,
        tell: Callable[[str], None],
    ) -> None:
        self._plans, self._links, self._options = plans, links, options
        self._clock, self._tell = clock, tell
        self._beat_s = -math.inf
        self._landing: set[str] = set()
        self._held: list[VehicleLink] = []
        self._rows: list[tuple[float, str, float, float, float]] = []
        self.plan_s = min(plan.first_s for plan in plans.values())
        self.late_s = 0.0

    @property
    def rows(self) -> list[tuple[float, str, float, float, float]]:
        """What was heard since the first take-off: time [s], UAS, north, east, down [m]."""
        return self._rows

    def fly(self) -> Ended:
        """Take off, stream, land; give up where that cannot be, and on Ctrl-C.

        Whatever else ends it, vehicles get their mode first.
        """
        flies = False
        try:
            self._make_ready()
            flies = True
            self._take_off()
            self._stream()
            self._wait_for_landings()
        except _GivenUpError as why:
            reason = str(why)
        except KeyboardInterrupt:
            reason = "stopped by hand"
        except BaseException:
            if flies:
                self._react()
            raise
        else:
            return Ended("", self.late_s)
        if flies:
            self._react()
        return Ended(reason, self.late_s)

    def _ticks(self) -> Iterator[float]:
        """Time [s] after each pause, in which all are heard and told that we are here."""
        while True:
            now_s = self._clock.now_s()
            if now_s >= self._beat_s + _AGAIN_S:
                self._beat_s = now_s
                for link in self._links.values():
                    link.beat()
            self._clock.wait(_TICK_S)
            now_s = self._clock.now_s()
            for name, link in self._links.items():
                link.hear(now_s)
                if link.armed and link.place_m is not None:
                    north_m, east_m, down_m = link.place_m.tolist()
                    self._rows.append((now_s, name, north_m, east_m, down_m))
            for link in self._held:
                link.go(self._plans[link.name].place_m(0.0), np.zeros(3))
            yield now_s

    def _make_ready(self) -> None:
        """Hear all of them, on the ground at their starts."""
        self._until(
            lambda link: link.place_m is not None and link.mode is not None,
            lambda link: None,
            self._options.patience_s,
            "is not heard from",
        )
        for name, link in self._links.items():
            assert link.place_m is not None
            away_m = math.hypot(*(link.place_m - self._plans[name].place_m(0.0))[:2])
            if away_m > _AT_START_M:
                raise _GivenUpError(f"{name} is {away_m:.0f} m from its start; put it there")
            if link.armed or -link.place_m[2] > _ON_GROUND_M:
                raise _GivenUpError(f"{name} is flying or armed; stream begins on the ground")

    def _take_off(self) -> None:
        patience_s, links = self._options.patience_s, self._links.values()
        # these take off by targets, which they have to hear for a while before they fly by them
        self._held = [link for link in links if link.autopilot.is_streamed_to]
        if self._held:
            self._let_pass(_STREAM_FIRST_S)
        self._until(
            lambda link: link.takes_targets,
            lambda link: link.set_mode(link.autopilot.targets),
            patience_s,
            "does not enter {targets}",
        )
        self._until(lambda link: link.armed, lambda link: link.arm(), patience_s, "does not arm")
        heights_m = {name: -float(plan.place_m(0.0)[2]) for name, plan in self._plans.items()}
        self._until(
            lambda link: (
                link.place_m is not None and -link.place_m[2] > heights_m[link.name] - _UP_WITHIN_M
            ),
            lambda link: (
                None if link.autopilot.is_streamed_to else link.take_off(heights_m[link.name])
            ),
            patience_s,
            "does not take off",
        )
        self._held = []

    def _let_pass(self, seconds: float) -> None:
        """Let some time pass."""
        began_s = self._clock.now_s()
        for now_s in self._ticks():
            if now_s >= began_s + seconds:
                return

    def _until(
        self,
        is_so: Callable[[VehicleLink], bool],
        ask: Callable[[VehicleLink], None],
        patience_s: float,
        otherwise: str,
    ) -> None:
        """Ask all vehicles until something holds of each."""
        began_s, asked_s = self._clock.now_s(), -math.inf
        for now_s in self._ticks():
            missing = [link for link in self._links.values() if not is_so(link)]
            if not missing:
                return
            if now_s > began_s + patience_s:
                link = missing[0]
                what = otherwise.format(targets=link.autopilot.targets_name)
                raise _GivenUpError(f"{link.name} {what} ({link.address})")
            if now_s >= asked_s + _AGAIN_S:
                asked_s = now_s
                for link in missing:
                    ask(link)

    def _stream(self) -> None:
        """Targets until the last one begins to land."""
        rate, before_s, stopped_since_s, told_s = 0.0, self._clock.now_s(), None, -math.inf
        said = ""
        for now_s in self._ticks():
            passed_s, before_s = now_s - before_s, now_s
            allowed, why = self._allowed_rate(now_s)
            rate = min(allowed, rate + _RATE_PER_S * passed_s)
            self.plan_s += rate * passed_s
            self.late_s += (1.0 - rate) * passed_s
            if why and why != said:
                self._tell(why)
            said = why
            if allowed == 0.0:
                stopped_since_s = now_s if stopped_since_s is None else stopped_since_s
                if now_s > stopped_since_s + self._options.patience_s:
                    raise _GivenUpError(why.removesuffix(": all hold"))
            else:
                stopped_since_s = None
            if now_s >= told_s + _TELL_EVERY_S:
                told_s = now_s
                self._tell(f"{self.plan_s:.0f} s of {self._last_s:.0f} s of the plan")
            if not self._send(rate):
                return

    @property
    def _last_s(self) -> float:
        return max(plan.last_s for plan in self._plans.values())

    def _flown(self) -> Iterator[tuple[VehicleLink, Timeline]]:
        """The vehicles that fly by targets."""
        for name, link in self._links.items():
            if name not in self._landing:
                yield link, self._plans[name]

    def _allowed_rate(self, now_s: float) -> tuple[float, str]:
        """How fast plan time may pass, 1 for as fast as time, and what keeps it from passing."""
        rate, why = 1.0, ""
        for link, plan in self._flown():
            if link.heard_s is None or now_s - link.heard_s > self._options.silent_s:
                return 0.0, f"{link.name} is not heard from: all hold"
            if not link.takes_targets or not link.armed:
                mode = link.autopilot.told(link.mode)
                return 0.0, f"{link.name} does not take targets ({mode}): all hold"
            steps = (0.0, 0.25 * _DELAY_S, 0.5 * _DELAY_S, 0.75 * _DELAY_S, _DELAY_S)
            behind_m = min(link.off_m(plan.place_m(self.plan_s - early)) for early in steps)
            share = min(max(2.0 - 2.0 * behind_m / self._options.lag_m, 0.0), 1.0)
            if share < rate:
                rate, why = share, f"{link.name} is behind: time passes more slowly for all"
                if share == 0.0:
                    why = f"{link.name} is more than {self._options.lag_m:g} m off: all hold"
        return rate, why

    def _send(self, rate: float) -> bool:
        """Send the targets of now; whether any vehicle still flies by them."""
        for link, plan in list(self._flown()):
            at_end = self.plan_s >= plan.last_s and link.off_m(plan.place_m(plan.last_s)) < 1.5
            if at_end:
                self._landing.add(link.name)
                link.set_mode(link.autopilot.land)
            elif link.takes_targets:  # one that a pilot has taken over is left alone
                link.go(plan.place_m(self.plan_s), rate * plan.velocity_mps(self.plan_s))
        for name in self._landing:
            link = self._links[name]
            if link.takes_targets and link.armed:
                link.set_mode(link.autopilot.land)
        return len(self._landing) < len(self._links)

    def _wait_for_landings(self) -> None:
        self._until(
            lambda link: not link.armed,
            lambda link: link.set_mode(link.autopilot.land) if link.takes_targets else None,
            _LANDING_S,
            "does not land",
        )

    def _react(self) -> None:
        """Give every vehicle that flies by targets its mode, until it says that it has it."""
        self._held = []

        def is_let_go(link: VehicleLink) -> bool:
            in_stream = link.takes_targets or link.mode is None
            return link.name in self._landing or not link.armed or not in_stream

        def tell_mode(link: VehicleLink) -> None:
            link.set_mode(getattr(link.autopilot, self._options.reaction))

        # before they are heard again, which may be what has failed
        for link in self._links.values():
            if not is_let_go(link):
                tell_mode(link)
        try:
            self._until(
                is_let_go,
                tell_mode,
                self._options.silent_s + 2.0 * _AGAIN_S,
                "does not answer",
            )
        except _GivenUpError as why:
            self._tell(f"{why}: it was told to {self._options.reaction}")
        except KeyboardInterrupt:
            self._tell("stopped at once: vehicles fly on as they were told last")
