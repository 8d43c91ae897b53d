import numpy as np
import pytest
from small_fleets import TOWER, every_waypoint, field, fleet_of, quickest, start_of
from small_worlds import box, meadow, waypoint
from uas_coverage_baselines.trajectory.course import course_of, trouble_alone
from uas_coverage_baselines.trajectory.first_guess import first_flight
from uas_coverage_baselines.trajectory.fleet import Moment, make_way
from uas_coverage_baselines.trajectory.retiming import retimed, shifted, stretches, worth
from uas_coverage_baselines.trajectory.space import Body, spare_of_rules_m
from uas_coverage_baselines.trajectory.work import done

from uas_coverage_env.geometry.segments import segment_clearance
from uas_coverage_env.planning.backup.braking import brake
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.vehicle.layout import PHI, THETA, VX, VZ, WX


@pytest.fixture(scope="module")
def flown():
    """A fleet of one over the field: it, its first sight, its route and its quickest flight."""
    scenario = field()
    fleet, swarm = fleet_of(scenario)
    route = every_waypoint(scenario)
    flight = quickest(fleet, start_of(swarm), route, 100)
    return fleet, swarm, route, flight


def test_every_sphere_is_touched_at_its_visit(flown):
    fleet, _, route, flight = flown
    away_m = np.linalg.norm(flight.path_m[flight.visits] - fleet.waypoints_m[route], axis=1)
    assert (away_m <= fleet.radius_m[route]).all()


def test_a_flight_ends_landed_at_home(flown):
    fleet, swarm, _, flight = flown
    course = course_of(fleet, 0, 0, swarm.x[0], flight)
    landing = fleet.programs[0].landing
    assert np.linalg.norm(course.x[-1, :3] - landing.home_m) < landing.distance_m
    assert np.linalg.norm(course.x[-1, VX : VZ + 1]) < landing.speed_mps


def test_what_is_flown_in_the_lpv_world_is_what_was_planned(flown):
    fleet, swarm, _, flight = flown
    course = course_of(fleet, 0, 0, swarm.x[0], flight)
    np.testing.assert_allclose(course.x[:, :3], flight.path_m, atol=1e-3)


def test_braking_from_anywhere_along_a_flight_keeps_the_limits_of_the_vehicle(flown):
    # so of planned states, not of all within the limits (tests/vehicle/test_inner_loop.py)
    fleet, swarm, _, flight = flown
    course = course_of(fleet, 0, 0, swarm.x[0], flight)
    vehicle, largest = fleet.arena.vehicles[0], np.zeros(3)
    assert np.hypot(*course.x[:, PHI : THETA + 1].T).max() > 0.9 * vehicle.tilt_max_rad
    for x in course.x:
        braking = brake(vehicle, np.ascontiguousarray(x), 14)[0]
        pairs = braking[:, [[VX, VX + 1], [PHI, THETA], [WX, WX + 1]]]
        largest = np.maximum(largest, np.linalg.norm(pairs, axis=2).max(axis=0))
    limits = vehicle.v_xy_max_mps, vehicle.tilt_max_rad, vehicle.rate_max_radps
    assert (largest <= 1.01 * np.array(limits)).all()


def test_the_straight_segments_of_a_flight_clear_the_hulls(flown):
    fleet, _, _, flight = flown
    for hull, obstacle in zip(fleet.brief.hulls, fleet.brief.obstacles, strict=True):
        least_m = fleet.brief.uas[0].radius_m + obstacle.safe_distance_m
        for p, q in zip(flight.path_m[:-1], flight.path_m[1:], strict=True):
            clearance_m = segment_clearance(hull.normals, hull.offsets_m, 0, hull.n_faces, *p, *q)
            assert clearance_m >= least_m


def test_retiming_makes_a_flight_much_shorter_than_its_first_guess(flown):
    fleet, swarm, route, flight = flown
    first = done(first_flight(fleet.programs[0], fleet.terrain, 0, start_of(swarm), route))
    assert first.is_clear
    assert flight.steps < 0.85 * first.steps


def test_shadow_prices_name_the_stretch_in_which_time_is_missing(flown):
    """Where three steps are taken from a stretch, its price is the highest of all."""
    fleet, swarm, route, flight = flown
    order, lengths = stretches(flight)
    for squeezed in range(len(lengths)):
        visits = shifted(flight.visits, order, squeezed, -3)
        tight = retimed(fleet.programs[0], start_of(swarm), route, flight, visits, flight.steps - 3)
        prices = worth(tight)
        assert int(np.argmax(prices.gain)) == squeezed
        assert prices.gain[squeezed] > 5.0
        with_one_more = shifted(tight.visits, order, squeezed, 1)
        helped = retimed(
            fleet.programs[0], start_of(swarm), route, tight, with_one_more, tight.steps + 1
        )
        assert helped.violation < tight.violation - 1.0


