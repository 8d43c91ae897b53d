"""What all tables `[[events]]` have in common."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Protocol, Self

from pydantic import Field, model_validator

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.scenario.fields import MovingObstacle, Name, Obstacle, Uas, Waypoint

Seconds = Annotated[float, Field(gt=0.0, le=1e6)]

EFFECTS = ("none", "lose", "deafen", "blind", "ground", "discharge", "drop")
"""What the step of the world can do; kernels know an effect by its place here."""


@dataclass(frozen=True)
class Effect:
    """What an event does to the state of the world, see `world.events`.

    Attributes:
        name: One of EFFECTS.
        for_s: How long; infinite: to the end [s].
        values: At most four numbers.
        on_all: It concerns all UAS.
    """

    name: str = "none"
    for_s: float = math.inf
    values: tuple[float, ...] = ()
    on_all: bool = False


class Scene(Protocol):
    """What events know of a scenario."""

    @property
    def uas(self) -> tuple[Uas, ...]:
        """The fleet."""
        ...

    @property
    def waypoints(self) -> tuple[Waypoint, ...]:
        """What is to be covered."""
        ...

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """Fixed obstacles."""
        ...

    @property
    def moving_obstacles(self) -> tuple[MovingObstacle, ...]:
        """Moving obstacles."""
        ...


class EventTable(StrictModel):
    """Something that happens during the mission: either at a time or at a rate.

    To be derived from, a class for each kind. A kind acts on the state of the world (`effect`), in
    every environment, or it changes the scene (`revised`): what planners are briefed of is then
    another from that time on.

    Attributes:
        at_s: Time at which it happens: at the first sample from then on [s].
        rate_per_h: Instead, how often it happens in an hour: the time is drawn with the mission's
            seed from the exponential distribution. It happens once at most.
    """

    changes_scene: ClassVar[bool] = False

    at_s: Seconds | None = None
    rate_per_h: Annotated[float, Field(gt=0.0, le=3600.0)] | None = None

    @model_validator(mode="after")
    def _has_one_time(self) -> Self:
        if (self.at_s is None) == (self.rate_per_h is None):
            raise ValueError("happens at_s or at a rate_per_h; give one of the two")
        return self

    def effect(self) -> Effect:
        """What it does to the state of the world."""
        return Effect()

    def revised(self, scenario: Scene, time_s: float, uas: int) -> dict[str, Any]:
        """The fields of the scenario that are others from time_s on.

        Indices stay what they were: what is new comes last.

        Args:
            scenario: As it was before.
            time_s: When it happens [s].
            uas: Index of the UAS that it concerns.
        """
        return {}

    def mistakes(self, scenario: Scene) -> Iterator[str]:
        """What it names although the scenario has no such thing: field, value and fix."""
        yield from ()


class OfUas(EventTable):
    """An event that concerns one UAS.

    Attributes:
        uas: Name of the UAS; without it, one is drawn with the mission's seed.
    """

    uas: Name | None = None

    def mistakes(self, scenario: Scene) -> Iterator[str]:
        """A UAS that there is not."""
        known = [uas.name for uas in scenario.uas]
        if self.uas is not None and self.uas not in known:
            yield f"uas: there is no UAS {self.uas!r}; there are {', '.join(known[:8])}"
