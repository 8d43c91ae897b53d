"""Velocities that point at waypoints and home: where they lead, how they are drawn, how likely."""

import numpy as np
import pytest
import torch
from torch.distributions import Categorical, Independent, MixtureSameFamily, Normal
from uas_coverage_agents.policy.actor import Actor, finely, on_straight_line
from uas_coverage_agents.training.actor import ActorCritic
from uas_coverage_agents.training.draws import drawn, likely

from uas_coverage_env.env import observation_columns
from uas_coverage_env.env.actions.velocity import SLOPE_AT_REST, _on_straight_line
from uas_coverage_env.env.versions import V1

BLOCKS = V1.observation
CANDIDATES = 12
HOME, ANYWHERE = CANDIDATES, CANDIDATES + 1


def actor(numbers=3, slope=SLOPE_AT_REST, **other):
    given = {"hidden": (6, 5), "width": 4, "rows": 3, "temperature": 0.0, "environment": {}}
    return Actor.of(BLOCKS, CANDIDATES, numbers, slope=slope, **{**given, **other})


def nothing_learned(network):
    """Tensors of which each output is the bias of a fresh network."""
    model = ActorCritic(network)
    return {
        name: np.asarray(each, float) * (name.endswith(("bias", "scale")))
        for name, each in model.tensors().items()
    }


def columns(group, feature):
    return observation_columns(group, feature, BLOCKS)


def closeness(away_m):
    return 30.0 / (30.0 + away_m)


def scene(legs, home=((1.0, 0.0), 100.0)):
    """What a UAS sees: (north, east) and length of the legs to some waypoints, and home."""
    seen = np.zeros(sum(block.size for block in BLOCKS))
    for k, (towards, away_m) in enumerate(legs):
        seen[columns("waypoints", "valid")[k]] = 1.0
        seen[columns("waypoints", "closeness")[k]] = closeness(away_m)
        seen[columns("ways", "direction")[k]] = towards
        seen[columns("ways", "leg")[k]] = seen[columns("ways", "closeness")[k]] = closeness(away_m)
    seen[columns("home", "direction")[0]], away_m = home
    seen[columns("home", "closeness")[0]] = closeness(away_m)
    return seen


def velocities(means):
    return finely(means[..., :2], SLOPE_AT_REST)


def test_each_component_flies_along_its_first_leg_and_anywhere_holds():
    network = actor()
    legs = [((0.6, 0.8), 90.0), ((0.0, -1.0), 70.0), ((-0.28, 0.96), 200.0)]
    found = network.forward(nothing_learned(network), scene(legs, ((0.8, -0.6), 300.0)))
    level = velocities(found[:, 1:])
    for k, towards in ((0, (0.6, 0.8)), (1, (0.0, -1.0)), (2, (-0.28, 0.96)), (HOME, (0.8, -0.6))):
        speed = np.hypot(*level[k])
        assert 0.2 < speed < 0.8
        np.testing.assert_allclose(level[k] / speed, towards, atol=1e-9)
    np.testing.assert_allclose(level[ANYWHERE], 0.0, atol=1e-12)


def test_the_nearer_the_slower_and_home_is_low_where_it_is_near():
    network = actor()
    tensors = nothing_learned(network)
    found = [
        network.forward(tensors, scene([], ((0.0, 1.0), away_m)))[HOME]
        for away_m in (200.0, 60.0, 40.0, 10.0, 4.0, 1.0)
    ]
    east = [velocities(each[1:])[1] for each in found]
    assert east[0] == pytest.approx(east[1])
    assert all(np.diff(east[1:]) < 0.0)
    assert 0.0 < 12.0 * east[-1] < 0.5
    height = [each[3] for each in found]
    assert height[:4] == pytest.approx([0.0] * 4, abs=1e-9)
    assert 0.0 > height[4] > height[5]
    assert height[5] < -1.0


def test_a_waypoint_that_is_not_there_is_never_pointed_at():
    network = actor()
    found = network.forward(nothing_learned(network), scene([((1.0, 0.0), 50.0)]))
    chances = np.exp(found[:, 0] - found[:, 0].max())
    assert np.flatnonzero(chances).tolist() == [0, HOME, ANYWHERE]
    assert found[0, 0] > found[HOME, 0] == found[ANYWHERE, 0]


def test_what_is_added_to_all_is_added_to_each():
    network = actor()
    tensors = nothing_learned(network)
    seen = scene([((1.0, 0.0), 50.0)])
    before = network.forward(tensors, seen)
    tensors["others.bias"][-3:] += (0.1, -0.2, 0.3)
    np.testing.assert_allclose(
        network.forward(tensors, seen) - before, np.tile((0.0, 0.1, -0.2, 0.3), (14, 1)), atol=1e-9
    )


