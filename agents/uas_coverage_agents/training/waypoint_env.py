"""The waypoint task as a vectorised environment of Stable-Baselines3: a lane is a team."""

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.waypoint.layout import OBSERVATION_SIZE, K
from uas_coverage_agents.waypoint.settings import WaypointSettings
from uas_coverage_agents.waypoint.sub_environments import (
    LANES,
    begin_lanes,
    make_lanes,
    pool_legs,
    step_lanes,
)
from uas_coverage_agents.waypoint.team import (
    ENERGY,
    FILTERED,
    LEFT,
    LOST_UAS,
    NO_UAS,
    NOT_HOME,
    TIME,
)
from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.entities.state import STATE
from uas_coverage_env.env.batch.state_dict import (
    Limits,
    check_like,
    check_values,
    fields_of,
    records_of,
)
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.world.arena import ARENA

_LARGEST_SHARE_COVERED = 0.7
_MOST_DISCHARGED = 0.3
_KEPT = ("scenario", "decider", "targets", "blocked", "candidates", "legal", "observation")
_ATTEMPTS = 100


def prices_of(settings: WaypointSettings) -> NDArray[np.float64]:
    """Price of each column of an account, see `team`."""
    prices = np.zeros(LEFT + 1)
    prices[ENERGY] = settings.price_per_Wh
    prices[TIME] = settings.price_per_s
    prices[FILTERED] = settings.price_filtered
    prices[LOST_UAS] = prices[NOT_HOME] = settings.price_lost
    prices[LEFT] = settings.price_left
    return prices


