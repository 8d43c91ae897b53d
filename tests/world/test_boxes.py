"""Boxes around obstacles: what they leave out, and many more obstacles than fit one look."""

import math

import numpy as np
import pytest

from uas_coverage_env import generate_scenario
from uas_coverage_env.compiled.kernels import inlined_kernel, kernel
from uas_coverage_env.geometry.segments import segment_clearance
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.broad_phase import (
    BLOCK,
    BOX,
    N_COLUMNS,
    obstacle_columns,
    padded,
    write_lower_bounds,
    write_meetings,
)
from uas_coverage_env.world.contacts import obstacle_clearance
from uas_coverage_env.world.routes import box_apart, line_is_clear

N_SEGMENTS = 300


@kernel
def bounds(columns, n, segment, bound_m, meets):
    x0, y0, z0, x1, y1, z1 = segment
    write_lower_bounds(columns, 0, n, x0, y0, z0, x1, y1, z1, bound_m)
    write_meetings(columns, BOX, 0, n, x0, y0, z0, x1, y1, z1, meets)


@inlined_kernel
def _both(arena, segment):
    x0, y0, z0, x1, y1, z1 = segment
    clearance_m, nearest = obstacle_clearance(arena, x0, y0, z0, x1, y1, z1)
    return clearance_m, nearest, line_is_clear(arena, x0, y0, z0, x1, y1, z1)


@kernel
def both(arena, segment):
    return _both(arena, segment)


@pytest.fixture(scope="module")
def arena():
    return build_arena(generate_scenario(17, n_obstacles=20, n_waypoints=20))


@pytest.fixture(scope="module")
def segments():
    rng = np.random.default_rng(0)
    ends = rng.uniform([-50, -50, -60], [450, 450, 5], (N_SEGMENTS, 3))
    away = rng.normal(0, 1, (N_SEGMENTS, 3)) * rng.choice([2.0, 15.0, 120.0], (N_SEGMENTS, 1))
    return [tuple(map(float, (*a, *(a + b)))) for a, b in zip(ends, away, strict=True)]


def crowded(arena, times):
    """The same obstacles several times: nothing that is asked of all of them changes."""
    obstacles = np.concatenate([arena.obstacles] * times).view(arena.obstacles.dtype)
    return arena._replace(obstacles=obstacles, obstacle_columns=obstacle_columns(obstacles))


def exact_clearances(arena, segment):
    return [
        segment_clearance(arena.normals, arena.offsets_m, o["first_face"], o["last_face"], *segment)
        for o in arena.obstacles
    ]


def test_a_lower_bound_is_never_above_the_clearance(arena, segments):
    n = arena.obstacle_columns.shape[1]
    bound_m, meets = np.zeros(n), np.zeros(n)
    bounded = 0
    for segment in segments:
        bounds(arena.obstacle_columns, n, segment, bound_m, meets)
        exact_m = np.array(exact_clearances(arena, segment))
        assert (bound_m[: len(exact_m)] <= exact_m).all()
        bounded += np.isfinite(bound_m[: len(exact_m)]).sum()
        # columns beyond the last obstacle are never near anything
        assert (bound_m[len(exact_m) :] == np.inf).all()
        assert not meets[len(exact_m) :].any()
    assert bounded > N_SEGMENTS


def test_boxes_meet_unless_they_are_apart(arena, segments):
    n = arena.obstacle_columns.shape[1]
    bound_m, meets = np.zeros(n), np.zeros(n)
    seen = set()
    for segment in segments:
        bounds(arena.obstacle_columns, n, segment, bound_m, meets)
        for obstacle, meeting in zip(arena.obstacles, meets, strict=False):
            assert bool(meeting) is not bool(box_apart(obstacle, *segment))
            seen.add(bool(meeting))
    assert seen == {True, False}


@pytest.mark.parametrize("times", [1, 4])
def test_the_clearance_is_the_least_of_all_also_of_more_obstacles_than_one_block(
    arena, segments, times
):
    many = crowded(arena, times)
    assert (len(many.obstacles) > BLOCK) == (times > 1)
    for segment in segments:
        exact_m = exact_clearances(arena, segment)
        clearance_m, nearest, clear = both(many, segment)
        assert clearance_m == min(exact_m)
        assert nearest % len(exact_m) == exact_m.index(clearance_m)
        assert clear == both(arena, segment)[2]


def test_an_obstacle_of_the_last_block_is_not_overlooked(arena, segments):
    # all but the last obstacle stand far away
    far = np.concatenate([arena.obstacles] * 4).view(arena.obstacles.dtype)[: BLOCK + 1]
    columns = obstacle_columns(far)
    columns[:, :BLOCK] = 1e9
    columns[BOX + 3 : BOX + 6, :BLOCK] = -1e9
    alone = arena._replace(obstacles=far[BLOCK:], obstacle_columns=obstacle_columns(far[BLOCK:]))
    among = arena._replace(obstacles=far, obstacle_columns=columns)
    for segment in segments:
        clearance_m, nearest, clear = both(among, segment)
        assert (clearance_m, clear) == both(alone, segment)[::2]
        assert nearest == BLOCK


def test_without_obstacles_everything_is_clear(arena, segments):
    empty = arena._replace(
        obstacles=arena.obstacles[:0], obstacle_columns=obstacle_columns(arena.obstacles[:0])
    )
    assert empty.obstacle_columns.shape == (N_COLUMNS, 0)
    assert both(empty, segments[0]) == (math.inf, -1, True)


def test_columns_come_in_sixteens():
    assert [padded(n) for n in (0, 1, 16, 17)] == [0, 16, 16, 32]
