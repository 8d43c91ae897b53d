"""Routes by imitation: `uas-coverage train learned-route`.

Three stages: `trajectory` labels towns with the routes that it would fly; the order networks learn
its choices; the flight network learns from flights along those routes how long they take, and so do
the flights that it then weighs. Nothing here is tuned on the set `test`.
"""

import json
from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import torch
from numpy.typing import NDArray
from pydantic import Field
from torch import nn

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
from uas_coverage_agents.training.learner import Arrays, Learned, Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.route_flights import Samples, courses_of, flown
from uas_coverage_agents.training.route_labels import Label, label_of
from uas_coverage_agents.training.settings import Count, LearnerSettings, own_settings
from uas_coverage_agents.training.torch_state import Modules
from uas_coverage_env.files.strict_toml import InputError, StrictModel
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.planning.routing.route_time import RoutingArrays
from uas_coverage_env.planning.routing.search import arrays_of
from uas_coverage_env.scenario import Scenario

HIDDEN = 32
_NOISE_S = (0.2, 1.0)
_MOST_SAMPLES = 500_000

Rate = Annotated[float, Field(gt=0.0)]


class RouteSettings(StrictModel):
    """How much is labelled and learned.

    Attributes:
        towns: Labelled to learn from.
        validation: Labelled to see what was learned.
        order_epochs: Passes over all choices.
        order_batch: Choices of a gradient step.
        order_rate: At the start.
        flight_towns: Along whose routes is flown.
        flight_rounds: Of flying and learning; the last rounds of the training.
        flight_epochs: Passes over all samples, in each.
        flight_batch: Samples of a gradient step.
        flight_rate: At the start.
    """

    towns: Count = 250
    validation: Count = 30
    order_epochs: Count = 60
    order_batch: Count = 256
    order_rate: Rate = 2e-3
    flight_towns: Count = 80
    flight_rounds: Count = 5
    flight_epochs: Count = 12
    flight_batch: Count = 512
    flight_rate: Rate = 3e-3


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


