"""What the safety filter flies instead of an unsafe command: the nearest one that is safe."""

import itertools
import math

import numpy as np
import pytest
from small_worlds import box, meadow, mover

from uas_coverage_env.autopilot.lookahead import braking_slack, fly_and_brake
from uas_coverage_env.autopilot.right_of_way import claim_way, room_beside
from uas_coverage_env.autopilot.safety import filter_commands
from uas_coverage_env.entities.commands import (
    ACCELERATION,
    CLIMB,
    COMMAND_DTYPE,
    VELOCITY,
    WRENCH,
)
from uas_coverage_env.entities.outcome import OUTCOME_DTYPE
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VX, VY

TURNS_DEG = (0, 25, -25, 50, -50, 80, -80, 110, -110, 150, -150, 180)
WISHED, UP, DOWN, LEVEL = range(4)


def scene(places_m, velocities_mps, *, obstacles=(), moving=(), dt_s=1.0):
    """UAS in flight at places, with horizontal velocities."""
    homes_m = [(10.0, 10.0 + 15.0 * i, -1.0) for i in range(len(places_m))]
    scenario = meadow(homes_m, obstacles=obstacles, moving_obstacles=moving, dt_s=dt_s)
    world = World(scenario, safety_filter=True)
    world.state.x[:, :3] = places_m
    world.state.x[:, [VX, VY]] = velocities_mps
    world.state.uas["reference_mps"] = velocities_mps
    return world


def command_of(kind, values):
    command = np.zeros(1, COMMAND_DTYPE).view(np.recarray)[0]
    command.kind = kind
    command.values[: len(values)] = values
    return command


def filtered(world, commands):
    """(Outcome, committed paths): of the filter, asked for these commands."""
    outcome = np.zeros(len(commands), OUTCOME_DTYPE).view(np.recarray)
    for i, (kind, values) in enumerate(commands):
        outcome["applied_command"]["kind"][i] = kind
        outcome["applied_command"]["values"][i, : len(values)] = values
    filter_commands(world.arena, world.state, False, outcome)
    return outcome


def state_of(world, i):
    return world.state.x[i], world.state.uas[i].reference_mps[:], world.state.uas[i].belief[:]


def path_of(world, i, kind, values, n_held=1):
    """The path (N+1, 3) [m] of a command that is braked after some steps."""
    path_m = np.zeros((int(world.arena.rules[0].lookahead_steps) + 1, 3))
    x, reference, belief = state_of(world, i)
    fly_and_brake(world.arena, i, x, reference, command_of(kind, values), False, path_m, belief,
                  n_held)  # fmt: skip
    return path_m


def wished_velocity(world, i, kind, values):
    """The velocity (north, east, down) [m/s] that a command is after."""
    uas, x = world.arena.uas[i], world.state.x[i]
    if kind == VELOCITY:
        down_mps = np.clip(-values[2] - x[2], -uas.climb_mps, uas.descent_mps)
        return values[0], values[1], down_mps
    if kind == ACCELERATION:
        reference = world.state.uas[i].reference_mps
        dt_s = world.scenario.dt_s
        return reference[0] + dt_s * values[0], reference[1] + dt_s * values[1], 0.0
    if kind == WRENCH:
        return x[VX], x[VY], 0.0
    return tuple(values[:3])


def alternatives(world, i, wish_mps):
    """(Distance from the wish [-], velocity (3,)) of every deflection, in no order.

    As `safety` counts: a turn by 60°, five sixths of the speed, and 0.45 / 0.45 a height.
    """
    uas = world.arena.uas[i]
    speed_mps = min(max(math.hypot(*wish_mps[:2]), 3.0), uas.speed_mps)
    heading = math.atan2(wish_mps[1], wish_mps[0])
    vertical = {WISHED: wish_mps[2], UP: -uas.climb_mps, DOWN: uas.descent_mps, LEVEL: 0.0}
    near = [
        (abs(turn) / 60 + 1.2 * (1 - share) + 0.45 * (height != WISHED), turn, share, height)
        for turn, share, height in itertools.product(TURNS_DEG, (1.0, 0.6, 0.3), (WISHED, UP, DOWN))
    ]
    last = [(100.0, turn, share, LEVEL) for turn in TURNS_DEG for share in (1.0, 0.3)]
    last += [(101.0, 0, 0.0, UP), (101.0, 0, 0.0, DOWN)]
    last += [(102.0, turn, 0.1, h) for turn in TURNS_DEG for h in (LEVEL, UP, DOWN)]
    return [
        (cost, (share * speed_mps * math.cos(heading + math.radians(turn)),
                share * speed_mps * math.sin(heading + math.radians(turn)), vertical[height]))
        for cost, turn, share, height in near + last
    ]  # fmt: skip


