"""The nearest open waypoints: any number of them, whatever was seen before."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from practice_grounds import practice_ground

from uas_coverage_env.compiled.kernels import kernel, lowest_bit
from uas_coverage_env.env import K_WAYPOINTS
from uas_coverage_env.env.observation.nearest import nearest_waypoints
from uas_coverage_env.simulation import World

MANY = 140
"""Waypoints on a coarse grid: many are equally far away."""


@kernel
def find(arena, state, i, candidates):
    nearest_waypoints(arena, state, i, candidates)


@kernel
def place_of(bits):
    return lowest_bit(bits)


@pytest.fixture(scope="module")
def world():
    rng = np.random.default_rng(0)
    places_m = rng.permutation(
        [(20.0 * a, 20.0 * b, -5.0) for a in range(1, 10) for b in range(16)]
    )
    grid = [(float(x), float(20.0 + y / 2), float(z)) for x, y, z in places_m[:MANY]]
    return World(practice_ground(waypoints_m=tuple(grid), n_uas=1))


def opened(world, n, n_open, rng):
    """The world with n waypoints, of which some are open."""
    uncovered = np.zeros(n, dtype=bool)
    uncovered[rng.permutation(n)[:n_open]] = True
    columns = np.ascontiguousarray(world.arena.waypoint_columns[:, :n])
    arena = world.arena._replace(waypoint_columns=columns)
    return arena, world.state._replace(uncovered=uncovered, x=world.state.x.copy())


def sorted_from(arena, state):
    """All open waypoints in order, the first of them."""
    away_m2 = ((arena.waypoint_columns[:3].T - state.x[0, :3]) ** 2).sum(axis=1)
    open_ones = np.flatnonzero(state.uncovered)
    nearest = open_ones[np.lexsort((open_ones, away_m2[open_ones]))][:K_WAYPOINTS]
    return [*nearest, *[-1] * (K_WAYPOINTS - len(nearest))]


@settings(max_examples=200, deadline=None, derandomize=True)
@given(
    n=st.integers(1, MANY),
    n_open=st.integers(0, MANY),
    before=st.lists(st.integers(-1, MANY + 5), min_size=K_WAYPOINTS, max_size=K_WAYPOINTS),
    seed=st.integers(0, 99),
)
@example(n=63, n_open=63, before=[-1] * K_WAYPOINTS, seed=0)
@example(n=64, n_open=64, before=[*range(52, 64)], seed=1)
@example(n=126, n_open=126, before=[*range(57, 69)], seed=2)
@example(n=127, n_open=20, before=[*range(12)], seed=3)
def test_they_are_those_that_sorting_all_finds_and_of_two_equally_far_the_first(
    world, n, n_open, before, seed
):
    rng = np.random.default_rng(seed)
    arena, state = opened(world, n, n_open, rng)
    state.x[0, :3] = 20.0 * rng.integers(0, 10), 10.0 * rng.integers(0, 20), -5.0
    # nothing twice but -1
    candidates = np.array([w if w not in before[:c] else -1 for c, w in enumerate(before)])

    find(arena, state, 0, candidates)

    assert candidates.tolist() == sorted_from(arena, state)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(
    n=st.integers(10, MANY),
    step_m=st.sampled_from([0.0, 0.1, 1.0, 5.0, 10.0, 60.0]),
    exact=st.booleans(),
    n_covered=st.sampled_from([0, 0, 0, 1, 5]),
    seed=st.integers(0, 999),
)
def test_a_uas_on_its_way_keeps_them_in_order(world, n, step_m, exact, n_covered, seed):
    rng = np.random.default_rng(seed)
    arena, state = opened(world, n, rng.integers(K_WAYPOINTS - 2, n + 1), rng)
    state.x[0, :3] = 20.0 * rng.integers(1, 9), 10.0 * rng.integers(1, 19), -5.0
    if not exact:  # from the places above many are equally far away
        state.x[0, :3] += rng.uniform(-10.0, 10.0, 3)
    candidates = np.full(K_WAYPOINTS, -1)
    find(arena, state, 0, candidates)
    for _ in range(10):
        state.x[0, :2] += step_m * rng.choice([-1.0, 0.0, 1.0], 2)
        state.uncovered[rng.choice(candidates, n_covered)] = False

        find(arena, state, 0, candidates)

        assert candidates.tolist() == sorted_from(arena, state)


@pytest.mark.parametrize("place", [0, 1, 31, 32, 62])
def test_the_lowest_bit_that_is_set_is_found(place):
    for bits in (1 << place, (1 << 62) | (1 << place)):
        assert place_of(bits) == place
