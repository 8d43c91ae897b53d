"""Vehicles that are others than is believed: they fly as their own vehicle files would say."""

import numpy as np
import pytest
from own_disturbances import SECRETLY_PERTURBING, drained, perturbed, push
from small_worlds import meadow

from uas_coverage_env import World
from uas_coverage_env.scenario import Scenario, Uncertainty
from uas_coverage_env.scenario.toml_text import toml_text
from uas_coverage_env.vehicle.layout import DELTA_THRUST, DOD, LIFT, U_TH, VX, VZ, X, Z
from uas_coverage_env.vehicle.record import VEHICLE_DTYPE
from uas_coverage_env.vehicle.true_vehicle import PERTURBATIONS
from uas_coverage_env.world import Velocity, Wrench

BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
HIGH = ((100.0, 100.0, -25.0),)
FLIGHT = [
    Wrench(0.6, 0.003, -0.002, 0.001),
    Wrench(-0.4, -0.002, 0.004, -0.001),
    Wrench(0.1, 0.001, 0.001, 0.0),
]
OUTSIDE = (1.5, -0.7, 0.4)
COMPUTED = (
    ("power", "hover_W"),
    ("power", "slope_W_per_N"),
    ("thrust_correction", "speed_N_per_mps"),
    ("thrust_correction", "climb_N_per_mps"),
    ("thrust_correction", "descent_N_per_mps"),
    ("thrust_correction", "tilt_N_per_rad"),
)
"""What a file may leave out, and has to, where another value contradicts it."""


@pytest.fixture
def true_file(tmp_path):
    """Makes the meadow with a vehicle file in which values are multiplied."""

    def make(scenario=None, set_to=None, left_out=(), **factors):
        scenario = scenario or meadow(HIGH)
        data = scenario.vehicles[0].model_dump(mode="json")
        for section, values in (set_to or {}).items():
            data[section] |= values
        for section, name in left_out:
            data[section][name] = None
        for key, factor in factors.items():
            section, name = key.split("__")
            data[section][name] *= factor
        file = tmp_path / f"{len(list(tmp_path.iterdir()))}.toml"
        file.write_text(toml_text(data))
        fleet = [{**uas.model_dump(), "vehicle": str(file)} for uas in scenario.uas]
        return Scenario.model_validate(scenario.model_dump(by_alias=True) | {"uas": fleet})

    return make


def flown(world, flight=FLIGHT):
    """States and outcomes of a flight; it starts moving."""
    world.state.x[0, VX : VZ + 1] = (6.0, -3.0, 0.5)
    outcomes = [world.step({"uas_1": wrench})[0].copy() for wrench in flight]
    return world.state.x[0].copy(), outcomes


def asked(flight, weight_N, mass=1.0, thrust=1.0):
    """The same thrust, as lift beyond the weight of the true vehicle."""
    return [
        Wrench(thrust * (weight_N + w.lift_N) - mass * weight_N, w.tau_x_Nm, w.tau_y_Nm, w.tau_z_Nm)
        for w in flight
    ]


@BOTH
@pytest.mark.parametrize("name", ["mass", "drag"])
def test_mass_and_drag_move_a_uas_as_its_own_file_would(true_file, dynamics, name):
    draggy = true_file(set_to={"airframe": {"drag_vertical_kgps": 0.3}})
    acting = (perturbed(**{name: 0.2}), push(*OUTSIDE))
    believed = World(draggy, dynamics=dynamics, disturbances=acting)
    factors = (
        {"airframe__mass_kg": 1.2}
        if name == "mass"
        else {"airframe__drag_kgps": 1.2, "airframe__drag_vertical_kgps": 1.2}
    )
    true_scenario = true_file(draggy, left_out=COMPUTED, **factors)
    true = World(true_scenario, dynamics=dynamics, disturbances=(push(*OUTSIDE),))
    weight_N = draggy.vehicles[0].weight_N
    flight = asked(FLIGHT, weight_N, mass=1.2) if name == "mass" else FLIGHT
    x, _ = flown(believed)
    expected, _ = flown(true, flight)
    still, _ = flown(World(draggy, dynamics=dynamics, disturbances=(push(*OUTSIDE),)))
    np.testing.assert_allclose(x[:DOD], expected[:DOD], rtol=0.0, atol=1e-9)
    assert abs(x[:DOD] - still[:DOD]).max() > 0.1


@BOTH
def test_the_battery_is_that_of_its_own_file(true_file, dynamics):
    cases = {
        "capacity": (-0.2, {"battery__capacity_Ah": 0.8}),
        "resistance": (
            0.5,
            {"battery__resistance_0_ohm": 1.5, "battery__resistance_th_ohm": 1.5},
        ),
        "power": (
            0.1,
            {
                "power__hover_W": 1.1,
                "power__slope_W_per_N": 1.1,
                "power__auxiliary_W": 1.1,
                "esc__constant_loss_W": 1.1,
                "esc__efficiency": 1.0 / 1.1,
            },
        ),
    }
    for name, (share, factors) in cases.items():
        believed = World(
            meadow(HIGH), dynamics=dynamics, disturbances=(perturbed(**{name: share}),)
        )
        x, outcomes = flown(believed)
        expected, others = flown(World(true_file(**factors), dynamics=dynamics))
        np.testing.assert_allclose(x, expected, rtol=1e-9, atol=1e-9, err_msg=name)
        for here, there in zip(outcomes, others, strict=True):
            for value in ("voltage_V", "current_A", "energy_Wh"):
                assert here[value] == pytest.approx(there[value], rel=1e-9), name
    assert x[U_TH] > 0.0


