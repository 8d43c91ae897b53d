"""UAS that have landed take off again, where the scenario lets them and no other is at work."""

import dataclasses

import numpy as np
import pytest
from eventful import event, field
from small_worlds import mover, waypoint
from uas_coverage_agents.route.planner import LearnedRoute
from uas_coverage_agents.velocity.planner import LearnedVelocity
from uas_coverage_baselines.tour import Tour
from uas_coverage_baselines.trajectory import Trajectory

from uas_coverage_env import Flight, MissionBrief, World, rollout
from uas_coverage_env.entities.state import FLYING, LANDED, LOST
from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.flight.metrics import accomplished, coverage, energy_Wh, home
from uas_coverage_env.flight.record import MODES
from uas_coverage_env.mission import first_sight
from uas_coverage_env.planning.around.handover import SILENT_S
from uas_coverage_env.planning.around.relaunch import Relaunch
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.uas_coverage_v0 import parallel_env
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.world import GoTo

AHEAD = (waypoint((80.0, 30.0, -20.0), 8.0), waypoint((100.0, 30.0, -20.0), 8.0))
LOST_AT_S = 5.0
LOST_2 = event("uas_lost", LOST_AT_S, uas="uas_2")

PLANNERS = {
    "tour": lambda: Tour(Tour.Options(moves=20_000, changes=60)),
    "trajectory": lambda: Trajectory(Trajectory.Options(orders=1, moves=20_000, programs=20)),
    "learned-route": lambda: LearnedRoute(LearnedRoute.Options(samples=4)),
    "learned-velocity": LearnedVelocity,
}


def again(*events, **more):
    """A mission in which UAS take off again."""
    return field(*events, **{"waypoints": AHEAD, **more}).model_copy(update={"relaunch": True})


class SecondUasWorks:
    """The last UAS that flies goes to the open waypoints, if it dares; the others go home."""

    def __init__(self, dares=True):
        self.dares, self.resets = dares, 0

    def reset(self, brief, seed):
        self.resets += 1

    def act(self, swarm):
        commands = {name: GoTo(None) for name in swarm.active}
        if self.dares and swarm.uncovered.any():
            commands[swarm.active[-1]] = GoTo(int(swarm.uncovered.argmax()))
        return commands


@pytest.fixture(scope="module")
def flight():
    return rollout(again(LOST_2), SecondUasWorks())


def test_a_uas_that_has_landed_covers_what_a_lost_uas_leaves(flight):
    assert accomplished(flight)
    assert coverage(flight) == 1.0
    assert home(flight).tolist() == [True, False]


def test_without_leave_it_stays_where_it_has_landed():
    flight = rollout(field(LOST_2, waypoints=AHEAD), SecondUasWorks())
    assert coverage(flight) == 0.0
    assert flight.steps == LOST_AT_S


@pytest.mark.parametrize("planner", list(PLANNERS.values()), ids=list(PLANNERS))
def test_every_planner_goes_on_with_it(planner):
    calm = rollout(again(), planner())
    works = int(calm.last_sample.argmax())
    assert calm.last_sample[1 - works] < LOST_AT_S < calm.last_sample[works]
    flight = rollout(again(event("uas_lost", LOST_AT_S, uas=calm.names[works])), planner())
    assert accomplished(flight)
    assert not flight.breaches
    assert home(flight)[1 - works]


def test_while_it_rests_nothing_moves_and_nothing_is_drawn(flight):
    drawn = np.flatnonzero(flight.current_A[:, 0] > 0.0)
    first_stay = slice(1, int(LOST_AT_S))
    assert drawn[0] == 0
    assert drawn[1] == LOST_AT_S
    assert {MODES[mode] for mode in flight.mode[first_stay, 0]} == {"return"}
    assert (flight.x[first_stay, 0] == flight.x[1, 0]).all()
    assert (flight.voltage_V[first_stay, 0] > 14.0).all()
    assert (flight.u[first_stay, 0] == 0.0).all()
    assert flight.last_sample[0] == flight.steps


def test_its_flight_is_kept_whole_in_files(flight, tmp_path):
    loaded = Flight.load(flight.save(tmp_path))
    assert loaded == flight
    assert energy_Wh(loaded)[0] > 0.5


def test_where_no_uas_takes_off_again_flights_are_what_they_were():
    stays, may = (rollout(s, SecondUasWorks()) for s in (field(waypoints=AHEAD), again()))
    for name in ("x", "u", "mode", "voltage_V", "current_A", "covered"):
        np.testing.assert_array_equal(getattr(stays, name), getattr(may, name))


