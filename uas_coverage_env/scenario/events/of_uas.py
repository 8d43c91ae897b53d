"""Events that happen to the UAS, or to the link between them and the planner."""

from __future__ import annotations

import math
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from uas_coverage_env.scenario.events.table import Effect, EventTable, OfUas, Seconds

Then = Literal["go_on", "hover", "return"]
"""What a UAS flies that hears no commands; kernels know it by its place here."""


def _deafen(then: str, for_s: float, *, on_all: bool = False) -> Effect:
    return Effect("deafen", for_s, (float(get_args(Then).index(then)),), on_all)


class UasLost(OfUas):
    """A UAS fails and is lost where it is.

    Attributes:
        kind: `"uas_lost"`.
    """

    kind: Literal["uas_lost"]

    def effect(self) -> Effect:
        """It is lost."""
        return Effect("lose")


class RadioLost(OfUas):
    """No command reaches a UAS for a while. On-board functions (return mode, filter) go on.

    Attributes:
        kind: `"radio_lost"`.
        for_s: How long [s].
        then: What it flies meanwhile: `"go_on"` (its last command), `"hover"` or `"return"`.
    """

    kind: Literal["radio_lost"]
    for_s: Seconds
    then: Then = "hover"

    def effect(self) -> Effect:
        """It hears nothing."""
        return _deafen(self.then, self.for_s)


class PlannerLost(EventTable):
    """The planner fails: no command reaches any UAS any more.

    Attributes:
        kind: `"planner_lost"`.
        then: What the UAS fly from now on: `"go_on"` (their last commands), `"hover"` or
            `"return"`.
    """

    kind: Literal["planner_lost"]
    then: Then = "return"

    def effect(self) -> Effect:
        """No UAS hears anything."""
        return _deafen(self.then, math.inf, on_all=True)


class GnssLost(OfUas):
    """A UAS is without satellite navigation for a while and goes by dead reckoning.

    It adds up its velocity, which is wrong by a horizontal drift of random direction. Its height
    comes from a barometer and stays right.

    Attributes:
        kind: `"gnss_lost"`.
        for_s: How long [s].
        drift_mps: How wrong its velocity is meanwhile [m/s].
    """

    kind: Literal["gnss_lost"]
    for_s: Seconds
    drift_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.2

    def effect(self) -> Effect:
        """Its position drifts."""
        return Effect("blind", self.for_s, (self.drift_mps,))


class LateStart(OfUas):
    """A UAS is not ready at t = 0: until `at_s` it stays at its start, its motors off.

    Attributes:
        kind: `"late_start"`.
    """

    kind: Literal["late_start"]

    @model_validator(mode="after")
    def _has_a_time(self) -> Self:
        if self.at_s is None:
            raise ValueError("a late_start happens at no rate_per_h; give at_s")
        return self

    def effect(self) -> Effect:
        """It stays where it is."""
        return Effect("ground")


class MotorDegraded(OfUas):
    """A motor of a UAS is damaged from now on: it has less thrust and draws more power.

    It acts as a disturbance does (`disturbances.motor_degraded`), and is taken away with these.

    Attributes:
        kind: `"motor_degraded"`.
        thrust_share: Share of the greatest thrust that is left; below what hovering takes, the UAS
            sinks [-].
        power_factor: How many times as much power it draws for the same thrust [-].
    """

    kind: Literal["motor_degraded"]
    thrust_share: Annotated[float, Field(gt=0.0, le=1.0)] = 1.0
    power_factor: Annotated[float, Field(ge=1.0, le=5.0)] = 1.0


class ChargeLost(OfUas):
    """The battery of a UAS loses charge at once: a cell fails, or what it holds was overrated.

    Attributes:
        kind: `"charge_lost"`.
        share: How much of its capacity [-].
    """

    kind: Literal["charge_lost"]
    share: Annotated[float, Field(gt=0.0, le=1.0)]

    def effect(self) -> Effect:
        """The depth of discharge rises."""
        return Effect("discharge", values=(self.share,))
