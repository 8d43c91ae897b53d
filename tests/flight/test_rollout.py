import math
import signal
import time
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from uas_coverage_env.files.strict_toml import InputError, parse
from uas_coverage_env.flight import (
    MODES,
    Assistants,
    AssistedOptions,
    Decision,
    Flight,
    PlannerError,
    PlannerOptions,
    rollout,
)
from uas_coverage_env.flight.metrics import accomplished, energy_Wh, filtered_share
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.vehicle import load_vehicle
from uas_coverage_env.world import GoTo, Velocity, Wrench


class Still:
    """Holds every UAS where it started, three metres higher."""

    def reset(self, scenario, seed):
        pass

    def act(self, swarm):
        return {name: Velocity(0.0, 0.0, 4.0) for name in swarm.active}


def changed(scenario, **fields):
    return parse(scenario.model_dump(by_alias=True) | fields, Scenario, "changed")


def commanding(command):
    planner: Any = Still()
    planner.act = lambda swarm: dict.fromkeys(swarm.active, command)
    return planner


def test_a_mission_that_covers_all_and_lands_is_accomplished(flight):
    assert flight.ended == "complete"
    assert accomplished(flight)
    assert flight.covered[0] == 1, "the waypoint above a start is covered at t = 0"
    assert flight.covered[-1] == 3
    assert (np.diff(flight.covered) >= 0).all()
    assert flight.violations == ()
    assert [MODES[code] for code in flight.mode[-1]] == ["landed", "landed"]


def test_inputs_and_currents_act_from_their_sample_to_the_next_and_end_with_the_landing(flight):
    for i, last in enumerate(flight.last_sample):
        assert (flight.current_A[:last, i] > 1.0).all(), "a multicopter in the air draws current"
        assert (flight.current_A[last:, i] == 0.0).all()
        assert (flight.u[last:, i] == 0.0).all()
        assert (flight.voltage_V[last:, i] > flight.voltage_V[last - 1, i]).all()
    assert flight.last_sample.max() == flight.steps


def test_the_record_is_what_a_world_flown_by_hand_shows(yard, listed, flight):
    world = World(yard)
    listed.reset(yard, 3)
    for k in range(flight.steps):
        swarm = world.swarm_state()
        np.testing.assert_array_equal(flight.x[k], swarm.x)
        np.testing.assert_array_equal(flight.moving_position_m[k], swarm.moving_position_m)
        assert flight.covered[k] == (~swarm.uncovered).sum()
        outcome = world.step(listed.act(swarm))
        for i, name in enumerate(swarm.names):
            if name in swarm.active:
                np.testing.assert_array_equal(flight.u[k, i], outcome["u"][i])
                assert flight.voltage_V[k, i] == outcome["voltage_V"][i]
                assert flight.current_A[k, i] == outcome["current_A"][i]
    assert world.done
    np.testing.assert_array_equal(flight.x[-1], world.swarm_state().x)


def test_modes_are_those_of_the_commands_then_the_end_of_each_uas(yard, flight):
    left = [MODES[code] for code in flight.mode[:, 0]]
    assert list(dict.fromkeys(left)) == ["transit", "return", "landed"]
    covering = rollout(yard, commanding(Velocity(0.0, 0.0, 3.0, mode="covering")), max_steps=2)
    assert {MODES[code] for code in covering.mode.ravel()} == {"covering"}


def test_distances_breaches_and_energy_are_those_of_the_world(yard, flight, listed):
    world = World(yard)
    listed.reset(yard, 3)
    separation_m, clearance_m, breaches, taken_Wh = [], [], 0, np.zeros(2)
    while not world.done:
        outcome = world.step(listed.act(world.swarm_state()))
        separation_m.append(outcome["separation_m"].min())
        clearance_m.append(outcome["obstacle_clearance_m"].min())
        breaches += outcome["breaches"].sum()
        taken_Wh += outcome["energy_Wh"]
    assert flight.min_separation_m == min(separation_m)
    assert flight.min_obstacle_clearance_m == min(clearance_m)
    assert flight.breaches == breaches
    np.testing.assert_allclose(energy_Wh(flight), taken_Wh, rtol=1e-12)


def test_distances_are_none_where_there_is_nothing_to_be_clear_of(yard):
    alone = changed(yard, uas=[yard.uas[0].model_dump()], obstacles=[], moving_obstacles=[])
    flight = rollout(alone, Still(), max_steps=2)
    assert flight.min_separation_m is None
    assert flight.min_obstacle_clearance_m is None
    assert flight.moving_position_m.shape == (3, 0, 3)


