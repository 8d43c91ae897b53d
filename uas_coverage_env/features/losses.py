"""What is lost at once: a UAS, charge of its battery."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.entities.outcome import FAULT, NONE
from uas_coverage_env.features.event import OfUas, concerns, happens
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.vehicle.layout import DOD


@rare_kernel
def _lose_uas(arena, state, outcome, f):
    for e in range(arena.events.shape[0]):
        for i in range(outcome.shape[0]):
            lost = happens(state, e) and concerns(arena, state, e, f, i) and outcome[i].flew
            if lost and outcome[i].contact == NONE:
                outcome[i].contact = FAULT


@rare_kernel
def _lose_charge(arena, state, outcome, f):
    for e in range(arena.events.shape[0]):
        for i in range(outcome.shape[0]):
            if happens(state, e) and concerns(arena, state, e, f, i) and outcome[i].flew:
                state.x[i, DOD] = min(state.x[i, DOD] + arena.events[e].values[0], 1.0)


class UasLost(OfUas):
    """A UAS fails and is lost where it is.

    Attributes:
        kind: `"uas_lost"`.
    """

    feature: ClassVar = MissionFeature("uas_lost", {Point.MOVED: _lose_uas})

    kind: Literal["uas_lost"]


class ChargeLost(OfUas):
    """The battery of a UAS loses charge at once: a cell fails, or what it holds was overrated.

    Attributes:
        kind: `"charge_lost"`.
        share: How much of its capacity [-].
    """

    feature: ClassVar = MissionFeature("charge_lost", {Point.MOVED: _lose_charge})

    kind: Literal["charge_lost"]
    share: Annotated[float, Field(gt=0.0, le=1.0)]

    @property
    def values(self) -> tuple[float, ...]:
        """The share."""
        return (self.share,)
