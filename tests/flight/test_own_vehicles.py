"""Flights of vehicles that are not shipped: the directory holds their files."""

import dataclasses
import json
import shutil
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from uas_coverage_env import vehicle
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight, rollout


def own_vehicle(folder: Path, name: str, capacity_Ah: float) -> str:
    """The path of a vehicle file like the shipped one's, with another battery."""
    shipped = (resources.files(vehicle) / "s500_v2.toml").read_text(encoding="utf-8")
    assert "capacity_Ah = 5.0" in shipped
    folder.mkdir()
    path = folder / name
    path.write_text(shipped.replace("capacity_Ah = 5.0", f"capacity_Ah = {capacity_Ah}"))
    return str(path)


def flown_by(yard, *vehicles: str) -> Flight:
    fleet = (
        uas.model_copy(update={"vehicle": vehicle})
        for uas, vehicle in zip(yard.uas, vehicles, strict=True)
    )
    return rollout(yard.model_copy(update={"uas": tuple(fleet)}), "nearest-waypoint", max_steps=5)


def test_a_flight_of_own_vehicles_stays_whole_where_their_files_are_gone(yard, tmp_path):
    light = own_vehicle(tmp_path / "light", "own.toml", 4.0)
    heavy = own_vehicle(tmp_path / "heavy", "own.toml", 6.0)
    flight = flown_by(yard, light, heavy)
    folder = flight.save(tmp_path / "flight").rename(tmp_path / "moved")
    assert {path.name for path in folder.glob("*.toml")} == {
        "vehicle_left.toml",
        "vehicle_right.toml",
    }
    assert str(tmp_path) not in (folder / "scenario.json").read_text()
    shutil.rmtree(tmp_path / "light")
    shutil.rmtree(tmp_path / "heavy")
    loaded = Flight.load(folder)
    assert loaded == flight
    assert [own.battery.capacity_Ah for own in loaded.scenario.vehicles] == [4.0, 6.0]
    again = rollout(loaded.scenario, "nearest-waypoint", max_steps=5)
    np.testing.assert_array_equal(again.x, flight.x)


def test_uas_that_share_an_own_vehicle_share_its_file(yard, tmp_path):
    own = own_vehicle(tmp_path / "own", "own.toml", 6.0)
    folder = flown_by(yard, own, own).save(tmp_path / "flight")
    assert {path.name for path in folder.glob("*.toml")} == {"vehicle_left.toml"}
    assert [v.battery.capacity_Ah for v in Flight.load(folder).scenario.vehicles] == [6.0, 6.0]
    folder = flown_by(yard, "s500_v2", own).save(folder, overwrite=True)
    names = [uas["vehicle"] for uas in json.loads((folder / "scenario.json").read_text())["uas"]]
    assert names == ["s500_v2", "vehicle_right.toml"]


def test_flights_whose_vehicles_differ_are_not_equal(yard, flight, tmp_path):
    other, same = (
        own_vehicle(tmp_path / name, "own.toml", capacity_Ah)
        for name, capacity_Ah in (("other", 6.0), ("same", 5.0))
    )
    fleet = {path: flown_by(yard, path, "s500_v2").scenario for path in (other, same)}
    assert dataclasses.replace(flight, scenario=fleet[same]) == flight
    assert dataclasses.replace(flight, scenario=fleet[other]) != flight


def test_a_vehicle_that_is_missing_is_named_with_its_field(yard, tmp_path):
    own = own_vehicle(tmp_path / "own", "own.toml", 6.0)
    folder = flown_by(yard, "s500_v2", own).save(tmp_path / "flight")
    (folder / "vehicle_right.toml").unlink()
    with pytest.raises(InputError) as error:
        Flight.load(folder)
    assert str(error.value).startswith(
        f"{folder / 'scenario.json'}: uas[1].vehicle: no vehicle file at "
        f"{folder / 'vehicle_right.toml'}"
    )
