"""What coming home takes: calibrated on flown returns, and never less than them with its margin."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from uas_coverage_env import MissionBrief, World, load_scenario
from uas_coverage_env.mission import Range
from uas_coverage_env.vehicle.layout import DOD, VX, VY, Z
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.world import Velocity

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))

from returns import flown_returns, town

FIRST_SEED, TOWNS = 7000, 10


@pytest.fixture(scope="module")
def errors():
    """(n, 4): time and charge flown less expected, over the margin; relative to the expected."""
    rows = []
    for seed in range(FIRST_SEED, FIRST_SEED + TOWNS):
        answers = Range(MissionBrief.of(town(seed)))
        for flown in flown_returns(seed):
            home = answers.home(0, flown.x)
            late_s, used = flown.time_s - home.time_s, flown.dod - home.dod
            rows.append(
                (
                    late_s / home.time_margin_s,
                    used / home.dod_margin,
                    late_s / home.time_s,
                    used / home.dod,
                )
            )
    return np.array(rows)


def test_no_return_takes_more_time_or_charge_than_estimated_with_the_margin(errors):
    assert len(errors) == 5 * TOWNS
    assert (errors[:, :2] < 1.0).all()


def test_the_expected_values_are_neither_cautious_nor_daring(errors):
    assert (np.abs(np.median(errors[:, 2:], axis=0)) < 0.03).all()
    assert (np.percentile(np.abs(errors[:, 2:]), 80, axis=0) < 0.06).all()


@pytest.fixture(scope="module")
def field():
    return MissionBrief.of(load_scenario("open_field"))


def state(field, north_m, velocity_mps=(0.0, 0.0), height_m=10.0, dod=0.2):
    x = World(field.as_scenario()).state.x[0].copy()
    x[0] += north_m
    x[Z] -= height_m
    x[VX], x[VY] = velocity_mps
    x[DOD] = dod
    return x


def test_the_farther_the_higher_and_the_faster_away_the_more_it_takes(field):
    answers = Range(field)
    near, far = (answers.home(0, state(field, m)) for m in (60.0, 160.0))
    speed_mps = field.vehicles[0].limits.v_xy_max_mps
    assert far.time_s - near.time_s == pytest.approx(100.0 / speed_mps)
    assert far.time_margin_s > near.time_margin_s
    away = answers.home(0, state(field, 60.0, (speed_mps, 0.0)))
    assert away.time_s > near.time_s > answers.home(0, state(field, 60.0, (-6.0, 0.0))).time_s
    high = answers.home(0, state(field, 60.0, height_m=39.0))
    assert high.time_s > 39.0 / field.vehicles[0].limits.v_down_max_mps > near.time_s


def test_an_emptier_battery_pays_more_for_the_same_flight(field):
    answers = Range(field)
    full, empty = (answers.home(0, state(field, 100.0, dod=dod)) for dod in (0.0, 0.7))
    assert full.time_s == empty.time_s
    assert empty.dod > 1.05 * full.dod


def test_obstacles_make_the_way_longer_and_the_margin_larger():
    village = load_scenario("village")
    free = village.model_copy(update={"obstacles": ()})
    behind = World(village).state.x[0].copy()
    answers = [Range(MissionBrief.of(made)) for made in (village, free)]
    obstructed = 0
    for hull in village.hulls:
        middle_m = hull.vertices_m.mean(axis=0)
        away_m = (middle_m - village.uas[0].start_m)[:2]
        behind[:2] = middle_m[:2] + 40.0 * away_m / np.linalg.norm(away_m)
        behind[Z] = middle_m[2]
        past, straight = (answer.home(0, behind) for answer in answers)
        assert past.time_s >= straight.time_s
        obstructed += past.time_margin_s > straight.time_margin_s + 4.0
    assert obstructed >= 3


def test_at_the_point_of_no_return_the_charge_suffices_for_the_way_home_and_no_more():
    scenario = town(FIRST_SEED)
    brief, (flown, *_) = MissionBrief.of(scenario), flown_returns(FIRST_SEED)
    answers, x = Range(brief), flown.x.copy()

    def spare(dod):
        x[DOD] = dod
        return answers.spare_dod(0, x)

    assert spare(0.0) > 0.0 > spare(brief.uas[0].dod_max)
    last = brentq(spare, 0.0, brief.uas[0].dod_max)
    assert last + flown.dod < brief.uas[0].dod_max


def test_the_rate_of_discharge_is_that_of_a_flight_at_full_speed(field):
    scenario = field.as_scenario()
    world = World(scenario)
    world.state.x[:, DOD] = 0.4
    names, speed_mps = world.names, 0.95 * field.vehicles[0].limits.v_xy_max_mps
    for _ in range(14):
        before = world.state.x[0, DOD]
        world.step({name: Velocity(speed_mps, 0.0, 10.0) for name in names})
    rate = (world.state.x[0, DOD] - before) / scenario.dt_s
    assert dod_per_s(field.vehicles[0], 0.4) == pytest.approx(rate, rel=0.03)
