"""Train a route policy by imitation: `python -m uas_coverage_agents.training.route_learning OUT`.

Three steps: `trajectory` labels towns with the routes that it would fly (resumable); the order
networks learn its choices; the flight network learns from flights along those routes how long they
take, and so do the flights that it then weighs. Nothing here is tuned on the set `test`.
"""

import argparse
import csv
import platform
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from uas_coverage_agents.policy import PolicyDescription, save_policy
from uas_coverage_agents.policy.description import ScenarioFamily, Towns, Training
from uas_coverage_agents.route.fleet_routes import RouteProblems
from uas_coverage_agents.route.layers import Layers, layers_of
from uas_coverage_agents.route.layout import route_networks
from uas_coverage_agents.route.leg_flight import N_FLIGHT
from uas_coverage_agents.route.order import (
    DONE,
    IN_THE_AIR,
    N_ORDER,
    WEIGHT,
    K,
    RouteWorkspace,
    move,
    next_free,
    observe_choices,
    route_workspace,
)
from uas_coverage_agents.route.policy_runner import observation
from uas_coverage_agents.training.route_flights import courses_of, flown
from uas_coverage_agents.training.route_labels import (
    FIRST_SEED,
    N_OBSTACLES,
    N_UAS,
    N_WAYPOINTS,
    VALIDATION_SEED,
    Label,
    labelled,
    town_of,
)
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.routing.route_time import RoutingArrays
from uas_coverage_env.planning.routing.search import arrays_of

HIDDEN = 32
ORDER_EPOCHS, ORDER_BATCH, ORDER_RATE = 60, 256, 2e-3
FLIGHT_TOWNS, FLIGHT_ROUNDS, FLIGHT_EPOCHS, FLIGHT_BATCH, FLIGHT_RATE = 80, 5, 12, 512, 3e-3
NOISE_S = (0.2, 1.0)
MOST_SAMPLES = 500_000


def _network(inputs: int) -> nn.Sequential:
    return nn.Sequential(
        nn.Linear(inputs, HIDDEN), nn.ReLU(), nn.Linear(HIDDEN, HIDDEN), nn.ReLU(),
        nn.Linear(HIDDEN, 1),
    )  # fmt: skip


def _tensors(name: str, network: nn.Sequential) -> dict[str, NDArray[np.float64]]:
    state = network.state_dict()
    return {
        f"{name}.layers.{k}.{part}": state[f"{2 * k}.{part}"].numpy().astype(np.float64)
        for k in range(3)
        for part in ("weight", "bias")
    }


def _choices(
    task: RoutingArrays, unit_s: float, routes: list[list[int]], room: RouteWorkspace
) -> list[tuple[NDArray, NDArray, int]]:
    """What is read, may be chosen and was chosen, when labelled routes are built again."""
    n_uas, n_waypoints = task.first.shape
    ready_s, place = np.zeros(n_uas), np.full(n_uas, IN_THE_AIR)
    before, open_ = n_waypoints + np.arange(n_uas), np.ones(n_waypoints, np.bool_)
    left = [list(route) for route in routes]
    found = []
    while open_.any():
        u = next_free(place, ready_s)
        if u == -1 or place[u] == DONE:
            break
        observe_choices(task, unit_s, u, ready_s, place, before, open_, room)
        w = left[u].pop(0) if left[u] else -1
        where = np.flatnonzero(room.candidates == w) if w >= 0 else np.array([K])
        if len(where) and room.legal[where[0]] and room.legal.sum() > 1:
            found.append((room.rows.astype(np.float32), room.legal.copy(), int(where[0])))
        move(task, u, w, ready_s, place, before, open_)
    return found


def choices_of(labels: list[Label]) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """All decisions of labelled towns: (N, K+1, N_ORDER), (N, K+1), (N,)."""
    room, found = route_workspace(), []
    for label in labels:
        brief = MissionBrief.of(town_of(label.seed))
        swarm = first_sight(brief)
        problems, works = RouteProblems(brief), np.ones(len(brief.uas), np.bool_)
        task = arrays_of(problems.seen(swarm, works, swarm.uncovered), WEIGHT)
        found += _choices(task, problems.unit_s, label.routes, room)
    rows, legal, choice = zip(*found, strict=True)
    return (
        torch.tensor(np.array(rows)),
        torch.tensor(np.array(legal)),
        torch.tensor(np.array(choice)),
    )


class OrderNetworks(nn.Module):
    """Scores of all choices."""

    def __init__(self) -> None:
        super().__init__()
        self.order, self.home = _network(N_ORDER), _network(N_ORDER)

    def forward(self, rows: torch.Tensor, legal: torch.Tensor) -> torch.Tensor:
        """(N, K+1, N_ORDER) -> (N, K+1)."""
        scores = torch.cat([self.order(rows[:, :-1])[..., 0], self.home(rows[:, -1])], 1)
        return scores.masked_fill(~legal, -1e9)


