"""A planner is handed what it may know about a mission, and no way to the rest."""

import copy
import pickle
from importlib import resources
from types import BuiltinMethodType, FunctionType, MethodType, ModuleType
from typing import Any

import numpy as np
import pytest

from uas_coverage_env import (
    MissionBrief,
    SwarmState,
    World,
    load_planner,
    planner_names,
    rollout,
    vehicle,
)
from uas_coverage_env.mission import MovingObstacleBrief
from uas_coverage_env.scenario import (
    Decoration,
    Geofence,
    MovingObstacle,
    Obstacle,
    Place,
    Scenario,
    ScheduledVelocity,
    Uas,
    Waypoint,
    load_scenario,
)
from uas_coverage_env.world import GoTo, Velocity

# the search below looks at every attribute, those too that pydantic is going to drop
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning")

LEAVES_S, SPEED_MPS = 37.25, 1.8125
"""Numbers that are found nowhere else in the mission."""

PUBLIC = {
    Scenario: {
        *("schema_version", "name", "dt_s", "max_steps", "landing_distance_m"),
        *("landing_speed_mps", "uas_safe_distance_m", "min_height_m", "from_ground"),
        *("route_margin_m", "geofence", "obstacles", "planar", "doors_m"),
        *("moving_obstacles", "uas", "waypoints", "decorations", "place", "execution"),
        *("sorties", "reserve"),
    },
    MovingObstacle: {"name", "kind", "radius_m", "height_m", "safe_distance_m", "start_m"},
    # these are handed over as they are
    Geofence: {"margin_m", "vertices_m"},
    Obstacle: {"name", "kind", "safe_distance_m", "vertices_m"},
    Uas: {
        *("name", "vehicle", "start_m", "land_m", "soc_0", "radius_m", "dod_max"),
        *("sensors", "heading"),
    },
    Waypoint: {
        *("kind", "position_m", "radius_m", "weight"),
        *("sensor", "heights_m", "max_speed_mps", "again_after_s"),
    },
    Decoration: {"name", "kind", "polygon_m"},
    Place: {"latitude_deg", "longitude_deg", "height_m"},
}
HIDDEN: dict[type, set[str]] = {
    Scenario: {"wind", "uncertainty", "disturbances", "events", "sensing", "relaunch", "walls"},
    MovingObstacle: {"schedule"},
}


@pytest.fixture(scope="module")
def scenario() -> Scenario:
    field = load_scenario("open_field")
    kite = MovingObstacle(
        name="kite",
        radius_m=2.0,
        height_m=4.0,
        safe_distance_m=3.0,
        start_m=(60.0, 60.0, -20.0),
        schedule=(
            ScheduledVelocity(from_s=0.0, velocity_mps=(0.0, 0.0, 0.0)),
            ScheduledVelocity(from_s=LEAVES_S, velocity_mps=(0.0, SPEED_MPS, 0.0)),
        ),
    )
    return field.model_copy(update={"moving_obstacles": (kite,)})


class Listener:
    """Keeps what it is handed, and holds every UAS in place."""

    def warm_up(self, brief):
        self.warmed_up_with = brief

    def reset(self, brief, seed):
        self.brief = brief

    def act(self, swarm):
        self.swarm = swarm
        return {name: Velocity(0.0, 0.0, 4.0) for name in swarm.active}


def everything_within(thing):
    """Every object that attributes, properties, items, elements and bound methods lead to."""
    seen, left = {}, [thing]
    while left:
        found = left.pop()
        if id(found) in seen or isinstance(found, type | ModuleType):
            continue
        seen[id(found)] = found
        if isinstance(found, dict):
            left += [*found.keys(), *found.values()]
        elif isinstance(found, list | tuple | set | frozenset):
            left += found
        elif isinstance(found, MethodType):
            left.append(found.__self__)
        elif isinstance(found, FunctionType):
            left += [cell.cell_contents for cell in found.__closure__ or ()]
        elif not isinstance(found, np.ndarray | str | bytes | int | float | BuiltinMethodType):
            names = {"__dict__", *(name for name in dir(found) if not name.startswith("__"))}
            left += [getattr(found, name) for name in names if hasattr(found, name)]
    return list(seen.values())


def reveals_the_schedule(thing):
    """Whether an object tells by itself when the kite leaves, or how fast."""
    if isinstance(thing, ScheduledVelocity):
        return thing.from_s > 0.0 or any(thing.velocity_mps)
    if isinstance(thing, np.ndarray):
        return bool(np.isin(thing, (LEAVES_S, SPEED_MPS)).any()) if thing.dtype == float else False
    text = repr(thing)
    return str(LEAVES_S) in text or str(SPEED_MPS) in text


@pytest.fixture(scope="module")
def listener(scenario):
    listener = Listener()
    rollout(scenario, listener, max_steps=2)
    return listener


def test_the_search_finds_a_schedule_where_there_is_one(scenario):
    assert any(map(reveals_the_schedule, everything_within(scenario)))


@pytest.mark.parametrize("handed", ["brief", "warmed_up_with", "swarm"])
def test_nothing_that_a_planner_is_handed_leads_to_the_schedule(listener, handed):
    found = everything_within(getattr(listener, handed))
    assert len(found) > 10
    assert not [thing for thing in found if reveals_the_schedule(thing)]