def choices_of(
    labels: list[Label], missions: Missions
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    """All decisions of labelled towns: (N, K+1, N_ORDER), (N, K+1), (N,)."""
    room, found = route_workspace(), []
    for label in labels:
        brief = MissionBrief.of(town_of(label.number, missions))
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


class RouteLearning:
    """See `Learner`: the rounds label towns, then one learns the order, then the others fly.

    Args:
        settings: Of the training; `[learning]` is `RouteSettings`.
        missions: From which the towns are.
        seed: Of networks, samples and flights.

    Raises:
        InputError: A setting is not for this learner, or there are too few rounds.
    """

    def __init__(self, settings: LearnerSettings, missions: Missions, seed: int) -> None:
        self._own = own_settings(settings, RouteSettings)
        self._labelling = settings.rounds - 1 - self._own.flight_rounds
        if self._labelling < 1:
            raise InputError(
                f"rounds is {settings.rounds}; give {self._own.flight_rounds + 2} or more: some to "
                f"label towns, one to learn the order, {self._own.flight_rounds} to learn flying"
            )
        torch.manual_seed(seed)
        self._missions, self._rng = missions, np.random.default_rng(seed)
        self._order, self._flight = OrderNetworks(), _network(N_FLIGHT)
        with torch.no_grad():  # straight on at full speed at first
            for parameter in list(self._flight.parameters())[-2:]:
                parameter.zero_()
        self._networks = Modules(order=self._order, flight=self._flight)
        self._labels: list[Label] = []
        self._samples = Samples(np.zeros((0, N_FLIGHT), np.float32), np.zeros(0, np.float32))

    @property
    def steps(self) -> int:
        """Samples of flights, and towns, that were learned from."""
        return len(self._samples.rows) + len(self._labels)

    def learn(self, number: int, told: Told) -> None:
        """Label, learn the order, or fly and learn."""
        own = self._own
        if number < self._labelling:
            wanted = (own.towns + own.validation) * (number + 1) // self._labelling
            while len(self._labels) < wanted:
                # those of validation first: each number below zero is one of them
                town = len(self._labels) - own.validation
                self._labels.append(label_of(town, town_of(town, self._missions)))
            told.add(self.steps, towns=len(self._labels))
        elif number == self._labelling:
            self._learn_order(told)
        else:
            self._learn_flight(told)

    def state_dict(self) -> Arrays:
        """Labels, networks and samples."""
        text = json.dumps([label._asdict() for label in self._labels]).encode()
        return {
            **self._networks.state_dict(),
            "labels": np.frombuffer(text, np.uint8).copy(),
            "rows": self._samples.rows,
            "beyond_s": self._samples.beyond_s,
        }

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """See `Learner`."""
        self._networks.load_state_dict(state)
        labels = json.loads(state["labels"].tobytes())
        self._labels = [Label(**row) for row in labels]
        self._samples = Samples(state["rows"], state["beyond_s"])

    def learned(self) -> Learned:
        """The networks, for `RouteRunner`."""
        tensors = {
            **_tensors("order", self._order.order),
            **_tensors("home", self._order.home),
            **_tensors("flight", self._flight),
        }
        return Learned("route", route_networks(HIDDEN), observation(), tensors)

    def _learn_order(self, told: Told) -> None:
        """Clone the planner's choices."""
        own = self._own
        rows, legal, choice = choices_of(self._labels[own.validation :], self._missions)
        seen = choices_of(self._labels[: own.validation], self._missions)
        optimiser = torch.optim.Adam(self._order.parameters(), own.order_rate)
        for epoch in range(own.order_epochs):
            optimiser.param_groups[0]["lr"] = own.order_rate * (1.01 - epoch / own.order_epochs)
            for batch in torch.randperm(len(rows)).split(own.order_batch):
                scores = self._order(rows[batch], legal[batch])
                loss = nn.functional.cross_entropy(scores, choice[batch])
                optimiser.zero_grad()
                loss.backward()
                optimiser.step()
            with torch.no_grad():
                scores = self._order(seen[0], seen[1])
                agree = float((scores.argmax(1) == seen[2]).float().mean())
                unseen = float(nn.functional.cross_entropy(scores, seen[2]))
            told.add(epoch + 1, order_loss=unseen, order_agreement=agree)

    def _learn_flight(self, told: Told) -> None:
        """Fitted values: fly with what is known, learn how long it took."""
        own, (rows, beyond_s) = self._own, self._samples
        unseen, first = self._labels[: own.validation], self._labels[own.validation :]
        courses = courses_of(first[: own.flight_towns], self._town)
        for noise_s in _NOISE_S:
            samples, _ = flown(courses, _layers(self._flight), noise_s, self._rng)
            rows = np.concatenate([rows, samples.rows])[-_MOST_SAMPLES:]
            beyond_s = np.concatenate([beyond_s, samples.beyond_s])[-_MOST_SAMPLES:]
        self._samples = Samples(rows, beyond_s)
        _fit(self._flight, torch.tensor(rows), torch.tensor(beyond_s), own)
        courses = courses_of(unseen, self._town)
        _, share = flown(courses, _layers(self._flight), 0.0, self._rng)
        told.add(self.steps, steps_over_planned=share)

    def _town(self, label: Label) -> Scenario:
        return town_of(label.number, self._missions)


def town_of(number: int, missions: Missions) -> Scenario:
    """The town of a label: of validation where it is below zero."""
    if number >= 0:
        return missions.mission(number)
    return missions.unseen(-1 - number)[1]


def _layers(network: nn.Sequential) -> Layers:
    return layers_of(route_networks(HIDDEN).flight, _tensors("flight", network), "flight.")


def _fit(
    network: nn.Sequential, rows: torch.Tensor, beyond_s: torch.Tensor, own: RouteSettings
) -> None:
    optimiser = torch.optim.Adam(network.parameters(), own.flight_rate)
    for epoch in range(own.flight_epochs):
        optimiser.param_groups[0]["lr"] = own.flight_rate * (1.01 - epoch / own.flight_epochs)
        for batch in torch.randperm(len(rows)).split(own.flight_batch):
            loss = nn.functional.smooth_l1_loss(network(rows[batch])[:, 0], beyond_s[batch])
            optimiser.zero_grad()
            loss.backward()
            optimiser.step()
