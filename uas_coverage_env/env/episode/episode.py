"""One scenario as learners fly it: what the multi-agent and the single-agent environment share."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.compiled.kernels import machine_code
from uas_coverage_env.compiled.memory import as_bytes
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.episode.act import acting_of, is_own, refuse_what_it_wrote
from uas_coverage_env.env.episode.arrays import arrays_of, report_start
from uas_coverage_env.env.episode.express import Moment
from uas_coverage_env.env.episode.global_state import global_state
from uas_coverage_env.env.episode.infos import Infos
from uas_coverage_env.env.episode.memory import EPISODE
from uas_coverage_env.env.episode.observe import observe_with, observing_of
from uas_coverage_env.env.episode.pay import paying_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.episode.step import ACCEPTED, step_episode_with
from uas_coverage_env.env.observation.own import OWN
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.room import Room
from uas_coverage_env.simulation import World
from uas_coverage_env.simulation.flight import feature_code
from uas_coverage_env.world import SwarmState
from uas_coverage_env.world.events import goes_home

# numpy takes as long to find them as to use them
_FLOAT32, _empty = np.dtype(np.float32), np.empty


class Episode:
    """One mission after another, in arrays.

    Args:
        scenario: What is flown.
        settings: How missions are flown and paid.
        room: The largest mission that `global_state` has room for; None: this one.

    Attributes:
        settings: As given.
        scenario: The scenario flown, with `max_steps` as given by `settings.max_steps`; where
            events have changed the scene, as it is now.
        revisions: How often they have since t = 0.
        names: Of all UAS, in order.
        actions: The kind of action.
        max_steps: Steps after which the episode is cut.
        steps: Flown since t = 0.
        tables: What does not change during a mission.
        asked: (U, size) the actions of the coming step, to be written before it.
        asked_rows: Its rows: to index the array takes longer.
        observation: (U, V) the latest; a new array in every step.
        amounts: Of the latest step, one row for each UAS: the columns of `memory`.
        infos: What is told about the UAS.
    """

    def __init__(
        self, scenario: Scenario, settings: MissionSettings, room: Room | None = None
    ) -> None:
        scenario = settings.limited(scenario)
        self.settings = settings
        self._room = room or Room.of(scenario)
        self.actions = actions_of(settings.kind, scenario)
        self._world = World(
            scenario,
            dynamics=settings.dynamics,
            return_mode=settings.return_mode,
            safety_filter=settings.safety_filter,
            measured_m=0.0,  # only what counts: nothing more is told
            disturbances=settings.disturbances,
            judges_wrenches=True,
        )
        self.names = self._world.names
        self.max_steps = scenario.max_steps
        self._lay_out()
        self._observation_shape = (len(self.names), settings.observation_size)
        self.observation = np.zeros(self._observation_shape, np.float32)
        self.steps = 0
        self.amounts: list[list[float]] = []
        self._first: tuple[list[NDArray[np.uint8]], NDArray[np.float32]] | None = None
        self._prepare()

    def _lay_out(self) -> None:
        """Make the arrays whose sizes are those of the scene."""
        world = self._world
        self.scenario, self.revisions = world.known, world.revisions
        _, self.tables, self._learners, self._scratch = arrays_of(
            world.arena, self.scenario, self.settings, self.actions
        )

    def _see_anew(self) -> None:
        """Go on in a scene that has changed: UAS are the same, waypoints keep their indices."""
        before = (*self._learners, *self._scratch)
        self._lay_out()
        for array, old in zip((*self._learners, *self._scratch), before, strict=True):
            array[: len(old)] = old
        self._prepare()
        self._look()

    def _prepare(self) -> None:
        world = self._world
        kind = self.actions.kind
        self.asked = self._learners.asked
        self.asked_rows = list(self.asked)
        self._report, self._paid = self._learners.report, self._learners.amounts
        self.infos = Infos(self.settings, self._learners, self._scratch)
        version = self.settings.version
        self._acting = acting_of(kind, version.actions)
        self._checks = is_own(self._acting)
        self._paying = paying_of(self.settings.reward, self.settings.weights, version.reward)
        self._observing = observing_of(self.settings.observation, version.observation)
        addresses = EPISODE.addresses_of(
            world.arena, world.state, self.tables, self._learners, self._scratch,
            self._acting, self._paying, self._observing,
        )  # fmt: skip
        goes_to = kind.goes_to or goes_home(self.scenario)
        called = assistants(world.return_mode, world.safety_filter, goes_to=goes_to)
        # what the kernel is given in every step: the arrays are written in place
        nonlinear = world.dynamics == "nonlinear"
        code = feature_code(
            world.features, otherwise=nonlinear or len(world.state.true_vehicles) > 0
        )
        at = np.array([*addresses, len(called), *called, *code])
        self._given = (at, nonlinear)
        seen = self.observation
        self._restarted = as_bytes((*self._learners, *self._scratch))
        self._step = machine_code(step_episode_with(version), (*self._given, False, seen, seen))

    def __getstate__(self) -> dict[str, Any]:
        # neither machine code nor addresses and views travel
        stays = (
            "asked", "asked_rows", "infos", "_report", "_paid", "_step", "_given",
            "_restarted", "_acting", "_paying", "_observing",
        )  # fmt: skip
        return {key: value for key, value in self.__dict__.items() if key not in stays}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._prepare()

    def reset(self, seed: int = 0, mission: int = 0) -> None:
        """Begin a new mission.

        Args:
            seed: Of all that disturbances draw.
            mission: Number of the mission since seeding; each draws other numbers.
        """
        self._world.reset(seed, mission)
        if self.revisions:
            self._lay_out()
            self._prepare()
        self.steps = 0
        first, observation = self._first or self._look_first()
        for array, start in zip(self._restarted, first, strict=True):
            array[:] = start
        self.observation = observation.copy()
        self.amounts = self._learners.amounts.tolist()

    def _look_first(self) -> tuple[list[NDArray[np.uint8]], NDArray[np.float32]]:
        """What missions begin with, always the same; kept."""
        report_start(self._world.state, self._learners)
        self.observation = np.zeros(self._observation_shape, np.float32)
        self._look()
        self._first = [array.copy() for array in self._restarted], self.observation
        return self._first

    def _look(self) -> None:
        """Observe a scene that is new to those that fly."""
        self._step(*self._given, True, self.observation, self.observation)

    def step(self) -> list[list[int]]:
        """Fly what was asked for one step.

        Returns:
            The report, one row for each UAS: the columns of `memory`.

        Raises:
            ValueError: An action is not finite; names UAS and value, and nothing has changed. Or
                an own kind of action wrote a command that cannot be flown.
        """
        observation = _empty(self._observation_shape, _FLOAT32)
        at, nonlinear = self._given
        invalid = self._step(at, nonlinear, False, self.observation, observation)
        if invalid != ACCEPTED:
            numbers_asked = self.asked[invalid].tolist()
            self.asked[invalid] = 0.0
            raise ValueError(
                f"action of {self.names[invalid]} is {numbers_asked}; give finite numbers"
            )
        self.observation = observation
        self.steps += 1
        self.amounts = self._paid.tolist()
        if self._checks:
            refuse_what_it_wrote(self.actions.kind, self.asked, self.names)
        if self._world.change_scene():
            self._see_anew()
        return self._report.tolist()

    @property
    def report(self) -> list[list[int]]:
        """The report of the latest step; before the first, one in which nothing happened."""
        return self._learners.report.tolist()

    def global_state(self) -> NDArray[np.float32]:
        """The whole mission as one vector, see `global_state`."""
        state = self._world.state
        sample = min(self.steps, len(self._world.arena.moving_path_m) - 1)
        return global_state(
            self._own(),
            state.uas["status"],
            state.uncovered,
            self._world.arena.moving_path_m[sample],
            self._world.arena.moving_velocity_mps[sample],
            self.tables.scales[0],
            self._room,
        )

    def _own(self) -> NDArray[np.float32]:
        """(U, size) the group `own` of the observations."""
        if OWN in self.settings.observation:
            at = self.settings.observation.index(OWN)
            first = sum(block.size for block in self.settings.observation[:at])
            return self.observation[:, first : first + OWN.size]
        world = self._world
        own = np.zeros((len(self.names), OWN.size), np.float32)
        observes = np.ones(len(self.names), dtype=np.bool_)
        arrays = (world.arena, world.state.as_observed(), self.tables, self._learners)
        blocks = self.settings.version.observation
        observe_with(blocks)(*arrays, observing_of([OWN], blocks), observes, own)
        return own

    @property
    def positions_m(self) -> NDArray[np.float64]:
        """(U, 3) [m] where the UAS are."""
        return self._world.state.x[:, :3]

    def swarm_state(self) -> SwarmState:
        """What a planner sees now."""
        return self._world.swarm_state()

    def moment(self) -> Moment:
        """The mission now, for `express`."""
        world = self._world
        arrays = (world.arena, world.state.as_observed(), self.tables, self._learners)
        return Moment(self.names, *arrays, world.dynamics == "nonlinear")
