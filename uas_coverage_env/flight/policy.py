"""Any function from observation to action as a planner."""

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.env.api.forms import shown
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.scales import K_WAYPOINTS
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.flight.planner import Assistants
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.world import Command, SwarmState

Policy = Callable[[Any], Any]
"""From an observation of an environment to an action of it."""


def as_planner(policy: Policy, *, swarm_of: int | None = None, **settings: Any) -> "PolicyFunction":
    """A planner that flies as a policy does in an environment, to the bit.

    Args:
        policy: From an observation to an action. It is called for each UAS that flies, with what
            `CoverageParallelEnv` shows of it; or see `swarm_of`.
        swarm_of: The UAS that `CoverageSwarmEnv` has room for, where it is a policy for that: it
            is called once per step, for all of them. None: a policy of one UAS.
        **settings: Of the environment that the policy belongs to, see `MissionSettings`: the kind
            of action, the blocks of the observation, the assistants that it wants to fly with.

    Raises:
        ValueError: A setting is wrong, or `policy` cannot be called.
    """
    return PolicyFunction(policy, MissionSettings.of(settings), swarm_of)


class PolicyFunction:
    """See `as_planner`, which makes it.

    Args:
        policy: From an observation to an action.
        settings: Of the environment that it belongs to.
        swarm_of: See `as_planner`.

    Raises:
        ValueError: See `as_planner`.
    """

    is_learner = True

    def __init__(
        self, policy: Policy, settings: MissionSettings, swarm_of: int | None = None
    ) -> None:
        if not callable(policy):
            raise ValueError(f"policy is {policy!r}; give a function from observation to action")
        if swarm_of is not None and (type(swarm_of) is not int or swarm_of < 1):
            raise ValueError(f"swarm_of is {swarm_of!r}; give a whole number from 1 on, or None")
        self._policy = policy
        self._settings = settings
        self._swarm_of = swarm_of
        # what it was trained without it may need in wind
        self.assistants = Assistants(settings.return_mode or None, settings.safety_filter or None)

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile observation and action."""
        interface = MissionInterface(brief, self._settings)
        swarm = first_sight(brief)
        interface.observe(swarm)
        space = interface.actions.space()
        interface.commands({name: space.sample() for name in swarm.active})

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission; what the policy draws is its own affair.

        Raises:
            ValueError: There are more UAS than `swarm_of`.
        """
        if self._swarm_of is not None and len(brief.uas) > self._swarm_of:
            raise ValueError(
                f"it has {len(brief.uas)} UAS, and the policy is one for {self._swarm_of}"
            )
        self._interface = MissionInterface(brief, self._settings)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Ask the policy."""
        interface = self._interface
        seen = interface.observe(swarm)
        masks = interface.action_masks() if self._settings.mask_in_observation else None
        active = {i: name for i, name in enumerate(swarm.names) if name in swarm.active}
        if self._swarm_of is not None:
            rows = self._joint_rows(self._swarm_of, seen, masks)
            return interface.commands({name: rows[i] for i, name in active.items()})
        told = {
            name: shown(self._settings, seen[i], None if masks is None else masks[i])
            for i, name in active.items()
        }
        return interface.commands({name: self._policy(each) for name, each in told.items()})

    def _joint_rows(
        self, n_uas: int, seen: NDArray[np.float32], masks: NDArray[np.int8] | None
    ) -> Any:
        """The actions of all UAS; what the mission lacks is shown as `CoverageSwarmEnv` does."""
        lacking = n_uas - len(seen)
        rows = np.pad(seen, ((0, lacking), (0, 0))).ravel()
        if masks is not None:
            none = self._settings.kind.masks(np.full((lacking, K_WAYPOINTS), -1))
            masks = np.concatenate([masks, none.astype(np.int8)]).ravel()
        told = shown(self._settings, rows, masks, n_uas)
        return self._interface.actions.joint_rows(self._policy(told), n_uas)