@BOTH
@pytest.mark.parametrize(
    ("name", "share"),
    [("mass", 0.1), ("thrust", -0.1), ("drag", 0.5), ("power", 0.1), ("resistance", 0.5)],
)
def test_what_is_worse_than_believed_takes_more_of_the_battery(dynamics, name, share):
    taken = []
    for disturbances in ((), (perturbed(**{name: share}),)):
        world = World(meadow(HIGH), dynamics=dynamics, disturbances=disturbances)
        before = world.state.x[0, DOD]
        for _ in range(15):
            world.step({"uas_1": Velocity(8.0, 0.0, 25.0)})
        taken.append(world.state.x[0, DOD] - before)
    assert taken[1] > 1.001 * taken[0]


@BOTH
def test_weak_motors_carry_less(dynamics):
    weak = World(meadow(HIGH), dynamics=dynamics, disturbances=(perturbed(thrust=-0.1),))
    outcome = weak.step({"uas_1": Wrench(0.0, 0.0, 0.0, 0.0)})
    assert weak.state.x[0, VZ] == pytest.approx(0.1 * 9.81)
    assert weak.state.x[0, Z] == pytest.approx(-25.0 + 0.05 * 9.81)
    assert weak.state.x[0, X] == 100.0
    assert outcome[0]["u"][LIFT] == 0.0
    true = weak.state.true_vehicles[0]
    np.testing.assert_array_equal(true["perturbation"], [0.0, -0.1, 0.0, 0.0, 0.0, 0.0])


@BOTH
def test_with_the_vehicle_that_is_believed_nothing_changes(dynamics):
    ends = [
        flown(World(meadow(HIGH), dynamics=dynamics, disturbances=acting))[0]
        for acting in ((), (perturbed(),))
    ]
    np.testing.assert_array_equal(*ends)


def test_a_small_perturbation_changes_little():
    ends = {}
    for dynamics in ("lpv", "nonlinear"):
        for size in (0.0, 1e-9):
            every = dict.fromkeys(PERTURBATIONS, size)
            world = World(meadow(HIGH), dynamics=dynamics, disturbances=(perturbed(**every),))
            ends[dynamics, size], outcomes = flown(world)
        np.testing.assert_allclose(ends[dynamics, 0.0], ends[dynamics, 1e-9], atol=1e-6)
        assert outcomes[-1]["u"][DELTA_THRUST] != 0.0


def test_a_charge_can_be_lost_at_once():
    worlds = [World(meadow(HIGH), disturbances=each) for each in ((), (drained(0.25),))]
    for world in worlds:
        world.step({"uas_1": Velocity(0.0, 0.0, 25.0)})
    lost = worlds[1].state.x[0, DOD] - worlds[0].state.x[0, DOD]
    assert lost == pytest.approx(0.25)


# what a step does not read: the inner loop's, the sizes of tables, and what judges a sample
NOT_FLOWN = {"gain", "governor_rows", "bounds", "faces", "fitted_trim_rad_per_mps"}


@BOTH
def test_what_acts_in_the_dynamics_acts_with_the_slightest_uncertainty_as_well(dynamics):
    """The true vehicle is flown by the same step: it cannot forget a parameter."""
    acted = 0
    fields = VEHICLE_DTYPE.fields
    assert fields is not None
    floats = [n for n, (kind, *_) in fields.items() if kind.base.kind == "f" and n not in NOT_FLOWN]
    slightly = meadow(HIGH).model_copy(update={"uncertainty": Uncertainty(mass=1e-6)})
    worlds = [World(slightly, dynamics=dynamics), World(meadow(HIGH), dynamics=dynamics)]
    for world in worlds:
        flown(world, FLIGHT[:1])
    start = worlds[1].state.x.copy()

    def after_a_step(field, factor):
        ends = []
        for world in worlds:
            world.state.x[:] = start
            flies = world.state.true_vehicles if len(world.state.true_vehicles) else None
            flies = world.arena.vehicles if flies is None else flies
            before = flies.copy()
            flies[field] *= factor
            outcome = world.step({"uas_1": FLIGHT[1]})[0]
            flies[:] = before
            ends.append([*world.state.x[0], outcome["voltage_V"], outcome["current_A"]])
        return np.array(ends)

    nominal = after_a_step("mass_kg", 1.0)
    for field in floats:
        uncertain, plain = after_a_step(field, 1.01)
        np.testing.assert_allclose(uncertain, plain, atol=1e-5, err_msg=field)
        acted += abs(plain - nominal[1]).max() > 1e-4
    assert acted > 15


def test_a_disturbance_that_does_not_say_that_it_changes_vehicles_is_refused():
    world = World(meadow(HIGH), disturbances=(SECRETLY_PERTURBING,))
    with pytest.raises(ValueError, match="make it with perturbs=True"):
        flown(world)


def test_a_vehicle_without_mass_is_refused():
    world = World(meadow(HIGH), disturbances=(perturbed(mass=-1.0),))
    with pytest.raises(ValueError, match="a perturbation is -1 or less; correct their kernels"):
        flown(world)
