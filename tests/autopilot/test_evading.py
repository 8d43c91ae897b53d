"""Evasive flights: how much room each has, and that the best of all is flown."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import clearance_of_cylinder
from small_worlds import box, meadow, mover

from uas_coverage_env.autopilot.evasion import evade, room_from_movers
from uas_coverage_env.autopilot.lookahead import (
    braking_slack,
    fixed_slack,
    fly_and_brake,
    peer_slack,
)
from uas_coverage_env.entities.commands import CLIMB, COMMAND_DTYPE
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VX, VY

SURPRISE_S, ENOUGH_M, LINGERING, PLENTY_M = 1.0, 3.0, 0.05, 2.0
RADIUS_M = 0.36


def watched(places_m, movers, obstacles=(), dt_s=1.0):
    """A world in which the first UAS is to evade, and each other one is committed to braking."""
    homes_m = [(10.0 + 10.0 * i, 10.0, -1.0) for i in range(len(places_m))]
    scenario = meadow(homes_m, moving_obstacles=movers, obstacles=obstacles, dt_s=dt_s)
    world = World(scenario, safety_filter=True)
    world.state.x[:, :3] = places_m
    committed_m = np.zeros((len(places_m), int(world.arena.rules[0]["lookahead_steps"]) + 1, 3))
    for i in range(1, len(places_m)):
        fly_and_brake(world.arena, i, *flown(world, i), world.arena.rules[0].brake, False,
                      committed_m[i], world.state.uas[i].belief[:])  # fmt: skip
    return world, committed_m


def flown(world, i=0):
    return world.state.x[i], world.state.uas[i].reference_mps[:]


def climb_of(velocity_mps):
    """A command to fly a velocity (north, east, down)."""
    command = np.zeros(1, COMMAND_DTYPE).view(np.recarray)[0]
    command.kind = CLIMB
    command.values[:3] = velocity_mps
    return command


def expected_room(scenario, step, path_m):
    """Room of the first UAS [m], as the module's text says, from the scenario alone."""
    time_s, dt_s = step * scenario.dt_s, scenario.dt_s
    rooms, hits = [], []
    for moving, centre_m in zip(
        scenario.moving_obstacles, scenario.moving_positions(time_s), strict=True
    ):
        (piece,) = moving.schedule
        velocity_mps = np.array(piece.velocity_mps)
        kept_m = RADIUS_M + moving.safe_distance_m + SURPRISE_S * np.linalg.norm(velocity_mps)
        ahead_m = centre_m + np.arange(len(path_m))[:, None] * dt_s * velocity_mps
        for k, away_m in enumerate(path_m - ahead_m):
            if k + 1 < len(path_m):
                to_m = path_m[k + 1] - ahead_m[k + 1]
                clear_m = clearance_of_cylinder(moving.radius_m, moving.height_m / 2, away_m, to_m)
                rooms.append(clear_m - kept_m)
                hits += [k] if clear_m < RADIUS_M else []
    if hits:
        return None, min(hits)
    return min([ENOUGH_M, *rooms]) + LINGERING * np.minimum(rooms, 0.0).sum() / (
        len(path_m) - 1
    ), None


speeds = st.floats(-6.0, 6.0)
velocities = st.tuples(speeds, speeds, st.sampled_from([0.0, -2.0, 1.5]))
offsets = st.tuples(*[st.floats(-25.0, 25.0)] * 2, st.floats(-10.0, 10.0))


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    movers=st.lists(st.tuples(offsets, velocities), min_size=1, max_size=2),
    step=st.integers(0, 12),
    steps=st.lists(st.tuples(speeds, speeds, st.floats(-2.0, 2.0)), min_size=1, max_size=5),
    dt_s=st.sampled_from([0.5, 1.0]),
)
def test_the_room_of_a_path_is_what_it_keeps_from_what_moves_on_as_it_moves_now(
    movers, step, steps, dt_s
):
    here_m = np.array([100.0, 100.0, -25.0])
    moving = [
        mover(tuple(here_m + away), (0.0, v), radius_m=1.0 + k, height_m=3.0 + k,
              safe_distance_m=1.0 + k, name=f"mover_{k}")
        for k, (away, v) in enumerate(movers)
    ]  # fmt: skip
    world, _ = watched([tuple(here_m)], moving, dt_s=dt_s)
    path_m = here_m + np.vstack([np.zeros(3), dt_s * np.cumsum(steps, axis=0)])
    room_m, hit = expected_room(world.scenario, step, path_m)
    found_m = room_from_movers(world.arena, step, 0, path_m)
    if hit is None:
        assert found_m == pytest.approx(room_m, abs=1e-6)
    else:
        assert found_m == pytest.approx(-1e6 + hit * dt_s, rel=0.0, abs=1e-6)