def slack_of(world, i, kind, values, committed_m, path_m=None):
    path_m = np.zeros_like(committed_m[0]) if path_m is None else path_m
    command = command_of(kind, values)
    return braking_slack(
        world.arena, world.state, i, command, False, -math.inf, path_m, committed_m
    )


def cost_of(found, velocity_mps):
    """How far from the wish what is flown is."""
    return min(cost for cost, one in found if np.allclose(one, velocity_mps, rtol=0.0, atol=1e-9))


WALL = box("wall", (108.0, 40.0, -48.0), (112.0, 160.0, 0.0))
SCENES = {
    "wall ahead": ([(94.0, 100.0, -20.0)], [(4.0, 2.0)], [WALL], (VELOCITY, (9.0, 3.0, 23.0))),
    "wall beside": ([(103.5, 100.0, -20.0)], [(0.5, 3.0)], [WALL], (ACCELERATION, (5.0, 1.0, 0.0))),
    "mate": (
        [(100.0, 100.0, -20.0), (100.0, 113.0, -19.0), (113.0, 90.0, -24.0)],
        [(1.0, 3.0), (0.0, 0.0), (0.0, 0.0)], [], (CLIMB, (3.0, 8.0, 1.0)),
    ),
    "ground": ([(100.0, 100.0, -1.4)], [(3.0, -1.0)], [], (VELOCITY, (2.0, -1.0, -9.0))),
    "ceiling": ([(100.0, 100.0, -46.5)], [(0.0, 2.0)], [], (CLIMB, (0.5, -1.0, -3.0))),
    "leaning": ([(99.5, 100.0, -20.0)], [(3.5, 0.0)], [WALL], (WRENCH, (0.0, 0.0, -0.03, 0.0))),
}  # fmt: skip


@pytest.mark.parametrize(
    ("name", "dt_s"), [*((name, 1.0) for name in SCENES), ("wall beside", 0.5)]
)
def test_an_unsafe_command_is_replaced_by_the_nearest_safe_one(name, dt_s):
    places_m, velocities_mps, obstacles, wish = SCENES[name]
    world = scene(places_m, velocities_mps, obstacles=obstacles, dt_s=dt_s)
    n_uas = len(places_m)
    committed_m = np.array([path_of(world, i, CLIMB, (0.0,) * 3) for i in range(n_uas)])
    outcome = filtered(world, [wish, *[(CLIMB, (0.0,) * 3)] * (n_uas - 1)])
    flown = outcome["applied_command"][0]
    assert slack_of(world, 0, *wish, committed_m) < 0.0
    assert outcome["filtered"].tolist()[0]
    assert world.state.uas["filtered"].tolist() == outcome["filtered"].tolist()
    assert flown["kind"] == CLIMB
    assert slack_of(world, 0, CLIMB, flown["values"], committed_m) >= 0.0
    found = alternatives(world, 0, wished_velocity(world, 0, *wish))
    cost = cost_of(found, flown["values"][:3])
    nearer = [v for nearer, v in found if nearer < cost - 1e-9]
    assert all(slack_of(world, 0, CLIMB, v, committed_m) < 0.0 for v in nearer)


def test_later_ones_keep_clear_of_what_earlier_ones_have_chosen():
    places_m = [(100.0, 90.0, -20.0), (100.0, 110.0, -20.0), (100.0, 120.0, -20.0)]
    world = scene(places_m, [(0.0, 2.0), (0.0, -2.0), (0.0, -2.0)])
    wishes = [(CLIMB, (0.0, 9.0, 0.0)), (CLIMB, (0.0, -9.0, 0.0)), (CLIMB, (0.0, -9.0, 0.0))]
    outcome = filtered(world, wishes)
    flown = outcome["applied_command"]
    committed_m = np.array([path_of(world, i, CLIMB, flown["values"][i]) for i in range(3)])
    assert outcome["filtered"].any()
    for i in range(3):
        assert slack_of(world, i, CLIMB, flown["values"][i], committed_m) >= -1e-3


