"""When return mode calls a UAS home, to the second, and how long it takes the way home to be."""

import math

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.autopilot.belief import estimated_speed, vertical_margin_mps
from uas_coverage_env.autopilot.return_mode import (
    call_home,
    has_to_return,
    seconds_home,
    seconds_to_keep,
)
from uas_coverage_env.autopilot.return_path import flight_home, latest_flight_home
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.entities.state import CONSUMPTION, FLYING, LANDED, WIND
from uas_coverage_env.scenario import Sensor, with_disturbances
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX, VY
from uas_coverage_env.vehicle.range import margin_to_land, seconds_to_land
from uas_coverage_env.world.overhangs import widest_overhang_m
from uas_coverage_env.world.places import may_be_at
from uas_coverage_env.world.routes import ROUND_CORNER, leg_from_corner, route

HOME_M = (30.0, 40.0, -1.0)
WORK = (waypoint((190.0, 190.0, -40.0), 5.0),)
THERMAL = Sensor(name="thermal")
NEAR, FAR, HIGH = (60.0, 80.0, -3.0), (190.0, 180.0, -11.0), (40.0, 60.0, -45.0)


def world_at(place_m, velocity_mps=(0.0, 0.0), *, level=None, wind_mps=(0.0, 0.0), **more):
    """A UAS in flight at a place; with a level of disturbances, it believes in the wind given."""
    scenario = meadow([HOME_M], waypoints=WORK, **{"dt_s": 0.5, "max_steps": 4000, **more})
    world = World(with_disturbances(scenario, level, 1) if level else scenario)
    world.state.x[0, :3] = place_m
    world.state.x[0, [VX, VY]] = velocity_mps
    world.state.uas[0].belief[WIND : WIND + 2] = wind_mps
    return world


def parts(world):
    return world.arena, world.state.x[0], world.state.uas[0].belief[:]


def speeds_of(world):
    uas = world.arena.uas[0]
    return uas["speed_mps"], uas["climb_mps"], uas["descent_mps"]


# how long it takes


def test_time_that_a_uas_is_given_has_speed_share_landing_and_height_in_it():
    world = world_at(FAR)
    speed_mps, _, descent_mps = speeds_of(world)
    way_m, above_m = math.hypot(160.0, 140.0), 10.0
    expected_s = way_m / (2.0 / 3.0 * speed_mps) + above_m / descent_mps + 12.0
    assert seconds_home(world.arena, 0, world.state.x[0]) == pytest.approx(expected_s)
    world.state.x[0, 2] = -0.5  # lower than home
    level_s = way_m / (2.0 / 3.0 * speed_mps) + 12.0
    assert seconds_home(world.arena, 0, world.state.x[0]) == pytest.approx(level_s)


def landing_s(world, way_m, towards_mps, roof_m=-math.inf, before_m=None, after_m=None):
    """Of the calibrated model [s], with what a test knows of the way."""
    above_m = HOME_M[2] - float(world.state.x[0, 2])
    before_m = way_m if before_m is None else before_m
    after_m = way_m if after_m is None else after_m
    vehicle = world.arena.vehicles[0]
    return seconds_to_land(vehicle, way_m, towards_mps, above_m, roof_m, before_m, after_m)


@pytest.mark.parametrize("velocity_mps", [(0.0, 0.0), (5.0, -2.0), (-3.0, -9.0), (6.0, 8.0)])
def test_a_straight_way_home_begins_with_the_velocity_towards_it(velocity_mps):
    world = world_at(NEAR, velocity_mps)
    towards_mps = -(30.0 * velocity_mps[0] + 40.0 * velocity_mps[1]) / 50.0
    expected_s = landing_s(world, 50.0, towards_mps)
    seconds, margin_s = flight_home(*parts(world)[:1], 0, world.state.x[0], parts(world)[2])
    assert seconds == pytest.approx(expected_s)
    assert margin_s == pytest.approx(margin_to_land(expected_s, False))


