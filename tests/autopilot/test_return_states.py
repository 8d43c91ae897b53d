"""Return mode keeps its promise for vehicles from 34 g to 900 kg: random states, none lost.

The same with 200 states each: `python benchmarks/returns.py --vehicle FILE --towns 40`.
"""

import sys
from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import DOD, VX, VY
from uas_coverage_env.world import GoTo

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from return_states import FLYABLE, flown_states, flown_wind_mps

VEHICLES = Path(__file__).parents[1] / "vehicles"
CRAZYFLIE, AIR_TAXI = "crazyflie", str(VEHICLES / "air_taxi.toml")


@pytest.mark.parametrize("wind_mps", [0.0, 8.0])
@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
@pytest.mark.parametrize("vehicle", [CRAZYFLIE, "s500_v2", AIR_TAXI])
def test_return_mode_brings_every_vehicle_home(vehicle, dynamics, wind_mps):
    flights = [
        flight for seed in range(2003, 2007) for flight in flown_states(
            seed, vehicle, dynamics, wind_mps
        )
    ]  # fmt: skip
    assert len(flights) == 20
    assert [flight.lost_to for flight in flights] == [None] * 20
    assert sum(flight.called_at_m is not None for flight in flights) > 15


def test_a_small_vehicle_is_promised_nothing_in_more_wind_than_it_can_fly_against():
    assert flown_wind_mps(load_vehicle(CRAZYFLIE), 8.0) == pytest.approx(FLYABLE * 1.5)
    assert flown_wind_mps(load_vehicle("s500_v2"), 8.0) == 8.0


def city(dt_s):
    """An air taxi over 20 km of open country."""
    side_m, height_m = 20_000.0, 650.0
    corners = [(n, e, d) for d in (0.0, -height_m) for n in (0.0, side_m) for e in (0.0, side_m)]
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": "city",
            "dt_s": dt_s,
            "max_steps": 4000,
            "landing_distance_m": 50.0,
            "landing_speed_mps": 2.0,
            "uas_safe_distance_m": 300.0,
            "geofence": {"margin_m": 10.0, "vertices_m": corners},
            "waypoints": ({"position_m": (19e3, 19e3, -300.0), "radius_m": 9.0, "weight": 1.0},),
            "uas": (
                {
                    "name": "taxi",
                    "vehicle": AIR_TAXI,
                    "start_m": (1e3, 1e3, -100.0),
                    "soc_0": 1.0,
                    "radius_m": 8.15,
                    "dod_max": 0.8,
                },
            ),
        }
    )


@pytest.mark.parametrize("dt_s", [1.0, 2.0])
def test_an_air_taxi_flies_out_until_it_is_called_and_comes_home_at_full_speed(dt_s):
    world = World(city(dt_s), return_mode=True)
    x, speeds_mps = world.state.x[0], []
    world.state.x[0, DOD] = 0.2
    while not world.done:
        world.step({"taxi": GoTo(0)})
        if world.state.uas[0].returning:
            speeds_mps.append(float(np.hypot(x[VX], x[VY])))
    assert world.state.uas[0].status == LANDED
    assert max(speeds_mps) > 29.0
    assert 0.6 < x[DOD] < 0.8
