"""Stuck detection: what it hides, for how long, and when it does not."""

import numpy as np
import pytest
from uas_coverage_agents.velocity.stuck_detection import HIDDEN_FOR_S, STUCK_AFTER_S, StuckDetection

from uas_coverage_env.env import OBSERVATION_SIZE, observation_columns
from uas_coverage_env.env.observation import K_WAYPOINTS

THERE, CLOSENESS = (observation_columns("waypoints", name)[:, 0] for name in ("valid", "closeness"))
NEAR, FAR = 0.6, 0.3


def sight(*waypoints: int, closeness: float = NEAR) -> tuple[np.ndarray, np.ndarray]:
    """View and candidates of one UAS that has these waypoints before it, nearest first."""
    view = np.zeros((1, OBSERVATION_SIZE), dtype=np.float32)
    candidates = np.full((1, K_WAYPOINTS), -1)
    n = len(waypoints)
    candidates[0, :n] = waypoints
    view[0, THERE[:n]] = 1.0
    view[0, CLOSENESS[:n]] = closeness * 0.9 ** np.arange(n)
    view[0, 0] = 0.25
    return view, candidates


def after(detection: StuckDetection, seconds: float, *waypoints: int, closeness: float = NEAR):
    """The last view of so many seconds before the same waypoints."""
    for _ in range(round(seconds)):
        view = detection.filter(*sight(*waypoints, closeness=closeness))
    return view


@pytest.fixture
def detection() -> StuckDetection:
    return StuckDetection(n_uas=1, n_waypoints=9, dt_s=1.0)


def test_at_first_everything_is_shown_as_it_is(detection):
    view, candidates = sight(4, 2, 7)
    assert np.array_equal(detection.filter(view, candidates), view)
    assert np.array_equal(after(detection, STUCK_AFTER_S - 1, 4, 2, 7), view)


def test_what_was_tried_for_too_long_is_hidden_and_the_others_move_up(detection):
    view, _ = sight(4, 2, 7)
    after(detection, STUCK_AFTER_S, 4, 2, 7)
    seen = after(detection, 1, 4, 2, 7)
    expected = view.copy()
    width = THERE[1] - THERE[0]
    end = THERE[0] + 3 * width
    expected[0, THERE[0] : end - width] = view[0, THERE[1] : end]
    expected[0, end - width : end] = 0.0
    assert np.array_equal(seen, expected)


def test_it_is_shown_again_later(detection):
    view, _ = sight(4, 2)
    after(detection, STUCK_AFTER_S, 4, 2)
    # the other one is far away meanwhile, or it would be tried for too long as well
    away, candidates = sight(2, 4, closeness=FAR)
    for _ in range(round(HIDDEN_FOR_S) - 1):
        assert detection.filter(away, candidates)[0, THERE].sum() == 1.0
    assert np.array_equal(detection.filter(view, sight(4, 2)[1]), view)


def test_the_last_one_is_never_hidden(detection):
    view, _ = sight(4)
    assert np.array_equal(after(detection, 3 * STUCK_AFTER_S, 4), view)


def test_a_long_way_to_the_nearest_does_not_try_patience(detection):
    view, _ = sight(4, 2, closeness=FAR)
    assert np.array_equal(after(detection, 5 * STUCK_AFTER_S, 4, 2, closeness=FAR), view)


def test_each_uas_has_its_own_patience():
    detection = StuckDetection(n_uas=2, n_waypoints=9, dt_s=1.0)
    for _ in range(round(STUCK_AFTER_S) + 1):
        (one, first), (two, second) = sight(4, 2), sight(2, 4, closeness=FAR)
        seen = detection.filter(np.concatenate([one, two]), np.concatenate([first, second]))
    assert seen[0, THERE].sum() == 1.0
    assert np.array_equal(seen[1], two[0])
