"""Returns: of planners and policies, the same as the environments pay."""

import dataclasses

import gymnasium
import numpy as np
import pytest

from uas_coverage_env import InputError, as_planner, evaluate, load_planner, rollout
from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.env.rewards.terms import REWARD_TERMS
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.metrics import energy_Wh, episode_return, reward_sums
from uas_coverage_env.scenario import generate_scenario

TOWN = generate_scenario(4, n_uas=2, n_waypoints=4, n_obstacles=2)
SHORT = {"max_cycles": 25}


def turning(seen):
    """Flies in curves that depend on what it sees."""
    return np.array([np.cos(9.0 * seen[0]), np.sin(9.0 * seen[1]), seen[2] - 0.5], np.float32)


def tumbling(seen):
    """Wrenches that soon lead beyond the limits."""
    return np.append(turning(seen), 0.3).astype(np.float32)


def nearest(seen):
    return 0


def paid_by_environment(policy, seed, **settings):
    """Sums of the terms, what was covered, and the energy [Wh]."""
    env = CoverageParallelEnv(TOWN, **settings)
    seen, infos = env.reset(seed=seed)
    sums, last = dict.fromkeys(REWARD_TERMS, 0.0), {}
    while env.agents:
        seen, _, _, _, infos = env.step({agent: policy(seen[agent]) for agent in env.agents})
        last |= infos
        for info in infos.values():
            for name, amount in info["reward_terms"].items():
                sums[name] += amount
    return (
        sums,
        max(i["covered"] for i in last.values()),
        sum(i["energy_Wh"] for i in last.values()),
    )


@pytest.mark.parametrize(
    ("policy", "settings"),
    [
        (turning, {"action": "velocity"}),
        (turning, {"action": "acceleration", "safety_filter": True, "return_mode": True}),
        (nearest, {"action": "waypoint", "return_mode": True}),
        (tumbling, {"action": "wrench"}),
        (tumbling, {"action": "wrench", "safety_filter": True, "dynamics": "nonlinear"}),
    ],
)
def test_a_policy_is_paid_what_its_environment_pays(policy, settings):
    settings = {**settings, **SHORT}
    (episode,) = evaluate(policy, TOWN, seeds=[3], **settings).episodes
    sums, covered, energy = paid_by_environment(policy, 3, **settings)
    assert episode.reward_terms == pytest.approx(sums, abs=1e-12)
    assert episode.coverage == covered / len(TOWN.waypoints)
    assert episode.energy_Wh == pytest.approx(energy)
    assert episode.episode_return == pytest.approx(sum(sums.values()))


def test_a_policy_for_the_swarm_flies_as_in_the_gymnasium_environment():
    def joint(seen):
        return np.tanh(seen[:6] + seen[234:240]).astype(np.float32)

    env = gymnasium.make("UASCoverage-v0", scenario=TOWN, **SHORT)
    seen, _ = env.reset(seed=0)
    over, paid = False, 0.0
    while not over:
        seen, reward, terminated, truncated, _ = env.step(joint(seen))
        paid += float(reward)
        over = terminated or truncated
    assert evaluate(joint, TOWN, seeds=[0], swarm_of=2, **SHORT).mean(
        "episode_return"
    ) == pytest.approx(paid)


def test_a_planner_is_paid_what_an_environment_pays_that_flies_its_commands():
    env = CoverageParallelEnv(TOWN, action="waypoint", return_mode=True, safety_filter=True)
    planner = load_planner("nearest-waypoint")
    env.reset(seed=1)
    planner.reset(env.brief, 1)
    paid = 0.0
    while env.agents:
        paid += sum(env.step(env.actions_of(planner.act(env.swarm_state())))[1].values())
    flown = evaluate("nearest-waypoint", TOWN, seeds=[1], return_mode=True, safety_filter=True)
    assert flown.mean("episode_return") == pytest.approx(paid)
    assert flown.mean("coverage") == 1.0
    assert flown.episodes[0].lost == 0


