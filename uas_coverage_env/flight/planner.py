"""What a planner is: the protocol, what it may tell about a decision, and its options."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

from pydantic import ConfigDict, Field

from uas_coverage_env.files.strict_toml import InputError, StrictModel
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.world import Command, SwarmState


@dataclass(frozen=True)
class Assistants:
    """Which assistants of the world fly along, see `World`.

    True: always; False: never; None: where something pushes back or a mission needs them
    otherwise, see `rollout`.
    """

    return_mode: bool | None = None
    safety_filter: bool | None = None


class Planner(Protocol):
    """Anything that flies a swarm: two methods are all that is needed.

    What a mission asks for beside planning is done round it, see `planning.around.Around`. More is
    read where a planner has it:

    - `warm_up(brief)`: compiles what needs compiling; called once, before `reset`, untimed.
    - `last_decision`: a `Decision` about the last `act`, or None.
    - `given_up`: waypoint (its index) -> why it is left open, in a few words; asked for at the end
      of a flight that has left some open (`Flight.left_open`).
    - `assistants`: the `Assistants` it wants to fly with, unless the caller says otherwise.
    - `routes`: (U,) the waypoints of each UAS, in order, at the last `reset` or `act`; along these
      an autopilot flies (`[execution]`). None: it has none.
    - `is_idle(swarm)`: whether a UAS flies that has nothing more to visit; a planner that has it is
      shown before the time which waypoints are asked for again (`SwarmState.again_s`), and brings
      UAS home for fresh packs by itself (`[sorties]` with `together = false`).
    - `goes_to`: whether it sends UAS by `GoTo`: the world's guidance is then compiled before the
      first decision, otherwise when such a command first comes; neither counts as time of it.
    - `is_learner`: whether its wrenches are judged as those of learners in environments, see
      `docs/rules.md`.
    - `options`: the pydantic model it was made with; goes into the record.
    - `fingerprint`: text that changes with the data it flies by (a policy's weights); part of the
      identity of its flights in a comparison.

    A planner that is found by name (entry-point group `uas_coverage.planners`) is a class with an
    attribute `Options` (see `PlannerOptions`), made as `PlannerClass(options)`; for KIND:ARGUMENT
    and MODULE:CLASS see `registry`.
    """

    def reset(self, brief: MissionBrief, seed: int, /) -> None:
        """Start a new mission; random numbers are drawn from the seed alone.

        Called again in flight when an event changes the scene (docs/faults.md), before the next
        `act`, with a brief of what is known then; the swarm goes on from where it is.

        Args:
            brief: The mission as far as a planner may know it: the fields of `Scenario` under
                their names, without the schedules of moving obstacles.
            seed: Of whatever is drawn.
        """
        ...

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Give each active UAS its command for the coming step."""
        ...


def check_planner(planner: object, name: str = "") -> None:
    """Refuse what is no planner, before it is asked for anything.

    Args:
        planner: What is to fly.
        name: What to call it in the error.

    Raises:
        InputError: It has no `reset` and `act`, or is a class; one line.
    """
    name = name or getattr(planner, "__name__", type(planner).__name__)
    if isinstance(planner, type):
        raise InputError(f"planner {name!r} is a class; make one, as in {name}()")
    for method in ("reset(brief, seed)", "act(swarm)"):
        if not callable(getattr(planner, method.partition("(")[0], None)):
            raise InputError(
                f"planner {name!r} has no method {method}; a planner has reset(brief, seed) and "
                "act(swarm), see docs/how_to_planner.md"
            )


class PlannerOptions(StrictModel):
    """Base of a planner's options: frozen, unknown names are errors, text is read as a number."""

    model_config = ConfigDict(strict=False)


class AssistedOptions(PlannerOptions):
    """Options of a planner that flies with both assistants unless they are taken away."""

    filter: bool = Field(default=True, description="fly with the safety filter")
    return_mode: bool = Field(default=True, description="fly with return mode")

    @property
    def assistants(self) -> Assistants:
        """The assistants that these options ask for, or take away."""
        return Assistants(self._wish("return_mode"), self._wish("filter"))

    def _wish(self, name: str) -> bool | None:
        # off by default: the planner does without where nothing pushes back
        off_anyway = type(self).model_fields[name].default is False
        return getattr(self, name) or (None if off_anyway else False)
