import itertools
import sys
from pathlib import Path

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.flight import rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import generate_scenario, warnings
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo, Velocity

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
from uas_coverage_env import independent_check

HOUSE = box("house", (60.0, 60.0, -9.0), (90.0, 90.0, 0.0), 1.0)


@pytest.fixture(scope="module")
def world():
    return World(meadow(obstacles=[HOUSE], min_height_m=3.0))


def judged_at(world, position_m):
    """What is said of a UAS that holds a place: breaches, and whether it is too low."""
    world.reset()
    world.state.x[0, :3] = position_m
    outcome = world.step({"uas_1": Velocity(0.0, 0.0, -position_m[2])})
    return int(outcome["breaches"][0]), bool(outcome["too_low"][0])


def test_below_the_least_height_is_a_breach_except_near_the_start(world):
    # the start is at (100, 100); the zone reaches 2 m + 2 x 3 m
    assert judged_at(world, (130.0, 100.0, -2.9)) == (1, True)
    assert judged_at(world, (130.0, 100.0, -3.1)) == (0, False)
    assert judged_at(world, (107.9, 100.0, -1.0)) == (0, False)
    assert judged_at(world, (108.1, 100.0, -1.0)) == (1, True)


def test_the_least_height_counts_from_the_roof_of_what_is_below(world):
    assert judged_at(world, (75.0, 75.0, -11.9)) == (1, True)
    assert judged_at(world, (75.0, 75.0, -12.1)) == (0, False)
    # beside the house only the ground is below, however near the edge
    assert judged_at(world, (91.5, 75.0, -9.5)) == (0, False)


def test_without_the_rule_no_uas_is_too_low():
    free = World(meadow(obstacles=[HOUSE]))
    assert judged_at(free, (130.0, 100.0, -1.0)) == (0, False)
    assert judged_at(free, (75.0, 75.0, -10.5)) == (0, False)


def test_a_raised_box_is_a_higher_box():
    corners = tuple(itertools.product((0.0, 4.0), (0.0, 6.0), (-5.0, 0.0)))
    raised = ConvexPolytope.from_points(corners).raised(3.0)
    higher = tuple(itertools.product((0.0, 4.0), (0.0, 6.0), (-8.0, 0.0)))
    points = np.random.default_rng(1).uniform(-12.0, 12.0, (200, 3))
    wanted = ConvexPolytope.from_points(higher).signed_distance(points)
    np.testing.assert_allclose(raised.signed_distance(points), wanted, atol=1e-9)


def test_a_slope_is_raised_straight_up():
    tent = ConvexPolytope.from_points(
        [(0, 0, 0), (0, 10, 0), (8, 0, 0), (8, 10, 0), (4, 0, -6), (4, 10, -6)]
    )
    raised = tent.raised(2.0)
    ridge, slope = np.array([4.0, 5.0, -6.0]), np.array([2.0, 5.0, -3.0])
    for roof in (ridge, slope):
        assert (
            raised.signed_distance(roof - [0, 0, 1.99])
            < 0
            < tent.signed_distance(roof - [0, 0, 0.01])
        )
        assert raised.signed_distance(roof - [0, 0, 2.01]) > 0


def test_what_is_kept_anyway_is_not_kept_twice():
    body = ConvexPolytope.from_points(np.array(HOUSE["vertices_m"]))
    assert body.raised(3.0, kept_m=3.0) is body
    roof = body.raised(3.0, kept_m=1.0)
    assert roof.signed_distance((75.0, 75.0, -12.0)) == pytest.approx(1.0)


class LowFlight:
    """Commands a flight across the field at a height, and goes home in the end."""

    def __init__(self, altitude_m=1.0):
        self.altitude_m = altitude_m

    def reset(self, brief, seed):
        self.brief = brief

    def act(self, swarm):
        if swarm.time_s < 25.0:
            return {name: Velocity(8.0, 0.0, self.altitude_m) for name in swarm.active}
        return {name: GoTo(None) for name in swarm.active}