def path_along(velocity_mps, n_steps=4):
    return np.array([100.0, 100.0, -25.0]) + np.arange(n_steps + 1)[:, None] * velocity_mps


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_what_comes_is_met_where_it_will_be_at_the_end_of_a_step(axis):
    towards = np.eye(3)[axis]
    for sign in (1.0, -1.0):
        comes = mover(
            tuple(np.array([100.0, 100.0, -25.0]) + sign * 20.0 * towards),
            (0.0, tuple(-sign * 4.0 * towards)), radius_m=2.0, height_m=4.0, safe_distance_m=1.0,
        )  # fmt: skip
        world, _ = watched([(100.0, 100.0, -25.0)], [comes])
        # 20 m less 2 m of its own and 5.36 m to be kept; it comes 4 m nearer in each of 2 steps
        stays_m = room_from_movers(world.arena, 0, 0, path_along(0.0 * towards, 2))
        assert stays_m == pytest.approx(ENOUGH_M)
        stays_m = room_from_movers(world.arena, 0, 0, path_along(0.0 * towards, 3))
        assert stays_m == pytest.approx(20.0 - 2.0 - 5.36 - 12.0)
        flees_m = room_from_movers(world.arena, 0, 0, path_along(-sign * 2.0 * towards, 3))
        assert flees_m == pytest.approx(ENOUGH_M)
        meets_m = room_from_movers(world.arena, 0, 0, path_along(sign * 1.0 * towards, 3))
        assert meets_m == pytest.approx(20.0 - 2.0 - 5.36 - 15.0 + LINGERING * (-2.36) / 3)


def test_a_path_that_ends_in_a_contact_is_worth_the_less_the_sooner_it_does():
    comes = mover((130.0, 100.0, -25.0), (0.0, (-4.0, 0.0, 0.0)), radius_m=2.0, height_m=4.0)
    for dt_s, flown_mps, hit in ((1.0, 0.0, 6), (1.0, 2.0, 4), (0.5, 0.0, 13), (0.5, 2.0, 9)):
        world, _ = watched([(100.0, 100.0, -25.0)], [comes], dt_s=dt_s)
        path_m = path_along(dt_s * flown_mps * np.eye(3)[0], 18)
        found_m = room_from_movers(world.arena, 0, 0, path_m)
        assert found_m == pytest.approx(-1e6 + hit * dt_s, rel=0.0, abs=1e-6)
        # the radius of the UAS decides what a contact is
        for gap_m, is_hit in ((RADIUS_M - 1e-6, True), (RADIUS_M + 1e-6, False)):
            aside_m = path_along(np.zeros(3), 18)
            aside_m[:, 1] += 2.0 + gap_m
            assert (room_from_movers(world.arena, 0, 0, aside_m) < -1e5) == is_hit


def ways_of(world, heading_rad):
    """Velocities (3,) [m/s] of evasive flights at full speed, nearest to the heading first."""
    uas = world.arena.uas[0]
    turns_deg = [0, 30, -30, 60, -60, 90, -90, 120, -120, 150, -150, 180]
    angles = heading_rad + np.deg2rad(turns_deg)
    level = [(uas.speed_mps * math.cos(a), uas.speed_mps * math.sin(a)) for a in angles]
    return [
        (*way, down_mps)
        for way in [*level, (0.0, 0.0)]
        for down_mps in (0.0, -uas.climb_mps, uas.descent_mps)
    ]


def is_provable(world, committed_m, velocity_mps):
    path_m = np.zeros_like(committed_m[0])
    command = climb_of(velocity_mps)
    asked = world.arena, world.state, 0, command, False, -1e-3, path_m, committed_m, False
    return braking_slack(*asked) >= -1e-3, path_m


def room_held(world, committed_m, velocity_mps, n_held):
    """Room [m] of a velocity held for some steps and braked; None where something is in the way."""
    arena, path_m = world.arena, np.zeros_like(committed_m[0])
    fly_and_brake(arena, 0, *flown(world), climb_of(velocity_mps), False, path_m,
                  world.state.uas[0].belief[:], n_held)  # fmt: skip
    slack_m = min(
        fixed_slack(arena, 0, path_m, len(path_m) - 1, -math.inf, PLENTY_M),
        peer_slack(arena, world.state.uas, 0, path_m, committed_m, -math.inf, PLENTY_M),
    )
    return room_from_movers(arena, world.state.step[0], 0, path_m) if slack_m >= 0.0 else None


