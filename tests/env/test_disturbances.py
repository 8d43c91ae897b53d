"""The same disturbances, from outside of the package, in single and batched environments."""

import pickle

import gymnasium
import numba
import numpy as np
import pytest
from own_disturbances import NOT_FINITE, gusts, push, weak_rotors
from practice_grounds import practice_ground

from uas_coverage_env import uas_coverage_v0
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.features import constant_wind, disturbances_of
from uas_coverage_env.scenario import Uncertainty, Wind, with_disturbances

GROUND = practice_ground(n_uas=2, max_steps=12)
LEVEL = disturbances_of(with_disturbances(GROUND, "moderate", 1))
OWN = (*LEVEL, gusts(), push(0.2, 0.0, 0.0), weak_rotors(0.05))
WINDY = GROUND.model_copy(update={"wind": Wind(mean_mps=5.0, from_deg=120.0)})
FAILS = {"kind": "motor_degraded", "at_s": 3.0, "thrust_share": 0.9, "power_factor": 1.3}
MOTOR = disturbances_of(GROUND.model_copy(update={"events": (FAILS,)}))
BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])


def flown(env, seeds, steps=10):
    """Positions after each step of missions under the same actions; a mission for each seed."""
    rows = []
    for seed in seeds:
        rng = np.random.default_rng(2)
        env.reset(seed=seed)
        for _ in range(steps):
            env.step({agent: rng.uniform(-0.4, 0.4, 3) for agent in env.agents})
            rows.append(env.swarm_state().x)
    return np.array(rows)


@BOTH
def test_what_flies_in_a_lane_flies_in_a_single_mission_of_its_seed(dynamics):
    settings = {"disturbances": OWN, "dynamics": dynamics}
    batch = CoverageBatch(3, GROUND, **settings)
    envs = [uas_coverage_v0.parallel_env(GROUND, **settings) for _ in range(3)]
    batch.reset(40)
    for lane, env in enumerate(envs):
        env.reset(seed=40 + lane)
    rng = np.random.default_rng(1)
    began = 0
    for _ in range(30):
        actions = rng.uniform(-0.4, 0.4, (3, 2, 3))
        ended = (batch.lanes.terminated | batch.lanes.truncated).tolist()
        observation = batch.step(actions)
        for lane, env in enumerate(envs):
            if ended[lane]:
                seen, _ = env.reset()
                began += 1
            else:
                seen = env.step(dict(zip(env.agents, actions[lane], strict=True)))[0]
            np.testing.assert_array_equal(observation[lane], list(seen.values()))
            np.testing.assert_array_equal(batch.swarm_state(lane).x, env.swarm_state().x)
    assert began >= 6
    assert (batch.worlds.x[0] != batch.worlds.x[1]).any()


def test_a_seed_repeats_the_missions_and_each_draws_its_own_numbers():
    env = uas_coverage_v0.parallel_env(GROUND, disturbances=OWN)
    first = flown(env, [5, None])
    assert (first[:10] != first[10:]).any()
    np.testing.assert_array_equal(flown(env, [5, None]), first)
    assert (flown(env, [6, None]) != first).any()
    unseeded = [uas_coverage_v0.parallel_env(GROUND, disturbances=OWN) for _ in range(2)]
    assert (flown(unseeded[0], [None]) != flown(unseeded[1], [None])).any()


def test_every_environment_takes_disturbances():
    wind = {"disturbances": OWN}
    single = gymnasium.make("UASCoverage-v0", scenario=GROUND, **wind)
    many = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=2,
        vectorization_mode="vector_entry_point",
        scenario=GROUND,
        **wind,
    )
    parallel = uas_coverage_v0.parallel_env(GROUND, **wind)
    turns = uas_coverage_v0.env(GROUND, **wind)
    still = gymnasium.make("UASCoverage-v0", scenario=GROUND)
    action = np.full(6, 0.2, np.float32)
    single.reset(seed=9)
    still.reset(seed=9)
    many.reset(seed=9)
    parallel.reset(seed=9)
    turns.reset(seed=9)
    for _ in range(5):
        observed = single.step(action)[0]
        in_still_air = still.step(action)[0]
        lanes = many.step(np.stack([action] * 2))[0]
        dealt = parallel.step(dict.fromkeys(parallel.agents, action[:3]))[0]
        for _ in range(2):
            turns.step(action[:3])
        np.testing.assert_array_equal(observed, np.concatenate(list(dealt.values())))
        np.testing.assert_array_equal(observed, lanes[0])
        for agent in turns.agents:
            np.testing.assert_array_equal(turns.observe(agent), dealt[agent])
    assert (observed != in_still_air).any()


