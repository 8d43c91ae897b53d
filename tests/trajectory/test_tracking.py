from dataclasses import replace

import numpy as np
import pytest
from hand_made import hover
from small_fleets import every_waypoint, field, fleet_of, quickest, start_of
from uas_coverage_baselines.trajectory import tracking
from uas_coverage_baselines.trajectory.course import course_of
from uas_coverage_baselines.trajectory.flight_model import NORMS, excess, flight_model
from uas_coverage_baselines.trajectory.mission_plan import Planned
from uas_coverage_baselines.trajectory.moving_obstacles import MovingObstacles
from uas_coverage_baselines.trajectory.plan_in_force import PlanInForce
from uas_coverage_baselines.trajectory.steering import Failures
from uas_coverage_baselines.trajectory.tracking import Tracking, tracked

from uas_coverage_env.vehicle.layout import VX, VZ

SETTLED = 8  # steps after which nothing is left of a start beyond the limits


@pytest.fixture
def under_way():
    return planned_in(field())


def planned_in(scenario):
    """The fleet, its first sight, and the plan of its first UAS without room."""
    fleet, swarm = fleet_of(scenario)
    route, start = every_waypoint(scenario), start_of(swarm)
    flight = quickest(fleet, start, route, 60)
    return fleet, swarm, Planned(route, flight, course_of(fleet, 0, 0, swarm.x[0], flight))


def again_from(fleet, planned, swarm, program_of):
    moving = MovingObstacles.seen(fleet.brief, swarm, np.zeros(1, np.bool_))
    return tracked(fleet, 0, {0: planned}, swarm, moving, program_of)


class Flown:
    """The plan in force, and what comes of a UAS that is pushed along it."""

    def __init__(self, under_way):
        self.fleet, self.first, self.planned = under_way
        self.tracking = Tracking(self.fleet)
        self.step = self.planned.flight.steps // 3

    def follow(self, off_mps=0.0, as_planned=(0,), filtered=False, responds=True, beside=None):
        """What is planned for the UAS after a sample at which its velocity is off by so much."""
        n = len(self.first.x)
        x = self.first.x.copy()
        x[0] = self.planned.course.x[self.step]
        x[0, VZ] += off_mps
        open_now = np.zeros(len(self.fleet.waypoints_m), np.bool_)
        open_now[self.planned.route[self.planned.flight.visits > self.step]] = True
        swarm = replace(
            self.first, step=self.step, x=x, uncovered=open_now, filtered=np.full(n, filtered),
            responds=np.full(n, responds),
        )  # fmt: skip
        moving = MovingObstacles.seen(self.fleet.brief, swarm, np.zeros(n, np.bool_))
        ends, no = {0: self.planned.course.end}, np.zeros(n, np.bool_)
        planned = (beside or {}) | {0: self.planned}
        in_force = PlanInForce(  # pyrefly: ignore[bad-argument-type]  # the plan is not looked at
            None, planned, ends, 0, frozenset((0,)), ~no, no, moving, no, no, None
        )
        self.tracking.follow(in_force, swarm, moving, as_planned)
        return in_force.planned.get(0), x[0]


def test_a_uas_that_is_where_it_was_planned_to_be_flies_on(under_way):
    flown = Flown(under_way)
    for _ in range(9):
        assert flown.follow()[0] is flown.planned
    assert not flown.tracking.is_disturbed
    assert not flown.tracking.fails


def test_a_uas_that_flew_something_else_has_no_plan_any_more_and_nothing_pushed_it(under_way):
    flown = Flown(under_way)
    assert flown.follow(0.8, as_planned=())[0] is None
    assert not flown.tracking.is_disturbed
    assert flown.fleet.programs[0].reserve == 0.0


