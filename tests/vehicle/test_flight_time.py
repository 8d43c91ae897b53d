"""One model of flight time: what its paces mean, and that the docs have them all."""

from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env.vehicle import flight_time_s, load_vehicle, range
from uas_coverage_env.vehicle.range import (
    Pace,
    Speeds,
    flight_seconds,
    level_seconds,
    seconds_until,
    speeds_of,
    vertical_seconds,
)

SPEEDS = Speeds(level_mps=10.0, climb_mps=3.0, descent_mps=2.0)
PACES = {name: value for name, value in vars(range).items() if isinstance(value, Pace)}
DOCS = Path(__file__).parents[2] / "docs" / "range_method.md"


def test_of_level_flight_and_descent_at_once_the_slower_decides():
    pace = Pace(speed_share=0.5, level_s=1.0, vertical_s=2.0, landing_s=4.0)
    assert flight_seconds(pace, SPEEDS, 0.0, 100.0, 0.0, 10.0) == 20.0 + 1.0 + 4.0
    assert flight_seconds(pace, SPEEDS, 0.0, 5.0, 0.0, 10.0) == 5.0 + 2.0 + 4.0


def test_in_turn_they_add_up():
    pace = Pace(detour=1.5, in_turn=True, landing_s=4.0)
    assert flight_seconds(pace, SPEEDS, 0.0, 100.0, 0.0, 10.0) == 15.0 + 5.0 + 4.0


def test_a_climb_takes_the_climb_rate_and_a_turn_its_time():
    assert flight_seconds(Pace(), SPEEDS, 0.0, 0.0, 9.0, 0.0) == 3.0
    assert flight_seconds(Pace(), SPEEDS, 2.5, 10.0, 0.0, 0.0) == 3.5


def test_nothing_is_added_for_a_climb_that_there_is_not():
    assert flight_seconds(Pace(vertical_s=9.0), SPEEDS, 0.0, 10.0, 0.0, 0.0) == 1.0


@pytest.mark.parametrize("name", PACES)
def test_arrays_give_the_same_as_the_compiled_parts(name):
    way_m, up_m = np.array([0.0, 31.7, 211.3]), np.array([0.0, 7.1, 0.3])
    pace = PACES[name]._replace(level_s=0.0, vertical_s=0.0, in_turn=True, landing_s=0.0)
    parts = level_seconds(pace, SPEEDS, way_m) + vertical_seconds(SPEEDS, up_m, up_m)
    compiled = [
        flight_seconds(pace, SPEEDS, 0.0, way, up, up)
        for way, up in zip(way_m.tolist(), up_m.tolist(), strict=True)
    ]
    assert parts.tolist() == compiled


def test_the_speeds_are_those_of_the_vehicle():
    limits = load_vehicle("s500_v2").limits
    assert speeds_of(load_vehicle("s500_v2")) == (
        limits.v_xy_max_mps,
        limits.v_up_max_mps,
        limits.v_down_max_mps,
    )


def test_a_battery_lasts_about_as_long_as_it_does_in_the_plant():
    vehicle = load_vehicle("s500_v2")
    power_W, dod_end = vehicle.power.hover_W, 0.8
    simulated_s = flight_time_s(vehicle, power_W, dod_end)
    assert seconds_until(vehicle, 0.0, dod_end, power_W) == pytest.approx(simulated_s, rel=0.03)


def test_the_docs_have_every_pace_with_its_numbers():
    rows = [
        [cell.strip() for cell in line.strip("|").split("|")]
        for line in DOCS.read_text(encoding="utf-8").splitlines()
        if line.startswith("| `")
    ]
    told = {row[0].strip("`"): row[1:7] for row in rows if row[0].strip("`") in PACES}
    assert told == {
        name: ["yes" if value is True else "no" if value is False else f"{value:.3g}"
               for value in pace]
        for name, pace in PACES.items()
    }  # fmt: skip
