"""Flies with a policy that chooses waypoints."""

from collections.abc import Mapping

import numpy as np

from uas_coverage_agents.policy.description import Observation
from uas_coverage_agents.policy.directory import Policy
from uas_coverage_agents.policy.pointer import Pointer
from uas_coverage_agents.waypoint.layout import (
    CANDIDATE,
    CRUISE_SHARE,
    LAYOUT,
    N_CANDIDATE,
    N_TEAM,
    OBSERVATION_SIZE,
    TEAM,
    WAY,
    K,
)
from uas_coverage_agents.waypoint.legs import legs_of
from uas_coverage_agents.waypoint.observation import NO_TARGET
from uas_coverage_agents.waypoint.scorer import best_choice, scorer_weights
from uas_coverage_agents.waypoint.search import Moment, Workspace, improve, no_plan, planned
from uas_coverage_agents.waypoint.team import NO_UAS, Choices, choose, flight_code, next_to_decide
from uas_coverage_env.autopilot.assist import assistants
from uas_coverage_env.entities.commands import COMMAND_DTYPE
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.flight import Assistants
from uas_coverage_env.mission import MissionBrief, WorldView, first_sight
from uas_coverage_env.mission.guided_flight import GuidedFlight
from uas_coverage_env.planning.around.handover import away_of
from uas_coverage_env.world import Command, GoTo, SwarmState, WorldState


def network(hidden: int, prior: float) -> Pointer:
    """The network that reads `observation()`."""
    return Pointer(
        inputs=OBSERVATION_SIZE,
        outputs=K + 1,
        team=N_TEAM,
        candidates=K,
        features=N_CANDIDATE,
        way=WAY,
        hidden=hidden,
        prior=prior,
    )


def observation() -> Observation:
    """What the policy reads."""
    return Observation.of(LAYOUT, (TEAM, CANDIDATE), {"cruise_share": CRUISE_SHARE})


_NOWHERE = np.zeros((1, 0, 3))


class WaypointRunner:
    """Every UAS chooses with the same network where to fly next; the world flies it there.

    Args:
        policy: Of the interface "waypoint".
        assistants: The assistants of the world that fly along.
        simulations: Missions simulated before a decision; 0: the network decides alone.

    Raises:
        ValueError: The policy was trained on another observation, or has another network.
    """

    def __init__(self, policy: Policy, assistants: Assistants, simulations: int = 0) -> None:
        described = policy.description
        if described.observation != observation():
            raise ValueError("its observation is not that of this version; train it anew")
        if not isinstance(described.network, Pointer):
            raise ValueError(f"network.kind is {described.network.kind!r}, not 'pointer'")
        if described.network != network(described.network.hidden, described.network.prior):
            raise ValueError("its network does not fit to its observation; train it anew")
        self._weights = scorer_weights(described.network, policy.tensors)
        self._return_mode = bool(assistants.return_mode)
        self._safety_filter = bool(assistants.safety_filter)
        self._simulations = simulations

    def warm_up(self, brief: MissionBrief) -> None:
        """Compile all that decides."""
        self.reset(brief, 0)
        self.act(first_sight(brief))

    def reset(self, brief: MissionBrief, seed: int) -> None:
        """Start a new mission; simulations draw from the seed."""
        self._view = WorldView(brief)
        self._still = self._view.arena._replace(
            moving=self._view.arena.moving[:0],
            moving_path_m=_NOWHERE,
            moving_velocity_mps=_NOWHERE,
        )
        self._legs = legs_of(self._still)
        self._guided = GuidedFlight(brief)
        n_uas, n_waypoints = len(brief.uas), len(brief.waypoints)
        self._targets = np.full(n_uas, NO_TARGET)
        self._returning = np.zeros(n_uas, dtype=np.bool_)
        self._blocked = np.zeros(n_waypoints, dtype=np.bool_)
        self._workspace = Workspace(
            state=self._view.state.copy(),
            commands=np.zeros(n_uas, dtype=COMMAND_DTYPE),
            outcome=np.zeros(n_uas, dtype=OUTCOME_DTYPE),
            choices=Choices(
                candidates=np.full(K, -1),
                legal=np.zeros(K + 1, dtype=np.bool_),
                observation=np.zeros(OBSERVATION_SIZE, dtype=np.float32),
            ),
            scores=np.zeros(K + 1),
            flight=0,
        )
        self._plan, self._trial, self._best = (no_plan(n_uas, n_waypoints) for _ in range(3))
        self._rng = np.random.default_rng(seed)

    def act(self, swarm: SwarmState) -> Mapping[str, Command]:
        """Keep the targets that are still good, and choose those that are missing."""
        self._decide(swarm)
        uas = {name: swarm.names.index(name) for name in swarm.active}
        targets = {name: int(self._targets[i]) for name, i in uas.items() if self._targets[i] >= 0}
        commands = self._guided.commands(swarm, targets, self._blocked)
        # a UAS called by return mode is also sent home here: the world may fly without it
        called = self._returning | swarm.returning
        home = [n for n, i in uas.items() if n not in targets or called[i]]
        return {**commands, **dict.fromkeys(home, GoTo(None))}

    def _decide(self, swarm: SwarmState) -> None:
        """Choose a target for every UAS that needs one now."""
        self._view.update(swarm)
        arena, state = self._view.arena, self._view.state
        state.uncovered[:] = self._guided.wanted(swarm.uncovered)
        silent = away_of(swarm)
        self._targets[silent] = NO_TARGET
        # one that takes no commands is as one on its way home, to the others and in simulations
        state.uas["returning"][:] |= self._returning | silent
        choices = self._workspace.choices
        looked_ahead = self._simulations == 0
        while True:
            i = next_to_decide(
                arena, self._legs, state, self._return_mode, self._blocked,
                self._targets, choices,
            )  # fmt: skip
            if i == NO_UAS:
                break
            choice = best_choice(
                self._weights, choices.observation, choices.legal, self._workspace.scores
            )
            if not looked_ahead:
                self._search(state)
                looked_ahead = True
            follow = planned(
                state.uncovered, self._plan, self._plan.following, i, choices.candidates,
                choices.legal,
            )  # fmt: skip
            choose(self._targets, choices.candidates, i, choice if follow < 0 else follow)
        # the world may call a UAS for a while; one that is called here lands first
        self._returning[:] |= state.uas["returning"] & ~silent & ~swarm.returning
        self._returning &= swarm.status == FLYING

    def _search(self, state: WorldState) -> None:
        """Make the plan better; the observation in the workspace is lost."""
        choices = self._workspace.choices
        kept = choices.candidates.copy(), choices.legal.copy()
        return_mode = self._return_mode
        improve(
            self._still, self._legs, self._weights, Moment(state, self._targets, self._blocked),
            return_mode, assistants(return_mode, self._safety_filter), self._plan,
            self._simulations, self._workspace._replace(flight=flight_code()), self._rng,
            self._trial, self._best,
        )  # fmt: skip
        self._plan, self._best = self._best, self._plan
        choices.candidates[:], choices.legal[:] = kept
