import numpy as np
import pytest
import uas_coverage_baselines.trajectory.program as program_module
import uas_coverage_baselines.trajectory.replanning as planner_module
from small_fleets import FIELD, HOUSE, TOWER, field
from small_worlds import box, meadow, mover, waypoint
from uas_coverage_baselines.trajectory import Trajectory, TrajectoryOptions
from uas_coverage_baselines.trajectory.mission_plan import plan_mission
from uas_coverage_baselines.trajectory.safeguard import Safeguard

from uas_coverage_env import Scenario, rollout
from uas_coverage_env.flight.metrics import accomplished, energy_Wh, fallback_reasons, home
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import generate_scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle.layout import DOD, VX

QUICK = {"orders": 1, "moves": 20_000, "programs": 40, "idle_work": 0}
TWO = ((100.0, 100.0, -1.0), (112.0, 100.0, -1.0))


def planner(**options):
    return Trajectory(TrajectoryOptions(**(QUICK | options)))


@pytest.fixture(scope="module")
def small_town():
    return generate_scenario(3, n_uas=2, n_waypoints=12, n_obstacles=4)


@pytest.fixture(scope="module")
def flight(small_town):
    return rollout(small_town, planner())


def is_harmless(flight):
    return flight.violations == () and flight.breaches == 0


class Watched(Trajectory):
    """Keeps every decision."""

    def reset(self, brief, seed):
        self.decisions = []
        super().reset(brief, seed)

    def act(self, swarm):
        commands = super().act(swarm)
        self.decisions.append(self.last_decision)
        return commands


class Breakable:
    """The interior point, which fails where it is told to."""

    def __init__(self, monkeypatch, fails):
        self.calls, self._solve, self._fails = 0, program_module.solve, fails
        monkeypatch.setattr(program_module, "solve", self)

    def __call__(self, *args, **options):
        self.calls += 1
        return self._fails(self.calls, self._solve(*args, **options))


def test_it_accomplishes_a_town_without_violation_or_breach(flight):
    assert accomplished(flight)
    assert is_harmless(flight)


def test_it_is_faster_and_takes_less_energy_than_flying_to_the_nearest(small_town, flight):
    nearest = rollout(small_town, "nearest-waypoint")
    assert flight.steps < 0.8 * nearest.steps
    assert energy_Wh(flight).sum() < 0.8 * energy_Wh(nearest).sum()


def test_the_same_seed_flies_the_same_mission(small_town, flight):
    np.testing.assert_array_equal(rollout(small_town, planner()).x, flight.x)


def test_the_whole_mission_is_flown_as_planned_before_take_off(small_town):
    watched = Watched(TrajectoryOptions(**QUICK))
    flight = rollout(small_town, watched)
    for u, uas in enumerate(small_town.uas):
        planned_m = watched.decisions[0].predicted_m[uas.name]
        np.testing.assert_allclose(flight.x[: len(planned_m) - 1, u, :3], planned_m[:-1], atol=1e-6)
    assert not any(decision.fallback for decision in watched.decisions)


def test_without_any_solution_it_stays_where_it_is_and_lands_at_last(small_town, monkeypatch):
    Breakable(monkeypatch, lambda _, found: found._replace(converged=False))
    watched = Watched(TrajectoryOptions(**QUICK))
    flight = rollout(small_town, watched)
    assert is_harmless(flight)
    assert home(flight).all()
    assert all(decision.fallback for decision in watched.decisions)


def test_a_solver_that_dies_in_flight_changes_nothing_of_what_was_verified(small_town, monkeypatch):
    solver = Breakable(monkeypatch, lambda _, found: found)
    first, brief = planner(idle_work=450), MissionBrief.of(small_town)
    first.warm_up(brief)
    first.reset(brief, 0)
    before_take_off = solver.calls
    whole = rollout(small_town, planner())

    def dies(calls, found):
        return found._replace(converged=False) if calls > before_take_off else found

    Breakable(monkeypatch, dies)
    np.testing.assert_array_equal(rollout(small_town, planner(idle_work=450)).x, whole.x)


def test_wrong_solutions_are_not_flown(small_town, monkeypatch):
    rng = np.random.default_rng(0)

    def wrong(_, found):
        if rng.random() < 0.5:
            return found
        return found._replace(
            x=found.x + rng.normal(size=found.x.shape), u=found.u + rng.normal(size=found.u.shape)
        )

    Breakable(monkeypatch, wrong)
    flight = rollout(small_town, planner())
    assert is_harmless(flight)
    assert home(flight).all()


def test_on_the_nonlinear_plant_it_tracks_its_plan_without_harm(small_town):
    flight = rollout(small_town, planner(), dynamics="nonlinear")
    assert accomplished(flight)
    assert is_harmless(flight)