def test_where_nothing_is_safe_what_spares_most_is_flown():
    wall = box("wall", (104.0, 40.0, -48.0), (112.0, 160.0, 0.0))
    world = scene([(98.5, 100.0, -20.0)], [(5.0, 2.0)], obstacles=[wall])
    committed_m = np.zeros((1, int(world.arena.rules[0].lookahead_steps) + 1, 3))
    wish = (CLIMB, (5.0, 2.0, 0.0))
    flown = filtered(world, [wish])["applied_command"][0]
    found = [v for _, v in alternatives(world, 0, wish[1])] + [(0.0, 0.0, 0.0)]
    slacks_m = [slack_of(world, 0, CLIMB, v, committed_m) for v in found]
    assert max(slacks_m) < -1e-2
    assert slacks_m[-1] < max(slacks_m) - 1e-3
    assert slack_of(world, 0, CLIMB, flown["values"], committed_m) == pytest.approx(max(slacks_m))


def test_a_hover_that_is_safe_for_a_hair_less_than_nothing_goes_on():
    """Rounding must not forbid braking on: a millimetre is tolerated, and no more."""
    wall = box("wall", (104.0, 40.0, -48.0), (112.0, 160.0, 0.0))
    kept_m = 0.36 + 2.0
    for away_m, brakes in ((5e-4, True), (-1e-2, True)):
        world = scene([(104.0 - kept_m - away_m, 100.0, -20.0)], [(0.0, 0.0)], obstacles=[wall])
        flown = filtered(world, [(CLIMB, (3.0, 0.0, 0.0))])["applied_command"][0]
        assert flown["kind"] == CLIMB
        assert (flown["values"][0] <= 0.0) == brakes


@pytest.mark.parametrize("aside_m", [0.0, 4.0, 9.0])
@pytest.mark.parametrize("wish", [(CLIMB, (0.0, 0.0, 0.0)), (VELOCITY, (1.0, 4.0, 21.0))])
def test_a_mate_makes_way_for_one_on_its_way_home_by_the_nearest_command_with_room(wish, aside_m):
    world = scene(
        [(100.0, 100.0, -20.0), (100.0 + aside_m, 74.0, -20.0)], [(0.0, -5.0), (0.0, 0.0)]
    )
    world.state.uas["returning"] = [True, False]
    home = (CLIMB, (0.0, -6.0, 0.0))
    outcome = filtered(world, [home, wish])
    assert not outcome["filtered"][0]
    flown = outcome["applied_command"][1]
    claims_m = np.zeros((2, int(world.arena.rules[0].lookahead_steps) + 1, 3))
    claim_way(world.arena, world.state, 0, command_of(*home), False, claims_m[0])
    committed_m = np.array([path_of(world, 0, *home), claims_m[1]])
    path_m, claimants = np.zeros_like(claims_m[0]), np.array([0, 1])

    def room_of(kind, values):
        if slack_of(world, 1, kind, values, committed_m, path_m) < 0.0:
            return -math.inf
        return room_beside(world.arena, 1, path_m, claimants, 1, claims_m)

    if room_of(*wish) >= 0.0:
        assert not outcome["filtered"][1]
        assert flown["kind"] == wish[0]
        return
    assert outcome["filtered"][1]
    found = alternatives(world, 1, wished_velocity(world, 1, *wish))
    rooms_m = [(cost, room_of(CLIMB, v)) for cost, v in found]
    with_room = [cost for cost, room_m in rooms_m if room_m >= 0.0]
    if with_room:
        assert cost_of(found, flown["values"][:3]) == pytest.approx(min(with_room))
        assert room_of(CLIMB, flown["values"]) >= 0.0
    else:
        most_m = max(room_m for _, room_m in rooms_m)
        assert room_of(CLIMB, flown["values"]) >= most_m - 2e-3


def test_what_comes_at_a_hovering_uas_makes_it_fly_and_leaves_it_room_to_brake():
    comes = mover((125.0, 100.0, -20.0), (0.0, (-6.0, 0.0, 0.0)))
    world = scene([(100.0, 100.0, -20.0)], [(0.0, 0.0)], moving=[comes])
    outcome = filtered(world, [(CLIMB, (0.0, 0.0, 0.0))])
    flown = outcome["applied_command"][0]
    assert outcome["filtered"][0]
    assert np.linalg.norm(flown["values"][:3]) > 3.0