class WaypointVecEnv(VecEnv):
    """Teams that fly missions; each step is the decision of one UAS of each team.

    A lane begins its next mission by itself. What mission that is follows from seed, lane and
    number of the mission alone. A mission ends by itself or with its time: nothing is truncated.

    Args:
        scenarios: What is flown; each mission draws one.
        settings: Prices, and how the missions are varied.
        n_lanes: Number of teams.
        seed: Of all that is drawn.
    """

    render_mode: str | None = None

    def __init__(
        self, scenarios: Sequence[Scenario], settings: WaypointSettings, n_lanes: int, seed: int
    ) -> None:
        self._worlds = pool_worlds(scenarios, measured_m=0.0)  # only what counts
        self._legs = pool_legs(scenarios)
        self._n_uas = ARENA.size(self._worlds.arenas, "U")
        self._n_waypoints = ARENA.size(self._worlds.arenas, "W")
        self._lanes, self._states = make_lanes(n_lanes, self._worlds)
        self._settings = settings
        self._prices = prices_of(settings)
        called = assistants(settings.return_mode, settings.safety_filter)
        self._assistants = (settings.return_mode, called)
        self._seed = seed
        self._missions = np.zeros(n_lanes, dtype=np.int64)
        self._choices = np.zeros(n_lanes, dtype=np.int64)
        super().__init__(
            n_lanes,
            gym.spaces.Box(-10.0, 10.0, (OBSERVATION_SIZE,), np.float32),
            gym.spaces.Discrete(K + 1),
        )

    def reset(self) -> NDArray[np.float32]:
        """Begin a mission in every lane."""
        self._begin(np.arange(self.num_envs))
        return self._lanes.observation.copy()

    def step_async(self, actions: NDArray[np.integer]) -> None:
        """Note the choices."""
        self._choices[:] = actions

    def step_wait(self) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], list]:
        """Fly on to the next decision in every lane.

        Raises:
            ValueError: A choice is not legal.
        """
        lanes = self._lanes
        if not lanes.legal[np.arange(self.num_envs), self._choices].all():
            raise ValueError("a choice is masked; ask `action_masks` before")
        before = lanes.account @ self._prices
        step_lanes(self._worlds, self._legs, lanes, self._states, self._choices, *self._assistants)
        rewards = (before - lanes.account @ self._prices).astype(np.float32)
        done = lanes.decider == NO_UAS
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for lane in np.flatnonzero(done):
            infos[lane] = {
                "terminal_observation": lanes.observation[lane].copy(),
                "TimeLimit.truncated": False,
                "account": lanes.account[lane].copy(),
            }
        if done.any():
            self._begin(np.flatnonzero(done))
        return lanes.observation.copy(), rewards, done, infos

    def action_masks(self) -> NDArray[np.bool_]:
        """(lanes, K + 1) which choices there are."""
        return self._lanes.legal.copy()

    def state_dict(self) -> dict[str, NDArray]:
        """All that changes, as plain arrays."""
        return fields_of(self._changing())

    def _changing(self) -> dict[str, NDArray]:
        state = {f"state.{name}": array for name, array in self._states._asdict().items()}
        lanes = {f"lanes.{name}": getattr(self._lanes, name) for name in _KEPT}
        return {**state, **lanes, "account": self._lanes.account, "missions": self._missions}

    def load_state_dict(self, state: dict[str, NDArray]) -> None:
        """Go on where `state_dict` was taken.

        Raises:
            ValueError: It is of another environment, or holds what no mission of this one can.
        """
        own = self._changing()
        check_like(state, fields_of(own))
        check_values(state, self._limits(state["lanes.scenario"]))
        for name, array in records_of(state, own).items():
            own[name][:] = array

    def _limits(self, scenario: NDArray[np.int64]) -> Limits:
        """What the indices may be of lanes that fly these scenarios."""
        s = scenario.clip(0, len(self._n_uas) - 1)
        sizes = {"S": len(self._n_uas), "U": self._n_uas[s], "W": self._n_waypoints[s]}
        longest = int(self._worlds.arenas.arrays.rules["max_steps"].max())
        of_lanes = LANES.limits(sizes, lanes=False)
        of_states = STATE.limits({"samples": longest + 1}, lanes=True)
        return {
            **{f"lanes.{name}": limits for name, limits in of_lanes.items()},
            **{f"state.{name}": limits for name, limits in of_states.items()},
            "missions": (0, np.iinfo(np.int64).max - 1),
        }

    def _begin(self, which: NDArray[np.integer]) -> None:
        """Begin missions in these lanes, in which there is something to decide."""
        for _ in range(_ATTEMPTS):
            if not len(which):
                return
            drawn = [self._draw(int(lane)) for lane in which]
            scenarios, covered, discharged = (
                np.stack(column) for column in zip(*drawn, strict=True)
            )
            begin_lanes(
                self._worlds, self._legs, self._lanes, self._states,
                which, scenarios, covered, discharged, *self._assistants,
            )  # fmt: skip
            which = which[self._lanes.decider[which] == NO_UAS]
        raise ValueError("the scenarios leave nothing to decide: take larger ones")

    def _draw(self, lane: int) -> tuple[NDArray, NDArray, NDArray]:
        """The next mission of a lane: scenario, what is covered, and lost charge."""
        rng = np.random.default_rng((self._seed, lane, int(self._missions[lane])))
        self._missions[lane] += 1
        s = int(rng.integers(len(self._n_uas)))
        covered = np.zeros(self._lanes.blocked.shape[1], dtype=np.bool_)
        discharged = np.zeros(self._lanes.targets.shape[1])
        if rng.random() < self._settings.covered_share:
            share = rng.uniform(0.0, _LARGEST_SHARE_COVERED)
            covered[:] = rng.random(len(covered)) < share
        if rng.random() < self._settings.discharged_share:
            discharged[:] = rng.uniform(0.0, _MOST_DISCHARGED, len(discharged))
        return np.array(s), covered, discharged

    def close(self) -> None:
        """Nothing is open."""

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the environment, once for each lane."""
        return [getattr(self, attr_name)] * len(list(self._get_indices(indices)))

    def has_attr(self, attr_name: str) -> bool:
        """Whether the environment has an attribute."""
        return hasattr(self, attr_name)

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Lanes have no attributes of their own."""
        raise AttributeError(
            f"{attr_name} cannot be set: environments have no attributes of their own"
        )

    def env_method(
        self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any
    ) -> list[Any]:
        """The rows of what a method of the environment gives, one for each lane."""
        rows = getattr(self, method_name)(*args, **kwargs)
        return [rows[lane] for lane in self._get_indices(indices)]

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        """Nothing is wrapped."""
        return [False] * len(list(self._get_indices(indices)))
