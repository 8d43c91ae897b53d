"""Events: the tables `[[events]]` of a scenario, a class for each kind, and when they act.

A kind is a class in a file of this folder, in `scenario/scene_events.py`, or in another package
that announces it in the entry-point group `uas_coverage.events`.
"""

import math
from collections.abc import Iterator
from typing import Annotated, Any, ClassVar, Self

from pydantic import Field, model_validator

from uas_coverage_env.compiled.kernels import inlined_kernel
from uas_coverage_env.entities.state import EVERY
from uas_coverage_env.features.feature import MissionFeature
from uas_coverage_env.files.names import Name
from uas_coverage_env.files.strict_toml import StrictModel

GROUP = "uas_coverage.events"

Seconds = Annotated[float, Field(gt=0.0, le=1e6)]


class EventTable(StrictModel):
    """Something that happens during the mission: either at a time or at a rate.

    To be derived from, a class for each kind. A kind acts at points of the step (`feature`), in
    every environment, or it changes the scene (`revised`): what planners are briefed of is then
    another from that time on.

    Attributes:
        at_s: Time at which it happens: at the first sample from then on [s].
        rate_per_h: Instead, how often it happens in an hour: the time is drawn with the mission's
            seed from the exponential distribution. It happens once at most.
    """

    feature: ClassVar[MissionFeature | None] = None
    """What it does in a step; one for all events of the kind. Its kernels find their events by
    `concerns`."""
    on_all: ClassVar[bool] = False
    """It concerns all UAS."""
    senses: ClassVar[bool] = False
    """It makes what is known of the state another than what is true."""
    changes_scene: ClassVar[bool] = False

    at_s: Seconds | None = None
    rate_per_h: Annotated[float, Field(gt=0.0, le=3600.0)] | None = None

    @model_validator(mode="after")
    def _has_one_time(self) -> Self:
        if (self.at_s is None) == (self.rate_per_h is None):
            raise ValueError("happens at_s or at a rate_per_h; give one of the two")
        return self

    @property
    def lasts_s(self) -> float:
        """How long; infinite: to the end [s]."""
        return math.inf

    @property
    def values(self) -> tuple[float, ...]:
        """At most four numbers, `arena.events[e].values` in kernels."""
        return ()

    @property
    def goes_home(self) -> bool:
        """Whether it may send a UAS home, which takes guidance."""
        return False

    def revised(self, scenario: Any, time_s: float, uas: int) -> dict[str, Any]:
        """The fields of the scenario that are others from time_s on.

        Indices stay what they were: what is new comes last.

        Args:
            scenario: As it was before.
            time_s: When it happens [s].
            uas: Index of the UAS that it concerns.
        """
        return {}

    def mistakes(self, scenario: Any) -> Iterator[str]:
        """What it names although the scenario has no such thing: field, value and fix."""
        yield from ()


class OfUas(EventTable):
    """An event that concerns one UAS.

    Attributes:
        uas: Name of the UAS; without it, one is drawn with the mission's seed.
    """

    uas: Name | None = None

    def mistakes(self, scenario: Any) -> Iterator[str]:
        """A UAS that there is not."""
        known = [uas.name for uas in scenario.uas]
        if self.uas is not None and self.uas not in known:
            yield f"uas: there is no UAS {self.uas!r}; there are {', '.join(known[:8])}"


@inlined_kernel
def concerns(arena, state, e, f, i):
    """Whether event e is one of feature f, and happens to UAS i."""
    uas = state.events[e].uas
    return arena.events[e].feature == f and uas in (i, EVERY)


@inlined_kernel
def happens(state, e):
    """Whether event e happens at the sample to which UAS have just moved (`Point.MOVED`)."""
    return state.events[e].step == state.step[0] + 1


@inlined_kernel
def lasts(arena, state, e):
    """Whether event e has begun and not ended in the step from the present sample."""
    since = state.step[0] - state.events[e].step
    return 0 <= since < arena.events[e].for_steps