def test_scenarios_with_and_without_disturbances_share_a_batch():
    uncertain = GROUND.model_copy(update={"uncertainty": Uncertainty(mass=0.05, power=0.1)})
    pool = (GROUND, WINDY, practice_ground(n_uas=1, max_steps=12), uncertain)
    batch = CoverageBatch(4, pool)
    batch.reset(0, scenarios=[0, 1, 2, 3])
    envs = [uas_coverage_v0.parallel_env(scenario) for scenario in pool]
    for lane, env in enumerate(envs):
        env.reset(seed=lane)
    rng = np.random.default_rng(3)
    for _ in range(10):
        actions = rng.uniform(-1.0, 1.0, (4, 2, 3))
        observation = batch.step(actions)
        for lane, env in enumerate(envs):
            asked = dict(zip(env.agents, actions[lane], strict=False))
            seen = env.step(asked)[0]
            np.testing.assert_array_equal(observation[lane, : len(seen)], list(seen.values()))
    assert (batch.worlds.x[0] != batch.worlds.x[1]).any()
    assert batch.worlds.true_vehicles["perturbation"].any(axis=(1, 2)).tolist() == [0, 0, 0, 1]


def test_a_batch_that_is_put_aside_goes_on_as_if_it_had_not_been():
    batch = CoverageBatch(2, GROUND, disturbances=OWN)
    batch.reset(3)
    actions = np.full((2, 2, 3), 0.1)
    for _ in range(4):
        batch.step(actions)
    kept = batch.state_dict()
    assert kept["memory"].any()
    # numbers that every format of files holds
    assert all(array.dtype.names is None for array in kept.values())
    other = CoverageBatch(2, GROUND, disturbances=OWN)
    other.load_state_dict(kept)
    copied = pickle.loads(pickle.dumps(batch))
    for name, value in (("mass_kg", np.nan), ("n_segments", 9)):
        broken = {key: array.copy() for key, array in kept.items()}
        broken[f"true_vehicles.{name}"][1, 0] = value
        with pytest.raises(ValueError, match=rf"true_vehicles.{name}\[1, 0\] is"):
            other.load_state_dict(broken)
    broken = {**kept, "memory": kept["memory"].copy()}
    broken["memory"][1].view(np.float64)[0] = np.nan
    with pytest.raises(ValueError, match=r"memory\[1\]\.\w+\.numbers\[0, 0\] is nan"):
        other.load_state_dict(broken)
    for _ in range(6):
        observation = batch.step(actions)
        np.testing.assert_array_equal(other.step(actions), observation)
        np.testing.assert_array_equal(copied.step(actions), observation)


def test_a_single_environment_that_travels_flies_on():
    env = uas_coverage_v0.parallel_env(GROUND, disturbances=OWN)
    flown(env, [4], steps=3)
    copied = pickle.loads(pickle.dumps(env))
    action = dict.fromkeys(env.agents, np.zeros(3))
    np.testing.assert_array_equal(
        list(copied.step(action)[0].values()), list(env.step(action)[0].values())
    )


def test_the_settings_decide_over_the_scenario():
    seeds = [0]
    still = flown(uas_coverage_v0.parallel_env(GROUND), seeds)
    off = flown(uas_coverage_v0.parallel_env(WINDY, disturbances=()), seeds)
    blown = flown(uas_coverage_v0.parallel_env(WINDY), seeds)
    wind = (constant_wind(5.0, 120.0),)
    given = flown(uas_coverage_v0.parallel_env(GROUND, disturbances=wind), seeds)
    np.testing.assert_array_equal(off, still)
    np.testing.assert_array_equal(given, blown)
    assert (blown != still).any()


def test_numbers_that_are_not_finite_end_a_step_with_a_line():
    action = np.zeros((2, 2, 3))
    env = uas_coverage_v0.parallel_env(GROUND, disturbances=(NOT_FINITE,))
    batch, threaded = (
        CoverageBatch(2, GROUND, disturbances=(NOT_FINITE,), threads=threads)
        for threads in (1, min(2, numba.get_num_threads()))
    )
    steps = (
        lambda: env.step(dict(zip(env.agents, action[0], strict=True))),
        lambda: batch.step(action),
        lambda: threaded.step(action),
    )
    for reset in (env.reset, batch.reset, threaded.reset):
        reset()
    for step in steps:
        for _ in range(3):
            step()
        with pytest.raises(ValueError, match="not finite; correct their kernels"):
            step()


def test_what_does_not_fit_is_refused():
    calm = weak_rotors(0.1)
    other = type(calm)("gusts", calm.act)
    cases = [
        (lambda: CoverageBatch(2, GROUND, disturbances="wind"), "disturbances"),
        (lambda: uas_coverage_v0.parallel_env(GROUND, disturbances=(gusts(), other)), "of its own"),
        (lambda: CudaMissions(2, GROUND, seed=-1), "seed is -1"),
    ]
    for case, match in cases:
        with pytest.raises(ValueError, match=match):
            case()


def test_they_run_on_a_simulated_gpu(flown_on_gpu):
    assert len(flown_on_gpu["disturbances"]) == 2
    for row in flown_on_gpu["disturbances"]:
        assert row["different"] == 0
        assert row["restarts"] >= 2
        assert row["apart"]


def test_threads_draw_what_one_thread_draws():
    threads = min(2, numba.get_num_threads())
    batches = [CoverageBatch(5, GROUND, disturbances=OWN, threads=n) for n in (1, threads)]
    for batch in batches:
        batch.reset(1)
    actions = np.full((5, 2, 3), 0.1)
    for _ in range(15):
        one, many = (batch.step(actions) for batch in batches)
        np.testing.assert_array_equal(one, many)
