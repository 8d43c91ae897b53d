"""`make_vec` is what `SyncVectorEnv` over single environments is, only in one compiled call."""

import pickle
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded
from gymnasium.vector import AutoresetMode, SyncVectorEnv, VectorEnv
from practice_grounds import practice_ground

import uas_coverage_env  # noqa: F401  it registers the ids
from uas_coverage_env.entities.state import ABSENT
from uas_coverage_env.env import CoverageSwarmEnv, CoverageVectorEnv
from uas_coverage_env.env.rendering.screen import Screen
from uas_coverage_env.env.rewards.terms import REWARD_TERMS

ID = "UASCoverage-v0"
GROUND = practice_ground(tower=True, n_moving=1, max_steps=25)
MIXED = [practice_ground(n_uas=n, max_steps=20) for n in (1, 3)]


def make(num_envs=3, **settings) -> Any:
    settings.setdefault("scenario", GROUND)
    return gymnasium.make_vec(
        ID, num_envs=num_envs, vectorization_mode="vector_entry_point", **settings
    )


def in_turn(num_envs=3, autoreset_mode=AutoresetMode.NEXT_STEP, **settings):
    settings.setdefault("scenario", GROUND)
    return SyncVectorEnv(
        [lambda: CoverageSwarmEnv(**settings)] * num_envs, autoreset_mode=autoreset_mode
    )


