"""`uas-coverage vehicle`: list, check, new."""

import re

import pytest

from uas_coverage_env.cli import main
from uas_coverage_env.vehicle import load_vehicle, vehicle_names

KNOWN = {
    "--mass-kg": "1.58",
    "--motors": "4",
    "--propeller-in": "10x4.5",
    "--cells": "4",
    "--capacity-Ah": "5",
    "--hover-minutes": "22.9",
    "--top-speed-mps": "12",
}


pytestmark = pytest.mark.usefixtures("elsewhere")


def new(*more, **changes):
    """`vehicle new` of the S500's data, some options changed by their Python names."""
    known = KNOWN | {f"--{name.replace('_', '-')}": value for name, value in changes.items()}
    return ["vehicle", "new", *(word for pair in known.items() for word in pair), *more]


def test_the_shipped_vehicles_are_listed_with_their_hover_time(capsys):
    assert main(["vehicle", "list"]) == 0
    out = capsys.readouterr().out
    for name in vehicle_names():
        assert re.search(rf"^ *{name} .*\d", out, re.MULTILINE)
    assert "22.9" in out


def test_a_check_says_what_follows_from_the_parts(capsys):
    assert main(["vehicle", "check", "s500_v2"]) == 0
    out = capsys.readouterr().out
    assert out.startswith("Holybro S500 V2 is valid\n")
    assert "193.8 W, 22.9 min to empty" in out
    assert re.search(r"lpv: 204\.6 W.*\n.*nonlinear: 192\.3 W", out)


def test_a_vehicle_is_made_and_every_assumption_is_said(elsewhere, capsys):
    assert main(new("--out", "mine.toml")) == 0
    out, err = capsys.readouterr()
    assert err == ""
    given, computed, assumed, flies = re.split(
        r"^(?:computed|assumed|as it flies)$", out, flags=re.M
    )
    assert "airframe.mass_kg = 1.58" in given
    assert "--mass-kg" in given
    assert "rotor.torque_Nm_per_radps2" in computed
    assert "momentum theory, figure of merit 0.65" in computed
    assert "battery.dod_max = 0.75" in assumed
    assert "asked for  22.9 min of hover down to 0% charge: 22.9 nonlinear, 22.9 lpv" in flies
    assert "vehicle in mine.toml" in flies
    vehicle = load_vehicle("mine.toml")
    assert vehicle.name == "mine"
    assert main(["vehicle", "check", "mine.toml"]) == 0
    assert f"{vehicle.power.hover_W:.4g} W" in capsys.readouterr().out


def test_a_made_vehicle_flies(elsewhere, capsys):
    from uas_coverage_env import load_scenario

    assert main(new("--out", "mine.toml", "--name", "My drone")) == 0
    mission = load_scenario("open_field")
    fleet = tuple(
        uas.model_copy(update={"vehicle": str(elsewhere / "mine.toml")}) for uas in mission.uas
    )
    mission.model_copy(update={"uas": fleet}).to_file("field.toml")
    run = ["run", "field.toml", "--planner", "nearest-waypoint", "--steps", "3", "--out", "flown"]
    assert main(run) == 0
    assert 'name = "My drone"' in next((elsewhere / "flown").glob("vehicle_*.toml")).read_text()


def test_a_file_that_exists_is_kept_unless_told(elsewhere, capsys):
    (elsewhere / "mine.toml").write_text("precious")
    assert main(new("--out", "mine.toml")) == 2
    assert capsys.readouterr().err == (
        "error: mine.toml: exists; give another file or add --overwrite\n"
    )
    assert (elsewhere / "mine.toml").read_text() == "precious"
    assert main(new("--out", "mine.toml", "--overwrite")) == 0
    assert load_vehicle("mine.toml").airframe.mass_kg == 1.58


def test_a_propeller_may_be_its_diameter_alone(capsys):
    assert main(new("--out", "plain.toml", propeller_in="10")) == 0
    assert load_vehicle("plain.toml").rotor.propeller_radius_m == 0.127


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"mass_kg": "0"},
            "vehicle new: mass_kg: should be greater than or equal to 0.01",
        ),
        ({"mass_kg": "nan"}, "vehicle new: mass_kg: should be a finite number, not nan"),
        ({"mass_kg": "heavy"}, "Invalid value for '--mass-kg'"),
        ({"propeller_in": "10-4.5"}, "--propeller-in '10-4.5': should be DIAMETERxPITCH"),
        ({"hover_minutes": "60"}, "hover_minutes 60 leaves"),
        ({"out": "mine.txt"}, "mine.txt: should end in .toml"),
        ({"out": "nowhere/mine.toml"}, "nowhere: is no folder; make it first"),
    ],
)
def test_a_mistake_is_one_line_and_no_file(changes, message, elsewhere, capsys):
    assert main(new(**({"out": "mine.toml"} | changes))) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert err.startswith(f"error: {message}")
    assert err.count("\n") == 1
    assert not list(elsewhere.iterdir())


def test_a_contradiction_in_a_file_ends_a_check_in_one_line(elsewhere, capsys):
    assert main(new("--out", "mine.toml")) == 0
    capsys.readouterr()
    path = elsewhere / "mine.toml"
    path.write_text(path.read_text().replace("[power]", "[power]\nhover_W = 60.0"))
    assert main(["vehicle", "check", "mine.toml"]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert re.fullmatch(
        r"error: mine\.toml: power\.hover_W is 60, but .* 193\.8 W to hover; .*\n", err
    )