def test_a_flight_that_hits_something_is_found_out(flown):
    fleet, swarm, _, flight = flown
    assert trouble_alone(fleet, 0, swarm.x[0], flight) is None
    path_m = flight.path_m.copy()
    middle = len(path_m) // 2
    path_m[middle] = np.mean(TOWER["vertices_m"], axis=0)
    assert spare_of_rules_m(fleet.programs[0].space, path_m, True) < 0.0
    path_m[middle] = (-3.0, 100.0, -20.0)
    assert spare_of_rules_m(fleet.programs[0].space, path_m, True) < 0.0


def test_a_flight_beyond_the_battery_is_not_flown():
    scenario = field(soc_0=0.2505)
    fleet, swarm = fleet_of(scenario)
    route = every_waypoint(scenario)
    flight = quickest(fleet, start_of(swarm), route, 20)
    assert trouble_alone(fleet, 0, swarm.x[0], flight) == "the battery does not last"


def test_a_flight_makes_way_for_another_on_its_path(flown):
    fleet, swarm, route, flight = flown
    body = Body(flight.path_m.copy(), 6.3, 6.3)
    body.path_m[:] += (0.5, 0.5, 0.0)
    body.path_m[: flight.steps // 3] += (60.0, 0.0, 0.0)  # joins later
    program = fleet.program(0, {}, [body], None)
    assert program.spare_from_bodies_m(flight.path_m) < 0.0
    other = done(make_way(program, start_of(swarm), route, flight))
    assert program.spare_from_bodies_m(other.path_m) >= -0.02
    assert other.is_clear


@pytest.mark.parametrize(
    ("obstacle", "place_m", "over"),
    [
        (TOWER, (160.0, 160.0, -12.0), False),
        (box("wall", (0.5, 60.0, -9.0), (199.5, 80.0, 0.0)), (100.0, 40.0, -6.0), True),
    ],
)
def test_tall_obstacles_are_flown_round_and_long_low_ones_over(obstacle, place_m, over):
    scenario = field(waypoints=(waypoint(place_m, 5.0),), obstacles=(obstacle,))
    fleet, swarm = fleet_of(scenario)
    route = every_waypoint(scenario)
    flight = quickest(fleet, start_of(swarm), route, 60)
    assert flight.is_clear
    roof_m = -min(z for _, _, z in obstacle["vertices_m"])
    assert (-flight.path_m[:, 2].min() > roof_m) == over


def test_with_nothing_to_visit_a_flight_goes_home():
    scenario = meadow()
    fleet, swarm = fleet_of(scenario)
    start = start_of(swarm)
    start[[0, 4, 8]] += (30.0, -20.0, -10.0)
    nothing = np.zeros(0, np.int64)
    flight = quickest(fleet, start, nothing, 60)
    assert flight.is_clear
    assert np.linalg.norm(flight.path_m[-1] - fleet.programs[0].landing.home_m) < 2.0


def test_a_far_waypoint_is_flown_to_at_nearly_full_speed():
    # programs of long legs take the solver up to 100 iterations, others some 16
    fleet, swarm = fleet_of(generate_scenario(1, 8, 100, 16, min_height_m=3.0))
    start_m = swarm.x[0, :2]
    away_m = np.linalg.norm(fleet.waypoints_m[:, :2] - start_m, axis=1)
    route = np.array([15])
    assert 400.0 < away_m[15] < 500.0
    flight = quickest(fleet, start_of(swarm), route, 100)
    full_speed_s = 2.0 * away_m[15] / fleet.terrain.legs.speed_mps[0]
    assert flight.is_clear
    assert fleet.brief.dt_s * flight.steps < full_speed_s + 8.0


def test_flights_planned_side_by_side_are_those_planned_one_by_one():
    fleet, swarm = fleet_of(generate_scenario(3, 3, 12, 2))
    moment = Moment(swarm.x, np.ones(3, bool), swarm.uncovered, np.zeros(12, np.int64), 0.0)
    routes = {uas: np.arange(4 * uas, 4 * uas + 4) for uas in range(3)}
    nothing = {uas: () for uas in range(3)}
    mission = moment, routes, nothing

    def flights(threads):
        drafts = fleet.drafts(*mission, 20, {}, threads)
        return done(fleet.apart(*mission, fleet.flights(*mission, drafts, threads)))

    one, three = flights(1), flights(3)
    for uas in range(3):
        np.testing.assert_array_equal(one[uas].x, three[uas].x)