def assert_same_infos(infos, expected):
    """All that the single environments tell of the swarm is told, with equal masks."""
    for name in ("covered", "energy_Wh", "action_mask"):
        assert (name in infos) == (name in expected)
        if name in infos:
            np.testing.assert_array_equal(infos[name], expected[name])
            np.testing.assert_array_equal(infos[f"_{name}"], expected[f"_{name}"])
    for term in REWARD_TERMS:
        mine, its = infos["reward_terms"][term], expected["reward_terms"][term]
        np.testing.assert_allclose(mine, its, rtol=0, atol=1e-12)
        np.testing.assert_array_equal(infos["reward_terms"][f"_{term}"], infos["_reward_terms"])
    for i, info in enumerate(expected["uas"].values()):
        if isinstance(info, np.ndarray):
            continue
        for lane in np.flatnonzero(info["_status"]):
            for name in ("status", "contact", "contact_with", "limits_exceeded", "returning"):
                assert infos[name][lane, i // 2] == info[name][lane]


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("action", ["velocity", "waypoint"])
def test_it_is_a_sync_vector_env_bit_for_bit(action, mode):
    settings = {"action": action, "autoreset_mode": mode, "max_cycles": 12}
    env, twin = make(**settings), in_turn(**settings)
    assert env.metadata["autoreset_mode"] == env.autoreset_mode == mode
    assert isinstance(env, VectorEnv)
    for space in ("single_observation_space", "observation_space", "single_action_space"):
        assert getattr(env, space) == getattr(twin, space)
    assert env.action_space == twin.action_space
    observation, infos = env.reset(seed=7)
    expected, expected_infos = twin.reset(seed=7)
    np.testing.assert_array_equal(observation, expected)
    assert_same_infos(infos, expected_infos)
    env.action_space.seed(1)
    ends = 0
    for _ in range(40):
        actions = env.action_space.sample()
        results, expected = env.step(actions), twin.step(actions)
        np.testing.assert_array_equal(results[0], expected[0])
        np.testing.assert_allclose(results[1], expected[1], rtol=0, atol=1e-12)
        for mine, its in zip(results[:4], expected[:4], strict=True):
            assert mine.dtype == its.dtype
            assert mine.shape == its.shape
        np.testing.assert_array_equal(results[2], expected[2])
        np.testing.assert_array_equal(results[3], expected[3])
        infos, expected_infos = results[4], expected[4]
        assert_same_infos(infos, expected_infos)
        ended = results[2] | results[3]
        ends += int(ended.sum())
        assert ("final_obs" in infos) == ("final_obs" in expected_infos)
        if "final_obs" in infos:
            np.testing.assert_array_equal(infos["_final_obs"], ended)
            assert_same_infos(infos["final_info"], expected_infos["final_info"])
            for mine, its in zip(infos["final_obs"], expected_infos["final_obs"], strict=True):
                assert (mine is None) == (its is None)
                if mine is not None:
                    np.testing.assert_array_equal(mine, its)
        if mode == AutoresetMode.DISABLED and ended.any():
            observation, infos = env.reset(options={"reset_mask": ended})
            expected, expected_infos = twin.reset(options={"reset_mask": ended})
            np.testing.assert_array_equal(observation, expected)
            assert_same_infos(infos, expected_infos)
    assert ends >= 6


def test_a_mission_that_has_ended_waits_for_its_reset_where_autoreset_is_disabled():
    env = make(autoreset_mode="Disabled", max_cycles=1)
    env.reset()
    _, _, _, truncated, _ = env.step(env.action_space.sample())
    assert truncated.all()
    with pytest.raises(ResetNeeded, match="environment 0"):
        env.step(env.action_space.sample())
    env.reset(options={"reset_mask": np.array([True, False, False])})
    with pytest.raises(ResetNeeded, match="environment 1"):
        env.step(env.action_space.sample())


def test_seeds_draw_the_scenarios_of_their_own_lanes():
    env = make(8, scenario=MIXED)
    first = env.reset(seed=11)[1]["scenario"]
    assert set(first) == {0, 1}
    np.testing.assert_array_equal(env.reset(seed=list(range(11, 19)))[1]["scenario"], first)
    np.testing.assert_array_equal(make(3, scenario=MIXED).reset(seed=13)[1]["scenario"], first[2:5])
    draws = {tuple(env.reset()[1]["scenario"]) for _ in range(6)}
    assert len(draws) > 1
    env.reset(seed=11)
    kept = env.reset(seed=[None, *range(12, 19)])[1]["scenario"]
    np.testing.assert_array_equal(kept[1:], first[1:])


def test_scenarios_of_different_fleets_share_the_spaces_of_the_largest():
    env = make(2, scenario=MIXED)
    observation, infos = env.reset(options={"scenario": np.array([0, 1])})
    size = observation.shape[1] // 3
    assert env.single_action_space.shape == (9,)
    np.testing.assert_array_equal(infos["status"], [[0, ABSENT, ABSENT], [0, 0, 0]])
    alone = CoverageSwarmEnv(MIXED[0])
    np.testing.assert_array_equal(observation[0, :size], alone.reset()[0])
    rng = np.random.default_rng(0)
    for _ in range(10):
        actions = rng.uniform(-1, 1, (2, 9)).astype(np.float32)
        observation, rewards, *_ = env.step(actions)
        expected, reward, *_ = alone.step(actions[0, :3])
        np.testing.assert_array_equal(observation[0, :size], expected)
        assert rewards[0] == pytest.approx(reward, abs=1e-12)
        assert not observation[0, size:].any()
        assert env.observation_space.contains(observation)


def test_observations_stay_as_they_were_unless_copies_are_spared():
    for copy in (True, False):
        env = make(2, copy=copy)
        kept = env.reset()[0]
        as_it_was = kept.copy()
        for _ in range(2):
            env.step(env.action_space.sample())
        assert np.array_equal(kept, as_it_was) == copy


def flown(env, singles, steps=6, watch=None):
    """Fly both with the same actions; waypoints are covered and paths drawn on the way."""
    env.reset(seed=0)
    for single in singles:
        single.reset()
    rng = np.random.default_rng(1)
    for _ in range(steps):
        actions = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        env.step(actions)
        for single, action in zip(singles, actions, strict=True):
            single.step(action[: single.action_space.shape[0]])
        if watch is not None:
            watch()


def test_pictures_show_every_mission_as_it_is_shown_alone():
    env = make(2, scenario=MIXED, render_mode="rgb_array")
    env.reset(seed=0)
    singles = [
        CoverageSwarmEnv(scenario, render_mode="rgb_array") for scenario in env.get_attr("scenario")
    ]
    flown(env, singles)
    pictures = env.render()
    assert isinstance(pictures, tuple), "as Gymnasium's wrappers expect"
    for picture, single in zip(pictures, singles, strict=True):
        np.testing.assert_array_equal(picture, single.render())


@pytest.mark.parametrize(
    ("num_envs", "rows", "columns", "size_px"),
    [(1, 1, 1, 512), (2, 1, 2, 512), (3, 2, 2, 512), (5, 2, 3, 341), (16, 4, 4, 256)],
)
def test_a_tile_is_the_picture_of_its_mission(num_envs, rows, columns, size_px):
    env = make(num_envs, render_mode="rgb_array_tiled")
    singles = [CoverageSwarmEnv(GROUND, render_mode="rgb_array") for _ in range(num_envs)]
    screens = [Screen(GROUND, "rgb_array", size_px=size_px) for _ in singles]

    def watch():
        for screen, single in zip(screens, singles, strict=True):
            screen.see(single.swarm_state().x[:, :3])

    watch()
    flown(env, singles, steps=3, watch=watch)
    picture = env.render()
    assert picture.shape == (rows * size_px, columns * size_px, 3)
    tiles = picture.reshape(rows, size_px, columns, size_px, 3).swapaxes(1, 2)
    tiles = tiles.reshape(rows * columns, size_px, size_px, 3)
    for tile, screen, single in zip(tiles, screens, singles, strict=False):
        np.testing.assert_array_equal(tile, screen.render(single.swarm_state()))
    assert all((tile == tile[0, 0]).all() for tile in tiles[num_envs:]), "the rest is paper"


def test_tiles_show_the_first_sixteen_missions_through_new_starts():
    env = make(20, scenario=MIXED, max_cycles=3, render_mode="rgb_array_tiled")
    alone = make(16, scenario=MIXED, max_cycles=3, render_mode="rgb_array_tiled")
    for some in (env, alone):
        some.reset(seed=4)
    rng = np.random.default_rng(0)
    for _ in range(8):
        actions = rng.uniform(-1, 1, env.action_space.shape).astype(np.float32)
        env.step(actions)
        alone.step(actions[:16])
        np.testing.assert_array_equal(env.render(), alone.render())
    assert env.render().shape == (1024, 1024, 3)
    twin = pickle.loads(pickle.dumps(env))
    np.testing.assert_array_equal(twin.render(), env.render())


def test_a_window_shows_the_tiles(monkeypatch):
    pygame = pytest.importorskip("pygame")
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    env = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=4,
        vectorization_mode="vector_entry_point",
        scenario=GROUND,
        render_mode="human",
    )
    env.reset()
    env.step(env.action_space.sample())
    assert env.render() is None
    assert pygame.display.get_surface().get_size() == (1024, 1024)
    env.close()
    env.close()
    assert pygame.display.get_surface() is None


