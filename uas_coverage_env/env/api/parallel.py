"""The multi-agent environment: one agent per UAS, all act at once (PettingZoo)."""

from collections.abc import Mapping
from typing import Any, ClassVar, Unpack

import numpy as np
from gymnasium import spaces
from gymnasium.error import ResetNeeded
from gymnasium.utils import seeding
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from uas_coverage_env.entities.state import FLYING, SWAPPING
from uas_coverage_env.env.api.documentation import Versioned
from uas_coverage_env.env.api.forms import LastKnown, observation_space, shown
from uas_coverage_env.env.episode.express import action_of
from uas_coverage_env.env.episode.global_state import global_space
from uas_coverage_env.env.episode.sequence import MissionSequence
from uas_coverage_env.env.episode.settings import MissionKeywords, MissionSettings, takes_settings
from uas_coverage_env.env.rendering.screen import RENDER_FPS, RENDER_MODES, Screen, offered
from uas_coverage_env.env.report import REWARD, STATUS
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike
from uas_coverage_env.world import Command, SwarmState

Observations = dict[str, Any]
"""Of each agent that acted: an array, or a dictionary with `mask_in_observation`."""
Infos = dict[str, dict[str, Any]]

_IN_FLIGHT = FLYING, SWAPPING


class CoverageParallelEnv(Versioned, ParallelEnv[str, NDArray[np.float32], Any]):
    """Several UAS cover the waypoints of an area and come home before their batteries end.

    Description:
        Every agent is a UAS of the scenario and has its name there. It flies among fixed and
        moving obstacles inside a geofence. A waypoint is covered when a flying UAS is within its
        radius at a sample. Flying costs energy: airframe and battery are the linear
        parameter-varying model of Gasche et al., Sec. II. A step is a time step of the scenario,
        1 s in those shipped.

    Action Space:
        velocity (default), `Box(-1, 1, (3,))`: north and east velocity in units of the vehicle's
        limit, and an altitude to hold, from the lowest (-1) to the highest (1) that lies 1 m
        inside of the fence's margin.

        acceleration, `Box(-1, 1, (3,))`: north and east in units of g · tilt limit; down, from the
        largest lift (-1) over hover (0) to the smallest (1).

        wrench, `Box(-1, 1, (4,))`: lift, from the smallest (-1) over the weight alone (0) to the
        largest (1); three torques in units of the limits. What no inner loop prevents costs the
        UAS: in each step that ends beyond a limit of the vehicle by more than the tolerance it pays
        the term violation, beyond 1.5 times the limit of speed or of tilt it is lost.

        waypoint, `Discrete(13)`: which of the 12 nearest open waypoints to fly to, in the order of
        the observation, or home (12). `infos[agent]["action_mask"]` is 1 for choices that exist;
        another choice keeps the former target or, where there is none, the place.

        An `ActionKind` of one's own: what it says.

        Finite numbers beyond ±1 are clipped. An action that is NaN, infinite, of a wrong type or
        shape, missing, or for an agent that never existed raises a ValueError and changes nothing.
        An action for an agent that has ended, or that the mission does not have, is ignored.

    Observation Space:
        A float32 `Box`, the same for all agents and all scenarios; with `mask_in_observation` a
        `Dict` of it and the mask, with `images_apart` of it and pictures. What lies beyond its
        bounds is clipped. Directions are those of the map: they do not turn with the UAS.

        {observations}

        `state()` is the whole mission in one vector, see
        `uas_coverage_env.env.episode.global_state`.

    Rewards:
        The sum of `infos[agent]["reward_terms"]`: terms times weights, and `reward_weights` changes
        the weights.

        {rewards}

    Infos:
        Numbers and arrays, each of the same kind and shape in every step. The last info of an agent
        that has ended is complete.

        {infos}
        - `reward_terms`: a dictionary
        - `action_mask`: with the waypoint action
        - `filter`: with the safety filter, a dictionary of `changed`, and of the commands `asked`
          and `applied`, each with `kind` (`CommandKind`) and four `values`

    Starting State:
        All UAS are at rest at their starts, with the charge that the scenario gives them. Only
        drawn missions and disturbances are random: `reset(seed=...)` repeats a draw, `reset()`
        draws the next one, `reset(options={"scenario": ...})` flies that scenario. Otherwise equal
        actions give equal missions.

    Episode End:
        Terminated: landed (slow and near its start, which it has left before or returns to), or
        lost (contact with an obstacle or a UAS, outside of the fence, battery overdrawn, out of
        control by its own wrench, an event).
        Truncated: still flying after `max_cycles` steps. An agent that has ended leaves `agents`; a
        UAS that lands to swap its battery pack (`[sorties]`, `together = false`) has not ended.

    Arguments:
        scenario: Name of a shipped scenario, path of a scenario file, a `Scenario` or its plain
            data. To draw a scenario at each reset: the name of a family (`generated`), a
            `MissionSource`, or any function `generator(rng) -> Scenario`.
        action: "velocity", "acceleration", "wrench", "waypoint" (v1: "planar"); or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_cycles: Time limit of the mission [steps]; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; the name of an
            observation (`default`, `local`, `grid`); None: those of the version.
        reward: Terms that the reward is made of, see `RewardTerm`; None: those of the version.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL). None: as in the version.
        render_mode: None, "rgb_array" (512 x 512 pixels) or "human" (a window, extra
            `human`: space pauses, right steps, escape closes it and the missions go on).

    Version History:
        v0: First version. After 0.3.0, wrenches beyond the vehicle's limits have a price.

        v1: Ways past obstacles are observed, velocities are fine near rest, waypoints can be passed
        over, and what is left open has a price (docs/versions.md).
    """

    metadata: ClassVar[dict[str, Any]] = {  # pyrefly: ignore[bad-override]
        "name": "uas_coverage",
        "render_modes": offered(RENDER_MODES),
        "render_fps": RENDER_FPS,
        "is_parallelizable": True,
    }

    @takes_settings
    def __init__(
        self,
        scenario: ScenarioLike = "village",
        *,
        render_mode: str | None = None,
        **settings: Unpack[MissionKeywords],
    ) -> None:
        self._missions = MissionSequence(scenario, MissionSettings.of(settings, self.version))
        self._episode = self._missions.episode
        self._screen = Screen(self._episode.scenario, render_mode)
        self.render_mode = render_mode
        self.possible_agents = list(self._missions.source.names)
        self.agents: list[str] = []
        self._begun = False
        self._index = {name: i for i, name in enumerate(self.possible_agents)}
        flown = self._episode.settings
        self._rows_alone = flown.rows_alone
        self._told: tuple[Observations, Infos] = ({}, {})
        # one object per agent: a learner seeds them one by one
        self.observation_spaces = {
            agent: observation_space(flown) for agent in self.possible_agents
        }
        self.action_spaces = {
            agent: self._episode.actions.space() for agent in self.possible_agents
        }
        self.state_space = global_space(self._missions.source.room)
        self.np_random, self.np_random_seed = seeding.np_random()

    @property
    def max_cycles(self) -> int:
        """Steps after which the episode is cut; to set it ends the mission: reset before a step."""
        return self._episode.max_steps

    @max_cycles.setter
    def max_cycles(self, steps: int) -> None:
        self._episode = self._missions.cut_after(steps)
        self._begun = False
        self.agents = []

    @property
    def scenario(self) -> Scenario:
        """The scenario flown; where it is drawn, `reset` comes first."""
        return self._missions.scenario

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The space of an agent's observations; always the same object."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The space of an agent's actions; always the same object."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, Infos]:
        """Begin a new mission.

        Args:
            seed: Seeds `np_random`, with which missions are drawn, and what disturbances draw;
                None: both go on drawing.
            options: `scenario`, a scenario, its name or its file: what to fly instead of drawing.

        Returns:
            Observations and infos of the agents that the mission has.

        Raises:
            ValueError: The mission does not fit the spaces, or is none.
        """
        if seed is not None:
            self.np_random, self.np_random_seed = seeding.np_random(seed)
        episode = self._episode = self._missions.begin(self.np_random, options, seed)
        self.agents = list(episode.names)
        self._begun = True
        if self.render_mode is not None:
            self._screen.begin(episode.scenario)
            self._screen.see(episode.positions_m)
            self._show()
        observations = dict(zip(self.agents, episode.observation, strict=True))
        rows = zip(self.agents, episode.report, episode.amounts, strict=True)
        infos = {
            agent: episode.infos.of(i, report, amounts)
            for i, (agent, report, amounts) in enumerate(rows)
        }
        self._told = ({}, {})
        return (observations, infos) if self._rows_alone else self._shown(observations, infos)

    def step(
        self, actions: Mapping[str, Any]
    ) -> tuple[Observations, dict[str, float], dict[str, bool], dict[str, bool], Infos]:
        """Fly every agent for one step.

        Args:
            actions: One action for each agent of `agents`; those of other agents are ignored.

        Returns:
            Observations, rewards, terminations, truncations and infos of the agents that acted.

        Raises:
            ValueError: An action is invalid, missing, or for an agent that never existed; names
                agent and value. Nothing has changed.
            ResetNeeded: `reset` was not called before.
        """
        if not self._begun:
            raise ResetNeeded("step() before reset(): call reset() first")
        agents, index, episode = self.agents, self._index, self._episode
        known = type(actions) is dict or isinstance(actions, Mapping)
        if not known or len(actions) != len(agents):
            self._check_agents(actions)
        if not agents:
            return {}, {}, {}, {}, {}
        accept, asked = episode.actions.accept, episode.asked_rows
        for agent in agents:
            if agent in actions:
                accept(agent, actions[agent], asked[index[agent]])
            else:
                self._check_agents(actions)
        report = episode.step()

        observation, amounts, told = episode.observation, episode.amounts, episode.infos
        over = episode.steps >= episode.max_steps
        observations: Observations = {}
        rewards: dict[str, float] = {}
        terminations: dict[str, bool] = {}
        truncations: dict[str, bool] = {}
        infos: Infos = {}
        ended = over
        # by index: to iterate over the array, or to zip, takes twice as long
        for agent in agents:
            i = index[agent]
            row, paid = report[i], amounts[i]
            flies = row[STATUS] in _IN_FLIGHT
            observations[agent] = observation[i]
            rewards[agent] = paid[REWARD]
            terminations[agent] = not flies
            truncations[agent] = over and flies
            infos[agent] = told.of(i, row, paid)
            if not flies:
                ended = True
        if ended:
            # what one that has ended was asked last must not count as its next action
            self._forget([a for a in agents if not (terminations[a] or truncations[a])])
        if self.render_mode is not None:
            self._screen.see(episode.positions_m)
            self._show()
        if not self._rows_alone:
            observations, infos = self._shown(observations, infos)
        return observations, rewards, terminations, truncations, infos

    def check_action(self, agent: str, action: Any) -> None:
        """Whether an agent could be given an action.

        Raises:
            ValueError: It could not; names agent and value.
        """
        asked = np.zeros(self._episode.actions.size)
        self._episode.actions.accept(agent, action, asked)
        if not np.isfinite(asked).all():
            raise ValueError(f"action of {agent} is {action!r}; give finite numbers")

    @property
    def brief(self) -> MissionBrief:
        """What a planner may know of the mission: `planner.reset(env.brief, seed)`."""
        return MissionBrief.of(self.scenario)

    def swarm_state(self) -> SwarmState:
        """What a planner sees now, in arrays of its own: its commands can be learned from."""
        return self._episode.swarm_state()

    def action_of(self, agent: str, command: Command, *, clip: bool = False) -> Any:
        """The action that flies a planner's command in the coming step, for imitation.

        Args:
            agent: One that flies.
            command: What a planner gives it. With actions that do not go to places, a GoTo is the
                velocity that guidance flies now.
            clip: Whether a number beyond the range of the action becomes the end of it.

        Returns:
            Of `action_space`; exact but for the rounding to float32.

        Raises:
            ValueError: No action of this kind flies the command; says why.
        """
        episode = self._episode
        return action_of(episode.actions, episode.moment(), agent, command, clip)

    def actions_of(self, commands: Mapping[str, Command], *, clip: bool = False) -> dict[str, Any]:
        """The actions that fly a planner's commands, see `action_of`: `env.step(actions)`."""
        return {agent: self.action_of(agent, each, clip=clip) for agent, each in commands.items()}

    def state(self) -> NDArray[np.float32]:
        """The whole mission as one vector of `state_space`."""
        return self._episode.global_state()

    def render(self) -> NDArray[np.uint8] | None:
        """The picture of the present state for "rgb_array"; the window for "human"."""
        if not self._begun:
            raise ResetNeeded("render() before reset(): call reset() first")
        self._screen.change(self._episode.scenario)
        return self._screen.render(self._episode.swarm_state())

    def close(self) -> None:
        """Close the window, if there is one; closing twice does no harm."""
        self._screen.close()

    def _shown(self, seen: Observations, infos: Infos) -> tuple[Observations, Infos]:
        settings, index, before = self._episode.settings, self._index, self._told
        mask_of = self._episode.infos.action_mask if settings.mask_in_observation else None
        as_shown = {
            agent: shown(settings, row, None if mask_of is None else mask_of(index[agent]))
            for agent, row in seen.items()
        }
        self._told = LastKnown(as_shown, before[0]), LastKnown(infos, before[1])
        return self._told

    def _show(self) -> None:
        if self.render_mode == "human":
            self.render()

    def _forget(self, alive: list[str]) -> None:
        self._episode.asked[:] = 0.0
        self.agents = alive

    def _check_agents(self, actions: Any) -> None:
        """Refuse actions for agents that never existed, and too few actions."""
        if not isinstance(actions, Mapping):
            raise ValueError(
                f"actions are {actions!r} of type {type(actions).__name__}; "
                f"give a mapping from agent to action"
            )
        for agent, action in actions.items():
            if agent not in self._index:
                known = ", ".join(self.possible_agents)
                raise ValueError(
                    f"action {action!r} for {agent!r}: there is no such agent: {known}"
                )
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            report = self._episode.report
            missing = [a for a in missing if report[self._index[a]][STATUS] != SWAPPING]
        if missing:
            raise ValueError(f"{missing[0]} has no action; give one for each agent that flies")
