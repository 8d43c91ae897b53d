from dataclasses import replace

import numpy as np
import pytest
from small_fleets import every_waypoint, field, fleet_of, quickest, start_of
from uas_coverage_baselines.trajectory.course import course_of
from uas_coverage_baselines.trajectory.flight_model import NORMS, excess, flight_model
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.steering import Failures
from uas_coverage_baselines.trajectory.tracking import tracked

from uas_coverage_env.vehicle.layout import VX, VZ

SETTLED = 8  # steps after which nothing is left of a start beyond the limits


@pytest.fixture
def under_way():
    """A fleet of one over the field, its first sight, and its plan without room."""
    scenario = field()
    fleet, swarm = fleet_of(scenario)
    route, start = every_waypoint(scenario), start_of(swarm)
    flight = quickest(fleet, start, route, 60)
    return fleet, swarm, Planned(route, flight, course_of(fleet, 0, 0, swarm.x[0], flight))


def again_from(fleet, planned, swarm, program_of):
    moving = MovingObstacles.seen(fleet.brief, swarm, np.zeros(1, np.bool_))
    return tracked(fleet, 0, {0: planned}, swarm, moving, program_of)


def most_used(fleet, flight):
    """Largest share of each of the vehicle's limits, once a flight has settled."""
    norms = np.linalg.norm(flight.x[SETTLED:][:, NORMS], axis=2)
    return norms.max(axis=0) / flight_model(fleet.arena.vehicles[0], 0.0).norms


def test_where_the_plant_is_not_the_model_plans_leave_room(under_way):
    fleet, swarm, planned = under_way
    assert most_used(fleet, planned.flight).max() > 0.99
    fleet.leave_room()
    roomy = again_from(fleet, planned, swarm, fleet.program)
    assert sorted(roomy.route) == sorted(planned.route)
    assert most_used(fleet, roomy.flight).max() < 0.975
    assert planned.flight.steps < roomy.flight.steps < 1.15 * planned.flight.steps


def test_a_uas_that_was_pushed_makes_its_visits_from_where_it_is(under_way):
    fleet, swarm, planned = under_way
    step = planned.flight.steps // 3
    x = swarm.x.copy()
    x[0] = planned.course.x[step]
    x[0, :3] += 0.2, -0.1, 0.0
    x[0, VX : VZ + 1] += 0.2, 0.1, 0.0
    open_now = np.zeros(len(fleet.waypoints_m), np.bool_)
    open_now[planned.route[planned.flight.visits > step]] = True
    pushed = replace(swarm, step=step, x=x, uncovered=open_now)
    again = again_from(fleet, planned, pushed, fleet.tracking_program)
    np.testing.assert_array_equal(again.course.x[0], x[0])
    assert set(again.route) == set(np.flatnonzero(open_now))
    places_m = again.course.x[again.flight.visits, :3]
    away_m = np.linalg.norm(places_m - fleet.waypoints_m[again.route], axis=1)
    assert (away_m < fleet.radius_m[again.route]).all()
    assert again.course.end <= planned.course.end + 4


def test_a_start_beyond_a_limit_is_led_back_within_it(under_way):
    fleet, _, planned = under_way
    model, program = fleet.programs[0].model, fleet.programs[0]
    step = int(np.argmax(np.linalg.norm(planned.flight.x[:, [1, 5]], axis=1)))
    start = planned.flight.x[step].copy()
    start[NORMS[0]] *= 1.3
    assert excess(model, start) == pytest.approx(0.3, abs=0.01)
    left = np.flatnonzero(planned.flight.visits > step)
    rest = planned.flight.after(step, left)
    flight = program.solve(start, planned.route[left], rest.visits + 2, longer(rest.x, 2))
    assert np.isfinite(flight.violation)
    assert all(excess(model, x) < 1e-6 for x in flight.x[SETTLED:])


def longer(x, steps):
    """States with the first held for some steps more."""
    return np.vstack([np.repeat(x[:1], steps, axis=0), x])


def test_one_wild_step_is_forgiven_and_a_lasting_force_is_not():
    once, lasting = Failures(), Failures()
    once.see(1.0)
    assert not once.are_many
    for _ in range(3):
        lasting.next_step()
        lasting.see(1.0)
    assert lasting.are_many
