"""One mission as learners fly it: what the multi-agent and the single-agent environment share."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from uas_coverage_env.env.actions import HOME_CHOICE, actions_of
from uas_coverage_env.env.global_state import global_space, global_state
from uas_coverage_env.env.kernel import ACCEPTED, step_episode
from uas_coverage_env.env.layout import OBSERVATION_SIZE
from uas_coverage_env.env.memory import EPISODE, LEARNERS, SCRATCH, Learners, Prices
from uas_coverage_env.env.rewards import weights_of
from uas_coverage_env.env.start import first_look, tables_of
from uas_coverage_env.kernels import machine_code
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.world import (
    CONTACT_NAMES,
    KIND_NAMES,
    STATUS_NAMES,
    SwarmState,
    World,
    assistants,
)
from uas_coverage_env.world.arena import ARENA

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
        tables: What does not change during a mission.
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
        self.tables = tables_of(scenario, self.actions)
        sizes = ARENA.sizes_of(self._world.arena, {"A": self.actions.size})
        self._learners = LEARNERS.zeros(sizes)
        self._scratch = SCRATCH.zeros(sizes)
        self._prices = Prices(weights_of(reward_weights))
        self.asked = self._learners.asked
        self._observation_shape = (len(self.names), OBSERVATION_SIZE)
        self.observation = np.zeros(self._observation_shape, np.float32)
        self.steps = 0
        self._first: tuple[Learners, NDArray[np.float32]] | None = None
        self._prepare()

    def _prepare(self) -> None:
        world = self._world
        addresses = EPISODE.addresses_of(
            world.arena, world.state, self.tables, self._learners, self._scratch, self._prices
        )
        called = assistants(world.return_mode, world.safety_filter, goes_to=self.chooses)
        # what the kernel is given in every step: the arrays are written in place
        at = np.array([*addresses, *called])
        self._given = (at, self.actions.kind, world.dynamics == "nonlinear")
        seen = self.observation
        # to assign a record field by field takes ten times as long
        self._scratch_bytes = [array.view(np.uint8) for array in self._scratch]
        self._step = machine_code(step_episode, (*self._given, self.max_cycles, seen, seen))

    def __getstate__(self) -> dict[str, Any]:
        # neither machine code nor addresses and views travel
        stays = ("_step", "_given", "_scratch_bytes")
        return {key: value for key, value in self.__dict__.items() if key not in stays}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.asked = self._learners.asked  # one array again, not two equal ones
        self._prepare()

    def reset(self) -> None:
        """Begin a new mission."""
        self._world.reset()
        self.steps = 0
        if self._first is None:
            self._first = first_look(
                self._world.arena, self._world.state, self.tables, self.actions.size
            )
        first, observation = self._first
        for array, start in zip(self._learners, first, strict=True):
            array[:] = start
        for array in self._scratch_bytes:
            array[:] = 0
        self.observation = observation.copy()

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
        return self._learners.report.tolist()

    @property
    def report(self) -> list[list[float]]:
        """The report of the latest step; before the first, one in which nothing happened."""
        return self._learners.report.tolist()

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
            self.tables.scales[0],
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
                "asked": _described(self._scratch.commands[i]),
                "applied": _described(self._scratch.outcome[i]["applied_command"]),
            }
        return info

    def action_mask(self, i: int) -> NDArray[np.int8]:
        """(K_WAYPOINTS + 1,) 1 where a choice of UAS i names a waypoint, and for home."""
        mask = np.ones(HOME_CHOICE + 1, np.int8)
        mask[:HOME_CHOICE] = self._learners.candidates[i] >= 0
        return mask


def with_max_steps(scenario: Scenario, max_cycles: int) -> Scenario:
    """The scenario with another limit of steps; return mode and the observed time know it."""
    whole = isinstance(max_cycles, int | np.integer) and not isinstance(max_cycles, bool)
    if not whole or not 1 <= max_cycles <= _LONGEST:
        raise ValueError(f"max_cycles is {max_cycles!r}; give a whole number from 1 to {_LONGEST}")
    return scenario.model_copy(update={"max_steps": int(max_cycles)})


def _described(command: np.void) -> dict[str, Any]:
    return {"kind": KIND_NAMES[int(command["kind"])], "values": command["values"].tolist()}