def rooms_of(world, committed_m, heading_rad):
    """(Velocity, room [m]) of braking, first, and of every evasive flight at full speed."""
    _, path_m = is_provable(world, committed_m, (0.0, 0.0, 0.0))
    found = [((0.0, 0.0, 0.0), room_from_movers(world.arena, world.state.step[0], 0, path_m))]
    for velocity_mps in ways_of(world, heading_rad):
        if is_provable(world, committed_m, velocity_mps)[0]:
            for held_s in (8.0, 3.0):
                n_held = round(held_s / world.scenario.dt_s)
                room_m = room_held(world, committed_m, velocity_mps, n_held)
                found += [(velocity_mps, room_m)] if room_m is not None else []
    return found


def rooms_near(world, committed_m, heading_rad):
    """The same of slower and shorter flights, each as long as there is room, by halving."""
    found = []
    for full_mps in ways_of(world, heading_rad):
        for share in (1.0, 0.35, 0.1):
            velocity_mps = tuple(share * np.array(full_mps))
            if not is_provable(world, committed_m, velocity_mps)[0]:
                continue
            held, longest = 0, round(8.0 / world.scenario.dt_s)
            while held < longest:
                n_held = math.ceil((held + longest) / 2)
                room_m = room_held(world, committed_m, velocity_mps, n_held)
                if room_m is None:
                    longest = n_held - 1
                else:
                    held = n_held
                    found.append((velocity_mps, room_m))
    return found


def evaded(world, committed_m, heading_rad=0.0):
    """(Whether it can be braked, velocity (3,) that is flown, path to which it is committed)."""
    command, path_m = climb_of((9.0, 9.0, 9.0)), np.zeros_like(committed_m[0])
    safe = evade(world.arena, world.state, 0, heading_rad, False, command, path_m, committed_m)
    return safe, command.values[:3].copy(), path_m


def street(wall_m, mate_m, comes_m, velocity_mps):
    """Hovering beside a wall and a mate while something comes."""
    comes = mover(comes_m, (0.0, velocity_mps), safe_distance_m=4.0)
    wall = box("wall", (60.0, 104.0 + wall_m, -48.0), (140.0, 106.0 + wall_m, 0.0))
    return watched([(100.0, 100.0, -20.0), mate_m], [comes], [wall])


def corner(down_m):
    """Hovering in a corner, right below the ceiling or above the ground, and all sides are shut."""
    comes = mover((144.0, 144.0, down_m), (0.0, (2.1, 2.1, 0.0)), radius_m=40.0,
                  safe_distance_m=1.0)  # fmt: skip
    return watched([(194.0, 194.0, down_m)], [comes])


STREETS = {
    "open": (60.0, (20.0, 20.0, -20.0), (128.0, 101.0, -20.0), (-5.0, 0.0, 0.0)),
    "wall": (3.0, (20.0, 20.0, -20.0), (100.5, 70.0, -18.0), (0.0, 5.0, 0.5)),
    "mate": (40.0, (107.0, 93.0, -20.0), (80.0, 84.0, -20.0), (4.0, 3.0, 0.0)),
    "above": (2.0, (88.0, 100.0, -21.0), (100.0, 100.0, -44.0), (0.0, 0.0, 3.0)),
}


@pytest.mark.parametrize("heading_rad", [0.3, -2.0])
@pytest.mark.parametrize("place", [*STREETS, "ceiling", "ground"])
def test_of_all_evasive_flights_at_full_speed_the_one_with_most_room_is_flown(place, heading_rad):
    if place in STREETS:
        world, committed_m = street(*STREETS[place])
    else:
        world, committed_m = corner({"ceiling": -49.3, "ground": -0.7}[place])
    found = rooms_of(world, committed_m, heading_rad)
    most_m = max(room_m for _, room_m in found)
    assert 0.0 < most_m > found[0][1]
    best = next(velocity for velocity, room_m in found if room_m == most_m)
    safe, velocity_mps, path_m = evaded(world, committed_m, heading_rad)
    assert safe
    np.testing.assert_allclose(velocity_mps, best, atol=1e-9)
    expected_m = np.zeros_like(path_m)
    fly_and_brake(world.arena, 0, *flown(world), climb_of(best), False, expected_m,
                  world.state.uas[0].belief[:])  # fmt: skip
    np.testing.assert_array_equal(path_m, expected_m)


