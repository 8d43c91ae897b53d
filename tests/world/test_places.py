"""Where a UAS may be, against distances that NumPy computes from the hulls of the scenario."""

import numpy as np
import pytest

from uas_coverage_env import load_scenario
from uas_coverage_env.world import build_arena
from uas_coverage_env.world.places import inside_fence_m, may_be_at

VILLAGE = load_scenario("village").model_copy(update={"min_height_m": 4.0})
ARENA = build_arena(VILLAGE)
CLOSE_M = 1e-6  # a place that is nearer to a limit may be on either side of it


def places_m():
    """(P, 3) places around walls, roofs and the fence."""
    rng = np.random.default_rng(0)
    corners_m = np.concatenate([hull.vertices_m for hull in (*VILLAGE.kept_hulls, VILLAGE.fence)])
    return corners_m[rng.integers(len(corners_m), size=600)] + rng.normal(0.0, 4.0, (600, 3))


def room_m(place_m, kept_m, inside_m):
    """The least distance to spare, of those from hulls (O,) and from the fence."""
    hulls_m = [hull.signed_distance(place_m) for hull in VILLAGE.kept_hulls]
    return min(*(np.array(hulls_m) - kept_m), -VILLAGE.fence.signed_distance(place_m) - inside_m)


def test_a_uas_may_be_where_neither_fence_nor_obstacles_are_nearer_than_a_breach():
    kept_m = VILLAGE.uas[0].radius_m + np.array([o.safe_distance_m for o in VILLAGE.obstacles])
    rooms_m = [room_m(place_m, kept_m, VILLAGE.geofence.margin_m) for place_m in places_m()]
    for place_m, room in zip(places_m().tolist(), rooms_m, strict=True):
        if abs(room) > CLOSE_M:
            assert may_be_at(ARENA, 0, *place_m) == (room > 0.0)
    assert 100 < sum(room > 0.0 for room in rooms_m) < 500


def test_from_a_place_that_is_too_near_routes_lead_on_but_no_nearer():
    hull, wall_m = VILLAGE.kept_hulls[0], float(ARENA.obstacles["wall_m"][0])
    face = int(np.argmin(np.abs(hull.normals[:, 2])))
    middle_m = hull.vertices_m.mean(axis=0)
    away_m = float(hull.face_distances(middle_m)[face])
    start_m, nearer_m, farther_m = (
        tuple((middle_m + (out_m - away_m) * hull.normals[face]).tolist())
        for out_m in (0.5 * wall_m, 0.4 * wall_m, 0.6 * wall_m)
    )
    assert not may_be_at(ARENA, 0, *start_m, farther_m)
    assert may_be_at(ARENA, 0, *start_m, start_m)
    assert may_be_at(ARENA, 0, *farther_m, start_m)
    assert not may_be_at(ARENA, 0, *nearer_m, start_m)


def test_outside_the_fence_the_distance_is_negative():
    middle_m = VILLAGE.fence.vertices_m.mean(axis=0)
    for share in (0.0, 0.9, 1.1):
        place_m = middle_m + share * (VILLAGE.fence.vertices_m[0] - middle_m)
        expected_m = -float(VILLAGE.fence.signed_distance(place_m))
        assert inside_fence_m(ARENA, *place_m.tolist()) == pytest.approx(expected_m)
        assert (expected_m > 0.0) == (share < 1.0)
