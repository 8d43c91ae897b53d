import math

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env.autopilot.return_mode import seconds_home
from uas_coverage_env.autopilot.return_path import route_home
from uas_coverage_env.entities.state import FLYING, LANDED
from uas_coverage_env.scenario import generate_scenario, load_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import VX, VY, VZ, X, Y, Z
from uas_coverage_env.world import GoTo, Velocity


def visit(world, orders, max_steps=600):
    """Fly each UAS to the waypoints of its order, then home.

    Returns:
        (breaches, least clearance from obstacles [m], longest time for one waypoint [s]).
    """
    orders = [list(order) for order in orders]
    breaches, clearance_m, longest, since = 0, math.inf, 0, [0] * len(orders)
    for step in range(max_steps):
        if world.done:
            break
        commands = {}
        for i, name in enumerate(world.names):
            if world.state.uas[i].status != FLYING:
                continue
            while orders[i] and not world.state.uncovered[orders[i][0]]:
                orders[i].pop(0)
                longest = max(longest, step - since[i])
                since[i] = step
            commands[name] = GoTo(orders[i][0] if orders[i] else None)
        outcome = world.step(commands)
        assert not outcome["contact"].any(), (step, outcome["contact"], world.state.x[:, :6])
        breaches += outcome["breaches"].sum()
        clearance_m = min(clearance_m, outcome["obstacle_clearance_m"].min())
    return breaches, clearance_m, longest


def test_the_waypoints_of_the_village_are_flown_one_after_another():
    world = World(load_scenario("village"))
    world.state.x[:, 12] = 0.0
    n = len(world.state.uncovered)
    # rows back and forth: legs over forests and houses, past the high-rises and the church
    rows = [list(range(row, row + 7)) for row in range(0, n, 7)]
    order = [w for k, row in enumerate(rows) for w in (row[::-1] if k % 2 else row) if w != 27]
    half = 21
    visit(world, [order[:half], order[half:]])
    assert world.state.uas["status"].tolist() == [LANDED, LANDED]
    assert np.flatnonzero(world.state.uncovered).tolist() in ([], [27])


@pytest.mark.parametrize("seed", range(3))
def test_random_targets_across_the_village_end_in_no_contact(seed):
    scenario = load_scenario("village")
    world = World(scenario)
    world.state.x[:, 12] = 0.0
    rng = np.random.default_rng(seed)
    order = [w for w in rng.permutation(49) if w != 27][:12]
    visit(world, [order, []])
    assert (world.state.uas["status"] == LANDED).all()
    assert not world.state.uncovered[order].any()


@pytest.mark.parametrize("seed", range(4))
def test_random_targets_in_generated_towns_end_in_no_contact(seed):
    scenario = generate_scenario(seed, n_uas=1, n_waypoints=25, n_obstacles=12)
    world = World(scenario)
    order = np.random.default_rng(seed).permutation(25)[:10]
    visit(world, [order])
    assert world.state.uas[0].status == LANDED
    assert not world.state.uncovered[order].any()


def fly(world, commands, n_steps):
    for _ in range(n_steps):
        if not world.done:
            outcome = world.step(commands)
            assert not outcome["contact"].any()
            yield outcome


def test_a_tall_building_is_passed_beside_and_a_low_one_above():
    for height_m, passes_over in ((40.0, False), (10.0, True)):
        house = box("house", (80.0, 70.0, -height_m), (120.0, 110.0, 0.0))
        world = World(
            meadow(
                [(20.0, 95.0, -10.0)],
                obstacles=[house],
                waypoints=[waypoint((180.0, 95.0, -10.0), 5.0)],
            )
        )
        over = beside = False
        for outcome in fly(world, {"uas_1": GoTo(0)}, 40):
            x, y = world.state.x[0, [X, Y]]
            inside = 80.0 < x < 120.0
            over |= inside and 70.0 < y < 110.0
            beside |= inside and not 70.0 < y < 110.0
            assert outcome["obstacle_clearance_m"][0] >= 2.36 - 1e-6
        assert (over, beside) == (passes_over, not passes_over)
        assert not world.state.uncovered[0]


