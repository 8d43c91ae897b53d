"""`learned-velocity`: routes as its plan, and one network that commands velocities along them."""

from types import SimpleNamespace

import numpy as np
import pytest
from tiny_trainings import untrained
from uas_coverage_agents.policy import load_policy, save_policy
from uas_coverage_agents.policy.mlp import Mlp
from uas_coverage_agents.policy.planner import PolicyPlanner
from uas_coverage_agents.policy.route_networks import RouteNetworks
from uas_coverage_agents.route.layers import layers_of
from uas_coverage_agents.route.leg_flight import AHEAD, MOST_HELD, spare_distance, steer_along
from uas_coverage_agents.route.planner import SHIPPED as LEARNED_ROUTE
from uas_coverage_agents.route.planner import LearnedRoute
from uas_coverage_agents.route.policy_runner import RouteRunner
from uas_coverage_agents.route.velocity_layout import (
    AIMED_M,
    ALONG_EAST,
    ALONG_NORTH,
    GROUPS,
    N_FRAME,
    N_VELOCITY,
    OWN,
    PLACES,
    SPARE,
    commanded,
    observe_route,
    outputs_of,
)
from uas_coverage_agents.training import velocity_learning
from uas_coverage_agents.training.learner import Told
from uas_coverage_agents.training.missions import Missions
from uas_coverage_agents.training.rounds import TrainingJob, train
from uas_coverage_agents.training.settings import settings_of
from uas_coverage_agents.training.velocity_learning import (
    DaggerRunner,
    DaggerSettings,
    VelocityLearning,
)
from uas_coverage_agents.velocity.planner import SHIPPED

from uas_coverage_env import generate_scenario, rollout
from uas_coverage_env.autopilot.control import write_command
from uas_coverage_env.autopilot.lookahead import PLENTY_M
from uas_coverage_env.entities.commands import COMMAND_DTYPE, VELOCITY
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight.metrics import coverage, energy_Wh, home
from uas_coverage_env.mission import MissionBrief, first_sight
from uas_coverage_env.vehicle.layout import VX, VY, X, Y, Z
from uas_coverage_env.world import Velocity, build_arena

NOTHING = np.zeros((0, N_VELOCITY)), np.zeros((0, 3))


@pytest.fixture(scope="module")
def town():
    return generate_scenario(seed=5, n_uas=2, n_waypoints=8, n_obstacles=2)


def _seen(arena, x, reference, targets):
    row, frame = np.zeros(N_VELOCITY), np.zeros(N_FRAME)
    observe_route(arena, 0, x, reference, targets, len(targets), row, frame)
    return row, frame


def _in_the_open(turn):
    """What is seen amid four waypoints; `turn` maps north and east to other directions."""
    scenario = generate_scenario(seed=5, n_uas=1, n_waypoints=AHEAD, n_obstacles=0)
    arena = build_arena(scenario)
    middle_m = scenario.fence.vertices_m[:, :2].mean(axis=0)
    waypoints = arena.waypoints.copy()
    for w, place_m in enumerate([(30.0, 5.0), (45.0, 30.0), (10.0, 40.0), (0.0, 0.0)]):
        waypoints[w]["position_m"][:2] = middle_m + turn @ place_m
        waypoints[w]["position_m"][2] = -12.0 - w
    x = np.zeros(14)
    x[X], x[Y] = middle_m
    x[Z] = -15.0
    velocity_mps = turn @ (6.0, -2.0)
    x[VX], x[VY] = velocity_mps
    return _seen(arena._replace(waypoints=waypoints), x, velocity_mps, np.arange(AHEAD))


@pytest.mark.parametrize(
    "turn",
    [np.array([[0.6, -0.8], [0.8, 0.6]]), np.array([[1.0, 0.0], [0.0, -1.0]])],
    ids=["turned", "mirrored"],
)
def test_what_it_sees_depends_neither_on_where_north_is_nor_on_the_left(turn):
    row, frame = _in_the_open(np.eye(2))
    other, other_frame = _in_the_open(turn)
    np.testing.assert_allclose(other, row, atol=1e-9)
    outputs = np.array([[0.7, -0.2, 0.3]])
    (here,), (there,) = (
        commanded(outputs, f[None], np.array([12.0])) for f in (frame, other_frame)
    )
    np.testing.assert_allclose(there[:2], turn @ here[:2], atol=1e-9)
    assert there[2] == pytest.approx(here[2])