def test_the_scenario_of_a_brief_stands_still(scenario, listener):
    still = listener.brief.as_scenario()
    assert not [thing for thing in everything_within(still) if reveals_the_schedule(thing)]
    assert still.moving_positions(500.0).tolist() == [[60.0, 60.0, -20.0]]
    assert still.moving_velocities(500.0).tolist() == [[0.0, 0.0, 0.0]]
    kite = still.moving_obstacles[0]
    assert still.model_copy(update={"moving_obstacles": scenario.moving_obstacles}) == scenario
    assert (
        kite.model_copy(update={"schedule": scenario.moving_obstacles[0].schedule})
        == (scenario.moving_obstacles[0])
    )


def test_two_missions_that_differ_in_what_is_going_to_happen_have_the_same_brief(scenario):
    still = MissionBrief.of(scenario).as_scenario()
    assert still != scenario
    assert MissionBrief.of(still) == MissionBrief.of(scenario)
    assert hash(MissionBrief.of(still)) == hash(MissionBrief.of(scenario))


def test_every_field_of_a_scenario_is_deliberately_public_or_hidden():
    for record, public in PUBLIC.items():
        assert set(record.model_fields) == public | HIDDEN.get(record, set()), record
    assert set(MissionBrief.model_fields) == PUBLIC[Scenario] | {"vehicles", "conditions"}
    assert set(MovingObstacleBrief.model_fields) == PUBLIC[MovingObstacle]


def test_a_field_that_a_scenario_gains_is_hidden(scenario):
    class Windy(Scenario):
        wind_mps: float = 7.5

    windy = Windy.model_validate(scenario.model_dump(by_alias=True))
    assert not hasattr(MissionBrief.of(windy), "wind_mps")


def test_public_fields_are_those_of_the_scenario(scenario):
    brief = MissionBrief.of(scenario)
    for name in (PUBLIC[Scenario] | {"vehicles", "hulls", "conditions"}) - {"moving_obstacles"}:
        assert getattr(brief, name) == getattr(scenario, name), name
    assert brief.fence is scenario.fence
    (kite,) = brief.moving_obstacles
    for name in PUBLIC[MovingObstacle]:
        assert getattr(kite, name) == getattr(scenario.moving_obstacles[0], name)


def test_what_a_brief_does_not_have_says_what_it_has(scenario):
    brief: Any = MissionBrief.of(scenario)
    with pytest.raises(AttributeError, match=r"no 'moving_positions'; it has .*as_scenario\(\)"):
        brief.moving_positions(3.0)


def test_a_brief_is_immutable_and_travels(scenario):
    brief = MissionBrief.of(scenario)
    with pytest.raises(ValueError, match="frozen"):
        brief.max_steps = 3
    for copied in (pickle.loads(pickle.dumps(brief)), copy.deepcopy(brief)):
        assert copied == brief
        assert copied.as_scenario() == brief.as_scenario()


def test_a_brief_travels_without_its_vehicle_files(scenario, tmp_path):
    file = tmp_path / "own.toml"
    file.write_bytes((resources.files(vehicle) / "s500_v2.toml").read_bytes())
    own = [{**uas.model_dump(), "vehicle": str(file)} for uas in scenario.uas]
    brief = MissionBrief.of(scenario.model_copy(update={"uas": own}))
    sent = pickle.dumps(brief)
    file.unlink()
    received = pickle.loads(sent)
    assert received.vehicles == brief.vehicles
    assert received.as_scenario().vehicles == brief.vehicles


class OfBefore:
    """A planner written when planners were still handed a scenario."""

    def reset(self, scenario: Scenario, seed: int) -> None:
        self.where_m = np.array([waypoint.position_m for waypoint in scenario.waypoints])
        corners_m = scenario.fence.vertices_m
        self.ceiling_m = -corners_m[:, 2].min() - scenario.geofence.margin_m
        self.most = [vehicle.limits.v_xy_max_mps for vehicle in scenario.vehicles]
        self.radius_m = [uas.radius_m for uas in scenario.uas]
        self.keep_m = [hull.n_faces for hull in scenario.hulls]
        self.size_m = [obstacle.radius_m for obstacle in scenario.moving_obstacles]
        self.until_s = scenario.max_steps * scenario.dt_s

    def act(self, swarm: SwarmState):
        away_m = np.linalg.norm(self.where_m - swarm.x[0, :3], axis=1)
        target = int(np.where(swarm.uncovered, away_m, np.inf).argmin())
        return {name: GoTo(target) for name in swarm.active}


def test_a_planner_of_before_flies_unchanged(scenario):
    world, planner = World(scenario), OfBefore()
    planner.reset(scenario, 0)
    flight = rollout(scenario, OfBefore(), max_steps=12)
    for k in range(12):
        np.testing.assert_array_equal(flight.x[k], world.swarm_state().x)
        world.step(planner.act(world.swarm_state()))


@pytest.mark.parametrize("name", [n for n in planner_names() if not n.startswith("milp")])
def test_our_planners_cannot_tell_two_futures_apart(scenario, name):
    still = MissionBrief.of(scenario).as_scenario()
    flights = [
        rollout(made, load_planner(name), seed=1, max_steps=10) for made in (scenario, still)
    ]
    np.testing.assert_array_equal(flights[0].x, flights[1].x)
