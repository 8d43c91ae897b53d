import dataclasses

import numpy as np
import pytest

from uas_coverage_env.flight import Flight, rollout
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import accomplished, coverage, energy_Wh, home
from uas_coverage_env.flight.record import LANDED, LOST, DecisionRecord


def test_energy_is_voltage_times_current_over_time(flight):
    constant = dataclasses.replace(
        flight,
        voltage_V=np.full_like(flight.voltage_V, 15.0),
        current_A=np.full_like(flight.current_A, 12.0) * [1.0, 0.5],
    )
    hours = len(flight.x) / 3600.0
    np.testing.assert_allclose(energy_Wh(constant), [180.0 * hours, 90.0 * hours])
    assert summary(constant)["energy_Wh"] == pytest.approx(270.0 * hours)


def test_energy_agrees_with_the_charge_that_left_the_battery(flight, yard):
    charge_Ah = flight.current_A.sum(axis=0) * yard.dt_s / 3600.0
    capacity_Ah = [vehicle.battery.capacity_Ah for vehicle in yard.vehicles]
    discharged = flight.x[-1, :, 12] - flight.x[0, :, 12]
    np.testing.assert_allclose(charge_Ah / capacity_Ah, discharged, rtol=1e-9)


def test_coverage_counts_waypoints_whatever_their_weight(flight):
    covered = flight.covered.copy()
    covered[-1] = 2
    assert coverage(dataclasses.replace(flight, covered=covered)) == pytest.approx(2 / 3)
    assert coverage(flight) == 1.0


def test_a_mission_fails_by_a_waypoint_a_uas_or_a_violation(flight):
    assert accomplished(flight)
    covered, mode = flight.covered.copy(), flight.mode.copy()
    covered[-1] = 2
    mode[-1, 1] = LOST
    assert not accomplished(dataclasses.replace(flight, covered=covered))
    assert not accomplished(dataclasses.replace(flight, mode=mode))
    assert not accomplished(dataclasses.replace(flight, violations=("any",)))


def test_only_a_uas_that_has_landed_is_home(flight):
    mode = flight.mode.copy()
    mode[-1] = (LANDED, LOST)
    assert home(dataclasses.replace(flight, mode=mode)).tolist() == [True, False]


def test_percentiles_are_those_of_the_decisions(flight):
    decisions = tuple(
        DecisionRecord(n / 100, n > 97, n / 10 if n % 2 else None) for n in range(101)
    )
    result = summary(dataclasses.replace(flight, decisions=decisions))
    assert result["decision_time_s"] == pytest.approx(
        {"p50": 0.5, "p95": 0.95, "p99": 0.99, "max": 1.0}
    )
    assert result["fallbacks"] == 3
    assert result["mip_gap_p50"] == pytest.approx(5.0)


def test_a_flight_that_was_asked_for_no_terms_keeps_no_reward(tmp_path):
    flight = rollout("open_field", "hover", max_steps=2, reward=())
    assert flight.reward_terms is None
    assert "return" not in summary(flight)
    assert not (flight.save(tmp_path) / "rewards.csv").exists()
    assert Flight.load(tmp_path).reward_terms is None
