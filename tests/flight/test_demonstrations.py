"""What planners do as data to learn from: exact observations, labels in hindsight, safe files."""

import numpy as np
import pytest
from leaderboard_rows import flights_in

from uas_coverage_env import load_planner, load_scenario, rollout, uas_coverage_v0
from uas_coverage_env.cli import main
from uas_coverage_env.env.actions.waypoint import HOME_CHOICE
from uas_coverage_env.env.policy.interface import MissionInterface
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Assistants, Demonstrations, demonstrate
from uas_coverage_env.flight.demonstrations import UNKNOWN_CHOICE, written
from uas_coverage_env.flight.metrics import episode_return

SCENARIO = load_scenario("open_field")


@pytest.fixture(scope="module")
def shown():
    return demonstrate(SCENARIO, "nearest-waypoint", seed=3)


def test_rows_are_those_of_the_steps_in_which_a_uas_flew(shown):
    flight = rollout(SCENARIO, "nearest-waypoint", 3)
    assert len(shown) == sum(flight.last_sample)
    assert len({*zip(shown.uas, shown.step, strict=True)}) == len(shown)
    assert shown.reward.sum() == pytest.approx(episode_return(flight))
    assert shown.missions[0]["covered"] == len(SCENARIO.waypoints)


def test_observations_are_those_that_the_environment_shows(shown):
    env = uas_coverage_v0.parallel_env(SCENARIO, return_mode=True, safety_filter=True)
    planner = load_planner("nearest-waypoint")
    observations, _ = env.reset(seed=3)
    planner.reset(env.brief, 3)
    for step in range(12):
        for i, agent in enumerate(env.possible_agents):
            row = shown.observation[(shown.step == step) & (shown.uas == i)][0]
            # actions are float32, commands are not
            np.testing.assert_allclose(row, observations[agent], atol=1e-4)
        observations, *_ = env.step(env.actions_of(planner.act(env.swarm_state()), clip=True))


def test_the_choice_is_the_waypoint_that_the_uas_covers_next():
    class Watch:
        def __init__(self):
            self.planner, self.swarms = load_planner("nearest-waypoint"), []
            self.assistants = Assistants(return_mode=True, safety_filter=True)

        def reset(self, brief, seed):
            self.planner.reset(brief, seed)
            self.observer = MissionInterface(brief)

        def act(self, swarm):
            self.observer.observe(swarm)
            self.swarms.append((swarm, self.observer.candidates.copy()))
            return self.planner.act(swarm)

    watch = Watch()
    shown = demonstrate(SCENARIO, watch)
    found = 0
    for row in np.flatnonzero((shown.choice >= 0) & (shown.choice < HOME_CHOICE)):
        step, uas = shown.step[row], shown.uas[row]
        chosen = watch.swarms[step][1][uas, shown.choice[row]]
        assert shown.choice_mask[row, shown.choice[row]]
        assert watch.swarms[step][0].uncovered[chosen]
        later = [
            k for k in range(step, len(watch.swarms)) if not watch.swarms[k][0].uncovered[chosen]
        ]
        if later:
            place = np.array(SCENARIO.waypoints[chosen].position_m)
            away_m = np.linalg.norm(watch.swarms[later[0]][0].x[uas, :3] - place)
            assert away_m <= SCENARIO.waypoints[chosen].radius_m + 15.0  # a step's way
            found += 1
    assert found > 0.5 * len(shown)
    assert {*shown.choice} <= {UNKNOWN_CHOICE, *range(HOME_CHOICE + 1)}


def test_the_velocity_asks_for_what_the_step_ended_with(shown):
    env = uas_coverage_v0.parallel_env(SCENARIO, return_mode=True, safety_filter=True)
    env.reset(seed=3)
    for step in range(30):
        rows = {i: (shown.step == step) & (shown.uas == i) for i in range(len(SCENARIO.uas))}
        flying = {f"uas_{i + 1}": shown.velocity[row][0] for i, row in rows.items() if row.any()}
        env.step({agent: flying[agent] for agent in env.agents})
    flown = env.swarm_state().x
    meant = rollout(SCENARIO, "nearest-waypoint", 3).x[30]
    # a velocity is asked for in the step at whose end it was flown, so that the flight lags
    assert np.abs(flown[:, :2] - meant[:, :2]).max() < 20.0  # of 172 m flown by then
    assert np.abs(flown[:, 2] - meant[:, 2]).max() < 2.0


