"""Pictures of rooms: doors are seen from above, and low heights have decimals."""

import numpy as np
from small_worlds import meadow, waypoint

from uas_coverage_env import load_planner, rollout
from uas_coverage_env.draw import Picture
from uas_coverage_env.draw.frame import Frame
from uas_coverage_env.draw.labels import metres
from uas_coverage_env.draw.terrain import height_words, lintels, terrain
from uas_coverage_env.flight.scene_history import SceneHistory
from uas_coverage_env.replay.scene_data import scene_data
from uas_coverage_env.scenario.walls import Door, Wall
from uas_coverage_env.simulation import World


def room(**door):
    wall = Wall(
        from_m=(0.0, 100.0), to_m=(200.0, 100.0), thickness_m=6.0, height_m=50.0,
        safe_distance_m=1.0, doors=(Door(at_m=100.0, width_m=60.0, **door),),
    )  # fmt: skip
    ground = meadow(((40.0, 40.0, -1.0),), waypoints=[waypoint((180.0, 20.0, -10.0), 3.0)])
    return ground.model_copy(update={"walls": (wall,)})


def pixel_at(scenario, north_m, east_m):
    frame = Frame.around(scenario.fence.vertices_m, 512)
    x, y = frame.pixels(np.array([north_m, east_m])).round().astype(int)
    return terrain(scenario, frame).getpixel((int(x), int(y)))


def test_a_door_below_a_lintel_is_open_in_a_picture_from_above():
    with_lintel, without = room(height_m=20.0), room()
    assert lintels(with_lintel) == [False, True, False]
    for north_m in (85.0, 92.0):
        assert pixel_at(with_lintel, north_m, 100.0) == pixel_at(without, north_m, 100.0)
    assert pixel_at(with_lintel, 40.0, 100.0) != pixel_at(with_lintel, 92.0, 100.0)


def test_what_hangs_above_no_doorway_is_drawn_as_it_is():
    scenario = room(height_m=20.0).model_copy(update={"doors_m": ()})
    assert lintels(scenario) == [False, False, False]


def test_heights_in_rooms_have_decimals_and_others_have_none():
    assert metres(1.2, 2.5) == "1.2"
    assert metres(1.2, 30.0) == "1"
    scenario = room(height_m=20.0)
    assert height_words(scenario.hulls[0], scenario.fence) == "50 m"


def test_a_picture_of_a_room_says_how_high_a_uas_is_to_the_decimetre():
    scenario = room()
    low = scenario.model_copy(
        update={
            "geofence": scenario.geofence.model_copy(
                update={
                    "vertices_m": [
                        (n, e, z) for n in (0.0, 200.0) for e in (0.0, 200.0) for z in (0.0, -5.0)
                    ]
                }
            ),
            "waypoints": (scenario.waypoints[0].model_copy(update={"position_m": (180, 20, -2)}),),
        }
    )

    def drawn(ground, down_m):
        world = World(ground)
        world.state.x[0, 2] = down_m
        return Picture(ground).draw(world.swarm_state())[-40:]

    assert (drawn(low, -1.2) != drawn(low, -1.4)).any()
    assert (drawn(scenario, -1.2) == drawn(scenario, -1.4)).all()


def test_a_replay_page_knows_what_hangs_above_a_doorway():
    flight = rollout(room(height_m=20.0), load_planner("hover"), max_steps=2)
    obstacles = scene_data(SceneHistory.of(flight))["obstacles"]
    assert [obstacle.get("overhead", False) for obstacle in obstacles] == [False, True, False]