def learn_order(
    train: list[Label], validation: list[Label], curve: list[dict[str, float]]
) -> OrderNetworks:
    """Clone the planner's choices."""
    rows, legal, choice = choices_of(train)
    seen = choices_of(validation)
    networks = OrderNetworks()
    optimiser = torch.optim.Adam(networks.parameters(), ORDER_RATE)
    for epoch in range(ORDER_EPOCHS):
        optimiser.param_groups[0]["lr"] = ORDER_RATE * (1.01 - epoch / ORDER_EPOCHS)
        for batch in torch.randperm(len(rows)).split(ORDER_BATCH):
            scores = networks(rows[batch], legal[batch])
            loss = nn.functional.cross_entropy(scores, choice[batch])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
        if epoch % 10 == 9:
            with torch.no_grad():
                scores = networks(seen[0], seen[1])
                agree = float((scores.argmax(1) == seen[2]).float().mean())
                unseen = float(nn.functional.cross_entropy(scores, seen[2]))
            curve.append({"epoch": epoch + 1, "order_loss": unseen, "order_agreement": agree})
            print(f"order, epoch {epoch + 1}: loss {unseen:.3f}, agreement {agree:.3f}", flush=True)
    return networks


def _layers(network: nn.Sequential) -> Layers:
    return layers_of(route_networks(HIDDEN).flight, _tensors("flight", network), "flight.")


def learn_flight(
    train: list[Label], validation: list[Label], seed: int, curve: list[dict[str, float]]
) -> nn.Sequential:
    """Fitted values: fly with what is known, learn how long it took, and again."""
    torch.manual_seed(seed)  # so that it does not depend on how the order was learned
    rng = np.random.default_rng(seed)
    courses, unseen = courses_of(train[:FLIGHT_TOWNS]), courses_of(validation)
    network = _network(N_FLIGHT)
    with torch.no_grad():  # straight on at full speed at first
        for parameter in list(network.parameters())[-2:]:
            parameter.zero_()
    rows, beyond_s = np.zeros((0, N_FLIGHT), np.float32), np.zeros(0, np.float32)
    for number in range(FLIGHT_ROUNDS + 1):
        _, share = flown(unseen, _layers(network), 0.0, rng)
        curve.append({"round": number, "steps_over_planned": share})
        print(f"flight, round {number}: {share:.4f} times the planned steps", flush=True)
        if number == FLIGHT_ROUNDS:
            return network
        for noise_s in NOISE_S:
            samples, _ = flown(courses, _layers(network), noise_s, rng)
            rows = np.concatenate([rows, samples.rows])[-MOST_SAMPLES:]
            beyond_s = np.concatenate([beyond_s, samples.beyond_s])[-MOST_SAMPLES:]
        _fit(network, torch.tensor(rows), torch.tensor(beyond_s))
    return network


def _fit(network: nn.Sequential, rows: torch.Tensor, beyond_s: torch.Tensor) -> None:
    optimiser = torch.optim.Adam(network.parameters(), FLIGHT_RATE)
    for epoch in range(FLIGHT_EPOCHS):
        optimiser.param_groups[0]["lr"] = FLIGHT_RATE * (1.01 - epoch / FLIGHT_EPOCHS)
        for batch in torch.randperm(len(rows)).split(FLIGHT_BATCH):
            loss = nn.functional.smooth_l1_loss(network(rows[batch])[:, 0], beyond_s[batch])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()


def run_script() -> None:
    """Label, learn, save."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("out", type=Path)
    parser.add_argument("--towns", type=int, default=250)
    parser.add_argument("--validation", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    began = time.process_time(), time.monotonic()
    torch.set_num_threads(1)
    torch.manual_seed(asked.seed)
    asked.out.mkdir(parents=True, exist_ok=True)
    validation = labelled(asked.out / "validation.json", VALIDATION_SEED, asked.validation)
    train = labelled(asked.out / "towns.json", FIRST_SEED, asked.towns)
    curve: list[dict[str, float]] = []
    order = learn_order(train, validation, curve)
    flight = learn_flight(train, validation, asked.seed, curve)
    settings = {
        name.lower(): value for name, value in globals().items()
        if name.isupper() and isinstance(value, int | float) and name not in ("K",)
    }  # fmt: skip
    description = PolicyDescription(
        interface="route",
        network=route_networks(HIDDEN),
        observation=observation(),
        scenarios=ScenarioFamily(
            name="generated",
            towns=Towns(
                first_seed=FIRST_SEED,
                n_uas=N_UAS,
                n_waypoints=N_WAYPOINTS,
                n_obstacles=N_OBSTACLES,
            ),
        ),
        training=Training(
            algorithm="imitation of trajectory",
            settings={**settings, "towns": asked.towns},
            seed=asked.seed,
            steps=0,
            process_s=round(time.process_time() - began[0], 1),
            wall_s=round(time.monotonic() - began[1], 1),
            machine=f"{platform.machine()}, {platform.system()}",
        ),
        versions={name: version(name) for name in ("numpy", "torch")},
    )
    tensors = {
        **_tensors("order", order.order),
        **_tensors("home", order.home),
        **_tensors("flight", flight),
    }
    save_policy(asked.out / "policy", description, tensors)
    names = sorted({name for row in curve for name in row})
    with (asked.out / "learning_curve.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, names)
        writer.writeheader()
        writer.writerows(curve)


if __name__ == "__main__":
    run_script()