def test_once_a_uas_is_pushed_all_plans_leave_room_from_where_it_is(under_way):
    flown = Flown(under_way)
    again, x = flown.follow(0.2)
    assert flown.tracking.is_disturbed
    assert flown.fleet.programs[0].reserve > 0.02
    np.testing.assert_array_equal(again.course.x[0], x)
    assert again.course.begin == flown.step
    assert flown.planned.course.end < again.course.end < 1.2 * flown.planned.course.end


def test_a_uas_that_its_filter_held_is_tracked_and_no_force_is_thought_of(under_way):
    flown = Flown(under_way)
    for _ in range(9):
        again, x = flown.follow(0.8, filtered=True)
        np.testing.assert_array_equal(again.course.x[0], x)
        assert again.course.end <= flown.planned.course.end + 4
    assert not flown.tracking.is_disturbed
    assert not flown.tracking.fails


@pytest.mark.parametrize(("off_mps", "responds", "times"), [(0.8, True, 3), (0.8, False, 0)])
def test_no_flight_goes_as_planned_where_velocities_are_off_again_and_again(
    under_way, off_mps, responds, times
):
    flown = Flown(under_way)
    for n in range(1, 6):
        flown.follow(off_mps, responds=responds)
        assert flown.tracking.fails == (times > 0 and n >= times), n


def test_steps_without_a_plan_count_once_something_has_pushed(under_way):
    flown, swarm = Flown(under_way), under_way[1]
    for _ in range(9):
        flown.tracking.flies_without_plan(0, swarm)
    assert not flown.tracking.fails
    flown.follow(0.2)
    deaf = replace(swarm, responds=np.zeros(1, np.bool_))
    for _ in range(9):
        flown.tracking.flies_without_plan(0, deaf)
    assert not flown.tracking.fails
    for n in range(1, 6):
        flown.tracking.flies_without_plan(0, swarm)
        assert flown.tracking.fails == (n > 4)


def test_too_late_for_another_flight_a_uas_ends_the_one_it_has(under_way):
    fleet, swarm, planned = under_way
    last = planned.flight.steps
    done = np.zeros(len(fleet.waypoints_m), np.bool_)
    for left in (1, 0):
        step = last - left
        there = replace(swarm, step=step, x=planned.course.x[None, step].copy(), uncovered=done)
        again = again_from(fleet, planned, there, fleet.tracking_program)
        assert (again is not None) == (left > 0)
        if left:
            np.testing.assert_array_equal(again.course.u, planned.course.u[step:])


def test_a_flight_from_elsewhere_may_end_up_to_four_steps_later(under_way, monkeypatch):
    fleet, swarm, planned = under_way
    tried = []
    monkeypatch.setattr(tracking, "_checked", lambda *of: tried.append(of[-1].steps))
    assert again_from(fleet, planned, swarm, fleet.tracking_program) is None
    assert tried == [planned.flight.steps + later for later in range(5)]


@pytest.mark.parametrize("off_m", [0.0, 5.0])
def test_whatever_another_uas_flies_one_that_was_pushed_is_tracked(off_m):
    flown = Flown(planned_in(field(starts_m=((100.0, 100.0, -1.0), (20.0, 180.0, -1.0)))))
    still = flown.planned.flight.after(0, np.zeros(0, np.int64))
    waits = Planned(still.visits, still, hover(flown.first.x[1, :3] + (off_m, 0.0, 0.0)))
    again, _ = flown.follow(0.2, beside={1: waits})
    assert flown.tracking.is_disturbed
    assert again is not flown.planned


def test_a_uas_that_was_thrown_too_far_has_no_flight_in_time(under_way):
    fleet, swarm, planned = under_way
    step = planned.flight.steps // 3
    x = planned.course.x[None, step].copy()
    open_now = np.ones(len(fleet.waypoints_m), np.bool_)
    x[0, 0] = 199.0 if x[0, 0] < 100.0 else 1.0
    thrown = replace(swarm, step=step, x=x, uncovered=open_now)
    assert again_from(fleet, planned, thrown, fleet.tracking_program) is None


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