def test_a_render_mode_that_there_is_not_is_refused():
    with pytest.raises(ValueError, match="human, rgb_array, rgb_array_tiled"):
        make(render_mode="ansi")


def test_nothing_can_be_rendered_before_the_first_reset():
    with pytest.raises(ResetNeeded):
        make(render_mode="rgb_array").render()
    assert make().render() is None


def test_attributes_are_asked_of_every_mission():
    env = make(2, scenario=MIXED, action="waypoint")
    env.reset(options={"scenario": np.array([1, 0])})
    assert [len(scenario.uas) for scenario in env.get_attr("scenario")] == [3, 1]
    assert env.call("action_masks")[0].shape == (3 * 13,)
    assert [len(state.names) for state in env.call("swarm_state")] == [3, 1]
    env.set_attr("note", ["a", "b"])
    assert env.get_attr("note") == ("a", "b")
    with pytest.raises(ValueError, match="shared"):
        env.set_attr("num_envs", 3)
    with pytest.raises(ValueError, match="1 values"):
        env.set_attr("note", ["a"])
    with pytest.raises(AttributeError):
        env.get_attr("nothing")


def test_infos_stay_as_they_were_told():
    env = make(scenario="village")
    env.reset(seed=0)
    env.action_space.seed(0)
    told = []
    for _ in range(60):
        *_, infos = env.step(env.action_space.sample())
        told.append((infos, str(infos)))
    for infos, then in told:
        assert str(infos) == then


def test_a_copy_in_another_process_flies_on():
    env = CoverageVectorEnv(2, GROUND)
    env.reset()
    actions = env.action_space.sample()
    env.step(actions)
    twin = pickle.loads(pickle.dumps(env))
    for mine, its in zip(env.step(actions)[:4], twin.step(actions)[:4], strict=True):
        np.testing.assert_array_equal(mine, its)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"reset_mask": np.zeros(3, dtype=bool)}, "one true value"),
        ({"reset_mask": [True, False, True]}, "give an array"),
        ({"reset_mask": np.ones(2, dtype=bool)}, "each of 3 environments"),
        ({"scenario": np.array([0, 1, 2])}, "indices from 0 to 0"),
        ({"scenario": [0.5] * 3}, "an index for each"),
    ],
)
def test_wrong_options_are_refused(options, message):
    env = make()
    env.reset()
    with pytest.raises(ValueError, match=message):
        env.reset(options=options)


def test_wrong_modes_are_refused_with_what_is_allowed():
    with pytest.raises(ValueError, match="it is one of NextStep, SameStep, Disabled"):
        make(autoreset_mode="sometimes")


def test_actions_that_are_no_array_are_refused_in_a_line():
    env = make()
    env.reset()

    class Learned:
        def __array__(self, dtype=None, copy=None):
            raise RuntimeError("call detach first")

    for wrong in (Learned(), [[0.0], [0.0, 1.0], []]):
        with pytest.raises(ValueError, match=r"action of the swarms is .* give an array"):
            env.step(wrong)


@pytest.mark.parametrize("seed", [-1, 1.5, "3", [1, 2], [0, 1, 2.5], 2**64])
def test_wrong_seeds_are_refused(seed):
    with pytest.raises((ValueError, gymnasium.error.Error), match=r"[Ss]eed"):
        make().reset(seed=seed)


def test_one_that_could_not_be_made_closes_without_a_word():
    """Gymnasium closes what it collects, even where `__init__` has raised."""
    CoverageVectorEnv.__new__(CoverageVectorEnv).close_extras()


def test_it_closes_twice():
    env = make()
    env.reset()
    env.close()
    env.close()