def test_over_home_the_way_home_is_down():
    world = world_at((*HOME_M[:2], -21.0), (4.0, 3.0))
    seconds, margin_s = flight_home(world.arena, 0, world.state.x[0])
    assert seconds == pytest.approx(landing_s(world, 0.0, 0.0))
    assert margin_s == pytest.approx(margin_to_land(seconds, False))


@pytest.mark.parametrize("across", [False, True])
def test_walls_on_the_way_home_are_passed_over_from_the_first_to_the_last(across):
    def turned(point):
        return (point[1], point[0], point[2]) if across else point

    walls = [
        box("low", turned((60.0, 0.5, -12.0)), turned((64.0, 199.5, 0.0))),
        box("high", turned((90.0, 0.5, -20.0)), turned((93.0, 199.5, 0.0))),
    ]
    scenario = meadow([turned((30.0, 100.0, -1.0))], obstacles=walls, waypoints=WORK)
    world = World(scenario)
    world.state.x[0, :3] = turned((120.0, 100.0, -4.0))
    low, high = world.arena.obstacles
    assert not world.arena.obstacles["tall"].any()
    before_m = 120.0 - (93.0 + high["wall_m"])
    after_m = (60.0 - low["wall_m"]) - 30.0
    expected_s = seconds_to_land(
        world.arena.vehicles[0], 90.0, 0.0, 3.0, float(high["roof_m"]) + 0.5 - 1.0,
        before_m, after_m,
    )  # fmt: skip
    seconds, margin_s = flight_home(world.arena, 0, world.state.x[0])
    assert seconds == pytest.approx(expected_s)
    assert seconds > landing_s(world, 90.0, 0.0) + 3.0
    assert margin_s == pytest.approx(margin_to_land(expected_s, True))


def corners_of_way(world):
    """(K, 2) places [m] between which the straight legs of the way home lie."""
    arena, here_m = world.arena, world.state.x[0, :3]
    home_m = np.array(world.scenario.uas[0].start_m)
    row = len(world.scenario.waypoints)
    *end_m, _, leg = route(arena, row, *here_m, *home_m)
    corners_m = [here_m[:2].copy(), np.array(end_m)]
    while leg == ROUND_CORNER:
        *end_m, leg = leg_from_corner(arena, row, *corners_m[-1], here_m[2], *home_m)
        corners_m.append(np.array(end_m))
    return np.array(corners_m)


@pytest.mark.parametrize("low_m", [(36.0, 40.0), (120.0, 124.0)], ids=["last", "first"])
@pytest.mark.parametrize("across", [False, True])
def test_on_a_way_round_a_tall_building_the_wall_of_any_leg_is_passed_over(low_m, across):
    def turned(point):
        return (point[1], point[0], point[2]) if across else point

    tall = box("tall", turned((75.0, 60.0, -49.5)), turned((95.0, 140.0, 0.0)))
    low = box("low", turned((low_m[0], 0.5, -10.0)), turned((low_m[1], 199.5, 0.0)))
    world = World(meadow([turned((20.0, 95.0, -1.0))], obstacles=[tall, low], waypoints=WORK))
    assert world.arena.obstacles["tall"].tolist() == [True, False]
    world.state.x[0, :3] = turned((150.0, 95.0, -3.0))
    corners_m = corners_of_way(world)
    assert len(corners_m) == 4
    lengths_m = np.linalg.norm(np.diff(corners_m, axis=0), axis=1)
    flown_m, north_m = np.append(0.0, np.cumsum(lengths_m)), corners_m[:, int(across)]
    wall_m, roof_m = (float(world.arena.obstacles[name][1]) for name in ("wall_m", "roof_m"))
    before_m, until_m = (
        float(np.interp(-edge_m, -north_m, flown_m))
        for edge_m in (low_m[1] + wall_m, low_m[0] - wall_m)
    )
    expected_s = seconds_to_land(
        world.arena.vehicles[0], flown_m[-1], 0.0, 2.0, roof_m + 0.5 - 1.0, before_m,
        flown_m[-1] - until_m,
    )  # fmt: skip
    seconds, margin_s = flight_home(world.arena, 0, world.state.x[0])
    assert seconds == pytest.approx(expected_s)
    assert margin_s == pytest.approx(margin_to_land(expected_s, True))


