"""The distance to spare of a path, and of a command that is braked, from everything around it."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracle import clearance_of_cylinder, clearance_of_segment, thrust_correction
from small_worlds import box, meadow, mover

from uas_coverage_env.autopilot.control import command_wrench
from uas_coverage_env.autopilot.lookahead import (
    braking_slack,
    fixed_slack,
    fly_and_brake,
    moving_slack,
    peer_slack,
    required_from,
)
from uas_coverage_env.autopilot.right_of_way import claim_way, room_beside
from uas_coverage_env.entities.commands import CLIMB, COMMAND_DTYPE, VELOCITY, WRENCH
from uas_coverage_env.entities.state import FLYING, LANDED, WIND
from uas_coverage_env.scenario import with_disturbances
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import linear_model, plant_step
from uas_coverage_env.vehicle.inner_loop import reseed_reference
from uas_coverage_env.vehicle.layout import DOD, VX, VY

RADII_M, APART_M, FENCE_M, BIT_M = (0.36, 1.1, 0.36), 5.0, 0.5, 1e-3
PLENTY_M = 2.0
MIDDLE_M = np.array([100.0, 100.0, -15.0])
OBSTACLES = [
    box("house", (108.0, 90.0, -12.0), (120.0, 104.0, 0.0), 2.0),
    box("tower", (84.0, 108.0, -48.0), (92.0, 118.0, 0.0), 1.0),
]
MOVERS = [
    mover((85.0, 92.0, -14.0), (0.0, (1.5, 1.0, -0.3)), radius_m=2.0, height_m=4.0,
          safe_distance_m=1.0, name="one"),
    mover((112.0, 112.0, -20.0), (0.0, (-2.0, -1.0, 0.5)), radius_m=1.0, height_m=8.0,
          safe_distance_m=2.0, name="two"),
]  # fmt: skip


def made(level=None, *, radii_m=RADII_M, **more):
    """Three UAS of different size near a house, a tower and two things that move."""
    homes_m = [(10.0, 10.0 + 20.0 * i, -1.0) for i in range(len(radii_m))]
    scenario = meadow(homes_m, **{"obstacles": OBSTACLES, "moving_obstacles": MOVERS, **more})
    fleet = [
        u.model_copy(update={"radius_m": r}) for u, r in zip(scenario.uas, radii_m, strict=True)
    ]
    scenario = scenario.model_copy(update={"uas": tuple(fleet)})
    return World(with_disturbances(scenario, level, 1) if level else scenario, safety_filter=True)


@pytest.fixture(scope="module")
def worlds():
    return {"still": made(), "light": made("light"), "high": made(min_height_m=6.0)}


def command_of(kind, *values):
    command = np.zeros(1, COMMAND_DTYPE).view(np.recarray)[0]
    command.kind = kind
    command.values[: len(values)] = values
    return command


def tube_m(world, i, k):
    widths_m = world.arena.tube_m[i]
    return widths_m[min(k, len(widths_m) - 1)]


def kept(required_m, now_m):
    return min(required_m, now_m - BIT_M)


def expected_fixed(world, i, path_m):
    """Distance to spare [m] from fence, height and what stands, from the scenario."""
    scenario, spare_m = world.scenario, []
    fence = scenario.fence
    level = np.hypot(fence.normals[:, 0], fence.normals[:, 1])
    now_m = -fence.face_distances(path_m[0])
    for k in range(1, len(path_m)):
        required_m = FENCE_M + level * tube_m(world, i, k)
        spare_m += list(-fence.face_distances(path_m[k]) - np.minimum(required_m, now_m - BIT_M))
    least_m = scenario.min_height_m
    if least_m:
        zone_m = scenario.landing_distance_m + 2.0 * least_m
        away_m = np.hypot(*(path_m[:, :2] - np.array(scenario.uas[i].start_m)[:2]).T)
        if away_m[0] > zone_m:
            least_m = kept(least_m, -path_m[0, 2])
        spare_m += [-z - least_m for z, far in zip(path_m[1:, 2], away_m[1:], strict=True)
                    if far > zone_m]  # fmt: skip
    for obstacle, hull in zip(scenario.obstacles, scenario.kept_hulls, strict=True):
        for k in range(len(path_m) - 1):
            required_m = RADII_M[i] + obstacle.safe_distance_m + tube_m(world, i, k + 1)
            clear_m = clearance_of_segment(hull, path_m[k], path_m[k + 1])
            spare_m.append(clear_m - kept(required_m, hull.face_distances(path_m[0]).max()))
    return min(spare_m)


def random_path(rng, n_steps=6):
    start_m = MIDDLE_M + rng.uniform(-20.0, 20.0, 3) * (1.0, 1.0, 0.7)
    if rng.random() < 0.3:  # beside a fence, the ground or the ceiling
        axis = rng.integers(3)
        start_m[axis] = rng.choice([(1.0, 199.0), (1.0, 199.0), (-1.0, -49.0)][axis])
    return start_m + np.vstack([np.zeros(3), np.cumsum(rng.uniform(-3.0, 3.0, (n_steps, 3)), 0)])


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(["still", "light", "high"]))
def test_a_path_spares_what_it_keeps_from_fence_ground_and_obstacles(worlds, seed, name):
    world, rng = worlds[name], np.random.default_rng(seed)
    i, path_m = int(rng.integers(3)), random_path(rng)
    exact_m = expected_fixed(world, i, path_m)
    known_m = rng.choice([PLENTY_M, 0.3])
    found_m = fixed_slack(world.arena, i, path_m, len(path_m) - 1, -math.inf, known_m)
    assert found_m == pytest.approx(min(known_m, exact_m), abs=1e-9)
    soon_m = fixed_slack(world.arena, i, path_m, len(path_m) - 1, 0.1, known_m)
    assert soon_m == pytest.approx(found_m) if found_m >= 0.1 else soon_m < 0.1


@settings(max_examples=30, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), step=st.integers(0, 4))
def test_a_path_spares_what_it_keeps_from_what_moves_on_as_it_does(worlds, seed, step):
    world, rng = worlds["still"], np.random.default_rng(seed)
    path_m, i = random_path(rng), int(rng.integers(3))
    spare_m = []
    for m, moving in enumerate(world.scenario.moving_obstacles):
        velocity_mps = np.array(moving.schedule[0].velocity_mps)
        required_m = RADII_M[i] + moving.safe_distance_m + np.linalg.norm(velocity_mps)
        assert required_from(world.arena, step, i, m) == pytest.approx(required_m)
        centre_m = np.array(moving.start_m) + step * velocity_mps
        size = moving.radius_m, moving.height_m / 2
        required_m = kept(required_m, clearance_of_cylinder(*size, *[path_m[0] - centre_m] * 2))
        away_m = path_m - centre_m - np.arange(len(path_m))[:, None] * velocity_mps
        spare_m += [
            clearance_of_cylinder(*size, start, end) - required_m
            for start, end in itertools.pairwise(away_m)
        ]
    found_m = moving_slack(world.arena, step, i, path_m, -math.inf, PLENTY_M)
    assert found_m == pytest.approx(min(PLENTY_M, *spare_m), abs=1e-6)
    soon_m = moving_slack(world.arena, step, i, path_m, 0.1, PLENTY_M)
    assert soon_m == pytest.approx(found_m) if found_m >= 0.1 else soon_m < 0.1


@settings(max_examples=40, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), name=st.sampled_from(["still", "light"]))
def test_a_path_spares_what_it_keeps_from_the_paths_of_the_others_that_fly(worlds, seed, name):
    world, rng = worlds[name], np.random.default_rng(seed)
    i, path_m = int(rng.integers(3)), random_path(rng)
    others_m = np.array([
        path_m + rng.uniform(-9.0, 9.0, 3) + np.cumsum(rng.uniform(-1.5, 1.5, path_m.shape), 0)
        for _ in range(3)
    ])  # fmt: skip
    world.state.uas["status"] = rng.choice([FLYING, LANDED], 3, p=[0.8, 0.2])
    spare_m = [PLENTY_M]
    for j in range(3):
        if j == i or world.state.uas["status"][j] == LANDED:
            continue
        away_m = path_m - others_m[j]
        now_m = max(math.hypot(*away_m[0, :2]), abs(away_m[0, 2]))
        for k in range(len(path_m) - 1):
            both_m = RADII_M[i] + RADII_M[j] + APART_M
            required_m = both_m + tube_m(world, i, k + 1) + tube_m(world, j, k + 1)
            apart_m = clearance_of_cylinder(0.0, 0.0, away_m[k], away_m[k + 1])
            spare_m.append(apart_m - kept(required_m, now_m))
    asked = world.arena, world.state.uas, i, path_m, others_m
    found_m = peer_slack(*asked, -math.inf, PLENTY_M)
    soon_m = peer_slack(*asked, 0.1, PLENTY_M)
    world.state.uas["status"] = FLYING
    assert found_m == pytest.approx(min(spare_m), abs=1e-6)
    assert soon_m == pytest.approx(found_m) if found_m >= 0.1 else soon_m < 0.1


def next_state(vehicle, record, x, governed, command, nonlinear):
    """The state after a step of a command; `governed` is what the inner loop tracks, written."""
    u = np.zeros(5)
    command_wrench(record, x, governed, command, u)
    if nonlinear:
        after = x.copy()
        plant_step(record, x, u, after)
    else:
        model = linear_model(vehicle, x[DOD], float(record["dt_s"]))
        u[4] = thrust_correction(vehicle, x, u[0])
        after = model.A @ x + model.B @ u + model.E
    if command.kind == WRENCH:
        reseed_reference(record, after, governed)
    return after


BRAKE = command_of(CLIMB, 0.0, 0.0, 0.0)


@pytest.mark.parametrize("nonlinear", [False, True], ids=["lpv", "nonlinear"])
@pytest.mark.parametrize(
    ("command", "n_held"),
    [
        (command_of(VELOCITY, 9.0, -6.0, 22.0), 1),
        (command_of(CLIMB, -5.0, 4.0, 1.5), 4),
        (command_of(WRENCH, 0.6, 0.01, -0.02, 0.0), 2),
    ],
    ids=["velocity", "climb", "wrench"],
)
def test_a_braking_flight_is_the_command_and_then_the_brake_until_the_uas_stands(
    command, n_held, nonlinear
):
    world = World(meadow([MIDDLE_M]))
    x, governed = world.state.x[0].copy(), np.array([4.0, 3.0])
    x[[VX, VY]] = governed
    path_m = np.zeros((40, 3))
    n_flown, slack_m = fly_and_brake(
        world.arena, 0, x, governed.copy(), command, nonlinear, path_m, None, n_held
    )
    assert slack_m == PLENTY_M
    assert n_held < n_flown < 39
    vehicle, record = world.scenario.vehicles[0], world.arena.vehicles[0]
    for k in range(n_flown + 1):
        np.testing.assert_allclose(path_m[k], x[:3], atol=1e-6)
        if k < n_flown:
            flown = command if k < n_held else BRAKE
            x = next_state(vehicle, record, x, governed, flown, nonlinear)
            is_still = np.abs(x[3:6]).sum() < 0.02 and np.abs(x[6:8]).sum() < 0.004
            is_still &= np.abs(x[9:11]).sum() < 0.004
            assert (is_still and k + 1 >= n_held) == (k + 1 == n_flown)
    np.testing.assert_array_equal(path_m[n_flown:], [path_m[n_flown]] * (40 - n_flown))


def test_a_uas_that_is_still_fast_at_the_end_of_its_path_has_no_room():
    world = World(meadow([MIDDLE_M]))
    x, governed = world.state.x[0].copy(), np.array([8.0, -6.0])
    x[[VX, VY]] = governed
    path_m = np.zeros((3, 3))
    asked = world.arena, 0, x, governed.copy(), BRAKE, False, path_m
    n_flown, slack_m = fly_and_brake(*asked)
    vehicle, record = world.scenario.vehicles[0], world.arena.vehicles[0]
    for _ in range(2):
        x = next_state(vehicle, record, x, governed, BRAKE, False)
    assert n_flown == 2
    assert slack_m == pytest.approx(0.1 - np.linalg.norm(x[3:6]), abs=1e-6)
    assert slack_m < 0.0


def test_in_wind_a_braking_flight_drifts_with_it_and_ends_leaning_into_it():
    ends_m = []
    for wind_mps in (0.0, 3.0):
        world = World(with_disturbances(meadow([MIDDLE_M]), "light", 1))
        world.state.uas[0].belief[WIND : WIND + 2] = 0.0, wind_mps
        path_m = np.zeros((25, 3))
        state = world.state.x[0], world.state.uas[0].reference_mps[:]
        n_flown, slack_m = fly_and_brake(
            world.arena, 0, *state, command_of(VELOCITY, 6.0, 0.0, 15.0), False, path_m,
            world.state.uas[0].belief[:],
        )  # fmt: skip
        assert slack_m == PLENTY_M
        assert n_flown < 24
        ends_m.append(path_m[-1])
    assert ends_m[1][1] - ends_m[0][1] > 0.01


def test_a_command_is_as_safe_as_the_least_that_its_braking_flight_spares(worlds):
    world = worlds["still"]
    world.state.x[:, :3] = MIDDLE_M
    world.state.x[1:, :2] += (0.0, 9.0), (-9.0, -12.0)
    committed_m = np.zeros((3, int(world.arena.rules[0].lookahead_steps) + 1, 3))
    committed_m[:] = world.state.x[:, None, :3]
    path_m, least = np.zeros_like(committed_m[0]), set()
    for north_mps, east_mps in ((0, 0), (8, -3), (0, 9), (-9, -9), (-4, -1), (-2, 6), (9, 9)):
        command = command_of(CLIMB, north_mps, east_mps, 0.0)
        asked = world.arena, world.state, 0, command, False
        found_m = braking_slack(*asked, -math.inf, path_m, committed_m)
        without_m = braking_slack(*asked, -math.inf, path_m, committed_m, False)
        n_flown = len(path_m) - 1
        spare_m = [
            fixed_slack(world.arena, 0, path_m, n_flown, -math.inf, PLENTY_M),
            peer_slack(world.arena, world.state.uas, 0, path_m, committed_m, -math.inf, PLENTY_M),
            moving_slack(world.arena, 0, 0, path_m, -math.inf, PLENTY_M),
        ]
        assert found_m == pytest.approx(min(spare_m))
        assert without_m == pytest.approx(min(spare_m[:2]))
        least.add(int(np.argmin(spare_m)))
        for enough_m in (0.0, 1.0):
            soon_m = braking_slack(*asked, enough_m, path_m, committed_m)
            assert soon_m == pytest.approx(found_m) if found_m >= enough_m else soon_m < enough_m
    assert least == {0, 1, 2}


@settings(max_examples=25, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), n_claims=st.integers(0, 2))
def test_a_path_has_the_room_that_it_keeps_beside_claimed_ways(worlds, seed, n_claims):
    world, rng = worlds["still"], np.random.default_rng(seed)
    path_m, claimants = random_path(rng), np.array([1, 2, 0])
    ways_m = path_m + rng.uniform(-8.0, 8.0, (3, 1, 3)) + rng.uniform(-1.0, 1.0, (3, 7, 3))
    rooms_m = [
        clearance_of_cylinder(0.0, 0.0, away_m[k], away_m[k + 1])
        - (RADII_M[0] + RADII_M[j] + APART_M + 1.0)
        for j in claimants[:n_claims]
        for away_m in [path_m - ways_m[j]]
        for k in range(6)
    ]
    expected_m = min([1.0, *rooms_m]) + 0.05 * np.minimum(rooms_m, 0.0).sum() / 6
    found_m = room_beside(world.arena, 0, path_m, claimants, n_claims, ways_m)
    assert found_m == pytest.approx(expected_m, abs=1e-6)


@pytest.mark.parametrize("dt_s", [0.5, 1.0, 2.0])
def test_a_way_is_claimed_for_five_seconds_and_braked_then(dt_s):
    world = World(meadow([MIDDLE_M], dt_s=dt_s), safety_filter=True)
    command = command_of(VELOCITY, 7.0, 5.0, 15.0)
    claim_m, expected_m = np.zeros((2, int(world.arena.rules[0].lookahead_steps) + 1, 3))
    claim_way(world.arena, world.state, 0, command, False, claim_m)
    state = world.state.x[0], world.state.uas[0].reference_mps[:]
    fly_and_brake(world.arena, 0, *state, command, False, expected_m,
                  world.state.uas[0].belief[:], round(5.0 / dt_s))  # fmt: skip
    np.testing.assert_array_equal(claim_m, expected_m)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(seed=st.integers(0, 2**32 - 1), level=st.sampled_from(["still", "light", "high"]))
def test_a_flight_is_given_up_only_where_all_of_it_has_too_little_to_spare(worlds, seed, level):
    world, rng = worlds[level], np.random.default_rng(seed)
    # at rest or moving, near sides and corners of the fence; some so near that leaving is allowed
    side_m = rng.choice([0.3, 0.8, 4.0, 15.0, 185.0, 199.2], 2)
    world.state.x[:] = 0.0
    world.state.x[:, :3] = MIDDLE_M
    world.state.x[0, :3] = *side_m, -rng.uniform(1.0, 49.0)
    world.state.x[0, VX : VX + 3] = rng.uniform(-2.0, 2.0, 3)
    committed_m = np.zeros((3, int(world.arena.rules[0].lookahead_steps) + 1, 3))
    committed_m[:] = world.state.x[:, None, :3]
    path_m = np.zeros_like(committed_m[0])
    for enough_m in (0.0, -1e-3, 0.7):
        command = command_of(CLIMB, *rng.uniform(-10.0, 10.0, 2), rng.uniform(-1.5, 1.0))
        asked = world.arena, world.state, 0, command, False, enough_m, path_m, committed_m
        found_m = braking_slack(*asked)
        soon_m = braking_slack(*asked, True, True)
        assert soon_m == found_m if found_m >= enough_m else soon_m < enough_m


def test_what_disturbances_may_lead_off_counts_at_the_fence_beyond_a_first_look(worlds):
    world = worlds["light"]
    tube_m = world.arena.tube_m[0, 6]
    assert tube_m > 0.1
    path_m = np.tile(MIDDLE_M, (7, 1))
    path_m[:, 1] = FENCE_M + PLENTY_M + tube_m / 2.0
    found_m = fixed_slack(world.arena, 0, path_m, 6, -math.inf, PLENTY_M)
    assert found_m == pytest.approx(PLENTY_M - tube_m / 2.0)


def test_a_flight_out_of_the_fence_is_given_up_where_it_leaves_it():
    world = World(meadow([(190.0, 100.0, -15.0)]), safety_filter=True)
    path_m = np.full((int(world.arena.rules[0].lookahead_steps) + 1, 3), np.nan)
    state = world.state.x[0], world.state.uas[0].reference_mps[:]
    command = command_of(CLIMB, 12.0, 0.0, 0.0)
    beyond = (
        world.arena, 0, *state, command, False, path_m, world.state.uas[0].belief[:], 9, 0.0,
    )  # fmt: skip
    n_flown, slack_m = fly_and_brake(*beyond)
    assert slack_m == -math.inf
    assert path_m[n_flown, 0] > 200.0 - FENCE_M >= path_m[n_flown - 1, 0]
    assert np.isnan(path_m[n_flown + 1 :]).all()
