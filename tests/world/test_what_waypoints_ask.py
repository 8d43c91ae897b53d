"""A waypoint may ask for a sensor, for heights and for a speed: the one rule of what is covered."""

import numpy as np
import pytest
from small_worlds import meadow, waypoint

from uas_coverage_env import Flight, load_planner, load_scenario, rollout
from uas_coverage_env.flight import covered_at, rest_of
from uas_coverage_env.scenario import Scenario, Sensor
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VX, VZ, Z
from uas_coverage_env.world import GoTo, Velocity
from uas_coverage_env.world.coverage import covering_samples

HERE = (100.0, 100.0, -20.0)


def asking(position_m=HERE, radius_m=10.0, **asked):
    return waypoint(position_m, radius_m) | asked


def over(*waypoints, sensors=((),), start_m=HERE) -> Scenario:
    """UAS 20 m apart, the first of them at `start_m`, each with sensors of these names."""
    starts = [(start_m[0], start_m[1] + 20.0 * i, start_m[2]) for i in range(len(sensors))]
    scenario = meadow(starts, waypoints=waypoints)
    fleet = tuple(
        uas.model_copy(update={"sensors": tuple(Sensor(name=name) for name in names)})
        for uas, names in zip(scenario.uas, sensors, strict=True)
    )
    return scenario.model_copy(update={"uas": fleet})


@pytest.mark.parametrize(
    ("asked", "carried", "covered"),
    [
        ({}, (), True),
        ({"sensor": "thermal"}, ("thermal",), True),
        ({"sensor": "thermal"}, ("gas", "camera"), False),
        ({"sensor": "thermal"}, (), False),
        ({"heights_m": (20.0, 25.0)}, (), True),
        ({"heights_m": (12.0, 19.0), "position_m": (100.0, 100.0, -15.0)}, (), False),
        ({"heights_m": (21.0, 29.0), "position_m": (100.0, 100.0, -25.0)}, (), False),
    ],
)
def test_at_rest_it_counts_which_uas_is_there_with_what_and_how_high(asked, carried, covered):
    world = World(over(asking() | asked, sensors=[carried]))
    assert world.state.uncovered.tolist() == [not covered]


@pytest.mark.parametrize(("speed_mps", "covered"), [(4.0, True), (4.6, False)])
def test_a_uas_that_is_too_fast_covers_nothing(speed_mps, covered):
    world = World(over(asking((130.0, 100.0, -20.0), 29.0, max_speed_mps=3.5)))
    world.state.x[0, VX] = speed_mps
    world.state.uas[0].reference_mps[:] = speed_mps, 0.0
    outcome = world.step({"uas_1": Velocity(speed_mps, 0.0, 20.0)})
    assert (np.linalg.norm(world.state.x[0, VX : VZ + 1]) <= 3.5) == covered
    assert outcome["newly_covered"].tolist() == [int(covered)]


def test_it_counts_for_the_one_that_carries_the_sensor_not_for_the_first_one_there():
    both = asking((100.0, 110.0, -20.0), 12.0, sensor="thermal")
    world = World(over(both, sensors=[(), ("thermal",)]))
    assert not world.state.uncovered.any()
    alone = World(over(both, sensors=[(), ()]))
    outcome = alone.step({name: Velocity(0.0, 0.0, 20.0) for name in alone.names})
    assert alone.state.uncovered.all()
    assert not outcome["newly_covered"].any()


def test_guidance_comes_to_rest_where_slowness_is_asked_for_and_passes_by_elsewhere():
    slow, fast = (asking((100.0, 180.0, -20.0), 6.0, max_speed_mps=v) for v in (0.8, None))
    steps = []
    for target in (slow, fast):
        world = World(over({k: v for k, v in target.items() if v is not None}))
        while world.state.uncovered.any() and world.state.step[0] < 60:
            world.step({"uas_1": GoTo(0, mode="covering")})
        steps.append(int(world.state.step[0]))
    assert steps[1] < steps[0] < 60


def test_return_mode_brings_home_a_uas_that_has_nothing_to_cover():
    far = asking((20.0, 20.0, -20.0), sensor="thermal")
    scenario = over(far, sensors=[("thermal",), ("camera",)])
    world = World(scenario, return_mode=True)
    outcome = world.step({name: Velocity(0.0, 0.0, 20.0) for name in world.names})
    assert outcome["returning"].tolist() == [False, True]


@pytest.fixture(scope="module")
def mission() -> Flight:
    return rollout(load_scenario("mixed_fleet"), load_planner("nearest-waypoint"))


def test_a_record_is_judged_by_the_rule_of_the_world(mission):
    at = covered_at(mission)
    counted = np.searchsorted(np.sort(at), np.arange(mission.steps + 1), side="right")
    assert counted.tolist() == mission.covered.tolist()
    for w, asked in enumerate(mission.scenario.waypoints):
        (who,) = np.flatnonzero(covering_samples(mission.scenario, w, mission.x[at[w]]))
        x = mission.x[at[w], who]
        assert asked.sensor in [sensor.name for sensor in mission.scenario.uas[who].sensors]
        assert asked.heights_m is None or asked.heights_m[0] <= -x[Z] <= asked.heights_m[1]
        speed_mps = np.linalg.norm(x[VX : VZ + 1])
        assert asked.max_speed_mps is None or speed_mps <= asked.max_speed_mps


def test_what_is_left_is_what_no_uas_covered_as_asked(mission):
    cut = rollout(mission.scenario, load_planner("nearest-waypoint"), max_steps=40)
    left = rest_of(cut)
    assert len(left.waypoints) == 20 - cut.covered[-1]
    assert left.uas == mission.scenario.uas
