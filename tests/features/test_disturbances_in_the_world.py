"""What disturbances do to the UAS of one world: wind, forces, inputs; and what they may not do."""

import math
import pickle

import numpy as np
import pytest
from own_disturbances import NOT_FINITE, gusts, push, weak_rotors
from small_worlds import meadow, waypoint

from uas_coverage_env import World
from uas_coverage_env.features import Disturbance, constant_wind, disturbances_of
from uas_coverage_env.scenario import Scenario, Wind
from uas_coverage_env.scenario.toml_text import toml_text
from uas_coverage_env.simulation.pool import pool_worlds
from uas_coverage_env.vehicle.layout import DOD, LIFT, TAU_X, THETA, VX, VY, VZ, X, Y, Z
from uas_coverage_env.vehicle.linear import rigid_body, taylor
from uas_coverage_env.vehicle.record import compile_vehicle
from uas_coverage_env.world import Velocity, Wrench

BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
HIGH = ((100.0, 100.0, -25.0),)


LEVEL = Wrench(0.0, 0.0, 0.0, 0.0)


def flown(world, steps, command=LEVEL):
    """States after each step."""
    states = []
    for _ in range(steps):
        world.step(dict.fromkeys(world.active, command))
        states.append(world.state.x.copy())
    return np.array(states)


def drags_kgps(body):
    return np.array([body.drag_kgps, body.drag_kgps, body.drag_vertical_kgps])


def moved(force_N, body, time_s):
    """Velocity and way from rest under a constant force against linear drag."""
    velocity, way = [], []
    for force, drag in zip(force_N, drags_kgps(body), strict=True):
        if drag == 0.0:
            velocity.append(force / body.mass_kg * time_s)
            way.append(0.5 * force / body.mass_kg * time_s**2)
        else:
            velocity.append(force / drag * -math.expm1(-drag / body.mass_kg * time_s))
            way.append(force / drag * time_s - velocity[-1] * body.mass_kg / drag)
    return np.array(velocity), np.array(way)


@pytest.fixture(scope="module")
def draggy(tmp_path_factory):
    """A meadow with a vehicle that has vertical drag, too."""
    scenario = meadow(HIGH)
    data = scenario.vehicles[0].model_dump(mode="json")
    data["airframe"]["drag_vertical_kgps"] = 0.3
    file = tmp_path_factory.mktemp("vehicle") / "draggy.toml"
    file.write_text(toml_text(data))
    fleet = [{**uas.model_dump(), "vehicle": str(file)} for uas in scenario.uas]
    return Scenario.model_validate(scenario.model_dump(by_alias=True) | {"uas": fleet})


def windy(scenario, **wind):
    return scenario.model_copy(update={"wind": Wind(**wind)})


@BOTH
def test_a_level_uas_is_carried_off_as_linear_drag_says(draggy, dynamics):
    for scenario in (draggy, meadow(HIGH)):
        wind = {"mean_mps": 3.0, "from_deg": 210.0, "up_mps": 1.0}
        world = World(windy(scenario, **wind), dynamics=dynamics)
        body = scenario.vehicles[0].airframe
        air_mps = np.array([3.0 * math.cos(math.pi / 6), 3.0 * math.sin(math.pi / 6), -1.0])
        x = flown(world, 8)[-1, 0]
        velocity_mps, way_m = moved(drags_kgps(body) * air_mps, body, 8.0)
        np.testing.assert_allclose(x[VX : VZ + 1], velocity_mps, rtol=1e-4, atol=1e-9)
        np.testing.assert_allclose(x[X : Z + 1] - HIGH[0], way_m, rtol=1e-3, atol=1e-9)


def test_a_west_wind_blows_towards_the_east():
    x = flown(World(windy(meadow(HIGH), mean_mps=4.0, from_deg=270.0)), 3)[-1, 0]
    assert x[VY] > 0.1
    assert abs(x[VX]) < 1e-12


def test_wind_is_the_force_drag_times_wind_of_the_discrete_model(draggy):
    air_mps = np.array([2.0, -1.5, 0.5])
    wind = Disturbance("wind", constant_wind(1.0, 0.0).act, tuple(air_mps))
    world = World(draggy, disturbances=(wind,))
    body = world.scenario.vehicles[0].airframe
    A, B = rigid_body(world.scenario.vehicles[0])
    force = np.zeros((14, 3))
    force[VX : VZ + 1] = np.diag([1.0, 1.0, 1.0]) / body.mass_kg
    inputs = np.column_stack([B, force])
    A, B = taylor(A, inputs, 1.0, 4)
    drag_N = drags_kgps(body) * air_mps
    world.state.x[0, THETA] = -0.05
    x = world.state.x[0].copy()
    outcome = world.step({"uas_1": Wrench(0.4, 0.003, -0.002, 0.001)})
    expected = A @ x + B @ np.concatenate([outcome[0]["u"], drag_N])
    np.testing.assert_allclose(world.state.x[0, :DOD], expected[:DOD], rtol=0.0, atol=1e-12)
    assert outcome[0]["wind_mps"].tolist() == air_mps.tolist()