def test_returns_add_up_what_comes_later(shown):
    first = shown.step == 0
    assert shown.returns()[first].sum() == pytest.approx(shown.reward.sum())
    np.testing.assert_array_equal(shown.returns(0.0), shown.reward)
    with pytest.raises(ValueError, match="discount is 2"):
        shown.returns(2.0)


def test_missions_survive_their_files_and_damage_is_named(shown, tmp_path):
    (tmp_path / "a.npz").write_bytes(written(shown))
    (tmp_path / "b.npz").write_bytes(written(shown))
    both = Demonstrations.load(tmp_path)
    np.testing.assert_array_equal(both.observation, np.tile(shown.observation, (2, 1)))
    assert both.missions == shown.missions * 2
    assert (np.bincount(both.mission) == len(shown)).all()
    whole = (tmp_path / "b.npz").read_bytes()
    (tmp_path / "b.npz").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"b\.npz"):
        Demonstrations.load(tmp_path)
    np.savez(tmp_path / "b.npz", about=np.array([{"schema": 1}], dtype=object))
    with pytest.raises(InputError, match=r"b\.npz"):
        Demonstrations.load(tmp_path)
    with pytest.raises(InputError, match="holds no demonstrations"):
        Demonstrations.load(tmp_path / "nowhere")


def asked(out, *more, planner="nearest-waypoint"):
    words = ["planner", "demonstrate", "open_field", "--planner", planner, "--jobs", "1"]
    return [*words, "--out", str(out), *more]


def test_the_command_goes_on_where_it_was_and_keeps_planners_apart(tmp_path, capsys):
    assert main(asked(tmp_path)) == 0
    kept = (tmp_path / "open_field.npz").stat().st_mtime_ns
    assert main(asked(tmp_path)) == 0
    assert "1 of 1 flights are there" in capsys.readouterr().out
    assert (tmp_path / "open_field.npz").stat().st_mtime_ns == kept
    assert main(asked(tmp_path, "generated:900000")) == 0
    assert [one["scenario"] for one in Demonstrations.load(tmp_path).missions] == [
        "open_field",
        "town-s900000-u3-w44-o14-h300cm",
    ]
    assert main(asked(tmp_path, "--seed", "1")) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert main(asked(tmp_path, "--option", "speed")) == 2


def test_what_is_shown_is_what_the_function_gives_and_its_row_is_in_the_store(shown, tmp_path):
    assert main(asked(tmp_path, "--seed", "3")) == 0
    found = Demonstrations.load(tmp_path)
    np.testing.assert_array_equal(found.observation, shown.observation)
    assert found.missions == shown.missions
    (row,) = flights_in(tmp_path)
    assert (row.steps, row.seed, row.label) == (shown.missions[0]["steps"], 3, "nearest-waypoint")
    assert row.episode_return == pytest.approx(shown.reward.sum())


def test_files_of_another_planner_are_not_read_once_it_is_overwritten(tmp_path):
    assert main(asked(tmp_path, "generated:900000")) == 0
    assert main(asked(tmp_path, "--overwrite", planner="hover")) == 0
    assert len(list(tmp_path.glob("*.npz"))) == 2, "foreign files are left alone"
    (mission,) = Demonstrations.load(tmp_path).missions
    assert (mission["scenario"], mission["planner"]) == ("open_field", "hover")
    (tmp_path / "open_field.npz").unlink()
    with pytest.raises(InputError, match=r"open_field\.npz"):
        Demonstrations.load(tmp_path)


def test_a_mission_that_a_planner_refuses_is_a_row_and_no_file(tmp_path, capsys, monkeypatch):
    (tmp_path / "refusing_planner.py").write_text(
        "class Refuses:\n"
        "    def reset(self, brief, seed):\n"
        "        raise ValueError('no map of this place')\n\n"
        "    def act(self, swarm):\n"
        "        return {}\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert main(asked(tmp_path / "out", planner="refusing_planner:Refuses")) == 1
    assert "no map of this place" in capsys.readouterr().err
    assert [one.status for one in flights_in(tmp_path / "out")] == ["failed"]
    with pytest.raises(InputError, match="holds no demonstrations"):
        Demonstrations.load(tmp_path / "out")


def test_a_folder_of_version_0_3_is_read_and_not_gone_on_with(shown, tmp_path, capsys):
    (tmp_path / "open_field.npz").write_bytes(written(shown))
    (tmp_path / "demonstrations.json").write_text("{}")
    assert Demonstrations.load(tmp_path).missions == shown.missions
    assert main(asked(tmp_path)) == 2
    assert "holds demonstrations.json of version 0.3.0 or older" in capsys.readouterr().err
