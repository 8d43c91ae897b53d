"""Maps drawn from the paper's description."""

from itertools import combinations

import numpy as np
import pytest

from uas_coverage_env.leaderboard import scenarios_of
from uas_coverage_env.mission import MissionBrief, WorldView
from uas_coverage_env.scenario import load_scenario, warnings
from uas_coverage_env.scenario.families.flood_village import flood_village

TEN = range(10)
DRAWN = {seed: flood_village(seed) for seed in TEN}


def test_a_seed_gives_one_map_and_another_seed_another():
    assert flood_village(4) == DRAWN[4]
    contents = [DRAWN[seed].content() for seed in TEN]
    for one, other in combinations(contents, 2):
        assert one["waypoints"] != other["waypoints"]
        assert one["obstacles"] != other["obstacles"]
        assert one["moving_obstacles"] != other["moving_obstacles"]


@pytest.mark.parametrize("seed", TEN)
def test_a_map_has_what_the_paper_says(seed):
    drawn = DRAWN[seed]
    kinds = [obstacle.kind for obstacle in drawn.obstacles]
    counts = {kind: kinds.count(kind) for kind in kinds}
    assert counts == {"forest": 4, "residential": 2, "high_rise": 3, "church": 1}
    assert len(drawn.waypoints) == 49
    assert [uas.start_m for uas in drawn.uas] == [(250.0, 10.0, -1.0), (230.0, 10.0, -1.0)]
    assert [uas.soc_0 for uas in drawn.uas] == [1.0, 0.433]
    assert {one.weight for one in drawn.waypoints if one.kind == "forest"} == {2.0}
    assert {one.weight for one in drawn.waypoints if one.kind != "forest"} == {1.0}
    assert not list(warnings(drawn))


@pytest.mark.parametrize("seed", TEN)
def test_every_waypoint_keeps_all_distances_from_what_stands(seed):
    drawn = DRAWN[seed]
    for waypoint in drawn.waypoints:
        place = np.array(waypoint.position_m)
        assert drawn.fence.signed_distance(place) < -5.0
        for obstacle, hull in zip(drawn.obstacles, drawn.hulls, strict=True):
            assert hull.signed_distance(place) > obstacle.safe_distance_m + 0.36


@pytest.mark.parametrize("seed", TEN)
def test_buildings_and_forests_do_not_overlap(seed):
    boxes = [
        (hull.vertices_m.min(axis=0), hull.vertices_m.max(axis=0)) for hull in DRAWN[seed].hulls
    ]
    for (low, high), (other_low, other_high) in combinations(boxes, 2):
        gap_m = np.maximum(low[:2] - other_high[:2], other_low[:2] - high[:2]).max()
        assert gap_m > 7.0, "no UAS could pass between them"


@pytest.mark.parametrize("seed", TEN)
def test_one_waypoint_in_the_east_lies_behind_the_helicopter(seed):
    drawn = DRAWN[seed]
    blocked = np.flatnonzero(WorldView(MissionBrief.of(drawn)).blocked())
    assert len(blocked) == 1
    helicopter = drawn.moving_obstacles[0]
    assert drawn.waypoints[blocked[0]].position_m[1] > helicopter.start_m[1] > 400.0


def test_helicopters_gain_no_more_than_3_mps_in_a_second():
    for scenario in (*DRAWN.values(), load_scenario("gasche2025")):
        times_s = np.arange(0.0, 300.0)
        velocities = np.array([scenario.moving_velocities(t)[0] for t in times_s])
        gained = np.linalg.norm(np.diff(velocities[:260, :2], axis=0), axis=1)
        assert gained.max() == pytest.approx(3.0)
        assert scenario.moving_positions(260.0)[0, 1] > 600.0, "it has left the area"


def test_the_map_that_stands_for_the_papers_is_the_village_but_for_helicopter_and_least_height():
    village, mine = load_scenario("village").content(), load_scenario("gasche2025").content()
    (theirs,), (ours,) = village.pop("moving_obstacles"), mine.pop("moving_obstacles")
    assert (village.pop("name"), mine.pop("name")) == ("village", "gasche2025")
    assert village.pop("min_height_m") == 3.0
    mine.pop("min_height_m", 0.0)
    assert mine == village
    assert theirs.pop("schedule") != ours.pop("schedule")
    assert theirs == ours


def test_drawn_maps_can_be_compared_on_by_name():
    found = scenarios_of(["flood-village:2:4,village"])
    assert list(found) == ["flood-village-2", "flood-village-3", "village"]
    assert found["flood-village-3"] == DRAWN[3]
