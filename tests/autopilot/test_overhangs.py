"""Below slabs, bridges and tree crowns: guidance finds the way in and the way out."""

from pathlib import Path

import numpy as np
import pytest
from small_worlds import box, meadow, waypoint

from uas_coverage_env import load_scenario, rollout
from uas_coverage_env.autopilot.exit_overhang import N_CELLS, way_out
from uas_coverage_env.entities.state import LANDED
from uas_coverage_env.flight.record import LANDED as FLIGHT_LANDED
from uas_coverage_env.simulation import World
from uas_coverage_env.world import GoTo
from uas_coverage_env.world.overhangs import is_below_overhang

SLAB = box("slab", (80.0, 120.0, -14.0), (120.0, 150.0, -10.0))
BLOCK = box("block", (80.0, 120.0, -14.0), (120.0, 150.0, 0.0))
START_M = (100.0, 60.0, -1.0)


def mushroom(name, north_m, east_m, radius_m=12.0, top_m=25.0):
    turns = np.arange(7) * 2.0 * np.pi / 7.0
    ring = np.column_stack([np.cos(turns), np.sin(turns)])
    middle_m = (north_m, east_m)
    vertices_m = [(*(middle_m + 2.0 * place), 0.0) for place in ring]
    vertices_m += [(*(middle_m + radius_m * place), -top_m) for place in ring]
    return {"name": name, "safe_distance_m": 2.0, "vertices_m": vertices_m}


def flown(world, target, max_steps=200):
    """Steps until the target is covered, or home is reached."""
    for step in range(max_steps):
        if world.done or (target is not None and not world.state.uncovered[target]):
            return step
        world.step({"uas_1": GoTo(target)})
    return None


def put(world, place_m):
    world.state.x[0, :3] = place_m
    world.state.uas[0].departed = True


def test_what_stands_on_the_ground_overhangs_nothing():
    over, beside = (World(meadow([START_M], obstacles=[one])).arena for one in (SLAB, BLOCK))
    assert over.obstacles["overhangs"].tolist() == [True]
    assert over.rules["overhangs"].all()
    assert beside.obstacles["overhangs"].tolist() == [False]
    assert is_below_overhang(over, 100.0, 130.0, -5.0)
    assert not is_below_overhang(over, 100.0, 130.0, -30.0)
    assert not is_below_overhang(over, 100.0, 100.0, -5.0)
    assert not is_below_overhang(beside, 100.0, 118.0, -5.0)


@pytest.mark.parametrize("place_m", [(100.0, 145.0, -5.0), (82.0, 122.0, -6.5), (118.0, 140.0, -3)])
def test_a_uas_below_a_slab_comes_home(place_m):
    world = World(meadow([START_M], obstacles=[SLAB]))
    put(world, place_m)
    assert flown(world, None) < 60
    assert world.state.uas[0].status == LANDED


def test_a_waypoint_below_a_slab_is_covered_and_left_again():
    target = waypoint((105.0, 132.0, -5.0), 3.0)
    world = World(meadow([START_M], obstacles=[SLAB], waypoints=[target]))
    assert flown(world, 0) < 60
    assert flown(world, None) < 60
    assert world.state.uas[0].status == LANDED


def test_a_home_below_a_slab_is_reached_from_above_it():
    world = World(meadow([(100.0, 135.0, -1.0)], obstacles=[SLAB]))
    put(world, (100.0, 135.0, -30.0))
    assert flown(world, None) < 120
    assert world.state.uas[0].status == LANDED


def test_between_crowns_that_touch_there_is_a_way_out():
    crowns = [mushroom("one", 90.0, 120.0), mushroom("two", 112.0, 120.0)]
    crowns.append(mushroom("three", 101.0, 138.0))
    world = World(meadow([START_M], obstacles=crowns))
    put(world, (101.0, 127.0, -3.0))
    assert is_below_overhang(world.arena, 101.0, 127.0, -3.0)
    assert flown(world, None) < 90
    assert world.state.uas[0].status == LANDED


def test_the_way_out_is_clear_and_ends_where_a_uas_can_climb():
    arena = World(meadow([START_M], obstacles=[SLAB])).arena
    places_m = np.empty((100, 3))
    cells = np.empty((3, N_CELLS), np.int32)
    count = way_out(arena, 0, 84.0, 130.0, -4.0, 100.0, 60.0, places_m, cells)
    assert 0 < count < 20
    end_m = places_m[count - 1]
    assert not is_below_overhang(arena, *end_m)
    # nothing but the slab is there: the way out keeps its distance from it
    assert (places_m[:count, 2] > -10.0 + 2.36).all()


def test_closed_in_on_all_sides_there_is_no_way_out():
    walls = [
        box("west", (90.0, 100.0, -20.0), (110.0, 102.0, 0.0)),
        box("east", (90.0, 118.0, -20.0), (110.0, 120.0, 0.0)),
        box("south", (90.0, 100.0, -20.0), (92.0, 120.0, 0.0)),
        box("north", (108.0, 100.0, -20.0), (110.0, 120.0, 0.0)),
        box("roof", (90.0, 100.0, -21.0), (110.0, 120.0, -19.0)),
    ]
    arena = World(meadow([START_M], obstacles=walls)).arena
    assert is_below_overhang(arena, 100.0, 110.0, -5.0)
    written = np.empty((100, 3)), np.empty((3, N_CELLS), np.int32)
    assert way_out(arena, 0, 100.0, 110.0, -5.0, 100.0, 60.0, *written) == 0


@pytest.mark.parametrize("case", sorted((Path(__file__).parent / "cases").glob("*.toml")))
def test_missions_in_which_uas_hovered_below_something_until_their_charge_was_gone(case):
    scenario = load_scenario(case)
    flight = rollout(scenario, "nearest-waypoint", return_mode=True, safety_filter=True)
    assert flight.violations == ()
    assert flight.breaches == 0
    assert flight.covered[-1] == len(scenario.waypoints)
    assert (flight.mode[-1] == FLIGHT_LANDED).all()
    assert flight.steps < 150