def test_too_low_is_counted_named_and_read_back(tmp_path):
    scenario = meadow([(20.0, 100.0, -1.0)], min_height_m=3.0, max_steps=20)
    flight = rollout(scenario, LowFlight())
    assert flight.breaches == flight.height_breaches > 10
    assert summary(flight)["height_breaches"] == flight.height_breaches
    flight.save(tmp_path / "low")
    assert type(flight).load(tmp_path / "low") == flight
    # judged anew from the files alone
    report = independent_check.check(tmp_path / "low")
    assert report.height_breaches == flight.height_breaches
    assert report.problems == []


def test_the_independent_check_knows_roofs(tmp_path):
    scenario = meadow([(20.0, 75.0, -10.7)], obstacles=[HOUSE], min_height_m=3.0, max_steps=14)
    flight = rollout(scenario, LowFlight(altitude_m=10.7))
    assert 2 <= flight.height_breaches == flight.breaches < 14
    flight.save(tmp_path / "over")
    report = independent_check.check(tmp_path / "over")
    assert report.height_breaches == flight.height_breaches
    assert report.problems == []


def test_the_safety_filter_keeps_the_least_height_and_lets_land():
    scenario = meadow([(20.0, 100.0, -1.0)], min_height_m=3.0, max_steps=120)
    flight = rollout(scenario, LowFlight(), safety_filter=True)
    assert flight.height_breaches == flight.breaches == 0
    assert flight.x[:, 0, 0].max() > 60.0
    assert flight.mode[-1, 0] == 3


def test_guidance_keeps_the_least_height_and_lets_land():
    scenario = meadow(
        [(20.0, 100.0, -1.0)],
        waypoints=[waypoint((150.0, 100.0, -2.0)), waypoint((30.0, 100.0, -1.0), 8.0)],
        obstacles=[HOUSE],
        min_height_m=4.0,
        max_steps=200,
    )

    class ThereAndBack:
        def reset(self, brief, seed):
            pass

        def act(self, swarm):
            left = np.flatnonzero(swarm.uncovered)
            target = int(left[0]) if len(left) else None
            return {name: GoTo(target) for name in swarm.active}

    flight = rollout(scenario, ThereAndBack())
    assert flight.covered[-1] == 2
    assert flight.mode[-1, 0] == 3
    assert flight.breaches == 0


def test_a_mission_at_0_says_nothing_of_the_rule_in_its_files():
    assert "min_height_m" not in meadow().content()
    assert meadow(min_height_m=3.0).content()["min_height_m"] == 3.0
    assert MissionBrief.of(meadow(min_height_m=3.0)).landing_zone_m == 8.0


def test_a_start_over_a_roof_keeps_the_least_height():
    with pytest.raises(ValueError, match="lower than min_height_m 3 above the roof of obstacle"):
        meadow([(75.0, 75.0, -11.0)], obstacles=[HOUSE], min_height_m=3.0)
    meadow([(75.0, 75.0, -12.5)], obstacles=[HOUSE], min_height_m=3.0)


def test_a_waypoint_that_can_be_covered_from_below_only_is_warned_of():
    low = waypoint((150.0, 150.0, -2.0), 3.0)
    over_roof = waypoint((75.0, 75.0, -12.0), 1.5)
    near_start = waypoint((100.0, 102.0, -2.0), 1.0)
    scenario = meadow(waypoints=[low, over_roof, near_start], obstacles=[HOUSE], min_height_m=6.0)
    said = [line for line in warnings(scenario) if "only from below min_height_m 6" in line]
    assert [line.split(".")[0] for line in said] == ["waypoints[0]", "waypoints[1]"]


def test_generated_towns_are_the_same_with_waypoints_lifted():
    plain, high = (generate_scenario(5, n_waypoints=20, min_height_m=h) for h in (0.0, 10.0))
    assert plain.obstacles == high.obstacles
    assert high.min_height_m == 10.0
    assert not warnings(high)
    lifted = [
        min(np.subtract(b.position_m, a.position_m).round(6).tolist())
        for a, b in zip(plain.waypoints, high.waypoints, strict=True)
    ]
    assert set(lifted) <= {0.0, -1.0}
    assert generate_scenario(5, min_height_m=0.0) == generate_scenario(5)
    with pytest.raises(ValueError, match="min_height_m is 11; it should be between 0 and 10"):
        generate_scenario(5, min_height_m=11)