def test_on_the_nonlinear_plant_flights_under_way_get_room_and_no_other_order(
    small_town, monkeypatch
):
    planned_at = []

    def planned(fleet, moment, step, *rest):
        planned_at.append(step)
        return plan_mission(fleet, moment, step, *rest)

    monkeypatch.setattr(planner_module, "plan_mission", planned)
    flight = rollout(small_town, planner(), dynamics="nonlinear")
    assert accomplished(flight)
    assert not set(planned_at) & set(range(1, 30))


def test_in_narrow_gaps_on_the_nonlinear_plant_it_follows_its_plan_without_harm():
    flight = rollout("walls:3100", planner(), dynamics="nonlinear")
    assert accomplished(flight)
    assert is_harmless(flight)
    assert not fallback_reasons(flight)


def test_a_weak_battery_gets_a_short_route():
    weak = field(starts_m=TWO, soc_0=1.0)
    data = weak.model_dump(by_alias=True)
    data["uas"][1]["soc_0"] = 0.27
    weak = type(weak).model_validate(data)
    flight = rollout(weak, planner())
    assert accomplished(flight)
    assert flight.x[-1, 1, DOD] <= 0.75
    way_m = np.abs(np.diff(flight.x[:, :, :3], axis=0)).sum(axis=(0, 2))
    assert way_m[1] < way_m[0]


def test_in_a_large_fleet_routes_leave_room_for_flights_that_take_longer_than_expected():
    town = generate_scenario(3, n_uas=5, n_waypoints=40, n_obstacles=0)
    weak = [uas.model_copy(update={"soc_0": 0.34}) for uas in town.uas]
    trajectory = planner(programs=3, weight_energy=5.0)  # hardly made shorter
    trajectory.reset(MissionBrief.of(town.model_copy(update={"uas": tuple(weak)})), 0)
    assert trajectory.mission_plan.troubles == {}
    assert len(trajectory.mission_plan.order.left_out) == 0


def test_the_waypoints_of_a_lost_uas_are_covered_by_the_others():
    scenario = field(starts_m=TWO)
    world, flown = World(scenario), planner()
    flown.reset(MissionBrief.of(scenario), 0)
    world.reset()
    for step in range(120):
        swarm = world.swarm_state()
        if not swarm.active:
            break
        commands = dict(flown.act(swarm))
        world.step(commands)
        if step == 6:
            lost = int(swarm.status.argmin())
            world.state.uas[lost].status = 2
    assert not world.swarm_state().uncovered.any()


PARKED = mover(
    (160.0, 150.0, -25.0),
    (0.0, (0.0, 0.0, 0.0)),
    (45.0, (0.0, 0.0, -3.0)),
    (50.0, (0.0, 12.0, 0.0)),
    radius_m=6.0,
    safe_distance_m=12.0,
)


def test_what_is_blocked_is_waited_for_at_a_distance_and_covered_later():
    scenario = field(starts_m=TWO, moving_obstacles=(PARKED,))
    flight = rollout(scenario, planner())
    assert accomplished(flight)
    assert is_harmless(flight)
    assert flight.steps > 45


@pytest.mark.parametrize("heading", [(0.0, 4.0, 0.0), (3.0, 3.0, 0.0), (-2.0, 5.0, 0.5)])
def test_nothing_comes_near_to_what_flies_through_the_mission(heading):
    crossing = mover((30.0, 5.0, -20.0), (0.0, heading), (20.0, (1.0, 3.0, 0.0)))
    flight = rollout(field(starts_m=TWO, moving_obstacles=(crossing,)), planner())
    assert is_harmless(flight)
    assert accomplished(flight)


def test_energy_can_be_weighed_more_than_time():
    """With a large weight one UAS may stay at home."""
    scenario = meadow(TWO, waypoints=FIELD, obstacles=(TOWER, HOUSE))
    quick = rollout(scenario, planner(weight_energy=0.0))
    thrifty = rollout(scenario, planner(weight_energy=2.0))
    assert quick.steps <= thrifty.steps
    assert energy_Wh(thrifty).sum() <= energy_Wh(quick).sum()


def test_no_uas_flies_faster_than_it_is_told_to():
    scenario = meadow(TWO[:1], waypoints=FIELD[:2])
    fast = MissionBrief.of(scenario).vehicles[0].limits.v_xy_max_mps
    slow = planner(speed_share=0.5)
    slow.reset(MissionBrief.of(scenario), 0)
    level_mps = np.hypot(*slow.in_force.planned[0].course.x[:, VX : VX + 2].T)
    assert 0.45 * fast < level_mps.max() <= 0.5 * fast


def test_most_of_a_large_fleet_fly_where_that_makes_the_mission_shorter():
    town = MissionBrief.of(generate_scenario(1, n_uas=8, n_waypoints=100, n_obstacles=6))
    eight = planner(programs=1, moves=100_000)
    eight.reset(town, 0)
    assert len(eight.in_force.planned) >= 5


