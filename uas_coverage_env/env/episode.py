"""One mission as learners fly it: what the multi-agent and the single-agent environment share."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.env.actions import HOME_CHOICE, actions_of
from uas_coverage_env.env.global_state import global_space, global_state
from uas_coverage_env.env.kernel import (
    ACCEPTED,
    CONTACT_WITH,
    COVERED,
    REPORT_SIZE,
    STATUS,
    addresses_of,
    step_episode,
)
from uas_coverage_env.env.layout import K_WAYPOINTS, OBSERVATION_SIZE
from uas_coverage_env.env.nearest import NO_TARGET, count_company, neighbours_of
from uas_coverage_env.env.observation import observe, scales_of
from uas_coverage_env.env.rewards import weights_of
from uas_coverage_env.kernels import machine_code
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.world import (
    COMMAND_DTYPE,
    CONTACT_NAMES,
    FLYING,
    KIND_NAMES,
    OUTCOME_DTYPE,
    STATUS_NAMES,
    SwarmState,
    World,
    assistants,
)

_LONGEST = 100_000
_FLOAT32 = np.dtype(np.float32)


class Episode:
    """One mission after another, in arrays.

    Args:
        scenario: Name of a shipped scenario, path of a scenario file, or a scenario.
        action: A name of `ACTION_NAMES`.
        dynamics: "lpv" or "nonlinear".
        return_mode: Bring every UAS home in time.
        safety_filter: Keep commands clear of harm.
        reward_weights: Reward term -> weight; the others keep their defaults.
        max_cycles: Steps after which the episode is cut; None: the scenario's.

    Attributes:
        scenario: The scenario flown, with `max_steps` as given by `max_cycles`.
        names: Of all UAS, in order.
        actions: The kind of action.
        max_cycles: Steps after which the episode is cut.
        chooses: Whether the action is a choice of waypoints.
        steps: Flown since t = 0.
        asked: (U, size) the actions of the coming step, to be written before it.
        observation: (U, OBSERVATION_SIZE) the latest; a new array in every step.

    Raises:
        ValueError: An argument is none of what is allowed; says what is.
    """

    def __init__(
        self,
        scenario: str | Path | Scenario,
        *,
        action: str,
        dynamics: str,
        return_mode: bool,
        safety_filter: bool,
        reward_weights: Mapping[str, float] | None,
        max_cycles: int | None,
    ) -> None:
        for name, switch in (("return_mode", return_mode), ("safety_filter", safety_filter)):
            if not isinstance(switch, bool | np.bool_):
                raise ValueError(f"{name} is {switch!r}; it is True or False")
        if not isinstance(scenario, Scenario):
            scenario = load_scenario(scenario)
        if max_cycles is not None:
            scenario = with_max_steps(scenario, max_cycles)
        self._weights = weights_of(reward_weights)
        self.actions = actions_of(action, scenario)
        self._world = World(
            scenario,
            dynamics=dynamics,  # pyright: ignore[reportArgumentType]  # the world checks it
            return_mode=bool(return_mode),
            safety_filter=bool(safety_filter),
            measured_m=0.0,  # only what counts: nobody is told more
        )
        self.scenario = scenario
        self.names = self._world.names
        self.max_cycles = scenario.max_steps
        self.chooses = action == "waypoint"
        self._filters = self._world.safety_filter
        self._tells_more = self.chooses or self._filters
        self._partners = {
            "obstacle": tuple(obstacle.name for obstacle in scenario.obstacles),
            "moving_obstacle": tuple(obstacle.name for obstacle in scenario.moving_obstacles),
            "uas": self.names,
        }
        n_uas = len(self.names)
        self._scales = scales_of(scenario)
        self._neighbours = neighbours_of(scenario)
        self.asked = np.zeros((n_uas, self.actions.size))
        self._targets = np.full(n_uas, NO_TARGET)
        self._candidates = np.full((n_uas, K_WAYPOINTS), -1)
        self._company = np.zeros((len(scenario.waypoints), 2), np.float32)
        self._commands = np.zeros(n_uas, dtype=COMMAND_DTYPE)
        self._outcome = np.zeros(n_uas, dtype=OUTCOME_DTYPE)
        self._report = np.zeros((n_uas, REPORT_SIZE))
        self._observation_shape = (n_uas, OBSERVATION_SIZE)
        self.observation = np.zeros(self._observation_shape, np.float32)
        self.steps = 0
        self._first_look: tuple[NDArray[Any], ...] | None = None
        self._prepare()

    @property
    def _fixed(self) -> tuple[NDArray[Any], ...]:
        """The first arrays of a learners' step, which nothing writes."""
        return self.actions.ranges, self._scales, self._neighbours, self._weights

    @property
    def _changing(self) -> tuple[NDArray[Any], ...]:
        """The arrays of a learners' step after them, but for the observation."""
        return (
            self.asked,
            self._targets,
            self._candidates,
            self._company,
            self._commands,
            self._outcome,
            self._report,
        )

    def _prepare(self) -> None:
        world = self._world
        arrays = (*self._fixed, *self._changing)
        aboard = assistants(world.return_mode, world.safety_filter, goes_to=self.chooses)
        addresses = addresses_of(world.arena, world.state, arrays, aboard)
        # what the kernel is given in every step: the arrays are written in place
        self._given = (*addresses, self.actions.kind, world.dynamics == "nonlinear")
        look = self.observation
        self._step = machine_code(step_episode, (*self._given, self.max_cycles, look, look))

    def __getstate__(self) -> dict[str, Any]:
        # neither machine code nor addresses travel
        kept = self.__dict__.items()
        return {key: value for key, value in kept if key not in ("_step", "_given")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    def reset(self) -> None:
        """Begin a new mission."""
        self._world.reset()
        self.steps = 0
        self.asked[:] = 0.0
        self._targets[:] = NO_TARGET
        # as bytes: to assign a record field by field takes ten times as long
        self._outcome.view(np.uint8)[:] = 0
        self._commands.view(np.uint8)[:] = 0
        if self._first_look is None:
            self._first_look = self._look()
        report, candidates, company, observation = self._first_look
        self._report[:] = report
        self._candidates[:] = candidates
        self._company[:] = company
        self.observation = observation.copy()

    def _look(self) -> tuple[NDArray[Any], ...]:
        """What missions begin with, always the same: report, candidates, company, observation."""
        world = self._world
        report = np.zeros_like(self._report)
        report[:, CONTACT_WITH] = -1
        report[:, STATUS] = world.state.status
        report[:, COVERED] = (~world.state.uncovered).sum()
        candidates = np.full_like(self._candidates, -1)
        company = np.zeros_like(self._company)
        observation = np.zeros_like(self.observation)
        count_company(world.state.uncovered, self._neighbours, company)
        observe(
            world.arena,
            world.state,
            self._scales,
            company,
            world.state.status == FLYING,
            self._targets,
            self.max_cycles,
            candidates,
            observation,
        )
        return report, candidates, company, observation

    def step(self) -> list[list[float]]:
        """Fly what was asked for one step.

        Returns:
            The report, one row for each UAS: reward terms, then the columns of `kernel`.

        Raises:
            ValueError: An action is not finite; names UAS and value, and nothing has changed.
        """
        observation = np.empty(self._observation_shape, _FLOAT32)
        invalid = self._step(*self._given, self.max_cycles, self.observation, observation)
        if invalid != ACCEPTED:
            numbers_asked = self.asked[invalid].tolist()
            self.asked[invalid] = 0.0
            raise ValueError(
                f"action of {self.names[invalid]} is {numbers_asked}; give finite numbers"
            )
        self.observation = observation
        self.steps += 1
        return self._report.tolist()

    def arrays(self) -> tuple[tuple[Any, ...], ...]:
        """What a kernel needs to fly many of these missions, after `reset`.

        Returns:
            The arena; what else does not change; what is not zero at the start; all that changes,
            in the order of `WorldState` and `step_learners`.
        """
        world = self._world
        return (
            world.arena,
            self._fixed,
            (
                world.state.x,
                world.state.uncovered,
                self._candidates,
                self._company,
                self.observation,
            ),
            (
                *world.state,
                *self._changing,
                self.observation,
            ),
        )

    @property
    def report(self) -> list[list[float]]:
        """The report of the latest step; before the first, one in which nothing happened."""
        return self._report.tolist()

    def global_state(self) -> NDArray[np.float32]:
        """The whole mission as one vector, see `global_state`."""
        state = self._world.state
        sample = min(self.steps, len(self._world.arena.moving_path_m) - 1)
        return global_state(
            self.observation,
            state.status,
            state.uncovered,
            self._world.arena.moving_path_m[sample],
            self._world.arena.moving_velocity_mps[sample],
            self._scales[0],
        )

    def state_space(self) -> spaces.Box:
        """A new space of `global_state`."""
        scenario = self.scenario
        return global_space(
            len(scenario.uas), len(scenario.moving_obstacles), len(scenario.waypoints)
        )

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """(U, 3) [m] where the UAS are."""
        return self._world.state.x[:, :3]

    def swarm_state(self) -> SwarmState:
        """What a player sees now."""
        return self._world.swarm_state()

    def info(self, i: int, row: list[float]) -> dict[str, Any]:
        """What is told about a UAS beside its observation and reward, see `CoverageParallelEnv`."""
        # all at once, and names as they stand in REWARD_TERMS: called most often of all
        (
            coverage, team_coverage, energy, violation, home, stranded, filter_, time,
            energy_Wh, contact, contact_with, status, filtered, returning, covered, _,
        ) = row  # fmt: skip
        info: dict[str, Any] = {
            "status": STATUS_NAMES[int(status)],
            "contact": None,
            "contact_with": None,
            "returning": returning > 0.0,
            "covered": int(covered),
            "energy_Wh": energy_Wh,
            "reward_terms": {
                "coverage": coverage,
                "team_coverage": team_coverage,
                "energy": energy,
                "violation": violation,
                "home": home,
                "stranded": stranded,
                "filter": filter_,
                "time": time,
            },
        }
        if contact:
            info["contact"] = kind = CONTACT_NAMES[int(contact)]
            if kind in self._partners:
                info["contact_with"] = self._partners[kind][int(contact_with)]
        if not self._tells_more:
            return info
        if self.chooses:
            info["action_mask"] = self.action_mask(i)
        if self._filters:
            info["filter"] = {
                "changed": filtered > 0.0,
                "asked": _described(self._commands[i]),
                "applied": _described(self._outcome[i]["applied_command"]),
            }
        return info

    def action_mask(self, i: int) -> NDArray[np.int8]:
        """(K_WAYPOINTS + 1,) 1 where a choice of UAS i names a waypoint, and for home."""
        mask = np.ones(HOME_CHOICE + 1, np.int8)
        mask[:HOME_CHOICE] = self._candidates[i] >= 0
        return mask


def with_max_steps(scenario: Scenario, max_cycles: int) -> Scenario:
    """The scenario with another limit of steps; return mode and the observed time know it."""
    whole = isinstance(max_cycles, int | np.integer) and not isinstance(max_cycles, bool)
    if not whole or not 1 <= max_cycles <= _LONGEST:
        raise ValueError(f"max_cycles is {max_cycles!r}; give a whole number from 1 to {_LONGEST}")
    return scenario.model_copy(update={"max_steps": int(max_cycles)})


def _described(command: np.void) -> dict[str, Any]:
    return {"kind": KIND_NAMES[int(command["kind"])], "values": command["values"].tolist()}
