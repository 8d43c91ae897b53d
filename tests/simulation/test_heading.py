"""UAS that are told to look where they fly (`heading = "course"`)."""

import math

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.flight import rollout
from uas_coverage_env.scenario import Sensing, Wind
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.inner_loop import COURSE_SPEED_MPS
from uas_coverage_env.vehicle.layout import N_STATES, PSI, TAU_Z, VX, VY, WZ, X, Z
from uas_coverage_env.world import Acceleration, GoTo, Velocity, Wrench

MODELS = ("lpv", "nonlinear")
OTHERS = [state for state in range(N_STATES) if state not in (PSI, WZ)]


def looking_ahead(scenario):
    """The same, all UAS looking where they fly."""
    fleet = tuple(uas.model_copy(update={"heading": "course"}) for uas in scenario.uas)
    return scenario.model_copy(update={"uas": fleet})


def field(**changes):
    return looking_ahead(meadow([(100.0, 100.0, -20.0)], **changes))


def fly(scenario, commands, **switches):
    """States (T+1, U, 14) and outcomes (T, U) of commands, one a step for all UAS."""
    world = World(scenario, **switches)
    states, outcomes = [world.state.x.copy()], []
    for command in commands:
        outcomes.append(world.step({name: command for name in world.active}))
        states.append(world.state.x.copy())
    return np.array(states), np.array(outcomes)


def towards(degrees, speed_mps=5.0, steps=1, altitude_m=20.0):
    north, east = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    return [Velocity(speed_mps * north, speed_mps * east, altitude_m)] * steps


def apart(angle, other):
    return np.abs(np.angle(np.exp(1j * (angle - other))))


@pytest.mark.parametrize("dynamics", MODELS)
def test_it_turns_to_its_course_within_its_rates_and_no_further(dynamics):
    scenario = field()
    commands = [*towards(90, steps=14), *towards(200, steps=18), *towards(-45, steps=18)]
    states, outcomes = fly(scenario, commands, dynamics=dynamics)
    limits = scenario.vehicles[0].limits
    more = 1.0001 if dynamics == "lpv" else 1.01
    turned = np.diff(states[:, 0, PSI])
    assert np.abs(turned).max() <= more * limits.yaw_rate_max_radps
    assert np.abs(turned).max() > 0.9 * limits.yaw_rate_max_radps
    faster = np.diff(states[:, 0, WZ])
    assert np.abs(faster).max() <= more * limits.angular_acceleration_z_max_radps2
    assert not outcomes["limits_exceeded"].any()
    for k in (14, 32, 50):
        course = math.atan2(states[k, 0, VY], states[k, 0, VX])
        assert apart(states[k, 0, PSI], course) < 0.03
        assert abs(states[k, 0, WZ]) < 0.02


@pytest.mark.parametrize("dynamics", MODELS)
def test_it_turns_the_shorter_way_round_and_counts_on_beyond_a_half_turn(dynamics):
    commands = [*towards(90, steps=10), *towards(170, steps=10), *towards(-170, steps=10)]
    states, _ = fly(field(), commands, dynamics=dynamics)
    assert states[:, 0, PSI].min() > -0.02
    assert states[-1, 0, PSI] == pytest.approx(math.radians(190), abs=0.03)


@pytest.mark.parametrize("dynamics", MODELS)
def test_a_uas_that_hovers_or_creeps_does_not_spin(dynamics):
    rng = np.random.default_rng(2)
    creeping = [towards(rng.uniform(0, 360), 0.6)[0] for _ in range(20)]
    commands = [*towards(120, steps=12), *towards(0, 0.0, steps=8), *creeping]
    states, _ = fly(field(), commands, dynamics=dynamics)
    slow = np.hypot(*states[20:, 0, VX : VY + 1].T)
    assert slow.max() < COURSE_SPEED_MPS
    assert np.ptp(states[20:, 0, PSI]) < 0.01
    assert np.abs(states[20:, 0, WZ]).max() < 0.02