def test_it_does_not_go_a_second_time_where_nothing_came_of_it():
    planner = SecondUasWorks(dares=False)
    flight = rollout(again(), planner)
    assert planner.resets == 2
    assert flight.ended == "complete"
    assert home(flight).all()


def test_no_file_says_so_that_did_not_before(tmp_path):
    assert "relaunch" not in field(waypoints=AHEAD).model_dump(by_alias=True)
    data = again().model_dump(mode="json", by_alias=True)
    assert data["relaunch"] is True
    with pytest.raises(InputError, match="relaunch: true does not go with from_ground"):
        parse({**data, "from_ground": True}, Scenario, "mission.toml")


def test_in_an_environment_a_uas_that_has_landed_has_left():
    env = parallel_env(again(LOST_2), action="waypoint")
    env.reset(seed=0)
    home_action = int(env.action_space("uas_1").n) - 1
    env.step({"uas_1": home_action, "uas_2": 0})
    for _ in range(8):
        assert env.agents in (["uas_2"], [])
        env.step(dict.fromkeys(env.agents, 0))
    assert env.agents == []


def seen(scenario, *status, **changes):
    """What is seen of UAS at their starts."""
    swarm = first_sight(MissionBrief.of(scenario))
    return dataclasses.replace(swarm, status=np.array(status), **changes)


def due(scenario, *status, **changes):
    return Relaunch(MissionBrief.of(scenario)).due(seen(scenario, *status, **changes)).tolist()


def test_no_uas_goes_while_another_is_at_work():
    assert due(again(), LANDED, LOST) == [True, False]
    assert due(again(), LANDED, LANDED) == [True, True]
    assert due(again(), LANDED, FLYING) == [False, False]


def test_where_a_waypoint_is_asked_for_again_one_goes_while_another_is_at_work():
    relaunch = Relaunch(MissionBrief.of(again()))
    swarm = seen(again(), LANDED, FLYING)
    assert relaunch.due(swarm, asked_again=True).tolist() == [True, False]
    nothing = dataclasses.replace(swarm, uncovered=np.zeros_like(swarm.uncovered))
    assert not relaunch.due(nothing, asked_again=True).any()


def test_one_that_return_mode_flies_home_is_not_at_work():
    assert due(again(), LANDED, FLYING, returning=np.array([False, True])) == [True, False]


def test_one_that_takes_no_commands_is_not_at_work_and_does_not_go():
    scenario = again()
    relaunch = Relaunch(MissionBrief.of(scenario))
    for step in range(int(SILENT_S) + 1):
        swarm = seen(scenario, LANDED, FLYING, responds=np.array([True, step == 0]), step=step)
        assert relaunch.due(swarm).tolist() == [step == SILENT_S, False]
    assert due(scenario, LANDED, LOST, responds=np.array([False, True])) == [False, False]


def test_it_goes_with_charge_enough_only():
    scenario = again()
    x = first_sight(MissionBrief.of(scenario)).x
    x[:, DOD] = scenario.uas[0].dod_max - 0.01
    assert due(scenario, LANDED, LOST, x=x) == [False, False]


def test_it_goes_with_time_enough_only():
    assert due(again(), LANDED, LOST, step=again().max_steps - 10) == [False, False]


def test_it_does_not_go_for_what_is_covered_or_kept_from_it():
    assert due(again(), LANDED, LOST, uncovered=np.zeros(2, bool)) == [False, False]
    covers_all = mover((90.0, 30.0, -20.0), (0.0, (0.0, 0.0, 0.0)), radius_m=60.0, height_m=30.0)
    assert due(again(moving_obstacles=(covers_all,)), LANDED, LOST) == [False, False]


def test_of_two_that_stand_too_near_to_each_other_one_goes():
    x = first_sight(MissionBrief.of(again())).x
    x[1, :3] = x[0, :3] + (3.0, 0.0, 0.0)
    assert due(again(), LANDED, LANDED, x=x) == [True, False]
    assert due(again(), LANDED, FLYING, x=x, returning=np.array([False, True])) == [False, False]


def test_a_uas_that_flies_or_is_lost_cannot_take_off():
    world = World(again())
    with pytest.raises(ValueError, match="has not landed"):
        world.take_off(np.array([True, False]))
