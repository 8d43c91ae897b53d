"""A policy scored in a batch: the same as one by one, to the last digit."""

import numpy as np
import pytest

from uas_coverage_env.env import OBSERVATION_SIZE
from uas_coverage_env.tasks import LEVELS, score, seeds_of

MEASURED = (
    "coverage", "steps", "energy_Wh", "energy_share", "episode_return", "all_home", "n_uas",
    "home", "lost",
)  # fmt: skip


def wanders(seen):
    """A policy that answers each row by itself, and differently in each."""
    rows = np.asarray(seen)
    return np.stack([np.sin(40.0 * rows[..., k]) for k in (0, 1, 2)], axis=-1)


def chooses(seen):
    rows = np.asarray(seen)
    return (np.abs(rows[..., 0] * 1000.0) % 13).astype(np.int64)


@pytest.mark.parametrize(
    ("level", "policy", "chosen"),
    [
        ("medium", wanders, {}),
        ("hard", wanders, {"observation": "local"}),
        ("hard", chooses, {"action": "waypoint"}),
        ("extreme", wanders, {}),
    ],
)
def test_a_batch_scores_what_missions_one_by_one_do(level, policy, chosen):
    n = 2 if level == "extreme" else 3
    one_by_one = score(policy, level, missions=n, **chosen)
    for batch in (1, 2, 50):
        together = score(policy, level, missions=n, batch=batch, **chosen)
        assert [each.seed for each in together.missions] == list(seeds_of("test")[:n])
        for one, other in zip(one_by_one.missions, together.missions, strict=True):
            assert one.value == other.value
            assert {name: one.figures[name] for name in MEASURED} == {
                name: other.figures[name] for name in MEASURED
            }
        assert together.score == one_by_one.score


def test_a_policy_of_the_swarm_is_asked_for_all_swarms_at_once():
    asked = []

    def policy(rows):
        asked.append(np.shape(rows))
        return wanders(np.reshape(rows, (*np.shape(rows)[:-1], 3, OBSERVATION_SIZE))).reshape(
            *np.shape(rows)[:-1], 9
        )

    alone = score(policy, "medium", missions=3, swarm_of=3)
    asked.clear()
    together = score(policy, "medium", missions=3, swarm_of=3, batch=3)
    assert asked[0] == (3, 3 * OBSERVATION_SIZE)
    assert [each.value for each in together.missions] == [each.value for each in alone.missions]


def test_what_a_batch_does_not_measure_is_none():
    (mission,) = score(wanders, "medium", missions=1, batch=1).missions
    assert mission.breaches is None
    assert LEVELS["medium"].scenarios("test", 1).keys() == {mission.seed}


@pytest.mark.parametrize(
    ("policy", "batch", "message"),
    [
        ("hover", 4, "'hover' is no policy"),
        (wanders, 0, "batch is 0"),
        (wanders, 2.5, "batch is 2.5"),
    ],
)
def test_what_cannot_fly_in_a_batch_is_refused(policy, batch, message):
    with pytest.raises(ValueError, match=message):
        score(policy, "medium", missions=1, batch=batch)
