"""The world as an object: one mission, step by step."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, get_args

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.assist import AssistantCode, assistants
from uas_coverage_env.compiled.kernels import machine_code
from uas_coverage_env.compiled.memory import as_bytes
from uas_coverage_env.compiled.random import SEEDS
from uas_coverage_env.entities.codes import DynamicsName
from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES, Command, pack
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import (
    FLYING,
    LANDED,
    STATE,
    SWAPPING,
    SwarmState,
    WorldState,
)
from uas_coverage_env.features.feature import MissionFeature, memory_words
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.ground_phases import take_off
from uas_coverage_env.simulation.flight import feature_code
from uas_coverage_env.simulation.scenes import (
    carried_over,
    changes_due,
    changes_scene,
    scene_after,
)
from uas_coverage_env.simulation.step import (
    ACCEPTED,
    LACKS_GUIDANCE,
    MISSION,
    begin_features_at,
    begin_mission,
    step_world,
)
from uas_coverage_env.vehicle.battery import BatteryState
from uas_coverage_env.vehicle.layout import DOD, PSI, U_TH, WZ
from uas_coverage_env.world.arena import Arena, build_arena
from uas_coverage_env.world.events import goes_home
from uas_coverage_env.world.packs import (
    mission_features,
    packs_left,
    swap_steps_left,
    swaps_alone,
)
from uas_coverage_env.world.sensing import senses

StepCode = Callable[..., int]

_OUTCOMES_IN_BLOCK = 256


def initial_state(
    scenario: Scenario, arena: Arena | None = None, features: Sequence[MissionFeature | None] = ()
) -> WorldState:
    """All UAS at rest at their starts, nothing covered; batteries rested, or after take-off.

    Args:
        scenario: The scenario.
        arena: The same as arrays; None: for what has no features.
        features: Those in the arena.
    """
    n_uas = len(scenario.uas)
    sizes = {"U": n_uas, "W": len(scenario.waypoints), "E": len(scenario.events)}
    sizes |= {"S": n_uas if senses(scenario) else 0, "B": n_uas if swaps_alone(scenario) else 0}
    sizes["memory words"] = memory_words(features, n_uas)
    sizes["true vehicles"] = 0 if arena is None else len(arena.true_uas)
    sizes["repeats"] = len(scenario.waypoints) if scenario.asks_again else 0
    state = STATE.zeros(sizes)
    state.x[:, :3] = [uas.start_m for uas in scenario.uas]
    if arena is not None:
        state.true_vehicles[:] = arena.vehicles[arena.true_uas]
    for i, (uas, vehicle) in enumerate(zip(scenario.uas, scenario.vehicles, strict=True)):
        battery = BatteryState.rested(vehicle.battery, 1.0 - uas.soc_0)
        if scenario.from_ground:
            battery = take_off(scenario, i).battery
        state.x[i, DOD], (state.x[i, U_TH], *further_V) = battery
        if further_V and len(state.true_vehicles):
            state.true_vehicles["further_V"][i, : len(further_V)] = further_V
    state.uas["status"][:] = FLYING
    state.uncovered[:] = True
    if len(state.measured):
        # where and how they start is known
        state.estimated[:] = state.measured[:] = state.observed[:] = state.x
    return state


def swarm_state(scenario: Scenario, arena: Arena, state: WorldState) -> SwarmState:
    """What planners see of a mission, in arrays of their own.

    Args:
        scenario: As it is now.
        arena: The same as arrays.
        state: The state.
    """
    step = int(state.step[0])
    sample = min(step, len(arena.moving_path_m) - 1)
    x = state.as_observed().x.copy()
    turning, turned_rad = arena.vehicles["follows_course"], np.zeros(0)
    if turning.any():
        turned_rad = np.where(turning, x[:, PSI], 0.0)
        x[turning, PSI] = x[turning, WZ] = 0.0
    return SwarmState(
        time_s=step * scenario.dt_s,
        step=step,
        names=tuple(uas.name for uas in scenario.uas),
        x=x,
        reference_mps=state.uas["reference_mps"].copy(),
        status=np.where(state.uas["status"] == SWAPPING, LANDED, state.uas["status"]),
        departed=state.uas["departed"].copy(),
        returning=state.uas["returning"].copy(),
        uncovered=state.uncovered.copy(),
        home_m=arena.uas["home_m"].copy(),
        moving_position_m=arena.moving_path_m[sample].copy(),
        moving_velocity_mps=arena.moving_velocity_mps[sample].copy(),
        responds=state.uas["responds_from_step"] <= step,
        turned_rad=turned_rad,
        packs_left=packs_left(arena, state),
        ground_s=scenario.dt_s * swap_steps_left(arena, state).astype(float),
        again_s=np.where(
            state.due_step > step, scenario.dt_s * (state.due_step - step).astype(float), np.inf
        ),
        filtered=state.uas["filtered"].copy(),
    )


class World:
    """One mission of a scenario.

    Args:
        scenario: The scenario.
        dynamics: The model that is flown.
        return_mode: Whether UAS are brought home in time.
        safety_filter: Whether commands are kept clear of harm.
        measured_m: Up to where distances are measured, see `build_arena`.
        disturbances: What pushes back; None: what the scenario says.
        judges_wrenches: Whether wrenches are a learner's, see `build_arena`.
        seed: Of all that disturbances draw, until `reset` is given another; from 0 to 2⁶⁴ - 1.

    Attributes:
        scenario: As given; likewise dynamics, return_mode and safety_filter.
        features: What the mission has of what few missions have.
        names: Names of the UAS, in order.
        known: The scenario as it is now: events may have changed the scene.
        arena: The same as arrays; not to be changed.
        revisions: How often events have changed the scene since t = 0.
    """

    def __init__(
        self,
        scenario: Scenario,
        *,
        dynamics: DynamicsName = "lpv",
        return_mode: bool = False,
        safety_filter: bool = False,
        measured_m: float = math.inf,
        disturbances: Sequence[MissionFeature] | None = None,
        judges_wrenches: bool = False,
        seed: int = 0,
    ) -> None:
        if dynamics not in get_args(DynamicsName):
            allowed = ", ".join(get_args(DynamicsName))
            raise ValueError(f"dynamics is {dynamics!r}; it is one of {allowed}")
        self.scenario = scenario
        self.dynamics = dynamics
        self.return_mode = bool(return_mode)
        self.safety_filter = bool(safety_filter)
        self.names = tuple(uas.name for uas in scenario.uas)
        self.features = mission_features(scenario, disturbances)
        self._measured_m, self._judges_wrenches = measured_m, bool(judges_wrenches)
        self.known, self.revisions = scenario, 0
        self.arena = self._first_arena = self._arena_of(scenario)
        self._start = initial_state(scenario, self.arena, self.features)
        begin_mission(self.arena, self._start, np.zeros(len(self.names), dtype=OUTCOME_DTYPE))
        self._state = self._start.copy()
        self._changes = changes_scene(scenario)
        self._nonlinear = dynamics == "nonlinear"
        self._goes_to = self.return_mode or goes_home(scenario)
        self._prepare()
        self._seed = 0
        self.reset(seed)

    def _prepare(self) -> None:
        # in a scene that has changed sizes are others: `reset` prepares anew
        self._restarted = list(zip(as_bytes(self._state), as_bytes(self._start), strict=False))
        self._outcomes = np.zeros((0, len(self.names)), dtype=OUTCOME_DTYPE)
        self._next_outcome = 0
        self._step: StepCode | None = None
        self._assistants: AssistantCode = np.zeros(0, dtype=np.int64)
        self._at = np.zeros(0, dtype=np.int64)

    def __getstate__(self) -> dict[str, Any]:
        # neither machine code nor addresses travel: they are made anew wherever the copy goes
        stays = ("_step", "_assistants", "_outcomes", "_at", "_restarted")
        return {k: v for k, v in self.__dict__.items() if k not in stays}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    @property
    def state(self) -> WorldState:
        """The state; its arrays are written by `reset` and `step`."""
        return self._state

    def reset(self, seed: int | None = None, mission: int = 0) -> None:
        """Go back to t = 0.

        Args:
            seed: Of all that disturbances draw; None: as before.
            mission: Number of the mission with this seed: each draws other numbers.

        Raises:
            ValueError: The seed is no whole number from 0 to 2⁶⁴ - 1.
        """
        if seed is not None:
            whole = isinstance(seed, int | np.integer) and not isinstance(seed, bool)
            if not whole or not 0 <= seed < SEEDS:
                raise ValueError(f"seed is {seed!r}; give a whole number from 0 to 2**64 - 1")
            self._seed = int(seed)
        if self.revisions:
            self.known, self.arena, self.revisions = self.scenario, self._first_arena, 0
            self._state = self._start.copy()
            self._prepare()
        for array, start in self._restarted:
            array[:] = start
        if self.features or len(self.state.events):
            begin_features_at(self._addresses(), np.uint64(self._seed), mission)

    def _addresses(self) -> NDArray[np.int64]:
        """Of arena, state and what features do; they hold until the scene changes."""
        if not len(self._at):
            code = feature_code(
                self.features, otherwise=self._nonlinear or len(self.state.true_vehicles) > 0
            )
            self._at = np.array([*MISSION.addresses_of(self.arena, self._state), *code])
        return self._at

    def step(self, commands: NDArray[np.void] | Mapping[str, Command]) -> NDArray[np.void]:
        """Fly all UAS for one step.

        Args:
            commands: One command for each active UAS, by name, or packed: (U,) of COMMAND_DTYPE.

        Returns:
            (U,) of OUTCOME_DTYPE, an array of its own.

        Raises:
            ValueError: A command is missing, surplus or invalid; nothing has changed.
        """
        if not isinstance(commands, np.ndarray):
            active = self.active
            commands = pack(commands, self.names, active, len(self.known.waypoints))
        elif commands.dtype != COMMAND_DTYPE or commands.shape != (len(self.names),):
            raise ValueError(
                f"commands have dtype {commands.dtype} and shape {commands.shape}; "
                f"give COMMAND_DTYPE and ({len(self.names)},)"
            )
        elif not commands.flags.c_contiguous:
            commands = commands.copy()
        outcome = self._fresh_outcome()
        # not before: environments have a world, too, and a step of their own
        step = self._step or self._make_ready(commands, outcome)
        invalid = step(
            self._at, commands, self._nonlinear, self._goes_to, self._assistants, outcome
        )
        if invalid == LACKS_GUIDANCE:
            # as much to compile as all the rest, for commands that may never come
            self._goes_to, self._step = True, None
            return self.step(commands)
        if invalid != ACCEPTED:
            raise ValueError(self._what_is_wrong(invalid, commands[invalid]))
        self.change_scene()
        return outcome

    def _make_ready(self, commands: NDArray[np.void], outcome: NDArray[np.void]) -> StepCode:
        self._assistants = assistants(self.return_mode, self.safety_filter, goes_to=self._goes_to)
        arguments = (
            self._addresses(), commands, self._nonlinear, self._goes_to, self._assistants, outcome
        )  # fmt: skip
        self._step = machine_code(step_world, arguments)
        return self._step

    def _arena_of(self, scenario: Scenario) -> Arena:
        return build_arena(
            scenario,
            measured_m=self._measured_m,
            features=self.features,
            judges_wrenches=self._judges_wrenches,
        )

    def change_scene(self) -> bool:
        """Let happen at this sample what changes the scene: it is another one from now on.

        Events do, and waypoints that are asked for again.

        `step` does so itself. It is for those that step the arrays of the world by code of their
        own; `arena` and `state` are other arrays then, and again after `reset`.

        Returns:
            Whether anything changed.
        """
        if not self._changes:
            return False
        state = self.state
        changes = changes_due(self.known, state)
        if not changes:
            return False
        for change in changes:
            self.known = scene_after(self.known, change, state)
        self.arena = self._arena_of(self.known)
        self._state = carried_over(self.known, self.arena, state)
        self.revisions += 1
        self._prepare()
        return True

    def take_off(self, uas: NDArray[np.bool_]) -> None:
        """Let UAS that have landed fly again, at rest where they landed, with what they have.

        Args:
            uas: (U,) which.

        Raises:
            ValueError: One of them has not landed; nothing has changed.
        """
        state = self._state
        if (state.uas["status"][uas] != LANDED).any():
            raise ValueError("a UAS that has not landed cannot take off; see swarm_state().status")
        state.uas["status"][uas] = FLYING
        state.uas["departed"][uas] = False
        state.uas["returning"][uas] = False

    def _fresh_outcome(self) -> NDArray[np.void]:
        """A row of its own for each step, from blocks: to ask for it alone takes longer to make."""
        if self._next_outcome == len(self._outcomes):
            rows = max(1, _OUTCOMES_IN_BLOCK // len(self.names))
            self._outcomes = np.zeros((rows, len(self.names)), dtype=OUTCOME_DTYPE)
            self._next_outcome = 0
        self._next_outcome += 1
        return self._outcomes[self._next_outcome - 1]

    def _what_is_wrong(self, i: int, command: np.void) -> str:
        kind = int(command["kind"])
        name = KIND_NAMES[kind] if 0 <= kind < len(KIND_NAMES) else f"of kind {kind}"
        return (
            f"command of {self.names[i]} is {name} {command['values'].tolist()}; give finite "
            f"values of a velocity, acceleration or wrench, or the index of a waypoint"
        )

    @property
    def active(self) -> tuple[str, ...]:
        """Names of the UAS that fly."""
        status = self.state.uas["status"].tolist()
        return tuple(name for name, s in zip(self.names, status, strict=True) if s == FLYING)

    @property
    def done(self) -> bool:
        """Whether no UAS flies any more, nor swaps packs to fly again."""
        status = self.state.uas["status"]
        return FLYING not in status and SWAPPING not in status

    @property
    def waits(self) -> bool:
        """Whether a waypoint is going to be asked for again that was covered."""
        return bool((self.state.due_step > self.state.step[0]).any())

    @property
    def visits_to_come(self) -> int:
        """How often waypoints are still to be covered, now and when they are asked for again."""
        return visits_to_come(self.known, self.state)

    @property
    def time_s(self) -> float:
        """Time since the start [s]."""
        return int(self.state.step[0]) * self.scenario.dt_s

    def swarm_state(self) -> SwarmState:
        """What planners see now, in arrays of their own."""
        return swarm_state(self.known, self.arena, self.state)


def visits_to_come(known: Scenario, state: WorldState) -> int:
    """How often waypoints are still to be covered, now and when they are asked for again.

    Args:
        known: The scenario as it is now.
        state: The state of its mission.
    """
    later = 0
    for w, due_step in enumerate(state.due_step):
        if state.uncovered[w] or due_step > state.step[0]:
            later += len(known.waypoints[w].again_after_s)
    return int(state.uncovered.sum()) + later