def test_the_first_place_is_straight_ahead_and_the_second_on_the_positive_side():
    row, _ = _in_the_open(np.eye(2))
    places = row[OWN.size : OWN.size + PLACES.size].reshape(PLACES.repeats, PLACES.width)
    way, across = PLACES.columns.way, PLACES.columns.way + 1
    assert places[0, across] == pytest.approx(0.0, abs=1e-12)
    assert places[0, way] > 0.0
    assert places[1, across] >= 0.0
    assert sum(group.size for group in GROUPS) == N_VELOCITY


def _towards_the_fence(left_m, speed_mps=11.0):
    """An arena, and a UAS that flies north, so far from the fence; its waypoints lie there."""
    scenario = generate_scenario(seed=5, n_uas=1, n_waypoints=AHEAD, n_obstacles=0)
    arena = build_arena(scenario)
    vertices_m = scenario.fence.vertices_m
    waypoints, x = arena.waypoints.copy(), np.zeros(14)
    x[X], x[Y], x[Z] = vertices_m[:, 0].max() - left_m, vertices_m[:, 1].mean(), -14.0
    x[VX] = speed_mps
    for w in range(AHEAD):
        waypoints[w]["position_m"] = vertices_m[:, 0].max() - 2.0, x[Y] + 5.0 * w, -14.0
    return arena._replace(waypoints=waypoints), x


def test_it_sees_how_much_distance_is_left_to_brake_in():
    spare = []
    for left_m in (90.0, 45.0, 25.0, 10.0):
        arena, x = _towards_the_fence(left_m)
        row, _ = _seen(arena, x, x[[VX, VY]], np.arange(AHEAD))
        spare.append(row[SPARE])
    far, near, nearer, too_near = np.array(spare)
    assert (far == 1.0).all()
    # it can still brake now, but not after flying on for long
    assert near[0] == 1.0
    assert near[3] < 0.0
    assert too_near[0] < 0.0
    assert (np.diff([far, near, nearer, too_near], axis=0) <= 0.0).all()
    # the longer it flies on before, the less is left
    assert (np.diff(spare, axis=1)[:, [0, 1, 2, 4]] <= 0.0).all()


def test_it_sees_what_flying_along_its_way_would_leave_whatever_way_it_flies_now():
    arena, x = _towards_the_fence(5.0)
    x[[VX, VY]] = 0.0, 4.0
    row, frame = _seen(arena, x, x[[VX, VY]], np.arange(AHEAD))
    north_mps, east_mps = arena.uas[0].speed_mps * frame[[ALONG_NORTH, ALONG_EAST]]
    command = np.zeros(1, COMMAND_DTYPE)[0]
    write_command(command, VELOCITY, north_mps, east_mps, frame[AIMED_M])
    path_m = np.empty((arena.rules[0].lookahead_steps + MOST_HELD, 3))
    left = [
        spare_distance(arena, 0, x, x[[VX, VY]], command, held, -np.inf, path_m) for held in (1, 2)
    ]
    assert max(left) < PLENTY_M
    np.testing.assert_allclose(row[SPARE][-2:], np.array(left) / PLENTY_M, atol=1e-9)


