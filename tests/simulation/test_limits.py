"""The paper's X and U: inputs are saturated, states beyond a limit are noted."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from small_worlds import meadow

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.vehicle.layout import DOD, U_TH
from uas_coverage_env.vehicle.limits import (
    DISTURBED_TOLERANCE,
    LIMIT_NAMES,
    LIMITS,
    LPV_TOLERANCE,
    NONLINEAR_TOLERANCE,
    limit_names,
)
from uas_coverage_env.world import Acceleration, Velocity, Wrench

S500 = load_vehicle("s500_v2")


def exceeded(outcome):
    return set(limit_names(outcome["limits_exceeded"][0]))


def fly(world, wrenches):
    """Outcomes of a flight of one UAS by wrenches."""
    return [world.step({"uas_1": wrench}).copy() for wrench in wrenches]


def a_somersault():
    """The largest torque for four seconds, then the largest the other way."""
    torque = S500.torque_max_Nm[1]
    return [Wrench(0.0, 0.0, torque if step < 4 else -torque, 0.0) for step in range(6)]


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_torques_within_their_limits_that_lead_beyond_tilt_and_speed_are_noticed(dynamics):
    world = World(meadow([(100.0, 100.0, -10.0)]), dynamics=dynamics)
    outcomes = fly(world, a_somersault()[:3])
    assert exceeded(outcomes[0]) == set()
    assert {"tilt", "speed"} <= exceeded(outcomes[2])
    assert outcomes[2]["contact"][0] == 0
    assert world.state.uas[0].status == FLYING


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_inputs_beyond_their_limits_fly_as_those_at_the_limits(dynamics):
    limits, torque = S500.limits, np.array(S500.torque_max_Nm)
    flown = []
    for share in (1.0, 7.0):
        world = World(meadow([(100.0, 100.0, -10.0)]), dynamics=dynamics)
        outcomes = fly(
            world,
            [
                Wrench(share * limits.lift_max_N, *(share * torque)),
                Wrench(share * limits.lift_min_N, *(-share * torque)),
            ],
        )
        flown.append((world.state.x.copy(), [outcome["u"][0].copy() for outcome in outcomes]))
    np.testing.assert_array_equal(flown[0][0], flown[1][0])
    np.testing.assert_array_equal(flown[0][1], flown[1][1])
    np.testing.assert_array_equal(flown[0][1][0][:4], [limits.lift_max_N, *torque])


@pytest.mark.parametrize(("dynamics", "dt_s"), [("lpv", 1.0), ("nonlinear", 1.0), ("lpv", 0.2)])
def test_whatever_velocities_and_accelerations_are_asked_for_no_limit_is_exceeded(dynamics, dt_s):
    world = World(meadow([(100.0, 100.0, -25.0)], dt_s=dt_s), dynamics=dynamics)
    rng = np.random.default_rng(0)
    for step in range(300):
        if step % 5 == 0:
            north, east = 40.0 * rng.uniform(-1.0, 1.0, 2)
            down = rng.uniform(-8.0, 8.0)
            velocity = Velocity(north, east, rng.uniform(-40.0, 90.0))
            asked: list[Any] = [velocity, Acceleration(north, east, down)]
            command = rng.choice(asked)
        outcome = world.step({"uas_1": command})
        assert exceeded(outcome) == set()
        # on a meadow without an end
        world.state.x[0, :3] = 100.0, 100.0, -25.0


def beyond(limit, share):
    """A state that uses so much of a limit after a step without torques, and that step."""
    limits = S500.limits
    x, wrench = np.zeros(12), Wrench(0.0, 0.0, 0.0, 0.0)
    match limit:
        case "speed":
            # held by the tilt that goes with it
            x[3], x[7] = share * limits.v_xy_max_mps, 0.0
            x[7] = -S500.trim_tilt_rad_per_mps * x[3]
        case "climb":
            x[5] = -share * limits.v_up_max_mps
        case "descent":
            x[5] = share * limits.v_down_max_mps
        case "tilt":
            x[6:8] = np.array([0.6, 0.8]) * share * limits.tilt_max_rad
        case "tilt_rate":
            x[9:11] = np.array([0.6, 0.8]) * share * limits.rate_max_radps
            x[6:8] = -0.5 * x[9:11]
        case "yaw_rate":
            x[11] = -share * limits.yaw_rate_max_radps
    return x, wrench


@pytest.mark.parametrize("limit", LIMIT_NAMES[:-2])
def test_a_limit_may_be_exceeded_by_the_tolerance_and_no_more(limit):
    for share, noted in ((1.009, set()), (1.011, {limit})):
        world = World(meadow([(100.0, 100.0, -10.0)]))
        state, wrench = beyond(limit, share)
        world.state.x[0, 3:12] = state[3:]
        assert exceeded(world.step({"uas_1": wrench})) == noted


def with_battery(**changed):
    battery = S500.battery.model_copy(update=changed)
    return S500.model_copy(update={"battery": battery})


@pytest.mark.parametrize(
    ("limit", "battery"),
    [("current", {"current_max_A": 14.6}), ("voltage", {"voltage_min_V": 14.2})],
)
def test_a_battery_that_gives_too_much_is_noticed(limit, battery):
    scenario = meadow([(100.0, 100.0, -10.0)])
    vars(scenario)["vehicles"] = (with_battery(**battery),)
    world = World(scenario)
    # nearly empty, after a long climb
    world.state.x[0, [DOD, U_TH]] = 0.72, 0.6
    assert exceeded(world.step({"uas_1": Velocity(9.0, 6.0, 40.0)})) == {limit}


def test_a_uas_that_has_landed_rests_and_exceeds_nothing():
    for mode in ("covering", "return"):
        world = World(meadow([(100.0, 100.0, -1.0)]))
        world.state.x[0, 11] = 1.1 * S500.limits.yaw_rate_max_radps
        outcome = world.step({"uas_1": Wrench(0.0, 0.0, 0.0, 0.0, mode=mode)})
        assert outcome["landed"][0] == (mode == "return")
        assert exceeded(outcome) == (set() if mode == "return" else {"yaw_rate"})


def test_the_limits_are_told_in_the_documentation_as_they_are():
    text = Path(__file__).parents[2].joinpath("docs", "rules.md").read_text(encoding="utf-8")
    for bit, limit in enumerate(LIMITS):
        assert f"| {bit} | `{limit.name}` | {limit.unit} | {limit.meaning} |" in text
    assert f"tolerance is {LPV_TOLERANCE:.0%} of the limit" in text.replace(" %", "%")
    assert f'With `dynamics="nonlinear"` it is {NONLINEAR_TOLERANCE:.0%}' in text.replace(" %", "%")
    disturbed = f"act, it is {DISTURBED_TOLERANCE:.0%} in both models"
    assert disturbed in text.replace(" %", "%")
