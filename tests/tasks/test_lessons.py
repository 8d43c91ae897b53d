"""Lessons: what each makes easier, and that no score is given on one."""

import pickle

import numpy as np
import pytest

from uas_coverage_env.scenario import Scenario
from uas_coverage_env.tasks import LESSONS, Lesson, level_named, parallel_env, score

HOME = 12


def stays_with_noise(rows):
    """Velocities about zero, as noisy as those of a learner that explores."""
    rng = np.random.default_rng(len(rows))
    noise = 0.1 * rng.standard_normal((len(rows), 3))
    return np.clip(noise - np.array([0.0, 0.0, 1.0]), -1.0, 1.0)


def nearest(rows):
    """The nearest open waypoint, then home."""
    return np.where(rows["action_mask"][:, 0] == 1, 0, HOME)


def flown(policy, level):
    more = {"action": "waypoint", "mask_in_observation": True} if policy is nearest else {}
    return score(policy, level, split="validation", missions=8, batch=8, **more)


@pytest.mark.parametrize(
    ("lesson", "policy", "figure", "sign"),
    [
        ("landing", stays_with_noise, "home", 1),
        ("few", nearest, "steps", -1),
        ("near", nearest, "steps", -1),
        ("charged", nearest, "home", 1),
        ("assisted", stays_with_noise, "lost", -1),
    ],
)
def test_the_same_policy_does_better_in_a_lesson(lesson, policy, figure, sign):
    on_level, in_lesson = (flown(policy, level) for level in ("hard", f"hard:{lesson}"))
    assert sign * (in_lesson.mean(figure) - on_level.mean(figure)) > 0.5
    assert in_lesson.score.value is None
    assert in_lesson.level == f"hard:{lesson}"


def test_every_lesson_is_tried_and_named():
    tried = test_the_same_policy_does_better_in_a_lesson.pytestmark[0].args[1]
    assert {lesson for lesson, *_ in tried} == set(LESSONS)


def test_lessons_add_up_and_leave_the_rest_of_a_mission_as_it_is():
    task = level_named("hard-v1:few+landing")
    assert (task.name, task.version.name) == ("hard-v1:few+landing", "v1")
    for seed, easier in task.scenarios("training", 3).items():
        mission = level_named("hard").scenario(seed)
        assert len(easier.waypoints) == 2 * len(mission.uas) < len(mission.waypoints)
        assert set(easier.waypoints) < set(mission.waypoints)
        assert easier.landing_distance_m > mission.landing_distance_m
        same = {"waypoints", "landing_distance_m", "landing_speed_mps"}
        assert easier.model_dump(exclude=same) == mission.model_dump(exclude=same)
    assert level_named("hard").scenario(seed) == mission


def test_near_leaves_a_waypoint_for_each_uas_and_none_that_is_left_out_is_nearer():
    for seed, easier in level_named("hard:near").scenarios("training", 3).items():
        mission = level_named("hard").scenario(seed)
        starts_m = np.array([uas.start_m for uas in mission.uas])

        def away_m(waypoint, starts_m=starts_m):
            return np.linalg.norm(starts_m - waypoint.position_m, axis=1).min()

        kept = [waypoint for waypoint in mission.waypoints if waypoint in easier.waypoints]
        assert tuple(kept) == easier.waypoints
        assert len(kept) == len(mission.uas)
        others = [each for each in mission.waypoints if each not in kept]
        assert max(map(away_m, kept)) <= min(map(away_m, others))


def test_one_of_ones_own_is_one_entry_more(monkeypatch):
    def calm(scenario: Scenario) -> Scenario:
        return scenario.model_copy(update={"wind": None, "uncertainty": None})

    monkeypatch.setitem(LESSONS, "calm", Lesson("still air", calm))
    env = parallel_env("hard:calm")
    env.reset(seed=0)
    assert env.scenario.wind is None
    assert level_named("hard").scenario(10_000_000).wind is not None


def test_a_lesson_travels_to_another_process():
    task = level_named("extreme:few+charged")
    again = pickle.loads(pickle.dumps(task))
    assert again.scenario(10_000_001) == task.scenario(10_000_001)


@pytest.mark.parametrize(
    ("asked", "reason"),
    [
        (lambda: score(nearest, "hard:few", missions=1), "hard:few is a lesson"),
        (lambda: level_named("hard:few").missions("test"), "no test missions"),
        (lambda: level_named("hard:fewer"), "one of landing, few, near, charged, assisted"),
        (lambda: level_named("hard:"), "lesson is ''"),
        (lambda: level_named("harder:few"), "level is 'harder'"),
    ],
)
def test_scores_on_a_lesson_and_what_is_none_are_refused(asked, reason):
    with pytest.raises(ValueError, match=reason):
        asked()
