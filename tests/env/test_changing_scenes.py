"""Scenes that change in a batch: what single missions of the same seeds fly, to the last bit."""

from typing import Any, get_args

import gymnasium
import numpy as np
import pytest
from changing_missions import AGAIN, EVENTS, EVERYTHING, STEPS, mission

from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.scenario.events import EVENT_KINDS


def fly_beside_single_missions(scenario, singles, seeds, n_steps=2 * STEPS + 4, **settings):
    """Fly a batch and, of every lane, a single environment; both begin anew in the next step.

    Returns:
        The most changes that the scenes of its missions had behind them.
    """
    envs: Any = gymnasium.make_vec(
        "UASCoverage-v0", num_envs=len(seeds), vectorization_mode="vector_entry_point",
        scenario=scenario, **settings,
    )  # fmt: skip
    single: list[Any] = [
        gymnasium.make("UASCoverage-v0", scenario=each, **settings) for each in singles
    ]
    seen, _ = envs.reset(seed=seeds)
    alone = [env.reset(seed=seed)[0] for env, seed in zip(single, seeds, strict=True)]
    over, n_changes = np.zeros(len(seeds), bool), 0
    envs.action_space.seed(0)
    for _ in range(n_steps):
        actions = envs.action_space.sample()
        if actions.dtype.kind == "f":
            actions *= 0.3
        seen, rewards, terminated, truncated, infos = envs.step(actions)
        for lane, env in enumerate(single):
            if isinstance(scenario, list) and envs.unwrapped.batch.lanes.mission[lane]:
                continue  # another one of them
            own = env.action_space.shape[0]
            if over[lane]:
                alone[lane], _ = env.reset()
                assert rewards[lane] == 0.0
            else:
                alone[lane], reward, *ends, info = env.step(actions[lane, :own])
                assert rewards[lane] == reward
                assert [terminated[lane], truncated[lane]] == ends
                assert infos["covered"][lane] == info["covered"]
                if "action_mask" in info:
                    n = len(info["action_mask"])
                    np.testing.assert_array_equal(
                        infos["action_mask"][lane, :n], info["action_mask"]
                    )
            np.testing.assert_array_equal(seen[lane, : len(alone[lane])], alone[lane])
            swarm, other = envs.call("swarm_state")[lane], env.unwrapped.swarm_state()
            for name in swarm.__slots__:
                np.testing.assert_array_equal(getattr(swarm, name), getattr(other, name), name)
            assert envs.call("brief")[lane] == env.unwrapped.brief
        over = terminated | truncated
        n_changes = max(n_changes, int((envs.unwrapped.batch.lanes.changes >= 0).sum()))
    return n_changes


def test_all_kinds_are_flown_here():
    kinds = {get_args(kind.model_fields["kind"].annotation)[0] for kind in EVENT_KINDS}
    assert kinds == {event["kind"] for event in EVENTS}


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: event["kind"])
def test_a_batch_flies_each_kind_of_event_as_single_missions_do(event):
    scenario = mission(event)
    n_changes = fly_beside_single_missions(scenario, [scenario] * 2, [3, 8], safety_filter=True)
    changes = scenario.events[0].changes_scene
    assert (n_changes > 0) == changes


@pytest.mark.parametrize("action", ["velocity", "waypoint", "wrench"])
def test_waypoints_that_are_asked_for_again_are_so_in_a_batch(action):
    scenario = mission(relaunch=True, **AGAIN)
    n_changes = fly_beside_single_missions(scenario, [scenario] * 2, [0, 1], action=action)
    assert n_changes > 0


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_all_that_may_happen_happens_at_once_and_beside_missions_without_it(dynamics):
    # time enough for return mode not to call them home at once
    pool = [
        mission(*EVENTS, relaunch=True, max_steps=70, **AGAIN),
        mission(n_uas=1, max_steps=70),
        mission(EVENTS[0], max_steps=70),
    ]
    seeds = [24, 25, 26, 21]  # of which two draw the first, and one each of the others
    batch = CoverageBatch(4, pool)
    batch.reset(seeds)
    drawn = batch.lanes.scenario.tolist()
    assert len(set(drawn)) > 1
    n_changes = fly_beside_single_missions(
        pool, [pool[s] for s in drawn], seeds, STEPS, return_mode=True, safety_filter=True,
        dynamics=dynamics,
    )  # fmt: skip
    assert n_changes >= 6


def test_missions_that_are_drawn_one_by_one_change_their_scenes():
    def draw(rng):
        place_m = (130.0, 100.0 + rng.uniform(0.0, 20.0), -10.0)
        added = {**EVENTS[0], "position_m": place_m, "at_s": 1.0 + rng.integers(0, 9)}
        return mission(added, EVENTS[5], relaunch=True, **AGAIN)

    assert fly_beside_single_missions(draw, [draw] * 3, [5, 6, 7], action="waypoint") > 0


