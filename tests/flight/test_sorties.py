"""A mission larger than one charge is flown in sorties, each of them a flight like any other."""

import json
import signal
from functools import partial
from itertools import pairwise

import pytest

from uas_coverage_env import Flight, generate_scenario, load_scenario, rollout
from uas_coverage_env.cli import main
from uas_coverage_env.files.errors import InputError
from uas_coverage_env.flight import covered_at, fly_sorties, sorties_summary
from uas_coverage_env.flight.metrics import accomplished
from uas_coverage_env.scenario import warnings


def with_charge(scenario, soc, **changes):
    fleet = tuple(uas.model_copy(update={"soc_0": soc}) for uas in scenario.uas)
    return scenario.model_copy(update={"uas": fleet, **changes})


FLY = partial(rollout, planner="nearest-waypoint")


@pytest.fixture(scope="module")
def mission():
    """Some waypoints of the village, too many for what is in the batteries."""
    village = load_scenario("village")
    return with_charge(
        village, 0.36, waypoints=village.waypoints[:16], sorties={"packs": 4, "swap_s": 120.0}
    )


@pytest.fixture(scope="module")
def sorties(mission):
    flights = list(fly_sorties(mission, FLY, 10))
    assert len(flights) > 1
    return flights


def test_together_they_cover_everything_once(mission, sorties):
    assert sum(int(flight.covered[-1]) for flight in sorties) == len(mission.waypoints)
    for before, after in pairwise(sorties):
        left = covered_at(before) == len(before.x)
        wanted = [w for w, open_ in zip(before.scenario.waypoints, left, strict=True) if open_]
        assert after.scenario.waypoints == tuple(wanted)
    assert accomplished(sorties[-1])


def test_each_begins_at_home_with_a_fresh_pack_of_those_that_are_left(mission, sorties):
    for number, flight in enumerate(sorties, start=1):
        assert flight.scenario.uas == mission.uas
        assert flight.scenario.sorties.packs == 4 - (number - 1)
        assert (flight.soc[0] == 0.36).all()
    assert [flight.scenario.name for flight in sorties][1:] == [
        f"village-sortie-{number}" for number in range(2, len(sorties) + 1)
    ]


def test_the_summary_adds_up(mission, sorties):
    result = sorties_summary(sorties)
    flown_s = sum(flight.steps * mission.dt_s for flight in sorties)
    assert result["time_s"] == flown_s + 120.0 * (len(sorties) - 1)
    assert result["sorties"][1]["begins_s"] == sorties[0].steps * mission.dt_s + 120.0
    assert result["energy_Wh"] == pytest.approx(
        sum((f.voltage_V * f.current_A).sum() * mission.dt_s / 3600.0 for f in sorties)
    )
    assert result["packs"] == dict.fromkeys(mission_names(mission), len(sorties))
    assert (result["ended"], result["coverage"], result["left"]) == ("complete", 1.0, 0)
    assert result["all_home"]


def mission_names(mission):
    return [uas.name for uas in mission.uas]


def test_packs_and_what_is_asked_bound_their_number(mission):
    few = mission.model_copy(update={"sorties": {"packs": 1}})
    (only,) = fly_sorties(few, FLY, 10)
    assert only.covered[-1] < len(mission.waypoints)
    assert sorties_summary([only])["ended"] == "packs used up"
    assert len(list(fly_sorties(mission, FLY, 1))) == 1
    without = mission.model_copy(update={"sorties": None})
    assert len(list(fly_sorties(without, FLY, 2))) == 2


def test_one_that_covers_nothing_or_does_not_come_home_is_the_last(mission):
    idle = list(fly_sorties(mission, partial(rollout, planner="hover"), 10))
    assert len(idle) == 1
    assert sorties_summary(idle)["ended"] in ("nothing covered", "in the air", "no UAS left")
    short = list(fly_sorties(mission, partial(FLY, max_steps=20), 10))
    assert len(short) == 1
    assert sorties_summary(short)["ended"] == "in the air"


def test_a_pack_counts_only_for_a_uas_that_flew(mission, sorties):
    first = sorties[0]
    x = first.x.copy()
    x[:, 1] = x[0, 1]
    grounded = Flight(**{**vars(first), "x": x})
    assert sorties_summary([grounded])["packs"] == {first.names[0]: 1, first.names[1]: 0}


def test_take_off_and_landing_count_where_missions_begin_on_the_ground(mission):
    ground = mission.model_copy(update={"from_ground": True})
    first = next(fly_sorties(ground, FLY, 1))
    result = sorties_summary([first])
    assert result["time_s"] > first.steps * ground.dt_s
    assert result["energy_Wh"] > (first.voltage_V * first.current_A).sum() * ground.dt_s / 3600.0