def test_a_contact_is_a_violation_with_time_kind_and_partner(yard):
    flight = rollout(yard, commanding(Velocity(12.0, 0.0, 3.0)))
    assert [violation.kind for violation in flight.violations] == ["geofence", "geofence"]
    violation = flight.violations[0]
    assert violation.partner is None
    k = round(violation.time_s / yard.dt_s)
    i = flight.names.index(violation.uas)
    assert flight.x[k, i, 0] > 100.0 >= flight.x[k - 1, i, 0]
    assert MODES[flight.mode[k, i]] == "lost"
    assert flight.ended == "complete"
    assert not accomplished(flight)


def test_a_limit_exceeded_is_one_violation_with_its_first_time_and_worst_value(yard):
    torque = load_vehicle("s500_v2").torque_max_Nm[1]
    flight = rollout(yard, commanding(Wrench(0.0, 0.0, -torque, 0.0)), max_steps=3)
    assert not accomplished(flight)
    mine = {one.partner: one for one in flight.violations if one.uas == "left"}
    assert {one.kind for one in flight.violations} == {"limit"}
    assert set(mine) == {"tilt", "tilt_rate", "speed"}
    tilt = mine["tilt"]
    assert (tilt.time_s, tilt.samples, tilt.limit) == (2.0, 2, 0.4363)
    assert tilt.value == pytest.approx(np.abs(flight.x[:, 0, 7]).max())
    assert str(tilt) == (
        "left, beyond its limit of tilt from 2 s on: 2.25 rad of 0.4363 rad at the worst, "
        "samples: 2"
    )


def test_what_the_safety_filter_replaced_is_kept_step_by_step(yard):
    toward_the_fence = commanding(Velocity(12.0, 0.0, 3.0))
    bare = rollout(yard, toward_the_fence)
    assert {decision.filtered for decision in bare.decisions} == {0}
    assert filtered_share(bare) == 0.0
    kept = rollout(yard, toward_the_fence, safety_filter=True, max_steps=40)
    assert not kept.violations
    replaced = [decision.filtered for decision in kept.decisions]
    assert replaced[0] == 0, "far from the fence there is nothing to replace"
    assert replaced[-1] == 2, "both are held back at the fence"
    assert filtered_share(kept) == pytest.approx(sum(replaced) / (2 * 40))


def test_a_collision_with_an_obstacle_names_the_obstacle(yard):
    planner: Any = Still()
    planner.act = lambda swarm: {
        name: Velocity(6.0, 3.0 if name == "left" else -3.0, 3.0) for name in swarm.active
    }
    flight = rollout(yard, planner)
    assert {(violation.kind, violation.partner) for violation in flight.violations} <= {
        ("obstacle", "shed"),
        ("uas", "left"),
        ("uas", "right"),
    }
    assert flight.violations


def test_a_flight_ends_after_the_steps_that_were_asked_for(yard):
    flight = rollout(yard, Still(), max_steps=4)
    assert (flight.steps, flight.ended) == (4, "steps")
    assert flight.x.shape == (5, 2, 14)
    assert (flight.current_A[-1] == 0.0).all(), "nothing acts after the last sample"
    assert len(flight.decisions) == 4


def test_a_flight_ends_after_the_steps_of_the_scenario_at_the_latest(yard):
    assert rollout(changed(yard, max_steps=3), Still(), max_steps=100).steps == 3


def test_seeds_and_switches_of_numpy_are_kept_with_the_flight(yard, tmp_path):
    numpys = {"max_steps": np.int64(1), "return_mode": np.True_, "safety_filter": np.False_}
    flight = rollout(yard, Still(), np.int64(3), **numpys)
    flight.save(tmp_path / "flight")
    kept = Flight.load(tmp_path / "flight")
    assert (kept.seed, kept.return_mode, kept.safety_filter, kept.steps) == (3, True, False, 1)


@pytest.mark.parametrize("steps", [0, 1.5, math.nan, "2"])
def test_a_limit_that_is_no_number_of_steps_is_refused(yard, steps):
    with pytest.raises(ValueError, match=r"max_steps is .*; give a whole number from 1 on"):
        rollout(yard, Still(), max_steps=steps)


@pytest.mark.parametrize("interrupted", ["act", "on_step"])
def test_ctrl_c_leaves_the_flight_so_far(yard, listed, interrupted):
    def stop(progress):
        if progress.swarm.step == 5:
            raise KeyboardInterrupt

    if interrupted == "act":
        act = listed.act
        listed.act = lambda swarm: stop(SimpleNamespace(swarm=swarm)) or act(swarm)
        flight = rollout(yard, listed)
    else:
        flight = rollout(yard, listed, on_step=stop)
    assert (flight.steps, flight.ended) == (5, "stopped")
    assert len(flight.u) == len(flight.covered) == len(flight.moving_position_m) == 6