@pytest.mark.parametrize("quarter", [1, 2])
def test_an_evasive_flight_turns_with_what_comes(quarter):
    angle = 0.5 * math.pi * quarter
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    away_m, speed_mps = np.array([24.0, 7.0]), np.array([-5.0, -1.0])
    flights = []
    for heading, rotation in ((0.5, np.eye(2)), (0.5 + angle, turn)):
        place_m = np.array([100.0, 100.0]) + rotation @ away_m
        comes = mover((*place_m, -20.0), (0.0, (*(rotation @ speed_mps), 0.0)))
        flights.append(evaded(*watched([(100.0, 100.0, -20.0)], [comes]), heading)[1])
    assert np.hypot(*flights[0][:2]) > 1.0
    np.testing.assert_allclose(turn @ flights[0][:2], flights[1][:2], atol=1e-6)
    assert flights[0][2] == flights[1][2]


def test_a_uas_that_cannot_brake_clear_of_a_wall_has_no_evasive_flight():
    comes = mover((60.0, 100.0, -20.0), (0.0, (5.0, 0.0, 0.0)))
    wall = box("wall", (106.0, 60.0, -48.0), (110.0, 140.0, 0.0))
    world, committed_m = watched([(100.0, 100.0, -20.0)], [comes], [wall])
    assert evaded(world, committed_m)[0]
    world.state.x[0, [VX, VY]] = 12.0, 0.0
    world.state.uas[0].reference_mps[:] = 12.0, 0.0
    assert not evaded(world, committed_m)[0]


def test_between_walls_the_slower_or_shorter_flight_with_most_room_is_flown():
    walls = [
        box("one", (70.0, 86.0, -49.0), (130.0, 90.5, 0.0), 1.0),
        box("other", (70.0, 109.5, -49.0), (130.0, 114.0, 0.0), 1.0),
        box("end", (70.0, 90.5, -49.0), (93.0, 109.5, 0.0), 1.0),
    ]
    comes = mover((115.0, 98.0, -20.0), (0.0, (-2.0, 0.0, 0.0)), radius_m=1.5,
                  height_m=80.0, safe_distance_m=3.0)  # fmt: skip
    world, committed_m = watched([(100.0, 100.0, -20.0)], [comes], walls)
    far = rooms_of(world, committed_m, 0.0)
    near = rooms_near(world, committed_m, 0.0)
    far_m, near_m = (max(room_m for _, room_m in found) for found in (far, near))
    assert far_m < 0.0
    assert near_m > far_m
    best = next(velocity for velocity, room_m in near if room_m == near_m)
    safe, velocity_mps, path_m = evaded(world, committed_m)
    assert safe
    np.testing.assert_allclose(velocity_mps, best, atol=1e-9)
    assert 0.0 < np.linalg.norm(velocity_mps) < 11.0
    assert fixed_slack(world.arena, 0, path_m, len(path_m) - 1, 0.0, PLENTY_M) >= -1e-3


def test_in_a_yard_that_leaves_room_for_one_step_at_full_speed_that_step_is_flown():
    walls = [
        box("north", (116.0, 80.0, -49.0), (120.0, 120.0, 0.0), 1.0),
        box("south", (80.0, 80.0, -49.0), (84.0, 120.0, 0.0), 1.0),
        box("east", (84.0, 116.0, -49.0), (116.0, 120.0, 0.0), 1.0),
        box("west", (84.0, 80.0, -49.0), (116.0, 84.0, 0.0), 1.0),
    ]
    comes = mover((100.0, 80.0, -20.0), (0.0, (0.0, 3.0, 0.0)), radius_m=3.0, height_m=60.0,
                  safe_distance_m=2.0)  # fmt: skip
    world, committed_m = watched([(100.0, 100.0, -20.0)], [comes], walls)
    ahead_mps = (float(world.arena.uas[0].speed_mps), 0.0, 0.0)
    assert room_held(world, committed_m, ahead_mps, 1) == ENOUGH_M
    assert room_held(world, committed_m, ahead_mps, 2) is None
    safe, velocity_mps, _ = evaded(world, committed_m)
    assert safe
    np.testing.assert_allclose(velocity_mps, ahead_mps)