def test_a_scenario_without_sorties_is_what_it_was():
    plain = generate_scenario(seed=1, n_uas=1, n_waypoints=3, n_obstacles=0)
    assert "sorties" not in plain.model_dump(mode="json", by_alias=True)
    assert "sorties" not in plain.file_text()


def test_the_table_is_read_back_and_flown_once_without_the_option(mission, tmp_path):
    mission.to_file(tmp_path / "mission.toml")
    assert load_scenario(tmp_path / "mission.toml") == mission
    plain = mission.model_copy(update={"sorties": None})
    one, other = FLY(mission), FLY(plain)
    assert (one.x == other.x).all()


def test_packs_count_against_the_warning_of_small_batteries(mission):
    small = mission.model_copy(update={"sorties": None})
    assert any("batteries will hardly" in line for line in warnings(small))
    assert not any("batteries will hardly" in line for line in warnings(mission))
    one = mission.model_copy(update={"sorties": {"packs": 1}})
    assert warnings(one) == warnings(small)


@pytest.mark.usefixtures("python_handles_interrupts")
def test_ctrl_c_while_a_sortie_is_written_ends_the_sorties(mission, tmp_path, monkeypatch):
    save = Flight.save

    def interrupted(*args, **kwargs):
        signal.raise_signal(signal.SIGINT)
        save(*args, **kwargs)

    monkeypatch.setattr(Flight, "save", interrupted)
    mission.to_file(tmp_path / "mission.toml")
    out = tmp_path / "out"
    command = ["run", str(tmp_path / "mission.toml"), "--planner", "nearest-waypoint"]
    assert main([*command, "--sorties", "9", "--out", str(out)]) == 130
    result = json.loads((out / "sorties.json").read_text())
    assert result["ended"] == "stopped"
    assert len(result["sorties"]) == 1
    assert Flight.load(out / "sortie_1").ended == "complete"


def test_the_command_keeps_a_flight_for_each_and_a_summary(mission, sorties, tmp_path, capsys):
    mission.to_file(tmp_path / "mission.toml")
    out = tmp_path / "out"
    command = ["run", str(tmp_path / "mission.toml"), "--planner", "nearest-waypoint"]
    assert main([*command, "--sorties", "9", "--out", str(out)]) == 0
    said = capsys.readouterr().out
    assert f"covered 100% in {len(sorties)} sorties; " in said
    for number, flight in enumerate(sorties, start=1):
        kept = Flight.load(out / f"sortie_{number}")
        assert (kept.x == flight.x).all()
    result = json.loads((out / "sorties.json").read_text())
    assert result == json.loads(json.dumps(sorties_summary(sorties)))
    # fewer, over the same folder: what is left of the longer run is named
    assert main([*command, "--sorties", "1", "--out", str(out), "--overwrite"]) == 1
    said = capsys.readouterr()
    assert "(packs used up)" in said.out
    assert "sortie_2: is of an earlier run" in said.err
    assert len(json.loads((out / "sorties.json").read_text())["sorties"]) == 1


def test_steps_and_sorties_together_are_refused(tmp_path, capsys):
    command = ["run", "open_field", "--steps", "3", "--sorties", "2", "--out", str(tmp_path / "o")]
    assert main(command) == 2
    assert "give either --steps or --sorties" in capsys.readouterr().err
    assert not (tmp_path / "o").exists()


def test_sorties_of_waypoints_that_are_asked_for_again_are_refused(tmp_path, capsys):
    scenario = load_scenario("open_field")
    first, *others = scenario.waypoints
    again = (first.model_copy(update={"again_after_s": (60.0,)}), *others)
    changed = scenario.model_copy(update={"waypoints": again, "relaunch": True})
    changed.to_file(tmp_path / "patrol.toml")
    assert main(["run", str(tmp_path / "patrol.toml"), "--sorties", "2"]) == 2
    said = capsys.readouterr().err
    assert "asked for again some time after they were covered (again_after_s)" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("packs = 0", "sorties.packs"),
        ("swap_s = 1.0", "sorties.packs"),
        ("packs = 2\nswap_s = -1.0", "sorties.swap_s"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused(table, said, tmp_path):
    text = load_scenario("open_field").file_text()
    (tmp_path / "a.toml").write_text(f"{text}\n[sorties]\n{table}\n")
    with pytest.raises(InputError, match=said):
        load_scenario(tmp_path / "a.toml")
