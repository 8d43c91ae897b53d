"""True vehicles drawn within bounds, and the levels of wind and of wrong models."""

import itertools

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import MissionBrief, World, generate_scenario, load_scenario
from uas_coverage_env.env import CoverageVectorEnv
from uas_coverage_env.features import disturbances_of
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import (
    GeneratedScenarios,
    Uncertainty,
    sample_scenario,
    with_disturbances,
)
from uas_coverage_env.scenario.families import installed_families
from uas_coverage_env.scenario.levels import DISTURBANCE_LEVELS
from uas_coverage_env.vehicle.layout import DOD, VZ, Z
from uas_coverage_env.vehicle.true_vehicle import CAPACITY, RESISTANCE
from uas_coverage_env.world import Velocity, Wrench

BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
STARTS = ((50.0, 50.0, -25.0), (100.0, 100.0, -25.0), (150.0, 150.0, -25.0))
BOUNDS = {
    "mass": 0.05,
    "thrust": 0.04,
    "drag": 0.2,
    "power": 0.1,
    "capacity_lost": 0.15,
    "resistance_gained": 0.5,
}
LEVEL = Wrench(0.0, 0.0, 0.0, 0.0)


def uncertain(starts=STARTS, **bounds):
    return meadow(starts).model_copy(update={"uncertainty": Uncertainty(**(bounds or BOUNDS))})


def perturbations(world):
    """(U, 6) by how much the vehicles that fly are others than their files say."""
    return world.state.true_vehicles["perturbation"].copy()


def drawn(world, mission=0):
    """`perturbations` of a mission."""
    world.reset(mission=mission)
    world.step(dict.fromkeys(world.active, LEVEL))
    return perturbations(world)


def test_true_vehicles_are_drawn_within_the_bounds_for_each_uas_and_mission():
    world = World(uncertain())
    missions = np.array([drawn(world, mission) for mission in range(400)])
    bounds = np.array(list(BOUNDS.values()))
    low, high = missions.min(axis=(0, 1)), missions.max(axis=(0, 1))
    assert (abs(missions) <= bounds).all()
    np.testing.assert_allclose(high[:CAPACITY], bounds[:CAPACITY], rtol=0.02)
    np.testing.assert_allclose(low[:CAPACITY], -bounds[:CAPACITY], rtol=0.02)
    assert -0.15 <= low[CAPACITY] < -0.14
    assert high[CAPACITY] <= 0.0
    assert low[RESISTANCE] >= 0.0
    assert len(np.unique(missions[..., 0])) == missions[..., 0].size
    np.testing.assert_allclose(missions.std(axis=(0, 1))[:4], bounds[:4] / np.sqrt(3.0), rtol=0.06)


def test_a_seed_repeats_the_vehicles_and_they_stay_the_same_in_a_mission():
    world = World(uncertain(), seed=4)
    first = drawn(world)
    world.step(dict.fromkeys(world.active, LEVEL))
    later = perturbations(world)
    np.testing.assert_array_equal(later, first)
    np.testing.assert_array_equal(drawn(World(uncertain(), seed=4)), first)
    assert (drawn(World(uncertain(), seed=5)) != first).all()


@BOTH
def test_a_mission_begins_in_the_hover_of_the_true_vehicle(dynamics):
    world = World(uncertain(mass=0.1, thrust=0.1), dynamics=dynamics)
    taken = []
    for _ in range(5):
        outcome = world.step(dict.fromkeys(world.active, LEVEL))
        taken.append(outcome["current_A"].copy())
    np.testing.assert_allclose(world.state.x[:, VZ], 0.0, atol=1e-9)
    np.testing.assert_allclose(world.state.x[:, Z], -25.0, atol=1e-9)
    mass, thrust = perturbations(world)[:, :2].T
    heaviest, lightest = np.argsort((1.0 + mass) / (1.0 + thrust))[[-1, 0]]
    assert taken[0][heaviest] > taken[0][lightest]


def test_planners_believe_the_vehicle_files():
    scenario = uncertain()
    brief = MissionBrief.of(scenario)
    stated = brief.conditions
    assert stated is not None
    assert stated.uncertainty == scenario.uncertainty  # bounds, and nothing that was drawn
    assert brief.model_dump() | {"conditions": None} == MissionBrief.of(meadow(STARTS)).model_dump()
    assert disturbances_of(brief.as_scenario()) == ()
    assert [each.name for each in disturbances_of(scenario)] == ["uncertainty"]
    arena = World(scenario).arena
    assert (arena.vehicles == World(meadow(STARTS)).arena.vehicles).all()


