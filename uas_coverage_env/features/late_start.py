"""UAS that are not ready at t = 0."""

from typing import ClassVar, Literal, Self

from pydantic import model_validator

from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.features.event import OfUas, concerns
from uas_coverage_env.features.feature import MissionFeature, Point


@rare_kernel
def _begin(arena, state, f, seed):
    for e in range(arena.events.shape[0]):
        for i in range(state.uas.shape[0]):
            if concerns(arena, state, e, f, i):
                uas = state.uas[i]
                uas.responds_from_step = max(uas.responds_from_step, state.events[e].step)


@rare_kernel
def _ground(arena, state, outcome, f):
    for e in range(arena.events.shape[0]):
        for i in range(state.uas.shape[0]):
            if concerns(arena, state, e, f, i) and state.step[0] < state.events[e].step:
                outcome[i].grounded = True


class LateStart(OfUas):
    """A UAS is not ready at t = 0: until `at_s` it stays at its start, its motors off.

    Attributes:
        kind: `"late_start"`.
    """

    feature: ClassVar = MissionFeature("late_start", {Point.BEGIN: _begin, Point.COMMAND: _ground})

    kind: Literal["late_start"]

    @model_validator(mode="after")
    def _has_a_time(self) -> Self:
        if self.at_s is None:
            raise ValueError("a late_start happens at no rate_per_h; give at_s")
        return self