@pytest.mark.parametrize("wind_mps", [(4.0, 0.0), (0.0, -5.0), (-3.0, 3.0), (3.6, 4.8)])
def test_wind_makes_the_way_home_longer_and_its_margin_wider(wind_mps):
    still, windy = world_at(NEAR), world_at(NEAR, level="light", wind_mps=wind_mps)
    still_s = landing_s(still, 50.0, 0.0)
    vehicle, uas = windy.arena.vehicles[0], windy.arena.uas[0]
    speed_mps = estimated_speed(
        vehicle.reference_max_mps, uas.speed_mps, *wind_mps, -30.0 / 50.0, -40.0 / 50.0
    )
    assert speed_mps < uas.speed_mps or wind_mps[0] <= 0.0
    more_s = 50.0 / speed_mps - 50.0 / uas.speed_mps
    down_mps = vehicle.v_down_max_mps
    slower_mps = down_mps - vertical_margin_mps(windy.state.uas[0].belief)
    more_s += 2.0 * (1.0 / slower_mps - 1.0 / down_mps)
    seconds, margin_s = flight_home(windy.arena, 0, *parts(windy)[1:])
    assert seconds == pytest.approx(still_s + more_s)
    blows_mps = math.hypot(*wind_mps)
    expected_s = margin_to_land(seconds, False) + 0.15 * seconds + 15.0 * blows_mps / uas.speed_mps
    assert margin_s == pytest.approx(expected_s)
    # what is not disturbed, or does not know, takes the still air's
    assert flight_home(windy.arena, 0, windy.state.x[0])[0] == pytest.approx(still_s)
    still.state.uas[0].belief[:2] = wind_mps
    assert flight_home(still.arena, 0, *parts(still)[1:])[0] == pytest.approx(still_s)


@pytest.mark.parametrize(
    ("here_m", "home_m", "low", "high"),
    [
        ((100.0, 100.0, -5.0), (30.0, 100.0, -30.0), (80.0, 80.0, -14.0), (120.0, 130.0, -10.0)),
        ((100.0, 100.0, -30.0), (30.0, 100.0, -1.0), (10.0, 90.0, -16.0), (40.0, 110.0, -9.0)),
    ],
    ids=["here", "home"],
)
def test_from_below_a_slab_and_to_below_one_it_takes_longer(here_m, home_m, low, high):
    slab = box("slab", low, high)
    world = World(meadow([home_m], obstacles=[slab], waypoints=WORK))
    arena = world.arena
    world.state.x[0, :3] = here_m
    across_m, climb_m = widest_overhang_m(arena, *min(here_m, home_m, key=lambda m: -m[2]))
    assert across_m > 30.0
    assert climb_m > 10.0
    seconds, _ = flight_home(arena, 0, world.state.x[0])
    arena.rules["overhangs"] = False
    without_s, _ = flight_home(arena, 0, world.state.x[0])
    climb_mps = arena.uas["climb_mps"][0]
    assert seconds - without_s == pytest.approx(15.0 + across_m / 0.6 + climb_m / climb_mps)