EVERY_KIND = [
    command
    for k in range(8)
    for command in (
        Velocity(6.0, 4.0 - 2.0 * k, 15.0),
        Acceleration(0.5, -0.8, -0.1),
        Wrench(0.4, 0.02, -0.03, 0.01),
        GoTo(0),
        GoTo(None),
    )
]


@pytest.mark.parametrize("air", ["still", "windy"])
def test_nothing_but_its_heading_depends_on_where_it_looks(air):
    """Of all kinds of commands, with all assistants: to the last bit."""
    scenario = meadow(
        [(100.0, 100.0, -20.0), (60.0, 60.0, -20.0)],
        obstacles=[box("house", (120.0, 80.0, -25.0), (130.0, 120.0, 0.0))],
    )
    if air == "windy":
        tables = {"wind": Wind(mean_mps=3.0, from_deg=30.0), "sensing": Sensing(delay_steps=2)}
        scenario = scenario.model_copy(update=tables)
    switches = {"return_mode": True, "safety_filter": True}
    north, asked = fly(scenario, EVERY_KIND, **switches)
    course, flown = fly(looking_ahead(scenario), EVERY_KIND, **switches)
    np.testing.assert_array_equal(course[..., OTHERS], north[..., OTHERS])
    np.testing.assert_array_equal(flown["u"][..., :TAU_Z], asked["u"][..., :TAU_Z])
    for name in ("energy_Wh", "obstacle_clearance_m", "breaches", "filtered"):
        np.testing.assert_array_equal(flown[name], asked[name])
    assert np.abs(course[..., PSI]).max() > 1.0


def test_in_wind_it_looks_along_its_way_over_ground():
    scenario = field().model_copy(update={"wind": Wind(mean_mps=5.0, from_deg=0.0)})
    states, _ = fly(scenario, towards(90, 4.0, steps=25))
    assert states[-1, 0, PSI] == pytest.approx(math.pi / 2, abs=0.1)


def test_a_flight_of_the_nonlinear_plant_comes_to_the_same_places():
    """At most 1.0 m and 0.26 m/s apart: one that faces north turns a little as it tilts."""
    scenario = meadow(
        [(100.0, 100.0, -20.0), (60.0, 60.0, -20.0)],
        waypoints=[waypoint((x, y, -20.0), 4.0) for x, y in ((150, 100), (150, 150), (60, 150))],
    )
    north = rollout(scenario, "nearest-waypoint", dynamics="nonlinear")
    course = rollout(looking_ahead(scenario), "nearest-waypoint", dynamics="nonlinear")
    assert np.abs(course.x[..., PSI]).max() > 2.0
    assert course.steps == north.steps
    np.testing.assert_array_equal(course.covered, north.covered)
    apart_m = np.linalg.norm(course.x[..., X : Z + 1] - north.x[..., X : Z + 1], axis=-1)
    assert apart_m.max() < 1.2
    assert not course.violations


def test_planners_see_axes_that_do_not_turn_and_where_it_looks():
    world = World(field())
    for command in towards(90, steps=12):
        world.step({"uas_1": command})
    swarm, x = world.swarm_state(), world.state.x
    assert swarm.x[0, PSI] == swarm.x[0, WZ] == 0.0
    assert swarm.heading_rad[0] == x[0, PSI] > 1.4
    np.testing.assert_array_equal(swarm.x[:, OTHERS], x[:, OTHERS])


def test_it_turns_round_for_its_way_home():
    """Once landed, its angles are 0, as those of all."""
    flight = rollout(field(waypoints=[waypoint((100.0, 130.0, -20.0), 8.0)]), "nearest-waypoint")
    assert flight.x[:, 0, PSI].max() > 1.4
    assert apart(flight.x[-2, 0, PSI], -math.pi / 2) < 0.6
    assert flight.x[-1, 0, PSI] == 0.0
