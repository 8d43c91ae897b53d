"""Take-off from the ground and landing on it: their time, their energy, and the battery."""

import pytest
from small_worlds import box, meadow

from uas_coverage_env.flight import rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.mission import first_sight
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.ground_phases import height_above_ground_m, take_off
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.battery import BatteryState
from uas_coverage_env.vehicle.layout import DOD, U_TH
from uas_coverage_env.vehicle.vertical_flight import vertical_flight
from uas_coverage_env.world import GoTo, Velocity

S500 = load_vehicle("s500_v2")


def from_ground(scenario: Scenario) -> Scenario:
    return scenario.model_copy(update={"from_ground": True})


class HomeAtOnce:
    def reset(self, brief, seed):
        pass

    def act(self, swarm):
        return {name: GoTo(None) for name in swarm.active}


def test_climbing_takes_more_power_than_hovering_and_descending_less():
    up, down = (vertical_flight(S500, 30.0, v, BatteryState(0.2, (0.1,))) for v in (-3.0, 1.5))
    assert (up.time_s, down.time_s) == (10.0, 20.0)
    powers = [3600.0 * flown.energy_Wh / flown.time_s for flown in (down, up)]
    assert powers[0] < S500.power.hover_W < powers[1]


def test_the_charge_drawn_is_the_energy_over_the_voltage():
    flown = vertical_flight(S500, 60.0, -3.0, BatteryState.rested(S500.battery, 0.3))
    volts = flown.energy_Wh / (S500.battery.capacity_Ah * (flown.battery.dod - 0.3))
    assert S500.battery.voltage_min_V < volts < S500.battery.ocv_V[0]
    assert flown.battery.pairs_V[0] > 0.0
    assert vertical_flight(S500, 0.0, -3.0, flown.battery) == (0.0, 0.0, flown.battery)


def test_a_mission_from_the_ground_begins_with_what_take_off_leaves():
    plain = meadow([(50.0, 50.0, -6.0)], soc_0=0.9)
    assert World(plain).state.x[0, DOD] == pytest.approx(0.1)
    grounded = from_ground(plain)
    start = World(grounded).state.x[0]
    assert start[DOD] == take_off(grounded, 0).battery.dod > 0.1
    assert start[U_TH] > 0.0
    assert first_sight(MissionBrief.of(grounded)).x[0, DOD] == start[DOD]


def test_the_ground_is_the_plane_or_the_roof_below():
    house = box("house", (60.0, 60.0, -9.0), (90.0, 90.0, 0.0), 1.0)
    bridge = box("bridge", (120.0, 60.0, -40.0), (150.0, 90.0, -30.0), 1.0)
    scenario = meadow([(10.0, 10.0, -6.0)], obstacles=[house, bridge])
    assert height_above_ground_m(scenario, (75.0, 75.0, -12.0)) == pytest.approx(3.0)
    assert height_above_ground_m(scenario, (95.0, 75.0, -12.0)) == pytest.approx(12.0)
    assert height_above_ground_m(scenario, (130.0, 75.0, -12.0)) == pytest.approx(12.0)
    assert height_above_ground_m(scenario, (130.0, 75.0, -42.0)) == pytest.approx(2.0)


def test_the_record_says_what_take_off_and_landing_take(tmp_path):
    scenario = from_ground(meadow([(50.0, 50.0, -6.0)], max_steps=30))
    flight = rollout(scenario, HomeAtOnce())
    (phases,) = summary(flight)["ground_phases"]
    assert phases["take_off_s"] == pytest.approx(2.0)
    assert phases["landing_s"] == pytest.approx(-flight.x[-1, 0, 2] / 1.5)
    assert phases["soc_on_ground"] < 1.0 - flight.x[-1, 0, DOD]
    assert phases["landing_Wh"] > 0.0
    flight.save(tmp_path / "flown")
    again = type(flight).load(tmp_path / "flown")
    assert again == flight
    assert summary(again)["ground_phases"] == [phases]


def test_a_uas_in_the_air_has_not_landed_on_the_ground():
    class Hover:
        def reset(self, brief, seed):
            pass

        def act(self, swarm):
            return {name: Velocity(0.0, 0.0, 6.0) for name in swarm.active}

    flight = rollout(from_ground(meadow([(50.0, 50.0, -6.0)])), Hover(), max_steps=2)
    (phases,) = summary(flight)["ground_phases"]
    assert phases["landing_s"] is phases["soc_on_ground"] is None


def test_without_it_nothing_is_said():
    flight = rollout(meadow([(50.0, 50.0, -6.0)], max_steps=5), HomeAtOnce())
    assert "ground_phases" not in summary(flight)
    assert "from_ground" not in flight.scenario.content()