def test_a_uas_that_stays_at_home_is_in_no_ones_way():
    """It lands in the first step; the other passes over it later, nearer than flying UAS may."""
    starts = ((20.0, 100.0, -1.0), (60.0, 102.0, -1.0))
    both = meadow(starts, waypoints=(waypoint((110.0, 100.0, -3.0), 3.0),))
    known = both.model_dump(mode="json", by_alias=True)
    known["uas"][1]["soc_0"] = 0.26
    watched = Watched(TrajectoryOptions(**QUICK))
    flown = rollout(Scenario.model_validate(known), watched)
    assert is_harmless(flown)
    assert flown.covered[-1] == 1
    assert not any(decision.fallback for decision in watched.decisions)


def test_a_single_waypoint_far_away_along_the_fence_is_flown_to():
    alone = meadow(((4.0, 4.0, -1.0),), waypoints=(waypoint((196.0, 4.0, -10.0)),))
    far = {"vertices_m": box("fence", (0.0, 0.0, -50.0), (700.0, 200.0, 0.0))["vertices_m"]}
    wide = alone.model_dump(mode="json", by_alias=True)
    wide["geofence"] |= far
    wide["waypoints"][0]["position_m"] = (690.0, 4.0, -10.0)
    flown = rollout(Scenario.model_validate(wide), planner())
    assert accomplished(flown)
    assert is_harmless(flown)
    assert flown.steps < 140


@pytest.mark.parametrize("least_m", [3.0, 8.0])
def test_outside_of_landing_zones_the_least_height_is_kept_above_ground_and_roofs(least_m):
    # waypoints near the ground, and a roof whose safe distance is less than the height
    house = box("house", (120.0, 80.0, -6.0), (150.0, 120.0, 0.0), 1.0)
    points = [(190.0, 100.0, -2.0), (190.0, 180.0, -2.0), (100.0, 180.0, -2.0)]
    mission = meadow(
        obstacles=[house],
        waypoints=[waypoint(point) for point in points],
        min_height_m=least_m,
    )
    flight = rollout(mission, planner())
    assert accomplished(flight)
    assert is_harmless(flight)
    free = rollout(mission.model_copy(update={"min_height_m": 0.0}), planner())
    zone_m = MissionBrief.of(mission).landing_zone_m
    lowest_m = []
    for one in (free, flight):
        outside = np.linalg.norm(one.x[:, 0, :2] - one.x[0, 0, :2], axis=1) > zone_m
        lowest_m.append(-one.x[outside, 0, 2].max())
    assert lowest_m[0] < least_m <= lowest_m[1], "without the rule it flies lower"


def test_a_yard_is_entered_straight_down_and_left_straight_up():
    wings = [
        box("south", (60.0, 60.0, -16.0), (68.0, 110.0, 0.0)),
        box("north", (102.0, 60.0, -16.0), (110.0, 110.0, 0.0)),
        box("west", (68.0, 60.0, -16.0), (102.0, 68.0, 0.0)),
        box("east", (68.0, 102.0, -16.0), (102.0, 110.0, 0.0)),
    ]
    yard = waypoint((85.0, 85.0, -5.0), 4.0)
    flown = rollout(meadow(((20.0, 20.0, -1.0),), waypoints=(yard,), obstacles=wings), planner())
    assert accomplished(flown)
    assert is_harmless(flown)
    assert not any(decision.fallback for decision in flown.decisions)


def test_a_way_round_two_corners_is_found():
    walls = [
        box("first", (0.0, 60.0, -50.0), (150.0, 64.0, 0.0)),
        box("second", (50.0, 130.0, -50.0), (200.0, 134.0, 0.0)),
    ]
    behind = waypoint((150.0, 170.0, -10.0))
    flown = rollout(meadow(((20.0, 20.0, -1.0),), waypoints=(behind,), obstacles=walls), planner())
    assert accomplished(flown)
    assert is_harmless(flown)
    assert not any(decision.fallback for decision in flown.decisions)


def test_what_was_flown_instead_of_a_plan_is_no_reason_to_give_plans_up(monkeypatch):
    chosen, until = Safeguard.chosen, 9

    def nothing_at_first(guard, swarm, *rest):
        return chosen(guard, swarm, *rest) if swarm.step > until else {}

    monkeypatch.setattr(Safeguard, "chosen", nothing_at_first)
    watched = Watched(TrajectoryOptions(**QUICK))
    flown = rollout(meadow(TWO, waypoints=FIELD), watched)
    assert accomplished(flown)
    assert all(decision.fallback for decision in watched.decisions[: until + 1])
    later = watched.decisions[until + 1 : -1]
    assert later
    # steered UAS have no predicted path
    assert all(decision.predicted_m and not decision.fallback for decision in later)
