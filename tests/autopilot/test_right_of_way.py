from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from small_worlds import box, meadow, waypoint

from uas_coverage_env.autopilot.right_of_way import decision_order
from uas_coverage_env.entities.commands import COMMAND_DTYPE, KIND_NAMES
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import X, Y, Z

VELOCITY = KIND_NAMES.index("velocity")
HOME_M = (100.0, 60.0, -1.0)
CORNER_M = np.array([198.0, 198.0, -30.0])
CANYON = [
    box("west", (70.0, 90.0, -49.0), (94.8, 150.0, 0.0)),
    box("east", (105.2, 90.0, -49.0), (130.0, 150.0, 0.0)),
]
"""Two walls as high as the ceiling, 10.4 m apart: no UAS passes beside another."""
OUT_OF_THE_WAY = [waypoint((5.0, 195.0, -40.0), 3.0)] * 3
"""No UAS covers them, which would call all home. Most are high: so high are routes planned."""
KEPT_M = 5.72
RESIDUE_M = 0.01
"""Braking is simulated until what is left of the motion is centimetres."""


def towards(place_m, gain):
    """Fly to a place, slower the nearer it is."""

    def command(x):
        way_m = place_m[:2] - x[:2]
        distance_m = np.hypot(*way_m)
        speed_mps = min(12.0, gain * distance_m)
        return (*(way_m / (distance_m + 1e-9) * speed_mps), -place_m[2], 0.0)

    return command


def put(world, places_m):
    """Place the UAS at rest."""
    world.reset()
    world.state.x[:, [X, Y, Z]] = places_m
    world.state.uas["departed"][:] = True


def see_home(world, wishes, n_waiting=0, max_steps=150):
    """Fly until the first UAS is home or lost.

    Args:
        world: The world.
        wishes: (state of the first UAS, index, state of the mate) -> values of its velocity.
        n_waiting: For how many steps the first UAS stays in the corner before it turns home.
        max_steps: How long it may take altogether.

    Returns:
        (contacts, smallest separation [m], how often a mate's command was changed).
    """
    state = world.state
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    contacts, apart_m, changed = 0, np.inf, 0
    for step in range(max_steps):
        if state.uas[0].status != FLYING:
            break
        commands[0] = (VELOCITY, towards(CORNER_M, 0.4)(state.x[0]), False)
        state.uas[0].returning = step >= n_waiting
        for i in range(1, len(world.names)):
            commands[i] = (VELOCITY, wishes(state.x[0], i, state.x[i]), False)
        outcome = world.step(commands)
        contacts += int((outcome["contact"] != 0).sum())
        apart_m = min(apart_m, outcome["separation_m"].min())
        changed += int(outcome["filtered"][1:].sum())
    return contacts, apart_m, changed


def assisted(scenario):
    return World(scenario, return_mode=True, safety_filter=True)


@cache
def swarm(n_uas):
    """A meadow with so many UAS, both assistants on."""
    starts_m = [HOME_M, *((20.0 * k, 20.0, -1.0) for k in range(1, n_uas))]
    return assisted(meadow(starts_m, waypoints=OUT_OF_THE_WAY))


def goalkeeper(first, _, x):
    way_m = np.array(HOME_M) - first[:3]
    return towards(first[:3] + 6.0 * way_m / np.linalg.norm(way_m), 0.4)(x)


def press(first, _, x):
    return towards(first[:3], 0.3)(x)


def siege(first, _, x):
    return towards(first[:3], 100.0)(x)


def doorstep(_, i, x):
    return towards(np.add(HOME_M, (0.0, 0.0, -3.0 * i)), 0.4)(x)


def cage(first, i, x):
    bars = [(-1, 0, 0), (0, 0, -1), (0, -1, 0), (0, 0, 1), (-0.7, -0.7, 0), (1, 0, 0), (0, 1, 0)]
    return towards(first[:3] + 6.3 * np.array(bars[i - 1]), 0.4)(x)


POLICIES = {p.__name__: p for p in (goalkeeper, press, siege, doorstep, cage)}


