"""What a UAS is told of the nearest waypoints, to the last bit as the formulas say it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from practice_grounds import practice_ground

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env import K_WAYPOINTS
from uas_coverage_env.env.actions.given import actions_of
from uas_coverage_env.env.episode.arrays import arrays_of
from uas_coverage_env.env.episode.settings import MissionSettings
from uas_coverage_env.env.observation.nearest import NO_TARGET
from uas_coverage_env.env.observation.waypoints import WAYPOINTS
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD

write = WAYPOINTS.write
N_UAS, N_WAYPOINTS = 3, 20
f4 = np.float32


@kernel
def look(arena, state, tables, learners, i, row):
    write(arena, state, tables, learners, i, row, row)


@pytest.fixture(scope="module")
def scene():
    rng = np.random.default_rng(0)
    places_m = rng.uniform((0.0, 0.0, -40.0), (200.0, 200.0, 0.0), (N_WAYPOINTS, 3))
    weights = rng.uniform(0.1, 5.0, N_WAYPOINTS)
    ground = practice_ground(
        waypoints_m=tuple(map(tuple, places_m.tolist())), weights=weights.tolist(), n_uas=N_UAS
    )
    world, setting = World(ground), MissionSettings()
    made = arrays_of(world.arena, ground, setting, actions_of(setting.kind, ground))
    made.learners.around[:] = rng.random(made.learners.around.shape)
    return ground, world, made


def near(distance_m):
    return f4(30.0) / (f4(30.0) + distance_m)


def length(dx, dy, dz=0):
    return np.sqrt(dx * dx + dy * dy + dz * dz)


def clipped(value):
    return min(max(value, f4(-1.0)), f4(1.0))


def row_of(ground, state, learners, i, w):
    """The numbers of one waypoint, one after the other."""
    place_m = np.array(ground.waypoints[w].position_m)
    uas, x = ground.uas[i], state.x
    heaviest = max(waypoint.weight for waypoint in ground.waypoints)
    dx, dy, dz = f4(place_m - x[i, :3])
    level_m, there_m = length(dx, dy), length(dx, dy, dz)
    per_m = f4(1.0) / level_m if level_m > f4(1e-6) else f4(0.0)
    home_m = length(*f4(place_m - np.array(uas.start_m)))
    others = [j for j in range(N_UAS) if j != i and state.uas["status"][j] == FLYING]
    other_m = min((length(*f4(place_m - x[j, :3])) for j in others), default=f4(np.inf))
    taken = any(learners.targets[j] == w and not state.uas["returning"][j] for j in others)
    return [
        1.0, clipped(dx * per_m), clipped(dy * per_m), near(there_m), clipped(dz * f4(1 / 20.0)),
        f4(ground.waypoints[w].weight * (1 / heaviest)), *learners.around[w], near(other_m),
        float(taken), near(home_m), (there_m, home_m),
    ]  # fmt: skip


@settings(max_examples=60, deadline=None, derandomize=True)
@given(
    seed=st.integers(0, 999),
    n=st.integers(0, K_WAYPOINTS),
    at=st.sampled_from([None, 0, N_WAYPOINTS - 1]),
    status=st.lists(st.booleans(), min_size=N_UAS, max_size=N_UAS),
)
def test_every_number_of_a_waypoint_is_that_of_the_formula(scene, seed, n, at, status):
    ground, world, made = scene
    rng = np.random.default_rng(seed)
    state, learners = world.state.copy(), made.learners
    state.x[:, :3] += rng.uniform(-60.0, 60.0, (N_UAS, 3))
    state.x[1, DOD] = rng.uniform(0.0, 1.0)
    if at is not None:  # straight above a waypoint, and one that is seen
        state.x[1, :2] = ground.waypoints[at].position_m[:2]
    state.uas["status"] = np.where(status, FLYING, FLYING + 1)
    state.uas["returning"] = rng.random(N_UAS) < 0.3
    learners.targets[:] = rng.integers(NO_TARGET, N_WAYPOINTS, N_UAS)
    seen = rng.permutation(N_WAYPOINTS)[:n]
    learners.candidates[1] = [*seen, *[-1] * (K_WAYPOINTS - n)]
    row = np.full(WAYPOINTS.size, 7.0, f4)

    look(world.arena, state, made.tables, learners, 1, row)

    told = row.reshape(K_WAYPOINTS, WAYPOINTS.width)
    uas = world.arena.uas[1]
    per_m = f4(uas.dod_per_s / (uas.speed_mps * 0.3))
    left = f4((uas.dod_max - state.x[1, DOD]) * (1.0 / 0.3))
    for w, numbers in zip(seen, told, strict=False):
        *expected, (there_m, home_m) = row_of(ground, state, learners, 1, w)
        expected.append(clipped(left - (there_m + home_m) * per_m))
        assert numbers.tolist() == [float(number) for number in expected]
    assert not told[n:].any()
