"""What moves comes at a UAS that hovers: it finds the room beside, above and away."""

from pathlib import Path

import pytest
from small_worlds import box, mover, waypoint

from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Velocity

VEHICLES = Path(__file__).parents[1] / "vehicles"
CRAZYFLIE, AIR_TAXI = "crazyflie", str(VEHICLES / "air_taxi.toml")
RADIUS_M = {CRAZYFLIE: 0.07, "s500_v2": 0.36, AIR_TAXI: 8.15}


def space(size_m, dt_s, vehicle, walls, comes, uas_safe_distance_m=0.3):
    """A box of air with one UAS, home in a corner that nothing passes."""
    north_m, east_m, height_m = size_m
    return Scenario.model_validate(
        {
            "schema": 1,
            "name": "space",
            "dt_s": dt_s,
            "max_steps": 2000,
            "landing_distance_m": 0.3,
            "landing_speed_mps": 0.2,
            "uas_safe_distance_m": uas_safe_distance_m,
            "geofence": {
                "margin_m": 0.1,
                "vertices_m": box("fence", (0.0, 0.0, -height_m), (north_m, east_m, 0.0))[
                    "vertices_m"
                ],
            },
            "obstacles": tuple(walls),
            "moving_obstacles": (comes,),
            "waypoints": (waypoint((0.97 * north_m, 0.97 * east_m, -0.6 * height_m), 0.01),),
            "uas": (
                {
                    "name": "uas_1",
                    "vehicle": vehicle,
                    "start_m": (0.97 * north_m, 0.97 * east_m, -0.4 * height_m),
                    "soc_0": 1.0,
                    "radius_m": RADIUS_M[vehicle],
                    "dod_max": 0.75,
                },
            ),
        }
    )


def hover(scenario, place_m, seconds, dynamics="lpv"):
    """Hover at a place; (contacts, breaches, time of the last sample [s])."""
    world = World(scenario, dynamics=dynamics, safety_filter=True)
    world.state.uas[0].departed = True
    world.state.x[0, :3] = place_m
    contacts = breaches = 0
    while not world.done and world.time_s < seconds and not contacts:
        outcome = world.step({"uas_1": Velocity(0.0, 0.0, -place_m[2])})
        contacts += int((outcome["contact"] != 0).sum())
        breaches += int(outcome["breaches"].sum())
    return contacts, breaches, world.time_s


def corridor(width_m, height_m, **person):
    """Two walls up to the ceiling, 20 m along east, and someone who walks between them."""
    half_m = 0.5 * width_m
    walls = [
        box("south", (4.0 - half_m - 0.15, 0.0, -height_m), (4.0 - half_m, 20.0, 0.0), 0.1),
        box("north", (4.0 + half_m, 0.0, -height_m), (4.0 + half_m + 0.15, 20.0, 0.0), 0.1),
    ]
    comes = mover(
        (4.0 + person["aside_m"], 1.0, -0.9),
        (0.0, (0.0, person["speed_mps"], 0.0)),
        radius_m=0.3,
        height_m=1.8,
        safe_distance_m=0.4,
        name="person",
    )
    return space((8.0, 20.0, height_m), 0.2, CRAZYFLIE, walls, comes)


@pytest.mark.parametrize("east_m", [6.0, 8.3, 13.0])
@pytest.mark.parametrize(
    ("width_m", "height_m", "aside_m"), [(2.0, 2.6, 0.0), (2.0, 3.2, 0.3), (2.6, 2.2, 0.1)]
)
def test_a_person_in_a_corridor_does_not_walk_into_a_hovering_uas(
    width_m, height_m, aside_m, east_m
):
    scenario = corridor(width_m, height_m, aside_m=aside_m, speed_mps=1.0)
    assert hover(scenario, (4.0, east_m, -1.2), 18.0)[:2] == (0, 0)


def test_nor_does_he_where_the_nonlinear_plant_is_flown():
    scenario = corridor(2.0, 2.6, aside_m=0.0, speed_mps=1.5)
    assert hover(scenario, (4.0, 6.0, -1.2), 8.0, "nonlinear")[:2] == (0, 0)


