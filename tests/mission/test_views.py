"""What a planner sees as arrays: the world's own, as far as it may know them."""

import numpy as np
import pytest

from uas_coverage_env import MissionBrief, load_scenario
from uas_coverage_env.mission import WorldView, first_sight
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo, build_arena


@pytest.fixture(scope="module")
def village():
    return load_scenario("village")


def test_a_view_holds_the_state_of_the_world_through_a_mission(village):
    short = village.model_copy(update={"max_steps": 90})  # soon it has to return
    world, view = World(short, return_mode=True), WorldView(MissionBrief.of(short))
    departed = returning = 0
    while not world.done and world.time_s < 90.0:
        view.update(world.swarm_state())
        for name, ours, theirs in zip(world.state._fields, view.state, world.state, strict=True):
            np.testing.assert_array_equal(ours, theirs, err_msg=name)
            assert not np.shares_memory(ours, theirs)
        departed, returning = (
            departed + view.state.uas[0].departed,
            returning + view.state.uas[0].returning,
        )
        first_and_last = np.flatnonzero(world.state.uncovered)[[0, -1]].tolist()
        targets = dict(zip(world.names, first_and_last, strict=True))
        world.step({name: GoTo(targets[name]) for name in world.active})
    assert 0 < returning < departed


def test_a_view_shows_moving_obstacles_where_they_are_now_and_nothing_later(village):
    world, view = World(village), WorldView(MissionBrief.of(village))
    for obstacles in ("moving_path_m", "moving_velocity_mps"):
        assert getattr(view.arena, obstacles).shape == (1, 1, 3)
    for time_s in (0.0, 118.0, 150.0):
        world.state.step[0] = int(time_s / village.dt_s)
        view.update(world.swarm_state())
        assert view.arena.moving_path_m[0].tolist() == village.moving_positions(time_s).tolist()
        shown_mps = view.arena.moving_velocity_mps[0]
        assert shown_mps.tolist() == village.moving_velocities(time_s).tolist()


def test_what_is_seen_at_rest_before_take_off_stays_there_at_every_sample(village):
    seen = MissionBrief.of(village).as_scenario()
    arena = build_arena(seen)
    for step, (path_m, velocity_mps) in enumerate(
        zip(arena.moving_path_m, arena.moving_velocity_mps, strict=True)
    ):
        assert path_m.tolist() == seen.moving_positions(step * seen.dt_s).tolist()
        assert not velocity_mps.any()


def test_the_rest_of_the_arena_is_the_worlds(village):
    world, view = World(village), WorldView(MissionBrief.of(village))
    for name, ours, theirs in zip(world.arena._fields, view.arena, world.arena, strict=True):
        if not name.startswith("moving_"):
            np.testing.assert_array_equal(ours, theirs, err_msg=name)


def test_the_first_sight_is_what_the_world_shows_at_first(village):
    seen, shown = first_sight(MissionBrief.of(village)), World(village).swarm_state()
    for name in shown.__slots__:
        np.testing.assert_array_equal(getattr(seen, name), getattr(shown, name), err_msg=name)