@pytest.mark.parametrize("drawn", [False, True])
def test_a_mission_that_begins_in_the_step_in_which_one_ends_begins_unchanged(drawn):
    # the last events come at the last sample
    scenario = mission({**EVENTS[0], "at_s": float(STEPS)}, EVENTS[3], n_uas=1)
    given = (lambda rng: scenario) if drawn else [scenario, scenario]
    next_step, same_step = (
        CoverageBatch(2, given, autoreset=mode, action="waypoint", threads=threads)
        for mode, threads in (("next_step", 1), ("same_step", 2 - drawn))
    )
    for batch in (next_step, same_step):
        batch.reset(4)
    for step in range(2 * STEPS):
        actions = np.full((2, 1), step % 3)
        for batch in (next_step, same_step):
            seen = batch.step(actions)
        if (step + 1) % STEPS:
            np.testing.assert_array_equal(next_step.observation, seen)
            continue
        final = same_step.missions.final
        np.testing.assert_array_equal(next_step.observation, final.observation)
        np.testing.assert_array_equal(next_step.learners.candidates, final.candidates)
        assert next_step.lanes.truncated.all()
        assert same_step.lanes.truncated.all()
        assert len(next_step.brief_of(0).waypoints) == 4
        assert len(same_step.brief_of(0).waypoints) == 3
        next_step.step(actions)  # begins
        np.testing.assert_array_equal(next_step.observation, same_step.observation)


@pytest.mark.parametrize("drawn", [False, True])
def test_a_batch_that_is_put_aside_goes_on_in_its_scenes(drawn):
    given = (lambda rng: EVERYTHING) if drawn else [mission(n_uas=1), EVERYTHING]
    batch, other = (CoverageBatch(3, given, action="waypoint") for _ in range(2))
    batch.reset(11, scenarios=None if drawn else np.array([1, 0, 1]))
    other.reset(2)
    for _ in range(10):
        batch.step(np.zeros((3, 2), int))
    assert (batch.lanes.changes >= 0).sum() > 4
    other.load_state_dict(batch.state_dict())
    for lane in range(3):
        assert other.brief_of(lane) == batch.brief_of(lane)
    for step in range(STEPS):
        actions = np.full((3, 2), step % 3)
        np.testing.assert_array_equal(other.step(actions), batch.step(actions))
        np.testing.assert_array_equal(other.lanes.rewards, batch.lanes.rewards)


@pytest.mark.parametrize(
    "changes",
    [
        [0, 0],  # twice the same
        [1],  # it does not change the scene
        [6],  # it has not happened
        [len(EVENTS) + 9],  # there is no such waypoint
        [-1, 0],
    ],
)
def test_changes_that_no_mission_can_have_are_refused(changes):
    scenario = mission(*EVENTS[:6], {**EVENTS[6], "rate_per_h": 1e-3})
    batch = CoverageBatch(1, scenario)
    batch.reset(0)
    for _ in range(8):
        batch.step(np.zeros((1, 2, 3)))
    state = batch.state_dict()
    state["changes"][:] = -1
    state["changes"][0, : len(changes)] = changes
    before = batch.state_dict()
    with pytest.raises(ValueError, match=r"changes.*which no mission here can have"):
        batch.load_state_dict(state)
    for name, array in batch.state_dict().items():
        np.testing.assert_array_equal(array, before[name])


def test_scenes_that_become_equal_are_laid_out_once():
    closed = {**EVENTS[6], "rate_per_h": None, "at_s": 4.0}  # the home of a UAS by lot
    batch = CoverageBatch(6, mission(EVENTS[0], closed))
    batch.reset(0)
    arenas = []
    for _ in range(4):
        batch.step(np.zeros((6, 2, 3)))
        first = batch.pool.arrays.arenas.first[batch.lanes.scene]
        arenas.append(len(np.unique(first, axis=0)))
    assert arenas == [1, 1, 1, 2]
    known = [batch.scenario_of(lane) for lane in range(6)]
    assert len({id(scenario) for scenario in known}) == 2
    assert len({scenario.uas[0].home_m for scenario in known}) == 2


def test_pictures_of_a_batch_show_its_scenes():
    envs = gymnasium.make_vec(
        "UASCoverage-v0", num_envs=2, vectorization_mode="vector_entry_point",
        scenario=mission(EVENTS[3]), render_mode="rgb_array",
    )  # fmt: skip
    envs.reset(seed=0)
    before = envs.render()
    for _ in range(4):
        envs.step(np.zeros((2, 6), np.float32))
    assert (np.asarray(envs.render()) != np.asarray(before)).mean() > 0.001


def test_a_mission_that_changes_its_scene_otherwise_than_the_examples_is_refused():
    def draw(rng):
        return mission(EVENTS[0] if rng.uniform() < 0.5 else EVENTS[8])

    calm = CoverageBatch(1, lambda rng: mission(EVENTS[8]))
    with pytest.raises(ValueError, match=r"again_after_s than the \d+ examples"):
        calm.reset(0, scenarios=mission(EVENTS[0]))
    CoverageBatch(1, draw).reset(0)
