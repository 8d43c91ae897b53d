"""Train velocities along routes: `python -m uas_coverage_agents.training.velocity_learning OUT`.

`learned-route` is the teacher: it builds the routes, and says in every state that the pupil comes
to which velocity it would fly there, after simulating eighty of them. The pupil, one network,
learns to say the same without simulating anything (DAgger: Ross, Gordon, Bagnell 2011). In the
first round the teacher flies, in the others the pupil. Nothing here is tuned on the set `test`.
"""

import argparse
import csv
import platform
import time
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from uas_coverage_agents.policy import (
    Policy,
    PolicyDescription,
    ScenarioFamily,
    Towns,
    Training,
    load_policy,
    save_policy,
)
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.policy.tensors import Tensors
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.leg_flight import AHEAD, steer_along
from uas_coverage_agents.route.planner import SHIPPED as TEACHER
from uas_coverage_agents.route.velocity_layout import (
    N_VELOCITY,
    OUTPUTS,
    outputs_of,
    velocity_networks,
)
from uas_coverage_agents.route.velocity_runner import RouteVelocityRunner, velocity_observation
from uas_coverage_agents.training.scenarios import VALIDATION, town
from uas_coverage_agents.training.score import MEASURES, fly, score
from uas_coverage_env.autopilot import velocity_of
from uas_coverage_env.flight import Assistants, rollout
from uas_coverage_env.world import COMMAND_DTYPE

HIDDEN = (96, 96)
ROUNDS, TOWNS_PER_ROUND = 6, 40
EPOCHS, LAST_EPOCHS, BATCH, RATE = 12, 40, 256, 2e-3
TRAINING = Towns(first_seed=1_000_000, n_uas=(1, 6), n_waypoints=(20, 60), n_obstacles=(5, 20))


class Pupil(RouteVelocityRunner):
    """Flies, and notes what it saw and what the teacher would have flown there.

    Args:
        policy: Of the pupil.
        teacher: Of the interface "route".
        led: Whether the teacher's commands are flown instead.
    """

    def __init__(self, policy: Policy, teacher: Policy, *, led: bool) -> None:
        super().__init__(policy, Assistants(), samples=8)
        network = teacher.description.network
        assert isinstance(network, RouteNetworks)
        self._flight = layers_of(network.flight, teacher.tensors, "flight.")
        self._command, self._led = np.zeros(1, COMMAND_DTYPE)[0], led
        self.noted: list[tuple[NDArray[np.float64], NDArray[np.float64]]] = []

    def velocities(self, flown: Sequence[int]) -> NDArray[np.float64]:
        """Those of whoever leads."""
        taught = np.array([self._taught(u) for u in flown]).reshape(-1, 3)
        speeds_mps = self.routes.view.arena.uas[flown]["speed_mps"]
        self.noted.append((self.rows[flown], outputs_of(taught, self.frames[flown], speeds_mps)))
        return taught if self._led else super().velocities(flown)

    def _taught(self, u: int) -> tuple[float, ...]:
        view, n = self.routes.view, min(len(self.routes.of(u)), AHEAD)
        x, reference = view.state.x[u], view.state.reference[u]
        known = steer_along(
            view.arena, u, x, reference, self.ahead[u], n, self._flight, self._command
        )
        if known:
            return tuple(self._command["values"][:3].tolist())
        velocity = velocity_of(view.arena, view.state, u, self.routes.onwards(u))
        return velocity.north_mps, velocity.east_mps, velocity.altitude_m


def fresh_network() -> nn.Sequential:
    """The pupil before training: it flies straight on at full speed."""
    widths = (N_VELOCITY, *HIDDEN)
    layers: list[nn.Module] = []
    for below, above in zip(widths, widths[1:], strict=False):
        layers += [nn.Linear(below, above), nn.ReLU()]
    last = nn.Linear(widths[-1], OUTPUTS)
    with torch.no_grad():
        last.weight.zero_()
        last.bias.copy_(torch.tensor([1.0, 0.0, 0.0]))
    return nn.Sequential(*layers, last)


def tensors_of(network: nn.Sequential, teacher: Tensors) -> dict[str, NDArray[np.float64]]:
    """Those of the pupil's policy: the orders are the teacher's."""
    modules = [module for module in network if isinstance(module, nn.Linear)]
    own = {
        f"flight.layers.{k}.{part}": getattr(module, part).detach().numpy().astype(np.float64)
        for k, module in enumerate(modules)
        for part in ("weight", "bias")
    }
    return {**{n: t for n, t in teacher.items() if not n.startswith("flight.")}, **own}


def fit(network: nn.Sequential, rows: torch.Tensor, outputs: torch.Tensor, epochs: int) -> float:
    """Fit the outputs; the mean loss of the last epoch."""
    optimiser = torch.optim.Adam(network.parameters(), RATE)
    mean = 0.0
    for epoch in range(epochs):
        optimiser.param_groups[0]["lr"] = RATE * (1.01 - epoch / epochs)
        losses = []
        for batch in torch.randperm(len(rows)).split(BATCH):
            loss = nn.functional.smooth_l1_loss(network(rows[batch]), outputs[batch], beta=0.1)
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
            losses.append(loss.item())
        mean = float(np.mean(losses))
    return mean