@pytest.mark.parametrize("least_m", [0.0, 1.0])
def test_a_velocity_along_the_route_leaves_the_distance_that_is_asked_for(least_m):
    expert = load_policy(LEARNED_ROUTE)
    network = expert.description.network
    assert isinstance(network, RouteNetworks)
    flight = layers_of(network.flight, expert.tensors, "flight.")
    command, found = np.zeros(1, COMMAND_DTYPE)[0], 0
    for left_m in range(20, 60, 4):
        arena, x = _towards_the_fence(left_m)
        reference, path_m = x[[VX, VY]], np.empty((arena.rules[0].lookahead_steps + MOST_HELD, 3))
        if steer_along(
            arena, 0, x, reference, np.arange(AHEAD), AHEAD, flight, 2, least_m, command
        ):
            found += 1
            left = spare_distance(arena, 0, x, reference, command, 2, -np.inf, path_m)
            assert left >= least_m
    assert 0 < found < 10


def test_where_it_is_too_late_to_brake_the_expert_turns_back():
    town = generate_scenario(seed=5, n_uas=1, n_waypoints=8, n_obstacles=0)
    training = untrained()
    rng, settings = np.random.default_rng(0), DaggerSettings()
    runner = DaggerRunner(training.learned(), training.expert, 1.0, settings, rng)
    brief = MissionBrief.of(town)
    runner.reset(brief, 0)
    sight, fence_m = first_sight(brief), town.fence.vertices_m
    sight.x[0, :3] = fence_m[:, 0].max() - 4.0, fence_m[:, 1].mean(), -14.0
    sight.x[0, VX] = sight.reference_mps[0, 0] = 11.0
    command = runner.act(sight)["uas_1"]
    assert isinstance(command, Velocity)
    assert command.north_mps < 0.0


def test_outputs_are_what_they_command_and_back():
    rng = np.random.default_rng(0)
    angle = rng.uniform(0.0, 6.0, 5)
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    frames = np.column_stack([along, along[:, 1], -along[:, 0], rng.uniform(5.0, 40.0, 5)])
    outputs, speeds_mps = rng.normal(size=(5, 3)), rng.uniform(8.0, 12.0, 5)
    back = outputs_of(commanded(outputs, frames, speeds_mps), frames, speeds_mps)
    np.testing.assert_allclose(back, outputs, atol=1e-12)


def test_it_looks_straight_on_at_full_speed_before_training():
    row, frame = _in_the_open(np.eye(2))
    learned = untrained().learned()
    inputs = np.concatenate([np.zeros(learned.network.inputs - N_VELOCITY), row])
    outputs = learned.network.forward(learned.tensors, inputs)
    values = commanded(outputs[None, -3:], frame[None], np.array([12.0]))[0]
    np.testing.assert_allclose(values[:2], 12.0 * frame[:2])
    assert values[2] == frame[4]


class ByLegFlight(RouteRunner):
    """Flies what `leg_flight` chooses, without a search."""

    def _command_of(self, swarm, u):
        routes, state = self._routes, self._routes.view.state
        if (guided := routes.guided(swarm, u)) is not None:
            return guided
        targets, ahead = routes.of(u)[:AHEAD], np.full(AHEAD, -1)
        ahead[: len(targets)] = targets
        command = np.zeros(1, COMMAND_DTYPE)[0]
        if not steer_along(
            routes.view.arena, u, state.x[u], state.uas[u].reference_mps[:], ahead, len(targets),
            self._flight, 1, 0.0, command,
        ):  # fmt: skip
            return routes.onwards(u)
        north_mps, east_mps, altitude_m, _ = command["values"].tolist()
        return Velocity(north_mps, east_mps, altitude_m, routes.mode(u))


class ByLegs(LearnedRoute):
    def _make_runner(self):
        return ByLegFlight(self.policy, self.assistants, samples=8)


def test_where_the_expert_leads_its_own_flight_is_flown_and_noted(town):
    training = untrained()
    rng = np.random.default_rng(0)
    settings = DaggerSettings(samples=8, held=1, spare_m=0.0)
    runner = DaggerRunner(training.learned(), training.expert, 1.0, settings, rng)
    led = rollout(town, runner, return_mode=False, safety_filter=True)
    own = rollout(town, ByLegs(), safety_filter=True)
    np.testing.assert_allclose(led.x, own.x, atol=1e-6)
    rows, outputs = (np.concatenate(part) for part in zip(*runner.labels, strict=True))
    assert len(rows) == len(outputs) > led.steps
    assert np.abs(outputs[:, :2]).max() <= 1.0 + 1e-9


