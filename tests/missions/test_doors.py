"""Two rooms and a door of 0.9 m between them: every planner flies a Crazyflie through and home."""

import pytest
from small_worlds import box

from uas_coverage_env import Scenario, load_planner, rollout
from uas_coverage_env.autopilot.return_path import flight_home
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.mission.access import Access
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo

LITTLE_MILP = {"horizon": 10, "threads": 1, "teams": 2, "at_once": 1}
FAST = {
    "nearest-waypoint": {},
    "lawnmower": {},
    "trajectory": {"orders": 1, "moves": 5_000, "programs": 40, "idle_work": 0},
}
SLOW = {"tour": {"moves": 5_000, "changes": 50}, "milp-mpc": LITTLE_MILP}


def rooms(door_m=0.9, **changes):
    """Rooms of 6 x 5 m, 2.5 m high, a wall of 0.15 m; a waypoint in each, the start in one."""
    middle, half = 3.0, 0.5 * door_m
    walls = [
        box("west", (0.0, 4.925, -2.5), (middle - half, 5.075, 0.0), 0.1),
        box("east", (middle + half, 4.925, -2.5), (6.0, 5.075, 0.0), 0.1),
    ]
    fence = box("fence", (0.0, 0.0, -2.5), (6.0, 10.0, 0.0))["vertices_m"]
    uas = {"name": "u", "vehicle": "crazyflie", "start_m": (1.0, 1.5, -1.2), "soc_0": 1.0}
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": "rooms",
            "dt_s": 0.2,
            "max_steps": 400,
            "landing_distance_m": 0.3,
            "landing_speed_mps": 0.2,
            "uas_safe_distance_m": 0.3,
            "geofence": {"margin_m": 0.1, "vertices_m": fence},
            "obstacles": walls,
            "uas": (uas | {"radius_m": 0.07, "dod_max": 0.75},),
            "waypoints": (
                {"position_m": (5.0, 1.5, -1.2), "radius_m": 0.4, "weight": 1.0},
                {"position_m": (1.0, 8.5, -1.2), "radius_m": 0.4, "weight": 1.0},
            ),
        }
        | changes
    )


def flies_through(name, options, **changes):
    flight = rollout(rooms(**changes), load_planner(name, options), safety_filter=True)
    assert flight.covered[-1] == 2
    assert flight.mode[-1].tolist() == [3]
    assert flight.violations == ()
    assert flight.breaches == 0
    return flight


@pytest.mark.parametrize("changes", [{}, {"route_margin_m": 0.05}])
@pytest.mark.parametrize("name", FAST)
def test_a_door_is_flown_through(name, changes):
    assert flies_through(name, FAST[name], **changes).steps < 200


@pytest.mark.slow
@pytest.mark.parametrize("name", SLOW)
def test_a_door_is_flown_through_by_planners_that_search(name):
    assert flies_through(name, SLOW[name]).steps < 200


def test_a_door_is_closed_to_routes_that_keep_too_much_and_named():
    access = Access(MissionBrief.of(rooms(route_margin_m=0.5)))
    assert access.has_way.tolist() == [[True, False]]
    (gap,) = access.narrow_gaps
    assert gap.width_m == pytest.approx(0.9)
    assert gap.needed_m == pytest.approx(2.0 * (0.07 + 0.1 + 0.5))


@pytest.mark.parametrize("door_m", [0.6, 0.9])
def test_the_way_home_through_a_door_takes_no_longer_than_return_mode_expects(door_m):
    world = World(rooms(door_m))
    state, dt_s = world.state, world.scenario.dt_s
    state.x[0, :3], state.uas[0].departed = (1.0, 8.5, -1.2), True
    seconds, margin_s = flight_home(world.arena, 0, state.x[0])
    steps = 0
    while not world.done:
        world.step({"u": GoTo(None)})
        steps += 1
    assert steps * dt_s < seconds + margin_s
    assert state.uncovered.tolist() == [True, False]


def test_return_mode_knows_what_a_door_costs_at_which_guidance_comes_to_rest():
    seconds = []
    for door_m in (0.6, 0.55):
        world = World(rooms(door_m))
        world.state.x[0, :3] = 1.0, 8.5, -1.2
        seconds.append(flight_home(world.arena, 0, world.state.x[0])[0])
    assert seconds[1] > seconds[0] + 5.0


def test_of_a_short_mission_return_mode_keeps_a_tenth_of_the_clock():
    for steps, reserve_s in ((400, 8.0), (3_000, 30.0)):
        (kept_s,) = World(rooms(max_steps=steps)).arena.rules["clock_reserve_s"]
        assert kept_s == pytest.approx(reserve_s)