@pytest.mark.parametrize("name", sorted({"SIGINT", "SIGTERM", "SIGHUP"} & set(dir(signal))))
def test_a_signal_ends_the_flight_after_the_step_and_is_handled_as_before_after_it(
    yard, listed, name
):
    number = getattr(signal, name)
    act, finished = listed.act, []

    def interrupted(swarm):
        if swarm.step == 5:
            signal.raise_signal(number)
        finished.append(swarm.step)
        return act(swarm)

    def handler(*_):
        raise KeyboardInterrupt

    listed.act, before = interrupted, signal.signal(number, handler)
    try:
        flight = rollout(yard, listed)
        assert signal.getsignal(number) is handler
    finally:
        signal.signal(number, before)
    assert (flight.steps, flight.ended) == (6, "stopped")
    assert finished[-1] == 5


@pytest.mark.usefixtures("python_handles_interrupts")
def test_a_second_ctrl_c_ends_the_flight_within_the_step(yard, listed):
    def interrupted(swarm):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    listed.act = interrupted
    flight = rollout(yard, listed)
    assert (flight.steps, flight.ended) == (0, "stopped")


def test_a_flight_can_be_stopped_from_outside(yard):
    asked = iter([False, False, True])
    flight = rollout(yard, Still(), should_stop=lambda: next(asked))
    assert (flight.steps, flight.ended) == (2, "stopped")


def test_progress_is_told_before_the_first_decision_and_after_every_step(yard):
    told = []
    rollout(yard, Still(), max_steps=3, on_step=told.append)
    assert [progress.swarm.step for progress in told] == [0, 1, 2, 3]
    assert [progress.max_steps for progress in told] == [3] * 4
    assert told[0].decision_time_s is None
    assert all(progress.decision_time_s > 0.0 for progress in told[1:])
    assert [progress.covered for progress in told] == [1] * 4


def test_warming_up_comes_first_and_is_not_timed(yard, listed):
    order = []
    reset = listed.reset
    listed.warm_up = lambda scenario: order.append("warm_up") or time.sleep(0.2)
    listed.reset = lambda scenario, seed: order.append(f"reset {seed}") or reset(scenario, seed)
    started = time.perf_counter()
    flight = rollout(yard, listed, seed=7, max_steps=3)
    elapsed_s = time.perf_counter() - started
    assert order == ["warm_up", "reset 7"]
    assert flight.wall_time_s <= elapsed_s - 0.2
    assert flight.wall_time_s >= sum(decision.duration_s for decision in flight.decisions)
    assert flight.x[0, 0, 12] == 0.0, "trying out the world leaves no trace in the flight"


def test_decision_time_is_that_of_the_planner_alone(yard):
    planner: Any = Still()
    act = planner.act
    planner.act = lambda swarm: time.sleep(0.02) or act(swarm)
    flight = rollout(yard, planner, max_steps=2, on_step=lambda progress: time.sleep(0.2))
    durations_s = [decision.duration_s for decision in flight.decisions]
    assert min(durations_s) >= 0.02
    # told three times: before the first step and after both
    assert sum(durations_s) <= flight.wall_time_s - 0.6


def test_what_a_planner_tells_about_its_decisions_is_kept(yard):
    planner: Any = Still()
    act = planner.act

    def telling(swarm):
        path_m = np.array([[swarm.step, n, -n] for n in range(4)], float)
        gap = [0.25, float("inf"), None][swarm.step]
        planner.last_decision = Decision({"right": path_m}, fallback=swarm.step == 1, mip_gap=gap)
        return act(swarm)

    planner.act = telling
    flight = rollout(yard, planner, max_steps=3)
    assert [decision.fallback for decision in flight.decisions] == [False, True, False]
    assert [decision.mip_gap for decision in flight.decisions] == [0.25, None, None]
    assert flight.plan["step"].tolist() == [0] * 4 + [1] * 4 + [2] * 4
    assert set(flight.plan["uas"]) == {1}
    assert flight.plan["n"].tolist() == [0, 1, 2, 3] * 3
    np.testing.assert_array_equal(flight.plan["position_m"][9], [2.0, 1.0, -1.0])


@pytest.mark.parametrize(
    ("asked", "given", "flown"),
    [
        (None, None, False),
        (Assistants(return_mode=True, safety_filter=True), None, True),
        (Assistants(return_mode=True, safety_filter=True), False, False),
        (None, True, True),
    ],
)
def test_assistants_are_those_of_the_planner_unless_the_caller_says_otherwise(
    yard, asked, given, flown
):
    planner: Any = Still()
    if asked is not None:
        planner.assistants = asked
    flight = rollout(yard, planner, max_steps=1, return_mode=given, safety_filter=given)
    assert flight.return_mode is flown
    assert flight.safety_filter is flown