@pytest.mark.parametrize("speed_mps", [0.5, 1.4])
def test_a_slow_and_a_fast_walker_are_let_pass_too(speed_mps):
    scenario = corridor(2.0, 2.8, aside_m=0.0, speed_mps=speed_mps)
    assert hover(scenario, (4.1, 9.0, -1.0), 18.0 / speed_mps)[:2] == (0, 0)


def test_where_there_is_no_room_at_all_a_uas_is_not_hit_sooner_than_if_it_stood_still():
    scenario = corridor(1.0, 1.85, aside_m=0.0, speed_mps=1.0)
    contacts, _, hit_s = hover(scenario, (4.0, 8.0, -1.0), 22.0)
    assert contacts == 1
    assert hit_s > 12.0  # standing still, it would be 6.6 s


@pytest.mark.parametrize("speed_mps", [1.0, 3.0])
def test_in_a_hall_without_walls_a_uas_steps_aside(speed_mps):
    comes = mover(
        (4.0, 1.0, -0.9), (0.0, (0.0, speed_mps, 0.0)), radius_m=0.3, height_m=1.8,
        safe_distance_m=0.4,
    )  # fmt: skip
    scenario = space((8.0, 20.0, 2.5), 0.2, CRAZYFLIE, (), comes)
    assert hover(scenario, (4.0, 10.0, -1.2), 18.0 / speed_mps)[:2] == (0, 0)


@pytest.mark.parametrize("speed_mps", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("width_m", [14.0, 17.0, 24.0])
def test_in_a_street_a_uas_lets_what_drives_through_it_pass_beside(width_m, speed_mps):
    half_m = 0.5 * width_m
    walls = [
        box("south", (0.0, 0.0, -50.0), (40.0 - half_m, 200.0, 0.0)),
        box("north", (40.0 + half_m, 0.0, -50.0), (80.0, 190.0, 0.0)),
    ]
    comes = mover(
        (40.0, 5.0, -25.0), (0.0, (0.0, speed_mps, 0.0)), radius_m=1.5, height_m=50.0,
        safe_distance_m=2.0,
    )  # fmt: skip
    scenario = space((80.0, 200.0, 50.0), 1.0, "s500_v2", walls, comes)
    assert hover(scenario, (40.0, 100.0, -20.0), 185.0 / speed_mps)[:2] == (0, 0)


@pytest.mark.parametrize("speed_mps", [2.0, 5.0])
def test_below_a_ceiling_a_uas_lets_what_fills_the_street_pass_below(speed_mps):
    walls = [
        box("south", (0.0, 0.0, -22.0), (30.0, 200.0, 0.0)),
        box("north", (50.0, 0.0, -22.0), (80.0, 190.0, 0.0)),
    ]
    comes = mover(
        (40.0, 5.0, -5.0), (0.0, (0.0, speed_mps, 0.0)), radius_m=9.0, height_m=10.0,
        safe_distance_m=2.0,
    )  # fmt: skip
    scenario = space((80.0, 200.0, 22.0), 1.0, "s500_v2", walls, comes)
    assert hover(scenario, (40.0, 100.0, -6.0), 185.0 / speed_mps)[:2] == (0, 0)


@pytest.mark.parametrize(
    ("aside_m", "speed_mps", "dynamics"),
    [
        (0.0, 15.0, "lpv"),
        (0.0, 25.0, "lpv"),
        (200.0, 25.0, "lpv"),
        (0.0, 40.0, "lpv"),
        (200.0, 25.0, "nonlinear"),
    ],
)
def test_an_air_taxi_gets_out_of_the_way_of_a_helicopter(aside_m, speed_mps, dynamics):
    comes = mover(
        (5000.0 + aside_m, 2500.0, -300.0), (0.0, (0.0, speed_mps, 0.0)), radius_m=15.0,
        height_m=30.0, safe_distance_m=300.0,
    )  # fmt: skip
    scenario = space((10000.0, 10000.0, 650.0), 2.0, AIR_TAXI, (), comes, 300.0)
    assert hover(scenario, (5000.0, 5000.0, -300.0), 3500.0 / speed_mps, dynamics)[:2] == (0, 0)
