"""Batteries of several RC pairs: what a file names, a replay shows and a mission flies."""

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env import World, linear_model, load_vehicle, simulate_battery
from uas_coverage_env.bound.prices import Ends, energy_prices
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.features.parameter_errors import uncertainty
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.scenario import Scenario, Uncertainty
from uas_coverage_env.scenario.packs import Sorties
from uas_coverage_env.scenario.toml_text import toml_text
from uas_coverage_env.vehicle import endurance
from uas_coverage_env.vehicle.battery import BatteryState, further_settled_V
from uas_coverage_env.vehicle.layout import DOD, N_STATES, U_TH
from uas_coverage_env.vehicle.parts import RcPair
from uas_coverage_env.world import Velocity

BOTH = pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
S500 = load_vehicle("s500_v2")
SLOW = RcPair(resistance_ohm=0.012, time_constant_s=40.0)
FAST = RcPair(resistance_ohm=0.006, time_constant_s=8.0)
TWO = S500.with_changes(battery={"rc": (SLOW,)})
HIGH = ((100.0, 100.0, -25.0),)


@pytest.fixture
def with_pairs(tmp_path):
    """Makes the meadow with a vehicle of these further pairs."""

    def make(*pairs, **changes):
        vehicle = S500.with_changes(battery={"rc": pairs})
        file = tmp_path / f"{len(pairs)}.toml"
        file.write_text(toml_text(vehicle.model_dump(mode="json")))
        scenario = meadow(HIGH).model_copy(update=changes)
        fleet = [{**uas.model_dump(), "vehicle": str(file)} for uas in scenario.uas]
        return Scenario.model_validate(scenario.model_dump(by_alias=True) | {"uas": fleet})

    return make


def flown(world, steps=60):
    """Voltages and currents of a flight that speeds up and brakes."""
    rows = []
    for k in range(steps):
        command = Velocity(8.0 if k % 20 < 10 else -8.0, 0.0, 25.0)
        outcome = world.step({"uas_1": command})[0]
        rows.append((outcome["voltage_V"], outcome["current_A"]))
    return np.array(rows).T


def test_a_current_held_on_lets_the_voltage_fall_by_an_exponential_for_each_pair():
    vehicle = S500.with_changes(
        battery={"resistance_th_ohm": 0.01, "time_constant_th_s": 25.0, "rc": (SLOW, FAST)}
    )
    time_s = np.arange(200.0)
    soc, voltage_V = simulate_battery(vehicle, np.full(200, 12.0), 0.95)
    battery = vehicle.battery
    open_V = np.interp(1.0 - soc, battery.ocv_dod, battery.ocv_V)
    drop_V = battery.resistance_0_ohm * 12.0
    for ohm, tau_s in ((0.01, 25.0), (0.012, 40.0), (0.006, 8.0)):
        drop_V += 12.0 * ohm * (1.0 - np.exp(-time_s / tau_s))
    np.testing.assert_allclose(open_V - voltage_V, drop_V, rtol=1e-6)


@BOTH
def test_a_mission_flies_with_the_voltage_of_all_its_pairs(with_pairs, dynamics):
    world = World(with_pairs(SLOW, FAST), dynamics=dynamics)
    voltage_V, current_A = flown(world)
    _, replayed_V = simulate_battery(world.scenario.vehicles[0], current_A, 1.0)
    _, paper_V = simulate_battery(S500, current_A, 1.0)
    # the voltage of a step in the nonlinear plant is a mean, in which the current varies
    tolerance_V = 1e-9 if dynamics == "lpv" else 0.05
    assert abs(voltage_V - replayed_V).max() < tolerance_V
    assert abs(voltage_V - paper_V)[20:].min() > 0.1
    battery = world.scenario.vehicles[0].battery
    state = BatteryState.rested(battery, 0.0)
    for ampere in current_A:
        state = state.after(battery, ampere, 1.0)
    further_V = world.state.true_vehicles["further_V"][0, :2]
    np.testing.assert_allclose(further_V, state.pairs_V[1:], rtol=1e-9)


@BOTH
def test_a_further_pair_of_hardly_any_resistance_changes_hardly_anything(with_pairs, dynamics):
    slight = RcPair(resistance_ohm=1e-6, time_constant_s=30.0)
    worlds = [World(with_pairs(*pairs), dynamics=dynamics) for pairs in ((), (slight,))]
    np.testing.assert_allclose(*map(flown, worlds), rtol=1e-3)
    np.testing.assert_allclose(worlds[0].state.x, worlds[1].state.x, atol=1e-4)


def test_a_mission_begins_rested_and_repeats_itself(with_pairs):
    world = World(with_pairs(SLOW))
    first = flown(world)
    assert world.state.true_vehicles["further_V"][0, 0] > 0.1
    world.reset()
    assert not world.state.true_vehicles["further_V"].any()
    np.testing.assert_array_equal(flown(world), first)