@pytest.mark.parametrize(
    ("commands", "reason"),
    [
        (lambda swarm: {"left": GoTo(0)}, "right"),
        (lambda swarm: dict.fromkeys(swarm.active, GoTo(99)), "99"),
        (lambda swarm: dict.fromkeys(swarm.active, Velocity(float("nan"), 0, 3)), "nan"),
        (lambda swarm: None, "None"),
    ],
)
def test_commands_that_cannot_be_flown_are_reported_with_planner_and_time(yard, commands, reason):
    planner: Any = Still()
    act = planner.act
    planner.act = lambda swarm: act(swarm) if swarm.step < 2 else commands(swarm)
    with pytest.raises(PlannerError, match=r"'Still' at step 2 \(t = 2 s\): ") as error:
        rollout(yard, planner)
    assert reason in str(error.value)


def test_a_planner_that_refuses_a_scenario_is_reported_as_bad_input(yard):
    planner = Still()

    def refuse(scenario, seed):
        raise ValueError("too many UAS for me")

    planner.reset = refuse
    with pytest.raises(InputError, match="'Still' refuses scenario 'yard': too many UAS for me"):
        rollout(yard, planner)


def test_options_of_a_planner_go_into_the_record(yard):
    class Options(PlannerOptions):
        patience_s: float = 2.5

    planner: Any = Still()
    planner.options = Options()
    flight = rollout(yard, planner, seed=11, max_steps=1)
    assert (flight.planner, flight.planner_options, flight.seed) == (
        "Still",
        {"patience_s": 2.5},
        11,
    )


def test_scenario_and_planner_may_be_names_or_files(yard, tmp_path):
    yard.to_file(tmp_path / "yard.toml")
    flight = rollout(tmp_path / "yard.toml", "hover", max_steps=2)
    assert flight.scenario == yard
    assert flight.planner == "hover"
    assert rollout("open_field", "hover", max_steps=1).scenario.name == "open_field"


def test_what_cannot_be_flown_is_refused_at_the_door(yard):
    with pytest.raises(InputError, match="unknown planner 'nobody'"):
        rollout(yard, "nobody")
    with pytest.raises(ValueError, match="newtonian"):
        rollout(yard, Still(), dynamics="newtonian")


@pytest.mark.parametrize("dynamics", ["lpv", "nonlinear"])
def test_the_same_seed_flies_the_same_flight(yard, dynamics):
    def flown(seed):
        flight = rollout(yard, "random-walk", seed, dynamics=dynamics, max_steps=25)
        return flight.x, flight.u, flight.voltage_V

    for mine, theirs in zip(flown(1), flown(1), strict=True):
        np.testing.assert_array_equal(mine, theirs)
    assert not np.array_equal(flown(1)[0], flown(2)[0])


def test_the_nonlinear_world_can_be_flown_too(yard, listed):
    flight = rollout(yard, listed, dynamics="nonlinear", max_steps=15)
    assert flight.dynamics == "nonlinear"
    assert not np.array_equal(flight.x[15], rollout(yard, listed, max_steps=15).x[15])


WIND = {"mean_mps": 2.0, "from_deg": 10.0}
LOST = {"kind": "uas_lost", "at_s": 500.0}


@pytest.mark.parametrize(
    "pushing", [{"wind": WIND}, {"uncertainty": {"mass": 0.01}}, {"events": [LOST]},
                {"sensing": {"position_noise_m": 0.1}}],
)  # fmt: skip
def test_where_something_pushes_back_assistants_fly_along_unless_they_are_refused(yard, pushing):
    scenario = changed(yard, **pushing)
    flight = rollout(scenario, Still(), max_steps=2)
    assert (flight.return_mode, flight.safety_filter) == (True, True)
    flight = rollout(scenario, Still(), max_steps=2, return_mode=False, safety_filter=False)
    assert (flight.return_mode, flight.safety_filter) == (False, False)


def test_an_assistant_that_options_take_away_stays_away_where_something_pushes_back(yard):
    windy = changed(yard, wind=WIND)
    planner: Any = Still()
    planner.assistants = AssistedOptions(filter=False).assistants
    flight = rollout(windy, planner, max_steps=1)
    assert (flight.return_mode, flight.safety_filter) == (True, False)
    planner.assistants = AssistedOptions(return_mode=False).assistants
    flight = rollout(windy, planner, max_steps=1)
    assert (flight.return_mode, flight.safety_filter) == (False, True)


def test_in_still_air_a_planner_without_assistants_flies_without(yard):
    flight = rollout(yard, Still(), max_steps=2)
    assert (flight.return_mode, flight.safety_filter) == (False, False)
    flight = rollout(changed(yard, wind=WIND), Still(), max_steps=2, disturbances=())
    assert (flight.return_mode, flight.safety_filter) == (False, False)