@BOTH
def test_standing_in_wind_takes_what_flying_through_still_air_takes(dynamics):
    in_wind = World(windy(meadow(HIGH), mean_mps=6.0, from_deg=0.0), dynamics=dynamics)
    in_still_air = World(meadow(HIGH), dynamics=dynamics)
    at_rest = World(meadow(HIGH), dynamics=dynamics)
    in_still_air.state.x[0, VX] = 6.0
    there, here, rest = (
        world.step({"uas_1": LEVEL})[0] for world in (in_wind, in_still_air, at_rest)
    )
    assert there["current_A"] == pytest.approx(here["current_A"], rel=1e-12)
    assert there["voltage_V"] == pytest.approx(here["voltage_V"], rel=1e-12)
    assert there["current_A"] != pytest.approx(rest["current_A"], rel=1e-3)
    both = in_wind.state.x[0], in_still_air.state.x[0]
    assert both[0][X] - 100.0 == pytest.approx(both[1][X] - 100.0 - 6.0)


@BOTH
def test_a_force_acts_as_one(draggy, dynamics):
    force_N = (0.8, -0.5, -0.3)
    world = World(draggy, dynamics=dynamics, disturbances=(push(*force_N),))
    x = flown(world, 6)[-1, 0]
    velocity_mps, way_m = moved(force_N, draggy.vehicles[0].airframe, 6.0)
    np.testing.assert_allclose(x[VX : VZ + 1], velocity_mps, rtol=1e-3)
    np.testing.assert_allclose(x[X : Z + 1] - HIGH[0], way_m, rtol=1e-3)


def test_disturbances_add_up():
    two = (push(0.5, 0.0, 0.0), constant_wind(2.0, 0.0))
    together = flown(World(meadow(HIGH), disturbances=two), 5)[:, 0]
    apart = [flown(World(meadow(HIGH), disturbances=(one,)), 5)[:, 0] for one in two]
    still = flown(World(meadow(HIGH)), 5)[:, 0]
    for k in (X, Y, VX, VY):
        np.testing.assert_allclose(
            together[:, k] - still[:, k], apart[0][:, k] + apart[1][:, k] - 2 * still[:, k]
        )


@BOTH
def test_inputs_that_are_changed_are_flown_and_kept_within_the_limits(dynamics):
    starts = ((60.0, 60.0, -25.0), (140.0, 140.0, -25.0))
    world = World(meadow(starts), dynamics=dynamics, disturbances=(weak_rotors(0.1),), seed=4)
    outcome = world.step(dict.fromkeys(world.active, LEVEL))
    weight_N = world.arena.vehicles["weight_N"]
    lost = -outcome["u"][:, LIFT] / weight_N
    assert (lost > 0.0).all()
    assert (lost < 0.1).all()
    assert lost[0] != lost[1]
    assert (world.state.x[:, VZ] > 0.0).all()
    again = world.step(dict.fromkeys(world.active, LEVEL))
    assert again["u"][:, LIFT].tolist() == outcome["u"][:, LIFT].tolist()
    strong = World(meadow(starts), dynamics=dynamics, disturbances=(weak_rotors(-100.0),))
    lifted = strong.step(dict.fromkeys(strong.active, LEVEL))
    assert lifted["u"][:, LIFT].tolist() == strong.arena.vehicles["lift_max_N"].tolist()
    assert not lifted["u"][:, TAU_X].any()


def test_gusts_are_those_of_the_seed_and_of_the_number_of_the_mission():
    world = World(meadow(HIGH), disturbances=(gusts(),), seed=7)
    first = flown(world, 6)
    world.reset()
    np.testing.assert_array_equal(flown(world, 6), first)
    world.reset(8)
    assert (flown(world, 6) != first).any()
    world.reset(7, mission=1)
    assert (flown(world, 6) != first).any()
    other = World(meadow(HIGH), disturbances=(push(0.0, 0.0, 0.0), gusts()), seed=7)
    np.testing.assert_array_equal(flown(other, 6), first)