def test_the_way_home_goes_round_what_is_tall():
    house = box("house", (80.0, 40.0, -45.0), (120.0, 110.0, 0.0))
    world = World(meadow([(180.0, 75.0, -1.0)], obstacles=[house]))
    x = world.state.x[0].copy()
    straight_m = route_home(world.arena, 0, *x[:3])[2]
    assert straight_m == pytest.approx(0.0)
    x[:3] = 20.0, 75.0, -10.0
    round_m = route_home(world.arena, 0, *x[:3])[2]
    # round the corners of the house, 2.36 m to keep and 1 m of margin beside its walls
    shortest = 40.0 + 6.72 + 2 * math.hypot(60.0 - 3.36, 35.0 + 3.36)
    assert shortest < round_m < shortest + 5.0
    x[2] = -49.4
    assert route_home(world.arena, 0, *x[:3])[2] > 160.0
    assert seconds_home(world.arena, 0, x) > round_m / 12.0 + 48.4 / 1.5


def test_a_uas_in_front_of_a_wall_climbs_before_it_goes_over():
    wall = box("wall", (60.0, 0.0, -14.0), (70.0, 200.0, 0.0))
    world = World(
        meadow(
            [(54.0, 100.0, -3.0)],
            obstacles=[wall],
            waypoints=[waypoint((120.0, 100.0, -8.0), 4.0)],
        )
    )
    for outcome in fly(world, {"uas_1": GoTo(0)}, 40):
        assert outcome["breaches"][0] == 0
    assert not world.state.uncovered[0]


def test_a_target_that_suddenly_lies_behind_a_wall_is_no_reason_to_hit_it():
    wall = box("wall", (130.0, 0.0, -45.0), (140.0, 150.0, 0.0))
    world = World(
        meadow(
            [(20.0, 100.0, -10.0)],
            obstacles=[wall],
            waypoints=[
                waypoint((126.0, 100.0, -10.0), 6.0),
                waypoint((150.0, 100.0, -10.0), 6.0),
            ],
        )
    )
    for _ in fly(world, {"uas_1": GoTo(0)}, 14):
        if not world.state.uncovered[0]:
            break
    for _ in fly(world, {"uas_1": GoTo(1)}, 60):
        pass
    assert not world.state.uncovered.any()


def test_home_is_reached_slowly_enough_to_land():
    world = World(meadow([(20.0, 30.0, -1.0)]))
    world.state.x[0, :3] = 180.0, 170.0, -45.0
    world.state.x[0, [VX, VY]] = 8.0, 8.0
    world.state.uas[0].reference_mps[:] = 8.0, 8.0
    for _ in fly(world, {"uas_1": GoTo(None)}, 70):
        pass
    assert world.state.uas[0].status == LANDED
    assert np.linalg.norm(world.state.x[0, :3] - world.scenario.uas[0].start_m) <= 2.0


def test_a_waypoint_already_covered_is_where_the_uas_comes_to_rest():
    here = waypoint((150.0, 150.0, -20.0), 15.0)
    world = World(meadow([(100.0, 100.0, -10.0)], waypoints=[here]))
    for _ in fly(world, {"uas_1": GoTo(0)}, 60):
        pass
    assert np.linalg.norm(world.state.x[0, [VX, VY, VZ]]) < 0.1
    assert np.linalg.norm(world.state.x[0, [X, Y, Z]] - here["position_m"]) < 1.0


def test_everything_low_is_flown_over_where_there_is_no_way_round():
    barrier = box("barrier", (90.0, -1.0, -38.0), (95.0, 201.0, 0.0))
    world = World(
        meadow(
            [(20.0, 100.0, -5.0)],
            obstacles=[barrier],
            waypoints=[waypoint((180.0, 100.0, -5.0), 5.0)],
        )
    )
    for _ in fly(world, {"uas_1": GoTo(0)}, 80):
        pass
    assert not world.state.uncovered[0]


def test_leaving_the_start_does_not_depend_on_other_commands():
    world = World(meadow([(100.0, 100.0, -1.0), (140.0, 140.0, -1.0)]))
    for _ in fly(world, {"uas_1": GoTo(0), "uas_2": Velocity(0.0, 0.0, 1.0)}, 5):
        pass
    assert world.state.uas["departed"].tolist() == [True, False]


def test_the_nonlinear_plant_is_guided_as_safely():
    house = box("house", (80.0, 70.0, -40.0), (120.0, 110.0, 0.0))
    shed = box("shed", (130.0, 60.0, -8.0), (150.0, 130.0, 0.0))
    world = World(
        meadow(
            [(40.0, 95.0, -1.0)],
            obstacles=[house, shed],
            waypoints=[waypoint((170.0, 95.0, -6.0), 8.0)],
        ),
        dynamics="nonlinear",
    )
    breaches, clearance_m, _ = visit(world, [[0]])
    assert not world.state.uncovered[0]
    assert world.state.uas[0].status == LANDED
    assert breaches == 0
    assert clearance_m >= 2.36 - 1e-6
