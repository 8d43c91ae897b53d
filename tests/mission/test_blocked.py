"""A waypoint is blocked while a moving obstacle's keep-out holds all places to cover it from."""

import numpy as np
import pytest

from uas_coverage_env import MissionBrief, load_scenario
from uas_coverage_env.mission import WorldView, first_sight
from uas_coverage_env.scenario import MovingObstacle, ScheduledVelocity

KITE_M, HALF_HEIGHT_M, SAFE_M = 12.0, 9.0, 4.0


@pytest.fixture(scope="module")
def brief() -> MissionBrief:
    field = load_scenario("open_field")
    kite = MovingObstacle(
        name="kite",
        radius_m=KITE_M,
        height_m=2 * HALF_HEIGHT_M,
        safe_distance_m=SAFE_M,
        start_m=field.waypoints[4].position_m,
        schedule=(ScheduledVelocity(from_s=0.0, velocity_mps=(0.0, 0.0, 0.0)),),
    )
    return MissionBrief.of(field.model_copy(update={"moving_obstacles": (kite,)}))


def keep_out_holds(brief, kite_m, points_m, margin_m=0.0):
    """Whether the keep-out around a kite holds all of some points; written from the definition."""
    keep_m = SAFE_M + margin_m + max(uas.radius_m for uas in brief.uas)
    away_m = np.abs(points_m - kite_m)
    beside = np.linalg.norm(away_m[:, :2], axis=1) < KITE_M + keep_m
    return bool((beside & (away_m[:, 2] < HALF_HEIGHT_M + keep_m)).all())


@pytest.fixture(scope="module")
def seen_with_kite_at(brief):
    view, swarm = WorldView(brief), first_sight(brief)

    def seen(kite_m):
        swarm.moving_position_m[0] = kite_m
        view.update(swarm)
        return view

    return seen


@pytest.mark.parametrize("shares", [(0.0, 0.0), (0.8, 0.8), (0.6, 0.3)])
@pytest.mark.parametrize("margin_m", [0.0, 6.0])
def test_it_is_blocked_while_the_keep_out_holds_every_place_to_cover_it_from(
    brief, seen_with_kite_at, shares, margin_m
):
    rng = np.random.default_rng(5)
    turn = np.linspace(0.0, 2.0 * np.pi, 721)
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    seen = set()
    for _ in range(300):
        w = int(rng.integers(len(brief.waypoints)))
        waypoint = brief.waypoints[w]
        kite_m = waypoint.position_m + rng.uniform(-25.0, 25.0, 3)
        level_m, up_m = np.array(shares) * waypoint.radius_m
        edge = np.vstack(
            [np.column_stack([level_m * ring, np.full(len(ring), s * up_m)]) for s in (-1.0, 1.0)]
        )
        blocked = seen_with_kite_at(kite_m).blocked(*shares, margin_m)
        held = keep_out_holds(brief, kite_m, waypoint.position_m + edge, margin_m)
        assert blocked[w] == held
        seen.add(held)
    assert seen == {True, False}


def test_nothing_is_blocked_where_nothing_moves(brief):
    alone = brief.model_copy(update={"moving_obstacles": ()})
    assert not WorldView(alone).blocked().any()


def test_what_was_blocked_opens_once_the_obstacle_has_left(brief, seen_with_kite_at):
    here_m = np.array(brief.waypoints[4].position_m)
    assert seen_with_kite_at(here_m).blocked()[4]
    above_m = here_m - (0.0, 0.0, 40.0)
    assert not seen_with_kite_at(above_m).blocked()[4]
