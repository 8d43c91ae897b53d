"""Ways past obstacles, found by shortcuts, are those that asking everything finds, to the bit."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from practice_grounds import box, practice_ground

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.env import K_WAYPOINTS
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.episode.arrays import arrays_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.ways import WAYS
from uas_coverage_env.scenario import Obstacle
from uas_coverage_env.simulation import World
from uas_coverage_env.world.routes import CREEP_M, crossing, line_is_clear, shortest_way

write, f4 = WAYS.write, np.float32
SIDE_M = 400.0


@kernel
def look(arena, state, tables, learners, i, row):
    write(arena, state, tables, learners, i, row, row)


@kernel
def way(arena, w, x0, y0, z0, x1, y1, z1):
    return shortest_way(arena, w, x0, y0, z0, x1, y1, z1)


@kernel
def is_clear(arena, x0, y0, z0, x1, y1, z1):
    return line_is_clear(arena, x0, y0, z0, x1, y1, z1)


def towers(n, seed):
    """Boxes on a grid, a few of them so low that they are flown over."""
    rng = np.random.default_rng(seed)
    made = []
    for k in range(n):
        middle = 60.0 + 60.0 * np.array([k % 5, k // 5]) + rng.uniform(-8.0, 8.0, 2)
        half, height = rng.uniform(3.0, 15.0, 2), 5.0 if k % 7 == 3 else 39.0
        corners = box((*(middle - half), -height), (*(middle + half), 0.0))
        made.append(Obstacle(name=f"tower_{k}", safe_distance_m=2.0, vertices_m=corners))
    return tuple(made)


@pytest.fixture(scope="module", params=[6, 25], ids=["few_corners", "many_corners"])
def scene(request):
    rng = np.random.default_rng(1)
    places_m = [(*p, -10.0) for p in rng.uniform(30.0, SIDE_M - 30.0, (40, 2)).tolist()]
    bare = practice_ground(size_m=SIDE_M, waypoints_m=tuple(places_m), n_uas=1)
    obstacles = towers(request.param, request.param)
    middles_m = [np.mean(o.vertices_m, axis=0)[:2] for o in obstacles]
    apart_m = [min(np.abs(w.position_m[:2] - m).max() for m in middles_m) for w in bare.waypoints]
    free = [w for w, m in zip(bare.waypoints, apart_m, strict=True) if m > 25.0]
    ground = bare.model_copy(update={"obstacles": obstacles, "waypoints": tuple(free)})
    setting, world = MissionSettings(version="v1"), World(ground)
    return world, arrays_of(world.arena, ground, setting, actions_of(setting.kind, ground))


def sides_of(arena, obstacle):
    rows = slice(obstacle["first_side"], obstacle["last_side"])
    return [(*n, m) for n, m in zip(arena.normals[rows, :2], arena.offsets_m[rows], strict=True)]


def asked_crossing(arena, obstacle, x0, y0, x1, y1):
    """`crossing`, side by side."""
    if max(x0, x1) < obstacle["lower_m"][0] or min(x0, x1) > obstacle["upper_m"][0]:
        return 2.0, False, False
    if max(y0, y1) < obstacle["lower_m"][1] or min(y0, y1) > obstacle["upper_m"][1]:
        return 2.0, False, False
    sides = sides_of(arena, obstacle)
    ends = [max(a * x + b * y + m for a, b, m in sides) for x, y in ((x0, y0), (x1, y1))]
    wall_m = obstacle["wall_m"]
    narrower_m = min([0.0, *(end - CREEP_M for end in ends if end > -wall_m)])
    enters, leaves = 0.0, 1.0
    for a, b, m in sides:
        d0, d1 = (a * x + b * y + (m - narrower_m) for x, y in ((x0, y0), (x1, y1)))
        if d0 >= 0.0 and d1 >= 0.0:
            enters = 2.0
            break
        if d0 >= 0.0:
            enters = max(enters, d0 / (d0 - d1))
        elif d1 >= 0.0:
            leaves = min(leaves, d0 / (d0 - d1))
    return (enters if enters < leaves else 2.0), min(ends) <= -wall_m, ends[1] <= 0.0


def hidden(arena, x0, y0, x1, y1):
    asked = [asked_crossing(arena, o, x0, y0, x1, y1) for o in arena.obstacles if o["tall"]]
    return any(at <= 1.0 and not over for at, over, _ in asked)


def asked_way(arena, w, x0, y0, z0, x1, y1, z1):
    """`shortest_way`: all corners in sight are compared."""
    dx, dy = x1 - x0, y1 - y0
    straight = x1, y1, math.sqrt(dx * dx + dy * dy)
    if not hidden(arena, x0, y0, x1, y1) or is_clear(arena, x0, y0, z0, x1, y1, z1):
        return straight
    ways = []
    for n, (north, east) in enumerate(arena.nodes_m):
        if not hidden(arena, x0, y0, north, east):
            to_m = math.sqrt((north - x0) * (north - x0) + (east - y0) * (east - y0))
            ways.append((to_m + arena.node_distance_m[w, n], n))
    length_m, n = min(ways, default=(math.inf, -1))
    if not math.isfinite(length_m):
        return straight
    north, east = arena.nodes_m[n]
    return north, east, math.hypot(north - x0, east - y0) + arena.node_distance_m[w, n]


def a_place(arena, rng):
    """Anywhere, beside or above an obstacle, or a corner itself."""
    kind = rng.integers(4)
    if kind == 0:
        o = arena.obstacles[rng.integers(len(arena.obstacles))]
        return (o["lower_m"] + rng.random(3) * (o["upper_m"] - o["lower_m"]))[:2]
    if kind == 1:
        return arena.nodes_m[rng.integers(len(arena.nodes_m))]
    return rng.uniform(0.0, SIDE_M, 2)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 9999))
def test_a_crossing_and_the_shortest_way_are_those_of_asking_every_side_and_corner(scene, seed):
    arena, rng = scene[0].arena, np.random.default_rng(seed)
    x0, y0 = a_place(arena, rng)
    w = int(rng.integers(len(arena.waypoints)))
    x1, y1 = arena.waypoints[w].position_m[:2] if rng.random() < 0.7 else a_place(arena, rng)
    if rng.random() < 0.3:  # along a side
        x1 = x0
    for obstacle in arena.obstacles:
        found = crossing(obstacle, arena.normals, arena.offsets_m, x0, y0, x1, y1)
        assert found == asked_crossing(arena, obstacle, x0, y0, x1, y1)
    z0 = -rng.uniform(1.0, 39.5)
    found = way(arena, w, x0, y0, z0, x1, y1, -10.0)
    assert found == asked_way(arena, w, x0, y0, z0, x1, y1, -10.0)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 9999), n=st.integers(0, K_WAYPOINTS))
def test_what_is_told_of_the_ways_to_the_nearest_waypoints_is_that_of_each_alone(scene, seed, n):
    (world, made), rng = scene, np.random.default_rng(seed)
    arena, state = world.arena, world.state.copy()
    state.x[0, :2], state.x[0, 2] = a_place(arena, rng), -rng.uniform(1.0, 39.5)
    seen = rng.permutation(len(arena.waypoints))[:n]
    if n and rng.random() < 0.3:  # straight above one of them
        state.x[0, :2] = arena.waypoints[seen[0]].position_m[:2]
    made.learners.candidates[0] = [*seen, *[-1] * (K_WAYPOINTS - len(seen))]
    row = np.full(WAYS.size, 7.0, f4)

    look(arena, state, made.tables, made.learners, 0, row)

    told = row.reshape(K_WAYPOINTS, WAYS.width)
    x, y, z = state.x[0, :3]
    for w, numbers in zip(seen, told, strict=False):
        north, east, way_m = way(arena, w, x, y, z, *arena.waypoints[w].position_m)
        dx, dy = north - x, east - y
        leg_m = math.sqrt(dx * dx + dy * dy)
        per_m = 1.0 / leg_m if leg_m > 1e-6 else 0.0
        close = [30.0 / (30.0 + m) for m in (way_m, leg_m)]
        expected = [min(max(d * per_m, -1.0), 1.0) for d in (dx, dy)] + close
        assert numbers.tolist() == [float(f4(number)) for number in expected]
    assert not told[len(seen) :].any()
