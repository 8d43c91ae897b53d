"""Train velocities along routes: `python -m uas_coverage_agents.training.velocity_learning OUT`.

`learned-route` is the expert: it builds the routes, and says in every state that the learner comes
to which velocity its `leg_flight` would choose, after simulating eighty of them. It is more
cautious than on its own, since the learner errs, and says what leads away from where it would not
have come. The learner, one network, learns to say the same without weighing anything (DAgger: Ross,
Gordon, Bagnell 2011). In the first round the expert flies, in the second either, then the learner.
Nothing here is tuned on the set `test`.
"""

import argparse
import math
import platform
import time
from collections.abc import Sequence
from importlib.metadata import version
from itertools import pairwise, product
from pathlib import Path
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from uas_coverage_agents.policy import Policy, PolicyDescription, load_policy, save_policy
from uas_coverage_agents.policy.description import ScenarioFamily, Towns, Training
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
from uas_coverage_agents.training import curve
from uas_coverage_agents.training.checkpoint import CurvePoint
from uas_coverage_agents.training.scenarios import town, validation_scenarios
from uas_coverage_agents.training.score import MEASURES, fly, score_of
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.guidance import velocity_of
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.flight import Assistants, rollout
from uas_coverage_env.flight.flight import unless_stopped
from uas_coverage_env.scenario import Scenario, with_disturbances
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS

CURVE_MISSIONS, SCORE_MISSIONS = 6, 40
_RETREATS = [
    (0.0, 0.0),
    *product((0.2, 0.4, 0.7), np.linspace(0.0, math.tau, 16, endpoint=False).tolist()),
]
"""Share of the top speed and direction of the velocities among which is chosen where it is late."""


class DaggerSettings(StrictModel):
    """How long is flown and learned.

    Attributes:
        towns: In which is flown; each round and each training flies others.
        levels: Of wind and wrong models that are flown in turn with still air.
        rounds: Of flying, and of learning from all that was flown so far.
        towns_per_round: How many.
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

    towns: Towns = Towns(
        first_seed=1_000_000, n_uas=(1, 6), n_waypoints=(20, 60), n_obstacles=(5, 20)
    )
    levels: tuple[str, ...] = ()
    rounds: int = 6
    towns_per_round: int = 45
    led: tuple[float, ...] = (1.0, 0.5)
    asked: float = 0.5
    samples: int = 8
    hidden: tuple[int, ...] = (104, 104)
    epochs: int = 8
    last_epochs: int = 40
    batch: int = 256
    rate: float = 2e-3
    beta: float = 0.1
    near_weight: float = 6.0
    held: int = 2
    spare_m: float = 1.5

    @property
    def family(self) -> ScenarioFamily:
        """What is trained on."""
        return ScenarioFamily(name="generated", towns=self.towns)


class ExpertLabels(NamedTuple):
    """What was seen, and the outputs that the expert would have given: (N, ...) each."""

    rows: NDArray[np.float64]
    outputs: NDArray[np.float64]


class DaggerRunner(RouteVelocityRunner):
    """Flies, and notes what it saw and what the expert would have flown there.

    Args:
        policy: Of the interface "route-velocity".
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
        policy: Policy,
        expert: Policy,
        led: float,
        settings: DaggerSettings,
        rng: np.random.Generator,
    ) -> None:
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