def test_weights_of_the_reward_are_those_that_are_given():
    usual, dear = (
        evaluate("lawnmower", TOWN, seeds=[0], reward_weights=weights, **SHORT)
        for weights in (None, {"energy": 2.0})
    )
    assert dear.mean("energy") == pytest.approx(10.0 * usual.mean("energy"))
    assert dear.mean("coverage") == usual.mean("coverage")


def test_missions_are_those_that_an_environment_draws_with_the_seed():
    names = []
    for seed in (5, 6):
        env = CoverageParallelEnv("generated", max_cycles=2)
        env.reset(seed=seed)
        names.append(env.scenario.name)
    evaluation = evaluate("hover", "generated", seeds=(5, 6), max_cycles=2)
    assert [episode.scenario for episode in evaluation.episodes] == names


def test_a_flight_keeps_its_rewards_in_its_directory(tmp_path):
    flight = rollout(TOWN, "nearest-waypoint", max_steps=6)
    assert flight.reward_terms.shape == (6, 2, len(REWARD_TERMS))
    energy = REWARD_TERMS.index("energy")
    assert flight.reward_terms[:, :, energy].sum() == pytest.approx(-0.2 * energy_Wh(flight).sum())
    again = Flight.load(flight.save(tmp_path / "flight"))
    assert again == flight
    assert reward_sums(again) == reward_sums(flight)


def test_a_flight_from_before_rewards_were_kept_still_reads(tmp_path):
    flight = rollout(TOWN, "hover", max_steps=3)
    folder = flight.save(tmp_path / "flight")
    (folder / "rewards.csv").unlink()
    old = Flight.load(folder)
    assert old == dataclasses.replace(flight, reward_terms=None, reward_names=())
    assert episode_return(old) is None
    flight.save(folder, overwrite=True)
    assert not (old.save(folder, overwrite=True) / "rewards.csv").exists()


@pytest.mark.parametrize(
    ("found", "put", "reason"),
    [
        ("time\n", "time,time\n", "twice"),
        ("uas_1,", "uas_9,", "uas_9"),
        ("0.0,uas_1", "9.0,uas_1", "not before the end"),
        ("0.0,uas_1,0.0", "0.0,uas_1,nan", "not finite"),
    ],
)
def test_a_damaged_file_of_rewards_is_refused_in_one_line(tmp_path, found, put, reason):
    folder = rollout(TOWN, "hover", max_steps=3).save(tmp_path / "flight")
    path = folder / "rewards.csv"
    path.write_text(path.read_text().replace(found, put, 1))
    with pytest.raises(InputError, match=reason):
        Flight.load(folder)


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"planner": 3}, "policy is 3"),
        ({"planner": turning, "swarm_of": 0}, "swarm_of is 0"),
        ({"planner": turning, "swarm_of": 1}, "2 UAS"),
        ({"planner": "hover", "seeds": ()}, "seeds are empty"),
        ({"planner": "hover", "reward_weights": {"fun": 1.0}}, "fun"),
        (
            {"planner": "hover", "episodes": 3},
            "'episodes'; there are seeds, swarm_of, on_episode, ",
        ),
        ({"planner": lambda seen: "left"}, "action of uas_1"),
        ({"planner": lambda seen: np.full(3, np.nan)}, "finite"),
    ],
)
def test_what_cannot_be_evaluated_is_refused_in_one_line(arguments, reason):
    given = {"scenario": TOWN, "seeds": [0], **SHORT, **arguments}
    with pytest.raises((ValueError, InputError), match=reason) as refused:
        evaluate(**given)
    assert "\n" not in str(refused.value)


def test_a_policy_is_a_planner_like_any_other():
    flight = rollout(TOWN, as_planner(nearest, action="waypoint", safety_filter=True), max_steps=40)
    assert flight.safety_filter
    assert flight.covered[-1] >= 1


def test_an_evaluation_prints_its_means():
    text = str(evaluate("hover", TOWN, seeds=[0, 1], max_cycles=3))
    assert "return" in text
    lines = dict(line.rsplit(maxsplit=1) for line in text.splitlines())
    assert (lines["lost"], lines["UAS"]) == ("0", "4")