def test_each_round_and_each_training_flies_missions_of_its_own(monkeypatch):
    flown: list[int] = []
    monkeypatch.setattr(Missions, "mission", lambda self, number: flown.append(number))
    monkeypatch.setattr(VelocityLearning, "_fit", lambda *_, **__: None)
    monkeypatch.setattr(velocity_learning, "rollout", lambda *_, **__: None)
    monkeypatch.setattr(velocity_learning, "unless_stopped", lambda _: None)
    monkeypatch.setattr(
        velocity_learning, "DaggerRunner", lambda *_: SimpleNamespace(labels=[NOTHING])
    )
    for seed in (0, 1):
        for number in range(2):
            learner = untrained("rounds=2", "learning.missions_per_round=3", seed=1000 * seed)
            learner.learn(number, Told())
    assert flown == list(range(12))


def test_a_training_leaves_a_policy_that_flies_and_the_same_seed_the_same(town, tmp_path):
    small = [
        *("rounds=2", "learning.missions_per_round=1", "learning.epochs=1"),
        *("learning.last_epochs=2", "size.n_uas=[1, 1]", "size.n_waypoints=[4, 4]"),
        "size.n_obstacles=[0, 1]",
    ]
    settings = settings_of("learned-velocity", changes=small)
    weights = []
    for name in ("first", "again"):
        (policy,) = train({tmp_path / name: TrainingJob(name, settings, 3, 1)}).values()
        weights.append(policy.description.weights_sha256)
        assert policy.description.interface == "route-velocity"
        assert policy.description.score.missions == 1
        assert policy.description.training.steps > 20
        assert policy.description.scenarios.towns.n_uas == (1, 1)
        assert (tmp_path / name / "learning_curve.csv").read_text().count("\n") == 4
    assert weights[0] == weights[1]
    flight = rollout(town, PolicyPlanner(None, tmp_path / "first" / "policy"), max_steps=5)
    assert flight.steps == 5


def test_a_policy_with_another_network_or_observation_is_refused_in_one_line(tmp_path):
    policy = load_policy(SHIPPED)
    network, described = policy.description.network, policy.description
    assert isinstance(network, RouteNetworks)
    deeper = network.flight.model_copy(update={"activation": "tanh"})
    other = described.model_copy(update={"network": network.model_copy(update={"flight": deeper})})
    save_policy(tmp_path / "network", other, policy.tensors)
    with pytest.raises(InputError, match="cannot be flown: its networks do not fit"):
        PolicyPlanner(None, tmp_path / "network")
    layout = described.observation.model_copy(update={"layout": "routes_v1"})
    save_policy(
        tmp_path / "layout", described.model_copy(update={"observation": layout}), policy.tensors
    )
    with pytest.raises(InputError, match="its observation is not that of this version"):
        PolicyPlanner(None, tmp_path / "layout")
    plain = Mlp(inputs=described.observation.size, hidden=(4,), outputs=3, activation="relu")
    rng = np.random.default_rng(0)
    save_policy(
        tmp_path / "plain",
        described.model_copy(update={"network": plain}),
        {name: rng.normal(size=shape) for name, shape in plain.shapes().items()},
    )
    with pytest.raises(InputError, match="'mlp', not 'routes'"):
        PolicyPlanner(None, tmp_path / "plain")


@pytest.mark.parametrize("alone", [False, True], ids=["assisted", "alone"])
def test_it_covers_a_town_comes_home_and_takes_a_fifth_less_than_the_nearest_waypoint(town, alone):
    assistants = {"safety_filter": not alone, "return_mode": not alone}
    flight = rollout(town, "learned-velocity", **assistants)
    nearest = rollout(town, "nearest-waypoint")
    assert coverage(flight) == 1.0
    assert home(flight).all()
    assert not flight.violations
    assert energy_Wh(flight).sum() < 0.8 * energy_Wh(nearest).sum()