class VelocityTraining:
    """One training: the network, its expert, and what was noted so far.

    Args:
        seed: Of network, samples and towns.
        settings: How long is flown and learned.
    """

    def __init__(self, seed: int, settings: DaggerSettings | None = None) -> None:
        torch.set_num_threads(1)
        torch.manual_seed(seed)
        self.settings = settings or DaggerSettings()
        self.seed, self.expert = seed, load_policy(EXPERT)
        self._rng = np.random.default_rng(seed)
        self._network = fresh_network(self.settings.hidden)
        self._rows = torch.zeros((0, N_VELOCITY))
        self._outputs = torch.zeros((0, OUTPUTS))
        self._began = time.process_time(), time.monotonic()

    @property
    def steps(self) -> int:
        """Velocities that were labelled so far."""
        return len(self._rows)

    def fly_and_note(self, number: int) -> None:
        """Fly the towns of a round, home without return mode."""
        settings = self.settings
        led = settings.led[number] if number < len(settings.led) else 0.0
        runner = DaggerRunner(self.policy(), self.expert, led, settings, self._rng)
        first = (self.seed * settings.rounds + number) * settings.towns_per_round
        for k in range(first, first + settings.towns_per_round):
            # without the filter, states come up in which it would have had to help
            flight = rollout(
                mission_of(settings, k), runner, return_mode=False, safety_filter=k % 3 == 0, seed=k
            )
            unless_stopped(flight)
        rows, outputs = (np.concatenate(part) for part in zip(*runner.labels, strict=True))
        self._rows = torch.cat([self._rows, torch.tensor(rows, dtype=torch.float32)])
        self._outputs = torch.cat([self._outputs, torch.tensor(outputs, dtype=torch.float32)])

    def fit(self, number: int) -> None:
        """Fit the network to all that was noted, after a round."""
        settings = self.settings
        last = number == settings.rounds - 1
        epochs = settings.last_epochs if last else settings.epochs
        urgent = 0.25 * (1.0 - self._rows[:, SPARE].amin(dim=1, keepdim=True))
        weight = 1.0 + settings.near_weight * urgent
        optimiser = torch.optim.Adam(self._network.parameters())
        for epoch in range(epochs):
            optimiser.param_groups[0]["lr"] = settings.rate * (1.01 - epoch / epochs)
            for batch in torch.randperm(len(self._rows)).split(settings.batch):
                given = self._network(self._rows[batch])
                errors = nn.functional.smooth_l1_loss(
                    given, self._outputs[batch], beta=settings.beta, reduction="none"
                )
                optimiser.zero_grad()
                (weight[batch] * errors).mean().backward()
                optimiser.step()

    def policy(self) -> Policy:
        """What flies now; its orders are the expert's."""
        modules = [module for module in self._network if isinstance(module, nn.Linear)]
        tensors = {n: t for n, t in self.expert.tensors.items() if not n.startswith("flight.")}
        for k, module in enumerate(modules):
            for part in ("weight", "bias"):
                array = getattr(module, part).detach().numpy().astype(np.float64)
                tensors[f"flight.layers.{k}.{part}"] = array
        description = PolicyDescription(
            interface="route-velocity",
            network=velocity_networks(_networks_of(self.expert).order, self.settings.hidden),
            observation=velocity_observation(),
            scenarios=self.settings.family,
            training=Training(
                algorithm="DAgger, taught by learned-route",
                settings=self.settings.model_dump(mode="json"),
                seed=self.seed,
                steps=self.steps,
                process_s=round(time.process_time() - self._began[0], 1),
                wall_s=round(time.monotonic() - self._began[1], 1),
                machine=f"{platform.machine()}, {platform.system()}",
            ),
            versions={name: version(name) for name in ("numpy", "torch")},
        )
        return Policy(description, tensors)


def mission_of(settings: DaggerSettings, number: int) -> Scenario:
    """A town to fly in, in still air or at one of the levels, which take turns."""
    level = (None, *settings.levels)[number % (1 + len(settings.levels))]
    return with_disturbances(town(settings.towns, number), level, number)


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


def point_of(policy: Policy, towns: Sequence[Scenario]) -> CurvePoint:
    """How a policy flies some towns, with both assistants."""
    means = dict(zip(MEASURES, fly(policy, towns).mean(axis=0).tolist(), strict=True))
    training = policy.description.training
    return CurvePoint(
        steps=training.steps,
        process_s=training.process_s,
        wall_s=training.wall_s,
        **{name: mean for name, mean in means.items() if name in CurvePoint.model_fields},
    )


def _networks_of(policy: Policy) -> RouteNetworks:
    network = policy.description.network
    if not isinstance(network, RouteNetworks):
        raise ValueError(f"network.kind is {network.kind!r}, not 'routes'")
    return network


def _flight_of(expert: Policy) -> Layers:
    return layers_of(_networks_of(expert).flight, expert.tensors, "flight.")


def train(training: VelocityTraining, directory: Path, missions: int) -> None:
    """Fly, learn, and again; leaves `policy/`, `learning_curve.csv` and `.png` in the directory."""
    directory.mkdir(parents=True, exist_ok=True)
    unseen = validation_scenarios(training.settings.family, max(missions, CURVE_MISSIONS))
    points = [point_of(training.policy(), unseen[:CURVE_MISSIONS])]
    for number in range(training.settings.rounds):
        training.fly_and_note(number)
        training.fit(number)
        points.append(point_of(training.policy(), unseen[:CURVE_MISSIONS]))
        curve.write(points, directory)
        print(f"round {number + 1} of {training.settings.rounds}: {points[-1]}", flush=True)
    policy = training.policy()
    scored = score_of(fly(policy, unseen[:missions]), "generated, validation")
    described = policy.description.model_copy(update={"score": scored})
    save_policy(directory / "policy", described, policy.tensors)


def run_script(argv: Sequence[str] | None = None) -> None:
    """Train, score and save."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("out", type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--missions", type=int, default=SCORE_MISSIONS, help="it is scored on")
    parser.add_argument(
        "--levels",
        nargs="*",
        default=[],
        choices=list(DISTURBANCE_LEVELS),
        help="of wind, beside still air",
    )
    asked = parser.parse_args(argv)
    settings = DaggerSettings(levels=tuple(asked.levels))
    train(VelocityTraining(asked.seed, settings), asked.out, asked.missions)


if __name__ == "__main__":
    run_script()
