"""Commands that do not arrive: a radio or a planner is lost."""

from typing import Any, ClassVar, Literal, get_args

from uas_coverage_env.compiled.kernels import inlined_kernel, rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.views import record_view
from uas_coverage_env.entities.commands import CLIMB, GO_TO, HOME, WRENCH
from uas_coverage_env.entities.state import NEVER
from uas_coverage_env.features.event import EventTable, OfUas, Seconds, concerns, lasts
from uas_coverage_env.features.feature import MissionFeature, Point

Then = Literal["go_on", "hover", "return"]
"""What a UAS flies that hears no commands; kernels know it by its place here."""

_GO_ON, _, _RETURN = range(len(get_args(Then)))

HEARD_DTYPE = record_dtype([("kind", "i8"), ("values", "f8", (4,)), ("returning", "?")])
"""The latest command that reached a UAS."""

_heard_of = record_view(HEARD_DTYPE)


@rare_kernel
def _hear(arena, state, outcome, f):
    """Give UAS that hear nothing what they fly by themselves."""
    heard = _heard_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        command = outcome[i].applied_command
        then = -1
        for e in range(arena.events.shape[0]):
            if concerns(arena, state, e, f, i) and lasts(arena, state, e):
                then = int(arena.events[e].values[0])
        latest = heard[i]
        if then == -1:
            latest.kind = command.kind
            for k in range(4):
                latest.values[k] = command.values[k]
            latest.returning = command.returning
        elif then == _GO_ON and latest.kind != WRENCH:
            command.kind = latest.kind
            for k in range(4):
                command.values[k] = latest.values[k]
            command.returning = latest.returning
        else:
            # torques that are held on would turn it over: it hovers
            command.kind = GO_TO if then == _RETURN else CLIMB
            for k in range(4):
                command.values[k] = 0.0
            if then == _RETURN:
                command.values[0] = HOME
            command.returning = then == _RETURN
        outcome[i].returning = command.returning


@rare_kernel
def _note_silence(arena, state, outcome, f):
    for i in range(state.uas.shape[0]):
        for e in range(arena.events.shape[0]):
            if concerns(arena, state, e, f, i) and lasts(arena, state, e):
                _stay_silent(state, i, state.events[e].step, arena.events[e].for_steps)


@inlined_kernel
def _stay_silent(state, i, since, for_steps):
    until = NEVER if for_steps >= NEVER else since + for_steps
    state.uas[i].responds_from_step = max(state.uas[i].responds_from_step, until)


_DEAF = MissionFeature(
    "commands_lost", {Point.COMMAND: _hear, Point.JUDGED: _note_silence}, memory=HEARD_DTYPE
)


class _Deafens:
    """What both events do to kernels."""

    feature: ClassVar = _DEAF

    @property
    def values(self) -> tuple[float, ...]:
        """What is flown meanwhile: the place of the key `then`."""
        table: Any = self
        return (float(get_args(Then).index(table.then)),)

    @property
    def goes_home(self) -> bool:
        """Whether UAS are sent home."""
        return self.values[0] == _RETURN


class RadioLost(_Deafens, OfUas):
    """No command reaches a UAS for a while. On-board functions (return mode, filter) go on.

    Attributes:
        kind: `"radio_lost"`.
        for_s: How long [s].
        then: What it flies meanwhile: `"go_on"` (its last command), `"hover"` or `"return"`.
    """

    kind: Literal["radio_lost"]
    for_s: Seconds
    then: Then = "hover"

    @property
    def lasts_s(self) -> float:
        """For as long as it says [s]."""
        return self.for_s


class PlannerLost(_Deafens, EventTable):
    """The planner fails: no command reaches any UAS any more.

    Attributes:
        kind: `"planner_lost"`.
        then: What the UAS fly from now on: `"go_on"` (their last commands), `"hover"` or
            `"return"`.
    """

    on_all: ClassVar[bool] = True

    kind: Literal["planner_lost"]
    then: Then = "return"