def test_gusts_have_the_spread_and_the_memory_that_they_are_made_with():
    world = World(meadow(HIGH, max_steps=100_000), disturbances=(gusts(2.0, 5.0),), seed=1)
    wind_mps = []
    for _ in range(4000):
        world.state.x[:] = world._start.x
        wind_mps.append(world.step({"uas_1": LEVEL})[0]["wind_mps"].copy())
    wind_mps = np.array(wind_mps)[50:]
    np.testing.assert_allclose(wind_mps.std(axis=0), 2.0, rtol=0.15)
    assert (abs(wind_mps.mean(axis=0)) < 0.4).all()
    for axis in wind_mps.T:
        assert np.corrcoef(axis[5:], axis[:-5])[0, 1] == pytest.approx(math.exp(-1.0), abs=0.12)


def test_each_uas_draws_its_own_numbers_unless_they_are_common():
    starts = ((60.0, 60.0, -25.0), (140.0, 140.0, -25.0))
    for common in (False, True):
        world = World(meadow(starts), disturbances=(gusts(common=common),))
        outcome = world.step(dict.fromkeys(world.active, LEVEL))
        assert (outcome[0]["wind_mps"] == outcome[1]["wind_mps"]).all() == common


def test_a_world_that_is_put_aside_goes_on_as_if_it_had_not_been():
    world = World(meadow(HIGH), disturbances=(gusts(),), seed=3)
    flown(world, 4)
    copied = pickle.loads(pickle.dumps(world))
    np.testing.assert_array_equal(flown(copied, 5), flown(world, 5))


def test_without_a_disturbance_a_scenario_flies_as_ever():
    still = flown(World(meadow(HIGH)), 5, Velocity(3.0, 1.0, 20.0))
    calm = World(windy(meadow(HIGH), mean_mps=0.0, from_deg=90.0))
    assert calm.features == ()
    np.testing.assert_array_equal(flown(calm, 5, Velocity(3.0, 1.0, 20.0)), still)
    off = World(windy(meadow(HIGH), mean_mps=9.0, from_deg=90.0), disturbances=())
    np.testing.assert_array_equal(flown(off, 5, Velocity(3.0, 1.0, 20.0)), still)
    assert len(disturbances_of(off.scenario)) == 1


def test_a_speed_over_ground_that_wind_adds_is_judged_with_the_tolerance_of_disturbances():
    limit_mps = meadow(HIGH).vehicles[0].limits.v_xy_max_mps
    for share, exceeds in ((1.1, False), (1.2, True)):
        masks = []
        for disturbances in ((), (constant_wind(0.01, 0.0),)):
            world = World(meadow(HIGH), disturbances=disturbances)
            still_left = world.arena.vehicles["axis_A"][0, 1, 1]
            world.state.x[0, VX] = share * limit_mps / still_left
            masks.append(world.step({"uas_1": LEVEL})[0]["limits_exceeded"])
        assert masks[0] & 1
        assert bool(masks[1] & 1) == exceeds


def test_numbers_that_are_not_finite_end_the_flight_with_a_line():
    world = World(meadow(HIGH), disturbances=(NOT_FINITE,))
    flown(world, 3)
    with pytest.raises(ValueError, match="not finite; correct their kernels"):
        flown(world, 1)


def test_what_is_no_disturbance_is_refused():
    again = waypoint((150.0, 150.0, -20.0)) | {"again_after_s": (30.0,)}
    cases = [
        (lambda: World(meadow(), disturbances=push(0.0, 0.0, 0.0)), "give a tuple"),
        (lambda: World(meadow(), disturbances=("wind",)), "no Feature"),
        (lambda: World(meadow(), disturbances=(gusts(), gusts())), "a name of its own"),
        (lambda: push(math.inf, 0.0, 0.0), r"push: parameters\[0\] is inf"),
        (lambda: Disturbance("", None), "give it a name"),
        (lambda: World(meadow(), seed=-1), "seed is -1"),
        (lambda: pool_worlds([windy(meadow(), mean_mps=1.0, from_deg=0.0)]), "the air is still"),
        (lambda: pool_worlds([meadow(waypoints=(again,))]), "again_after_s"),
    ]
    for case, match in cases:
        with pytest.raises(ValueError, match=match):
            case()


def test_a_vehicle_at_any_time_step_knows_what_a_force_does():
    vehicle = meadow().vehicles[0]
    for dt_s in (0.25, 1.0, 2.0):
        position_m, velocity_mps = compile_vehicle(vehicle, dt_s)["horizontal_force_B"]
        rate = vehicle.airframe.drag_kgps / vehicle.airframe.mass_kg
        steady = 1.0 / vehicle.airframe.drag_kgps
        assert velocity_mps == pytest.approx(steady * -math.expm1(-rate * dt_s), rel=1e-3)
        assert position_m == pytest.approx(
            steady * (dt_s + math.expm1(-rate * dt_s) / rate), rel=1e-2
        )