def around_corner(n_uas, seed=0):
    """Places near a corner of the fence, the first in it, no two nearer than is allowed."""
    rng = np.random.default_rng(seed)
    places_m = [CORNER_M]
    while len(places_m) < n_uas:
        place_m = CORNER_M - (*rng.uniform(0.0, 20.0, 2), rng.uniform(-15.0, 15.0))
        away_m = np.abs(np.array(places_m) - place_m)
        if np.maximum(np.hypot(away_m[:, 0], away_m[:, 1]), away_m[:, 2]).min() > KEPT_M:
            places_m.append(place_m)
    return np.array(places_m)


@pytest.mark.parametrize("n_uas", [2, 5, 8])
@pytest.mark.parametrize("policy", POLICIES.values(), ids=POLICIES)
def test_mates_that_try_to_keep_a_uas_from_home_do_not_succeed(policy, n_uas):
    world = swarm(n_uas)
    put(world, around_corner(n_uas))
    contacts, apart_m, changed = see_home(world, policy, n_waiting=40)
    assert world.state.uas[0].status == LANDED
    assert contacts == 0
    assert apart_m >= KEPT_M - RESIDUE_M
    assert changed > 0


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 10_000),
    n_uas=st.integers(2, 8),
    names=st.lists(st.sampled_from(sorted(POLICIES)), min_size=7, max_size=7),
)
def test_nor_does_any_mixture_of_them_from_anywhere_around_a_corner(seed, n_uas, names):
    world = swarm(n_uas)
    put(world, around_corner(n_uas, seed))
    policies = [POLICIES[name] for name in names]
    contacts, apart_m, _ = see_home(world, lambda x0, i, x: policies[i - 1](x0, i, x), n_waiting=40)
    assert world.state.uas[0].status == LANDED
    assert contacts == 0
    assert apart_m >= KEPT_M - RESIDUE_M


def test_a_uas_that_hovers_in_a_canyon_leaves_it_before_one_that_comes_home():
    world = assisted(
        meadow([HOME_M, (20.0, 20.0, -1.0)], obstacles=CANYON, waypoints=OUT_OF_THE_WAY)
    )
    put(world, [(100.0, 160.0, -3.0), (100.0, 120.0, -3.0)])
    contacts, apart_m, changed = see_home(world, lambda *_: (0.0, 0.0, 3.0, 0.0))
    assert world.state.uas[0].status == LANDED
    assert contacts == 0
    assert apart_m >= KEPT_M - RESIDUE_M
    assert changed > 0


def test_two_on_their_way_home_through_a_canyon_pass_each_other():
    world = assisted(
        meadow([HOME_M, (100.0, 180.0, -1.0)], obstacles=CANYON, waypoints=OUT_OF_THE_WAY)
    )
    put(world, [(100.0, 170.0, -10.0), (100.0, 70.0, -10.0)])
    world.state.uas["returning"][:] = True
    contacts = 0
    for _ in range(150):
        if not world.done:
            contacts += int(world.step(np.zeros(2, COMMAND_DTYPE))["contact"].any())
    assert world.state.uas["status"].tolist() == [LANDED, LANDED]
    assert contacts == 0


def hover(world, n_steps):
    """Fly for a while with commands to stay; whether the filter changed any of the mates'."""
    commands = np.zeros(len(world.names), COMMAND_DTYPE)
    commands["values"][:, 2] = -world.state.x[:, Z]
    return any(bool(world.step(commands)["filtered"][1:].any()) for _ in range(n_steps))


def test_a_mate_beside_the_way_home_is_left_in_peace_and_one_on_it_is_not():
    changed = []
    for aside_m in (0.0, 8.0):
        world = swarm(2)
        put(world, [(100.0, 160.0, -20.0), (100.0 + aside_m, 130.0, -20.0)])
        world.state.uas[0].returning = True
        changed.append(hover(world, 10))
    assert changed == [True, False]


def test_no_uas_makes_way_for_one_that_is_not_called_home():
    world = swarm(2)
    put(world, [(100.0, 160.0, -20.0), (100.0, 150.0, -20.0)])
    assert not hover(world, 10)


def test_those_on_their_way_home_decide_first_and_those_that_do_not_fly_do_not_decide():
    state = World(meadow([(20.0 * k, 20.0, -1.0) for k in range(1, 6)])).state
    state.uas["returning"][[1, 3, 4]] = True
    state.uas[1].status = LANDED
    order = np.zeros(5, np.int64)
    assert decision_order(state, order) == (4, 2)
    assert order[:4].tolist() == [3, 4, 0, 2]