def test_bounds_of_zero_are_no_disturbance():
    assert disturbances_of(uncertain(mass=0.0)) == ()
    assert "uncertainty" not in meadow().content()


def test_an_aged_battery_ends_sooner():
    ends = []
    for scenario in (meadow(STARTS), uncertain(capacity_lost=0.3, resistance_gained=0.5)):
        world = World(scenario)
        for _ in range(20):
            world.step(dict.fromkeys(world.active, Velocity(5.0, 0.0, 25.0)))
        ends.append(world.state.x[:, DOD])
    assert (ends[1] > 1.02 * ends[0]).all()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("mass = 0.6", "uncertainty.mass: should be less than or equal to 0.5"),
        ("mass = -0.1", "uncertainty.mass: should be greater than or equal to 0"),
        ("masses = 0.1", "uncertainty.masses: unknown key; did you mean mass?"),
        ("drag = inf", "uncertainty.drag: should be a finite number"),
    ],
)
def test_a_mistake_in_the_bounds_is_one_line(tmp_path, line, message):
    path = tmp_path / "uncertain.toml"
    meadow().to_file(path)
    path.write_text("\n".join([path.read_text(), "[uncertainty]", line]))
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_levels_grow_and_each_begins_where_the_one_before_ends():
    levels = list(DISTURBANCE_LEVELS.values())
    assert list(DISTURBANCE_LEVELS) == ["light", "moderate", "strong"]
    assert [level.mean_mps[1] for level in levels] == [4.0, 7.0, 10.0]
    for weaker, stronger in itertools.pairwise(levels):
        assert weaker.mean_mps[1] == stronger.mean_mps[0]
        assert weaker.gusts.peak_mps < stronger.gusts.peak_mps
        bounds = zip(weaker.uncertainty, stronger.uncertainty, strict=True)
        assert all(one[1] < other[1] for one, other in bounds)


def test_a_level_changes_the_air_and_the_vehicles_of_a_town_and_nothing_else():
    still = generate_scenario(7)
    for name, level in DISTURBANCE_LEVELS.items():
        windy = generate_scenario(7, disturbances=name)
        assert windy.name == f"{still.name}-{name}"
        assert level.mean_mps[0] <= windy.wind.mean_mps <= level.mean_mps[1]
        off = {"wind": None, "uncertainty": None, "name": still.name}
        assert windy.model_copy(update=off) == still
        assert windy == with_disturbances(still, name, 7)
        assert [each.name for each in disturbances_of(windy)] == [
            *("wind", "turbulence", "random_gusts", "uncertainty"),
        ]
    winds = {str(with_disturbances(still, "light", seed).wind) for seed in range(20)}
    assert len(winds) == 20
    assert with_disturbances(still, None, 3) is still


def test_generated_scenarios_have_the_levels_by_name():
    for name in DISTURBANCE_LEVELS:
        family = installed_families()[f"generated-{name}"]
        assert family == GeneratedScenarios(disturbances=name)
        assert family.of_seed(5) == sample_scenario(5, disturbances=name)
        assert family.of_seed(5).name == f"{sample_scenario(5).name}-{name}"


def test_a_level_that_there_is_not_is_one_line():
    for make in (
        lambda: generate_scenario(1, disturbances="stormy"),
        lambda: GeneratedScenarios(disturbances="stormy"),
        lambda: with_disturbances(generate_scenario(1), "stormy", 1),
        lambda: generate_scenario(1, disturbances=3),
    ):
        with pytest.raises(ValueError, match="it should be light, moderate, strong or None"):
            make()


def test_learners_train_in_missions_of_a_level_that_all_differ():
    family = GeneratedScenarios((1, 2), (4, 6), (0, 1), disturbances="moderate")
    env = CoverageVectorEnv(3, family, max_cycles=4)
    env.reset(seed=1)
    winds = set()
    for _ in range(10):
        env.step(np.zeros_like(env.action_space.sample()))
        winds |= {str(scenario.wind) for scenario in env.batch.pool.scenarios}
    assert len(winds) > 3