@pytest.mark.parametrize(
    ("velocity_mps", "wind_mps", "dt_s"),
    [((0.0, 0.0), (0.0, 0.0), 0.5), ((8.0, -6.0), (3.0, -2.0), 1.0), ((8.0, 6.0), (0.0, 0.0), 1.0)],
)
def test_a_step_later_the_way_home_is_that_from_the_farthest_place_that_may_be_reached(
    velocity_mps, wind_mps, dt_s
):
    wall = box("wall", (95.0, 60.0, -49.5), (98.0, 160.0, 0.0))
    world = world_at(
        (104.0, 100.0, -3.0), velocity_mps, level="light", wind_mps=wind_mps, obstacles=[wall],
        dt_s=dt_s,
    )  # fmt: skip
    arena, x, belief = parts(world)
    vehicle = arena.vehicles[0]
    most_mps2 = vehicle.gravity_mps2 * math.tan(vehicle.tilt_max_rad)
    stops_s = 1.5 * math.hypot(*velocity_mps) / most_mps2
    longest_s = 1.5 * vehicle.v_xy_max_mps / most_mps2
    middle_m = x[:2] + (dt_s + 0.6 * stops_s) * np.array(velocity_mps)
    around_m = most_mps2 * dt_s * (dt_s + 0.6 * longest_s)
    down_m = min(-3.0 + dt_s * vehicle.v_down_max_mps, -arena.rules[0]["floor_m"])
    turns = np.arange(8) * np.pi / 4
    ring_m = around_m * np.column_stack([np.cos(turns), np.sin(turns)])
    places_m = [middle_m, *(middle_m + ring_m), *(middle_m + 2.0 * ring_m)]
    latest_s, refused = [], 0
    for place_m in places_m:
        there = x.copy()
        there[:3], there[VX : VY + 1] = (*place_m, down_m), 0.0
        if may_be_at(arena, 0, *there[:3]):
            latest_s.append(sum(flight_home(arena, 0, there, belief)))
        else:
            refused += 1
    assert refused > 0 < len(latest_s)
    expected_s = dt_s + stops_s + max(latest_s)
    assert latest_flight_home(arena, 0, x, belief) == pytest.approx(expected_s)


@pytest.mark.parametrize("place_m", [NEAR, HIGH])
def test_where_little_is_left_the_way_home_a_step_later_counts_too(place_m):
    world = world_at(place_m, (6.0, 8.0))
    arena, x, belief = parts(world)
    now_s = sum(flight_home(arena, 0, x, belief))
    later_s = now_s + 3.0 * world.scenario.dt_s
    after_s = latest_flight_home(arena, 0, x, belief)
    assert after_s > later_s
    for left_s, kept_s in (
        (later_s - 0.01, later_s),
        (later_s + 0.01, after_s),
        (2.0 * now_s + 119.9, after_s),
        (2.0 * now_s + 120.1, later_s),
    ):
        assert seconds_to_keep(arena, 0, x, left_s, belief) == pytest.approx(kept_s)


# when it is called


def flips_at(calls, low, high, steps=45):
    """Where something that is false at `low` becomes true on the way to `high`."""
    assert not calls(low)
    assert calls(high)
    for _ in range(steps):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if calls(middle) else (middle, high)
    return high


def at_dod(world, asked):
    def calls(dod):
        world.state.x[0, DOD] = dod
        return asked(world)

    return calls


def has_to(world):
    return bool(has_to_return(world.arena, world.state, 0))


def goes_on_home(world):
    """Whether a UAS that was called is not let go back to work."""
    world.state.uas[0].returning = True
    call_home(world.arena, world.state, False, np.zeros(1, OUTCOME_DTYPE))
    return bool(world.state.uas[0].returning)


@pytest.mark.parametrize("asked", [has_to, goes_on_home])
@pytest.mark.parametrize("consumption", [0.0, 0.2, -0.3])
@pytest.mark.parametrize("place_m", [NEAR, FAR, HIGH])
@pytest.mark.parametrize("level", ["light", "strong"])
def test_a_battery_calls_a_uas_home_when_it_leaves_no_more_than_is_to_be_kept(
    place_m, level, consumption, asked
):
    world = world_at(place_m, (3.0, 4.0), level=level)
    arena, x, belief = parts(world)
    belief[CONSUMPTION] = consumption
    share, more_s = (1.0, 0.0) if asked is has_to else (2.0, 60.0)
    uas, rules = arena.uas[0], arena.rules[0]
    waits_s = 20.0 * max(arena.tube_m[0, -1] / rules.landing_distance_m - 2.0, 0.0)
    assert (waits_s > 0.0) == (level == "strong")

    def is_short(dod):
        home_s = share * seconds_home(arena, 0, x) + more_s
        if dod + home_s * uas.dod_per_s >= uas.dod_max:
            return True
        left_s = (uas.dod_max - dod) / (uas.dod_per_s * (1.0 + max(consumption, 0.0))) - waits_s
        return share * seconds_to_keep(arena, 0, x, left_s, belief) + more_s >= left_s

    expected = flips_at(is_short, 0.0, 0.75)
    assert flips_at(at_dod(world, asked), 0.0, 0.75) == pytest.approx(expected, abs=1e-9)