def test_take_off_leaves_its_mark_on_every_pair(with_pairs):
    world = World(with_pairs(SLOW, FAST, from_ground=True))
    slow_V, fast_V, none_V = world.state.true_vehicles["further_V"][0]
    assert 0.0 < slow_V < fast_V < world.state.x[0, U_TH]
    assert none_V == 0.0


def test_an_aged_battery_has_more_resistance_in_every_pair(with_pairs):
    world = World(with_pairs(SLOW), disturbances=(uncertainty(Uncertainty(resistance_gained=0.5)),))
    flown(world, 1)
    true = world.state.true_vehicles[0]
    more = true["resistance_0_ohm"] / S500.battery.resistance_0_ohm
    assert more > 1.0
    assert true["further_resistance_ohm"][0] == pytest.approx(more * SLOW.resistance_ohm)


def test_batteries_of_any_number_of_pairs_fly_side_by_side(with_pairs):
    pool = (meadow(HIGH), with_pairs(SLOW, sorties=Sorties(packs=2, swap_s=5.0, together=False)))
    batch = CoverageBatch(2, pool)
    batch.reset(0, scenarios=[0, 1])
    alone = [CoverageBatch(1, scenario) for scenario in pool]
    for each in alone:
        each.reset(0)
    for _ in range(20):
        actions = np.full((2, 1, 3), 0.7)
        batch.step(actions)
        for lane, each in enumerate(alone):
            each.step(actions[lane : lane + 1])
            np.testing.assert_array_equal(batch.worlds.x[lane], each.worlds.x[0])


def test_planners_take_further_pairs_as_settled_in_a_hover():
    model, plain = (linear_model(vehicle, 0.2) for vehicle in (TWO, S500))
    x = np.zeros(N_STATES)
    x[DOD] = 0.2
    hover_A = TWO.power.hover_W / TWO.battery.voltage_nominal_V
    x[U_TH] = TWO.battery.resistance_th_ohm * hover_A
    _, voltage_V, current_A = model.C @ x + model.F
    assert voltage_V * current_A == pytest.approx(TWO.power.hover_W, rel=0.01)
    assert voltage_V < (plain.C @ x + plain.F)[1] - 0.9 * further_settled_V(TWO)[0]
    assert endurance(TWO).hover_min < endurance(S500).hover_min


def test_a_battery_settles_at_its_steady_voltage():
    battery = TWO.battery
    state = BatteryState.rested(battery, 0.0)
    for _ in range(400):
        state = state.after(battery, 10.0, 1.0)
    steady_V = 10.0 * (battery.resistance_ohm - battery.resistance_0_ohm)
    assert sum(state.pairs_V) == pytest.approx(steady_V, rel=1e-4)
    assert state.dod == pytest.approx(400.0 * 10.0 / (3600.0 * battery.capacity_Ah))


def test_no_flight_takes_less_than_the_bound_says(with_pairs):
    world = World(with_pairs(SLOW))
    voltage_V, current_A = flown(world, 200)
    prices = energy_prices(world.scenario.vehicles[0], Ends(1.0, 2.0, 1.0, 50.0), 0.75)
    assert 0.85 * (voltage_V @ current_A) < 200.0 * prices.step < voltage_V @ current_A
    assert prices.once > energy_prices(S500, Ends(1.0, 2.0, 1.0, 50.0), 0.75).once


def test_a_battery_of_the_papers_pair_alone_is_written_as_it_always_was():
    assert "rc" not in S500.model_dump()["battery"]
    assert TWO.model_dump(mode="json")["battery"]["rc"] == [SLOW.model_dump()]
    assert hash(TWO) != hash(S500)
    assert TWO.with_changes(airframe={"mass_kg": 1.6}).battery.rc == TWO.battery.rc


@pytest.mark.parametrize(
    ("pairs", "message"),
    [
        ('rc = [{resistance_ohm = 0.01}]', r"battery.rc\[0\].time_constant_s: is missing"),
        ('rc = [{resistance_ohm = 0.01, tau_s = 1.0}]', r"battery.rc\[0\].tau_s: unknown key"),
        ('rc = [{resistance_ohm = -1.0, time_constant_s = 9.0}]', r"rc\[0\].resistance_ohm: .*0"),
        ("rc = [" + "{resistance_ohm = 0.001, time_constant_s = 9.0}," * 4 + "]", r"rc: .*3"),
        ('rc = [{resistance_ohm = 9.0, time_constant_s = 9.0}]', r"battery"),
    ],
)  # fmt: skip
def test_a_mistake_in_a_pair_is_one_line(tmp_path, pairs, message):
    text = toml_text(S500.model_dump(mode="json")).replace("dod_cutoff", f"{pairs}\ndod_cutoff")
    path = tmp_path / "wrong.toml"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        load_vehicle(path)
    assert "\n" not in str(caught.value)