def test_speeds_score_and_heights_of_the_scorer_are_those_of_candidates_alone():
    network = actor()
    tensors = nothing_learned(network)
    seen = scene([((1.0, 0.0), 5.0)])
    before = network.forward(tensors, seen)
    tensors["candidates.score.bias"] += (0.5, 0.0, 0.0, 0.25, 0.5)
    change = network.forward(tensors, seen) - before
    np.testing.assert_allclose(change[0], (0.5, 0.0, 0.0, 0.25 + 0.5 * 0.5), atol=1e-9)
    np.testing.assert_allclose(change[[HOME, ANYWHERE]], 0.0, atol=1e-12)
    for k, reach_m in ((1, 10.0), (2, 60.0)):
        tensors = nothing_learned(network)
        tensors["candidates.score.bias"][1:3] = 0.0
        tensors["candidates.score.bias"][k] = np.arctanh(0.5)
        north = velocities(network.forward(tensors, seen)[0, 1:])[0]
        assert north == pytest.approx(5.0 / reach_m * 0.5 * (0.1 + 0.9 * 0.25))


@pytest.mark.parametrize(("numbers", "slope"), [(3, SLOPE_AT_REST), (2, SLOPE_AT_REST), (3, 1.0)])
def test_torch_and_numpy_give_the_same_scores_and_means(numbers, slope):
    network = actor(numbers, slope)
    model = ActorCritic(network)
    with torch.no_grad():
        for each in model.parameters():
            each += 0.3 * torch.randn(each.shape, generator=torch.Generator().manual_seed(1))
    rng = np.random.default_rng(0)
    seen = rng.uniform(-1.0, 1.0, (40, network.inputs)).astype(np.float32)
    seen[:, columns("ways", "leg")] = rng.uniform(0.2, 1.0, (40, CANDIDATES, 1))
    seen[:20, columns("waypoints", "valid").min() :] = 0.0
    model.standardise(*model.read(torch.from_numpy(seen)), None)
    expected = model.outputs(*model.read(torch.from_numpy(seen))).detach().numpy()
    tensors = {name: each.astype(float) for name, each in model.tensors().items()}
    found = network.forward(tensors, seen)
    assert found.shape == (40, CANDIDATES + 2, 1 + numbers)
    assert {name: each.shape for name, each in tensors.items()} == network.shapes()
    np.testing.assert_allclose(found, expected, rtol=1e-4, atol=1e-4)
    assert (found[:20, :CANDIDATES, 0] < -1e8).all()
    assert (found[20:, :CANDIDATES, 0] > -1e8).all()


def test_what_is_near_to_hit_is_read_finely_too():
    network, seen = actor(), scene([])
    first = len(network.columns) + len(network.sharp)
    seen[columns("surroundings", "rays")[0]] = 1.0 - np.arange(10) / 20.0
    finest = network.read(seen)[first : first + 10]
    np.testing.assert_allclose(finest, np.maximum(-0.3 * np.arange(10), -1.0))
    seen[columns("surroundings", "clearance")[0]] = 0.1
    assert 0.6 in network.read(seen)[len(network.columns) : first].round(9)
    chooses = Actor.of(
        BLOCKS, 12, 15, hidden=(4,), width=4, rows=3, temperature=0.0, environment={}
    )
    assert chooses.ones == ()
    assert network.velocity == tuple(columns("own", "velocity")[0, :2])
    assert network.pointing.home == tuple(columns("home", "direction")[0])


def test_numbers_and_shares_of_the_limit_are_those_of_the_action():
    shares = np.linspace(-1.0, 1.0, 9)
    found = on_straight_line(np, shares, SLOPE_AT_REST)
    np.testing.assert_allclose(found, [_on_straight_line(s, 1.0, SLOPE_AT_REST) for s in shares])
    np.testing.assert_allclose(finely(found, SLOPE_AT_REST), shares, atol=1e-12)


def a_mixture(n=1):
    generator = torch.Generator().manual_seed(0)
    scores = torch.tensor([2.0, 1.0, -1e9]).expand(n, 3)
    return torch.cat(
        [scores[:, :, None], torch.randn(3, 3, generator=generator).expand(n, 3, 3)], 2
    )


def test_a_mixture_is_as_likely_as_torch_says():
    outputs, noise = a_mixture(5), 0.3
    actions = torch.randn(5, 3, generator=torch.Generator().manual_seed(2))
    weights = Categorical(logits=outputs[:, :, 0])
    exact = MixtureSameFamily(weights, Independent(Normal(outputs[:, :, 1:], noise), 1))
    found, entropy = likely(outputs, actions, None, noise)
    apart = found - exact.log_prob(actions)
    assert torch.allclose(apart, apart[0].expand(5), atol=1e-4)
    assert float(entropy) == pytest.approx(float(weights.entropy().mean()), abs=1e-5)


def test_a_mixture_is_drawn_by_its_scores_and_with_the_noise():
    torch.manual_seed(0)
    outputs, noise = a_mixture(20_000), 0.01
    actions, chance = drawn(outputs, None, noise)
    assert torch.equal(chance, likely(outputs, actions, None, noise)[0])
    apart = (actions[:, None] - outputs[:, :, 1:]).norm(dim=2)
    nearest = apart.argmin(1)
    share = torch.bincount(nearest, minlength=3) / len(nearest)
    wanted = torch.softmax(outputs[0, :, 0], 0)
    assert torch.allclose(share, wanted, atol=0.02)
    spread = (actions - outputs[torch.arange(len(nearest)), nearest, 1:]).std()
    assert float(spread) == pytest.approx(noise, rel=0.05)