def test_far_away_the_time_that_a_uas_is_given_calls_it_before_the_calibrated_way_does():
    world = world_at((190.0, 180.0, -45.0))
    arena, x, _ = parts(world)
    uas = arena.uas[0]
    home_s = seconds_home(arena, 0, x)
    assert home_s > seconds_to_keep(arena, 0, x, home_s)
    called_at = flips_at(at_dod(world, has_to), 0.0, 0.75)
    assert called_at == pytest.approx(uas.dod_max - home_s * uas.dod_per_s, abs=1e-9)


@pytest.mark.parametrize("place_m", [NEAR, FAR, HIGH])
def test_the_clock_calls_a_uas_home_with_half_a_minute_to_spare(place_m):
    world = world_at(place_m, dt_s=0.2)
    needed_s = seconds_home(world.arena, 0, world.state.x[0]) + 30.0 - 12.0
    last = math.floor(4000 - needed_s / 0.2)  # then there is as much left, or a little more
    world.state.step[0] = last
    assert not has_to(world)
    world.state.step[0] = last + 1
    assert has_to(world)


@pytest.mark.parametrize("heading_rad", [0.0, 1.2, 2.5, 4.0])
def test_a_wind_of_nearly_the_highest_airspeed_calls_home_only_where_wind_is_declared(heading_rad):
    def calls(wind_mps):
        blows = wind_mps * math.cos(heading_rad), wind_mps * math.sin(heading_rad)
        world.state.uas[0].belief[WIND : WIND + 2] = blows
        return has_to(world)

    world = world_at((*HOME_M[:2], -3.0), level="light")
    most_mps = world.arena.vehicles[0].reference_max_mps
    assert flips_at(calls, 0.0, 14.0) == pytest.approx(0.88 * most_mps)
    world = world_at((*HOME_M[:2], -3.0))
    assert not calls(14.0)


def test_a_uas_with_nothing_left_to_cover_is_called_and_one_with_something_is_not():
    world = world_at(NEAR)
    assert not has_to(world)
    world.state.uncovered[:] = False
    assert has_to(world)


def test_waypoints_that_only_others_can_cover_do_not_keep_a_uas_from_home():
    scenario = meadow([HOME_M, (60.0, 60.0, -1.0)], waypoints=[WORK[0] | {"sensor": "thermal"}])
    fleet = (scenario.uas[0], scenario.uas[1].model_copy(update={"sensors": (THERMAL,)}))
    world = World(scenario.model_copy(update={"uas": fleet}))
    assert [bool(has_to_return(world.arena, world.state, i)) for i in (0, 1)] == [True, False]


def test_in_still_air_a_uas_that_was_called_stays_called_and_in_wind_it_may_go_back():
    for level, stays in ((None, True), ("light", False)):
        assert goes_on_home(world_at(NEAR, level=level)) == stays


def test_only_those_that_fly_are_called():
    world = World(meadow([HOME_M, (60.0, 60.0, -1.0)], waypoints=WORK))
    world.state.uncovered[:] = False
    world.state.uas[0].status = LANDED
    call_home(world.arena, world.state, False, np.zeros(2, OUTCOME_DTYPE))
    assert world.state.uas["returning"].tolist() == [False, True]
    assert world.state.uas["status"].tolist() == [LANDED, FLYING]
