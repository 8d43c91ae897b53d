"""Velocities along routes by imitation: `uas-coverage train learned-velocity`.

`learned-route` is the expert: it builds the routes, and says in every state that the learner comes
to which velocity its `leg_flight` would choose, after simulating eighty of them. It is more
cautious than on its own, since the learner errs, and says what leads away from where it would not
have come. The learner, one network, learns to say the same without weighing anything (DAgger: Ross,
Gordon, Bagnell 2011). In the first round the expert flies, in the second either, then the learner.
Nothing here is tuned on the set `test`.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise, product
from typing import Annotated, Any, NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import nn

from uas_coverage_agents.policy import Policy, load_policy
from uas_coverage_agents.policy.description import ScenarioFamily, Training
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.layers import Layers, layers_of
from uas_coverage_agents.route.leg_flight import (
    AHEAD,
    MOST_HELD,
    spare_distance,
    steer_along,
)
from uas_coverage_agents.route.planner import SHIPPED as EXPERT
from uas_coverage_agents.route.velocity_layout import (
    AIMED_M,
    N_VELOCITY,
    OUTPUTS,
    SPARE,
    outputs_of,
    velocity_networks,
)
from uas_coverage_agents.route.velocity_runner import RouteVelocityRunner, velocity_observation
from uas_coverage_agents.training.learner import SEEDS_APART, Arrays, Learned, Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.settings import Count, LearnerSettings, own_settings
from uas_coverage_agents.training.torch_state import Modules
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.guidance import velocity_of
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.flight import Assistants, rollout
from uas_coverage_env.flight.flight import unless_stopped

_RETREATS = [
    (0.0, 0.0),
    *product((0.2, 0.4, 0.7), np.linspace(0.0, math.tau, 16, endpoint=False).tolist()),
]
"""Share of the top speed and direction of the velocities among which is chosen where it is late."""


Share = Annotated[float, Field(ge=0.0, le=1.0)]
Positive = Annotated[float, Field(gt=0.0)]


class DaggerSettings(StrictModel):
    """How long is flown and learned.

    Attributes:
        missions_per_round: Flown in each round; each round and each training flies others.
        led: Share of the steps that the expert flies, in the first rounds; later ones: none.
        asked: Share of the other steps in which it is asked; neighbouring ones say much the same.
        samples: Sets of routes that are built.
        hidden: Widths of the layers between.
        epochs: Of learning, in each round.
        last_epochs: In the last.
        batch: Steps that are learned from at once.
        rate: At which is learned at first.
        beta: Error above which the loss (smooth L1) is linear.
        near_weight: Further weight of steps in which it is late to brake: an error costs a UAS.
        held: Steps for which the expert's velocity could be flown before braking.
        spare_m: Distance that is left then, beyond what has to be kept [m].
    """

    missions_per_round: Count = 45
    led: tuple[Share, ...] = (1.0, 0.5)
    asked: Share = 0.5
    samples: Count = 8
    hidden: Annotated[tuple[Count, ...], Field(min_length=1, max_length=8)] = (104, 104)
    epochs: Count = 8
    last_epochs: Count = 40
    batch: Count = 256
    rate: Positive = 2e-3
    beta: Positive = 0.1
    near_weight: Annotated[float, Field(ge=0.0)] = 6.0
    held: Count = 2
    spare_m: float = 1.5


class ExpertLabels(NamedTuple):
    """What was seen, and the outputs that the expert would have given: (N, ...) each."""

    rows: NDArray[np.float64]
    outputs: NDArray[np.float64]


class DaggerRunner(RouteVelocityRunner):
    """Flies, and notes what it saw and what the expert would have flown there.

    Args:
        learned: Of the interface "route-velocity".
        expert: Of the interface "route".
        led: Share of the steps that the expert flies.
        settings: Of routes, and how often the expert is asked in other steps.
        rng: Draws the steps.

    Attributes:
        labels: What was noted, one for each step in which it was asked.
    """

    learned_up_to_mps = math.inf  # what is to be learned is flown in any wind

    def __init__(
        self,
        learned: Learned,
        expert: Policy,
        led: float,
        settings: DaggerSettings,
        rng: np.random.Generator,
    ) -> None:
        policy = learned.policy(
            ScenarioFamily(name="none"),
            Training(
                algorithm="in training", settings={}, seed=0, steps=0, process_s=0.0, wall_s=0.0,
                machine="",
            ),
        )  # fmt: skip
        super().__init__(policy, Assistants(), settings.samples)
        self._expert = _flight_of(expert)
        self._command = np.zeros(1, COMMAND_DTYPE)[0]
        self._led, self._settings, self._rng = led, settings, rng
        self.labels: list[ExpertLabels] = []

    def velocities(self, flown: Sequence[int]) -> NDArray[np.float64]:
        """Those of the expert, where it leads, or of the network."""
        leads, asked = self._rng.random(2) < (self._led, self._settings.asked)
        if not (leads or asked):
            return super().velocities(flown)
        labelled = np.array([self._expert_velocity(u) for u in flown])
        speeds_mps = self.routes.view.arena.uas[flown]["speed_mps"]
        outputs = outputs_of(labelled, self.frames[flown], speeds_mps)
        self.labels.append(ExpertLabels(self.rows[flown], outputs))
        return labelled if leads else super().velocities(flown)

    def _expert_velocity(self, u: int) -> list[float]:
        view, n = self.routes.view, min(len(self.routes.of(u)), AHEAD)
        x, reference = view.state.x[u], view.state.uas[u].reference_mps[:]
        # with more caution than the expert flies itself, since the learner errs
        for held, spare_m in ((self._settings.held, self._settings.spare_m), (1, 0.0)):
            if steer_along(
                view.arena, u, x, reference, self.ahead[u], n, self._expert, held, spare_m,
                self._command,
            ):  # fmt: skip
                return self._command["values"][:3].tolist()
        if self.rows[u, SPARE.start] < 0.0:
            return self._clearest(u)
        velocity = velocity_of(view.arena, view.state, u, self.routes.onwards(u))
        return [velocity.north_mps, velocity.east_mps, velocity.altitude_m]

    def _clearest(self, u: int) -> list[float]:
        """Where it is too late to brake: what leaves the most distance to spare."""
        view, command = self.routes.view, self._command
        path_m = np.empty((view.arena.rules[0]["lookahead_steps"] + MOST_HELD, 3))
        speed_mps, altitude_m = view.arena.uas[u]["speed_mps"], self.frames[u, AIMED_M]
        found_m, found = -math.inf, [0.0, 0.0, altitude_m]
        for share, angle_rad in _RETREATS:
            north_mps = share * speed_mps * math.cos(angle_rad)
            east_mps = share * speed_mps * math.sin(angle_rad)
            write_command(command, VELOCITY, north_mps, east_mps, altitude_m)
            spare_m = spare_distance(
                view.arena, u, view.state.x[u], view.state.uas[u].reference_mps, command, 1,
                -math.inf,
                path_m,
            )  # fmt: skip
            if spare_m > found_m:
                found_m, found = spare_m, [north_mps, east_mps, altitude_m]
        return found


class VelocityLearning:
    """See `Learner`: each round flies missions, and learns from all that was noted so far.

    Args:
        settings: Of the training; `[learning]` is `DaggerSettings`.
        missions: Where is flown.
        seed: Of network, samples and draws.

    Raises:
        InputError: A setting is not for this learner.
    """

    def __init__(self, settings: LearnerSettings, missions: Missions, seed: int) -> None:
        torch.manual_seed(seed)
        self._own = own_settings(settings, DaggerSettings)
        self._rounds, self._missions = settings.rounds, missions
        self._first = seed // SEEDS_APART * settings.rounds
        self._rng = np.random.default_rng(seed)
        self._network = fresh_network(self._own.hidden)
        self._modules = Modules(flight=self._network)
        self._rows = np.zeros((0, N_VELOCITY), np.float32)
        self._outputs = np.zeros((0, OUTPUTS), np.float32)
        self.expert = load_policy(EXPERT)

    @property
    def steps(self) -> int:
        """Velocities that were labelled so far."""
        return len(self._rows)

    def learn(self, number: int, told: Told) -> None:
        """Fly and note, then fit the network to all that was noted."""
        self._fly_and_note(number)
        self._fit(last=number == self._rounds - 1, told=told)

    def state_dict(self) -> Arrays:
        """The network, and what was noted."""
        noted = {"rows": self._rows, "outputs": self._outputs}
        return {**self._modules.state_dict(), **noted}

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Learner`."""
        self._modules.load_state_dict(state)
        self._rows, self._outputs = state["rows"], state["outputs"]

    def learned(self) -> Learned:
        """The network; its orders are the expert's."""
        modules = [module for module in self._network if isinstance(module, nn.Linear)]
        tensors = {n: t for n, t in self.expert.tensors.items() if not n.startswith("flight.")}
        for k, module in enumerate(modules):
            for part in ("weight", "bias"):
                array = getattr(module, part).detach().numpy().astype(np.float64)
                tensors[f"flight.layers.{k}.{part}"] = array
        network = velocity_networks(_networks_of(self.expert).order, self._own.hidden)
        return Learned("route-velocity", network, velocity_observation(), tensors)

    def _fly_and_note(self, number: int) -> None:
        """Fly the missions of a round, home without return mode."""
        own = self._own
        led = own.led[number] if number < len(own.led) else 0.0
        runner = DaggerRunner(self.learned(), self.expert, led, own, self._rng)
        first = (self._first + number) * own.missions_per_round
        for k in range(first, first + own.missions_per_round):
            # without the filter, states come up in which it would have had to help
            flight = rollout(
                self._missions.mission(k), runner, return_mode=False, safety_filter=k % 3 == 0,
                seed=k,
            )  # fmt: skip
            unless_stopped(flight)
        rows, outputs = (np.concatenate(part) for part in zip(*runner.labels, strict=True))
        self._rows = np.concatenate([self._rows, rows.astype(np.float32)])
        self._outputs = np.concatenate([self._outputs, outputs.astype(np.float32)])

    def _fit(self, *, last: bool, told: Told) -> None:
        """Fit the network to all that was noted."""
        own = self._own
        epochs = own.last_epochs if last else own.epochs
        rows, outputs = torch.from_numpy(self._rows), torch.from_numpy(self._outputs)
        urgent = 0.25 * (1.0 - rows[:, SPARE].amin(dim=1, keepdim=True))
        weight = 1.0 + own.near_weight * urgent
        optimiser = torch.optim.Adam(self._network.parameters())
        for epoch in range(epochs):
            optimiser.param_groups[0]["lr"] = own.rate * (1.01 - epoch / epochs)
            losses = []
            for batch in torch.randperm(len(rows)).split(own.batch):
                errors = nn.functional.smooth_l1_loss(
                    self._network(rows[batch]), outputs[batch], beta=own.beta, reduction="none"
                )
                optimiser.zero_grad()
                loss = (weight[batch] * errors).mean()
                loss.backward()
                optimiser.step()
                losses.append(loss.item())
            told.add(self.steps, loss=float(np.mean(losses)))


def fresh_network(hidden: tuple[int, ...]) -> nn.Sequential:
    """A network that flies straight on at full speed."""
    layers: list[nn.Module] = []
    for below, above in pairwise((N_VELOCITY, *hidden)):
        layers += [nn.Linear(below, above), nn.ReLU()]
    last = nn.Linear(hidden[-1], OUTPUTS)
    with torch.no_grad():
        last.weight.zero_()
        last.bias.copy_(torch.tensor([1.0, 0.0, 0.0]))
    return nn.Sequential(*layers, last)


def _networks_of(policy: Policy) -> RouteNetworks:
    network = policy.description.network
    if not isinstance(network, RouteNetworks):
        raise ValueError(f"network.kind is {network.kind!r}, not 'routes'")
    return network


def _flight_of(expert: Policy) -> Layers:
    return layers_of(_networks_of(expert).flight, expert.tensors, "flight.")
