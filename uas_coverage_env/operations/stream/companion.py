"""The companion: one time for all vehicles, which passes as they can follow.

In a plan, time keeps UAS apart. So there is one plan time for all of them. It passes at the rate
that all can follow (`pace`), more slowly as one falls behind, and comes to a stand where one is not
heard, is flown by a pilot, or has to come back to its path: always so slowly that every
vehicle comes to rest on its path. If that lasts, or on Ctrl-C, the stream is given up in a defined
way (`giving_up`).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.operations.stream.fleet import Fleet, GivenUpError
from uas_coverage_env.operations.stream.giving_up import NOTHING_TOLD, GivingUp
from uas_coverage_env.operations.stream.link import VehicleLink
from uas_coverage_env.operations.stream.preflight import Failsafes, meet, read_limits, take_off
from uas_coverage_env.operations.stream.rejoin import WayBack
from uas_coverage_env.operations.stream.slowdowns import TROUBLES
from uas_coverage_env.operations.stream.surroundings import SwarmSurroundings
from uas_coverage_env.operations.stream.time_scaling import Pace
from uas_coverage_env.operations.stream.timeline import Timeline
from uas_coverage_env.operations.stream.vehicle_limits import Limits

FloatArray = NDArray[np.float64]

_DELAY_S = 0.2
"""What is reported may be so old, and what is sent may be followed so much later."""
_LEAD_S = 0.5
"""Velocities are sent so far ahead: GUIDED takes no accelerations, and follows so much later."""
_TRAILS_M = 1.0
"""GUIDED trails an accelerating target, or is beside it, by so much."""
_SAME_M = 1.0
_LOOKS_S = np.arange(-100, 21) / 10.0
_NOW = 100
"""Where on a path a vehicle may be: times from its place on; row of that."""
_BRAKES_SHARE = 0.8
_HURRY_PER_S = 0.3
_RECOVERS_PER_S = 0.15
_STANDS = 0.02
_TELLS_BELOW = 0.8
_TELL_EVERY_S = 10.0
_LANDING_S = 180.0


@dataclass(frozen=True)
class StreamOptions:
    """How a plan is streamed.

    Attributes:
        lag_m: Behind by so much, or so far off its path, a vehicle lets all stand [m].
        patience_s: So long all may stand, and a vehicle may take to be ready [s].
        silent_s: Not heard for so long, a vehicle counts as lost, and all slow down [s].
        reaction: One of `REACTIONS`.
        late: Share of the plan's time by which streaming may take longer, or it is refused.
    """

    lag_m: float = 5.0
    patience_s: float = 60.0
    silent_s: float = 1.5
    reaction: str = "home"
    late: float = 0.05


class Ended(NamedTuple):
    """How a stream has ended.

    Attributes:
        reason: Why it was given up; empty: all have landed.
        late_s: How much longer streaming took than planned [s].
        done: What vehicles were told then.
    """

    reason: str
    late_s: float
    done: str = ""


class Companion:
    """Flies plans by streaming targets.

    Args:
        plans: By name of the UAS.
        fleet: Their vehicles.
        around: What they have to be clear of.
        options: How.
        may_hurry: Whether plan time may make up for what it is late.
        check: Called with the pace and what vehicles can do, before any arms; may refuse.
    """

    def __init__(
        self,
        plans: Mapping[str, Timeline],
        fleet: Fleet,
        around: SwarmSurroundings,
        options: StreamOptions,
        may_hurry: bool,
        check: Callable[[Pace, Mapping[str, Limits]], None],
    ) -> None:
        self._plans, self._fleet, self._around = plans, fleet, around
        self._options, self._may_hurry, self._check = options, may_hurry, check
        self._limits: dict[str, Limits] = {}
        self._landing: set[str] = set()
        self._back: dict[str, WayBack] = {}
        self._failsafes = Failsafes(fleet)
        self._has_told = self._recovers = False
        self.plan_s = min(plan.first_s for plan in plans.values())
        self.late_s, self._rate_per_s, self._off_path_m = 0.0, 0.0, 0.0

    def fly(self) -> Ended:
        """Take off, stream, land; give up where that cannot be, and on Ctrl-C.

        Whatever else ends it, vehicles get their mode first.
        """
        try:
            self._make_ready()
            self._stream()
            self._wait_for_landings()
        except GivenUpError as why:
            reason = str(why)
        except KeyboardInterrupt:
            reason = "stopped by hand"
        except BaseException:
            self._give_up()
            raise
        else:
            self._failsafes.put_back()
            return Ended("", self.late_s)
        done = self._give_up()
        self._failsafes.put_back()
        return Ended(reason, self.late_s, done)

    def _give_up(self) -> str:
        if not self._has_told:  # what flies already is another's
            return NOTHING_TOLD
        homes_m = {name: plan.place_m(plan.last_s) for name, plan in self._plans.items()}
        giving_up = GivingUp(
            self._fleet, self._around, self._limits, homes_m, self._options.reaction
        )
        return giving_up.react(self._landing)

    def _make_ready(self) -> None:
        fleet, patience_s = self._fleet, self._options.patience_s
        starts_m = {name: plan.place_m(plan.first_s) for name, plan in self._plans.items()}
        meet(fleet, starts_m, patience_s)
        self._limits = read_limits(fleet)
        self._pace = Pace(
            self._plans, self._limits, self._around, self._options.silent_s, self._may_hurry
        )
        self._check(self._pace, self._limits)
        straight = {name: self._goes_straight_home(name) for name in self._plans}
        self._failsafes.set(straight, patience_s)
        self._has_told = True
        take_off(fleet, starts_m, patience_s)

    def _goes_straight_home(self, name: str) -> bool:
        plan = self._plans[name]
        home_m, return_m = plan.place_m(plan.last_s), self._limits[name].return_m
        places_m = plan.places_at_m(np.arange(plan.first_s, plan.last_s, 2.0))
        return all(
            self._around.goes_straight_home(name, place_m, home_m, return_m) for place_m in places_m
        )

    def _stream(self) -> None:
        """Targets until the last one begins to land."""
        rate, before_s, stood_since_s, told_s = 0.0, self._fleet.now_s(), None, -np.inf
        said, said_s = ("", ""), -np.inf
        for now_s in self._fleet.ticks():
            passed_s, before_s = now_s - before_s, now_s
            self._see_who_is_away(now_s, rate, passed_s)
            allowed, stops, about, why = self._allowed_rate(now_s, rate)
            before, rate = rate, self._next_rate(rate, allowed, passed_s)
            self._rate_per_s = (rate - before) / max(passed_s, 1e-3)
            self.plan_s += rate * passed_s
            self.late_s += (1.0 - rate) * passed_s
            is_new = about != said and (stops or now_s > said_s + _TELL_EVERY_S)
            if why and is_new:
                self._fleet.tell(why)
                said, said_s = about, now_s
            elif stops or not why:
                said = about
            if stops and rate < _STANDS:
                stood_since_s = now_s if stood_since_s is None else stood_since_s
                if now_s > stood_since_s + self._options.patience_s:
                    raise GivenUpError(why.split(": all")[0].split("; all")[0])
            elif not stops:
                stood_since_s = None
            if now_s >= told_s + _TELL_EVERY_S:
                told_s = now_s
                self._fleet.tell(f"{self.plan_s:.0f} s of {self._last_s:.0f} s of the plan")
            if not self._send(rate):
                return

    @property
    def _last_s(self) -> float:
        return max(plan.last_s for plan in self._plans.values())

    def _flown(self) -> Iterator[tuple[VehicleLink, Timeline]]:
        """The vehicles that fly by targets."""
        for link in self._fleet:
            if link.name not in self._landing:
                yield link, self._plans[link.name]

    def _next_rate(self, rate: float, allowed: float, passed_s: float) -> float:
        """The rate a moment later: it changes only as fast as all can follow."""
        fall, _ = self._pace.change(self.plan_s, rate, _BRAKES_SHARE)
        _, rise = self._pace.change(self.plan_s, rate)
        most = self._pace.at(self.plan_s)
        self._recovers = allowed < 0.9 * min(most, 1.0) or (self._recovers and rate < 0.95 * most)
        if self._recovers:  # it may have to brake again at once, where the plan does
            rise = min(rise, _RECOVERS_PER_S)
        rate = min(max(allowed, rate + fall * passed_s), rate + rise * passed_s, most)
        return 0.0 if allowed == 0.0 and rate < _STANDS else max(rate, 0.0)

    def _is_silent(self, link: VehicleLink, now_s: float) -> bool:
        return link.heard_s is None or now_s - link.heard_s > self._options.silent_s

    def _see_who_is_away(self, now_s: float, rate: float, passed_s: float) -> None:
        """Bring those back to their places that were not there for the stream."""
        for link, plan in self._flown():
            name = link.name
            if self._is_silent(link, now_s) or not link.takes_targets or not link.armed:
                self._back[name] = WayBack()
            elif name in self._back:
                others_m = self._fleet.others_m(name)
                self._back[name].go_on(
                    *(link, plan, self.plan_s, self._around, others_m, passed_s), stands=rate == 0.0
                )
                if self._back[name].is_there:
                    del self._back[name]

    def _allowed_rate(self, now_s: float, rate: float) -> tuple[float, bool, tuple[str, str], str]:
        """How fast plan time may pass.

        Returns:
            That; whether all have to stand; which trouble it is and whose; what the user reads.
        """
        late = _HURRY_PER_S * max(self.late_s, 0.0) if self._may_hurry else 0.0
        allowed, trouble, said = min(1.0 + late, self._pace.at(self.plan_s)), "", ""
        whose = ""
        for link, plan in self._flown():
            found, share, more = self._trouble(link, plan, now_s, rate)
            if share < 1.0:
                allowed = min(allowed, share)
            if found and (not trouble or TROUBLES[found].stops > TROUBLES[trouble].stops):
                trouble, whose = found, link.name
                said = TROUBLES[found].says.format(name=whose, more=more)
        return allowed, allowed == 0.0, (trouble, whose), said

    def _trouble(
        self, link: VehicleLink, plan: Timeline, now_s: float, rate: float
    ) -> tuple[str, float, str]:
        """What is wrong with a vehicle, key of `TROUBLES`; how fast time may pass; more words."""
        if self._is_silent(link, now_s):
            return "silent", 0.0, ""
        if not link.takes_targets or not link.armed:
            return "left", 0.0, link.autopilot.told(link.mode)
        assert link.place_m is not None
        if link.name in self._back:
            off_m = link.off_m(plan.place_m(self.plan_s))
            is_blocked = self._back[link.name].is_blocked
            return "blocked" if is_blocked else "away", 0.0, f"{off_m:.0f} m"
        limits = self._limits[link.name]
        if rate > 0.0 and (
            self._around.stops_in_m(link.name, link.place_m, link.velocity_mps, limits) <= 0.0
        ):
            return "unclear", 0.0, ""
        behind_m = self._behind_m(link.place_m, plan, rate)
        over_m = max(behind_m, self._off_path_m - _TRAILS_M)
        share = min(max(1.0 - over_m / self._options.lag_m, 0.0), 1.0)
        return ("behind" if share < _TELLS_BELOW else ""), share, ""

    def _behind_m(self, place_m: FloatArray, plan: Timeline, rate: float) -> float:
        """How far a vehicle is behind along its path, beyond what is to be expected [m].

        `_off_path_m` is then how far it is beside it.
        """
        path_m = plan.places_at_m(self.plan_s + _LOOKS_S)
        away_m = np.linalg.norm(path_m - place_m, axis=1)
        self._off_path_m = float(away_m.min())
        # where a path turns back, a place is on both its legs: the later one is meant
        nearest = int(np.flatnonzero(away_m <= self._off_path_m + _SAME_M)[-1])
        path_m = path_m[: _NOW + 1]
        behind_m = np.linalg.norm(np.diff(path_m[nearest:], axis=0), axis=1).sum()
        speed_mps = rate * float(np.linalg.norm(plan.velocity_mps(self.plan_s)))
        return float(behind_m) - _DELAY_S * speed_mps - _TRAILS_M

    def _send(self, rate: float) -> bool:
        """Send the targets of now; whether any vehicle still flies by them."""
        ahead_s = self.plan_s + rate * _LEAD_S
        ahead = max(min(rate + _LEAD_S * self._rate_per_s, self._pace.at(ahead_s)), 0.0)
        for link, plan in list(self._flown()):
            at_end = self.plan_s >= plan.last_s and link.off_m(plan.place_m(plan.last_s)) < 1.5
            back = self._back.get(link.name)
            if at_end and back is None:
                self._landing.add(link.name)
                link.set_mode(link.autopilot.land)
            elif back is not None:
                if link.takes_targets and back.place_m is not None:
                    link.go(back.place_m, back.velocity_mps)
            elif link.takes_targets:
                velocity_mps = ahead * plan.velocity_mps(ahead_s)
                link.go(plan.place_m(self.plan_s), velocity_mps)
        for name in self._landing:
            link = self._fleet.links[name]
            if link.takes_targets and link.armed:
                link.set_mode(link.autopilot.land)
        return len(self._landing) < len(self._plans)

    def _wait_for_landings(self) -> None:
        self._fleet.until(
            lambda link: not link.armed,
            lambda link: link.set_mode(link.autopilot.land) if link.takes_targets else None,
            _LANDING_S,
            "does not land",
        )
