"""Parameters in the files of exports: names and units of each firmware, and who can load them."""

import json
import re

import numpy as np
import pytest

pytest.importorskip("pyproj")

from copter_model import values_of
from pymavlink import mavwp
from small_worlds import box, meadow, waypoint
from test_when_something_fails import BEYOND, HERE, SCHOOL, flown

from uas_coverage_env import rollout
from uas_coverage_env.cli import main
from uas_coverage_env.operations import ExportOptions, LocalFrame, make_export
from uas_coverage_env.operations.mission_export.formats.firmware import (
    COPTER_46,
    COPTER_47,
    FIRMWARES,
    PX4,
)
from uas_coverage_env.operations.mission_export.formats.parameters import PARAMETERS
from uas_coverage_env.vehicle.battery import open_circuit_voltage

# read in the sources of ArduCopter 4.7-dev of December 2025 and 4.8-dev of April 2026, and in
# PX4's parameter files of 2026: AP_Int8 2, AP_Int16 4, AP_Int32 6, AP_Float 9 (MAV_PARAM_TYPE)
OLD = {"WPNAV_SPEED": 9, "WPNAV_SPEED_UP": 9, "WPNAV_SPEED_DN": 9, "WPNAV_RADIUS": 9}
OLD |= {"WPNAV_ACCEL": 9, "WPNAV_ACCEL_Z": 9, "WPNAV_JERK": 9, "LAND_SPEED": 4, "LAND_ALT_LOW": 4}
OLD |= {"LAND_SPEED_HIGH": 4, "RTL_ALT": 6, "RTL_CLIMB_MIN": 4, "RTL_SPEED": 4, "RTL_ALT_FINAL": 4}
NEW = {"WP_SPD": 9, "WP_SPD_UP": 9, "WP_SPD_DN": 9, "WP_RADIUS_M": 9, "WP_ACC": 9, "WP_ACC_Z": 9}
NEW |= {"WP_JERK": 9, "LAND_SPD_MS": 9, "LAND_ALT_LOW_M": 9, "LAND_SPD_HIGH_MS": 9, "RTL_ALT_M": 9}
NEW |= {"RTL_CLIMB_MIN_M": 9, "RTL_SPEED_MS": 9, "RTL_ALT_FINAL_M": 9}
BOTH = {"WP_YAW_BEHAVIOR": 2, "FENCE_ENABLE": 2, "FENCE_TYPE": 2, "FENCE_ALT_MAX": 9}
BOTH |= {"FENCE_RADIUS": 9, "FENCE_MARGIN": 9, "FENCE_ACTION": 2, "RTL_CONE_SLOPE": 9}
BOTH |= {"RTL_ALT_TYPE": 2, "RTL_LOIT_TIME": 6, "RALLY_INCL_HOME": 2, "BATT_CAPACITY": 6}
BOTH |= {"BATT_LOW_MAH": 9, "BATT_LOW_VOLT": 9, "BATT_FS_LOW_ACT": 2, "BATT_CRT_MAH": 9}
BOTH |= {"BATT_CRT_VOLT": 9, "BATT_FS_CRT_ACT": 2, "BATT_LOW_TIMER": 2, "BATT_FS_VOLTSRC": 2}
BOTH |= {"BATT_ARM_VOLT": 9, "FS_THR_ENABLE": 2, "FS_GCS_ENABLE": 2, "FS_GCS_TIMEOUT": 9}
BOTH |= {"FS_OPTIONS": 6, "OA_TYPE": 2, "FS_EKF_ACTION": 2, "FS_EKF_THRESH": 9, "FS_DR_ENABLE": 2}
SOMETIMES = {"SRTL_ACCURACY": 9, "SRTL_POINTS": 4, "RALLY_LIMIT_KM": 9}
OF_PX4 = {
    "COM_LOW_BAT_ACT": 6,
    "RTL_TYPE": 6,
    "RTL_CONE_ANG": 6,
    "NAV_RCL_ACT": 6,
    "BAT1_N_CELLS": 6,
}
OF_PX4 |= {"COM_RCL_EXCEPT": 6, "NAV_DLL_ACT": 6, "GF_ACTION": 6, "RTL_RETURN_ALT": 9}
OF_PX4 |= {"GF_MAX_HOR_DIST": 9, "GF_MAX_VER_DIST": 9, "BAT_CRIT_THR": 9, "BAT_EMERGEN_THR": 9}

SMALL = [[9.0, 49.0], [9.0012, 49.0], [9.0012, 49.0008], [9.0, 49.0008], [9.0, 49.0]]


@pytest.fixture(scope="module")
def field():
    return flown()


def files_of(flight, kind="ardupilot", **options):
    return make_export(flight, ExportOptions(kind, **options)).files


def as_qgroundcontrol_reads(text, system_id):
    """Of every version up to 2026: five columns between tabs, of this vehicle; name -> value, type.

    After ParameterManager::readParametersFromStream, which passes over all other lines in silence.
    """
    found = {}
    for line in text.splitlines():
        columns = line.split("\t")
        if line.startswith("#") or len(columns) != 5:
            assert line.startswith("#"), f"dropped without a word: {line}"
            continue
        assert int(columns[0]) == system_id, "of another vehicle: refused"
        found[columns[2]] = float(columns[3]), int(columns[4])
    return found


@pytest.mark.parametrize(
    ("firmware", "wanted", "unwanted"),
    [(COPTER_46, OLD, NEW), (COPTER_47, NEW, OLD), (None, OLD | NEW, {})],
)
def test_a_vehicle_finds_the_names_of_its_firmware_and_no_others(field, firmware, wanted, unwanted):
    found = set(values_of(files_of(field, firmware=firmware)["uas_1.param"]))
    assert found - set(SOMETIMES) == set(wanted) | set(BOTH)
    assert not found & set(unwanted)


def test_old_and_new_names_say_the_same_each_in_its_unit(field):
    values = values_of(files_of(field)["uas_1.param"])
    pairs = {"WPNAV_SPEED": "WP_SPD", "WPNAV_RADIUS": "WP_RADIUS_M", "RTL_ALT": "RTL_ALT_M"}
    pairs |= {
        "WPNAV_ACCEL": "WP_ACC",
        "LAND_SPEED": "LAND_SPD_MS",
        "LAND_ALT_LOW": "LAND_ALT_LOW_M",
    }
    for old, new in pairs.items():
        assert values[old] == 100.0 * values[new] > 0.0
    assert values["WP_SPD"] == field.scenario.vehicles[0].limits.v_xy_max_mps
    assert values["RTL_ALT_M"] == 15.0


@pytest.mark.parametrize("firmware", [None, COPTER_46, COPTER_47, PX4])
def test_quick_ground_control_takes_every_line_of_params_with_the_type_of_the_firmware(
    field, firmware
):
    files = files_of(field, "qgc", firmware=firmware)
    found = as_qgroundcontrol_reads(files["uas_1.params"], 1)
    types = {name: kind for name, (_, kind) in found.items()}
    known = OF_PX4 if firmware == PX4 else OLD | NEW | BOTH | SOMETIMES
    assert {name: types[name] for name in types if name in known} == {
        name: known[name] for name in types if name in known
    }
    assert (firmware == PX4) == (set(OF_PX4) <= set(types))
    for value, kind in found.values():
        assert kind == 9 or value == int(value)
    if firmware == PX4:
        assert "uas_1.param" not in files
    else:
        assert values_of(files["uas_1.param"]) == {
            name: value for name, (value, _) in found.items()
        }


def test_each_vehicle_of_a_fleet_has_a_file_of_its_own_system_id():
    starts_m = ((20.0, 40.0, -1.0), (20.0, 160.0, -1.0))
    places = [waypoint((100.0, 40.0, -20.0)), waypoint((100.0, 160.0, -20.0))]
    scenario = meadow(starts_m, waypoints=places).model_copy(update={"place": HERE})
    files = files_of(rollout(scenario, "nearest-waypoint"), "qgc")
    for system_id in (1, 2):
        assert as_qgroundcontrol_reads(files[f"uas_{system_id}.params"], system_id)


def test_no_parameter_stands_twice_and_every_name_is_one_a_vehicle_can_hold():
    for firmware in FIRMWARES:
        names = [p.names[firmware].name for p in PARAMETERS if firmware in p.names]
        assert len(names) == len(set(names)) > 20
        assert all(re.fullmatch(r"[A-Z][A-Z0-9_]{2,15}", name) for name in names)


def test_the_levels_of_low_charge_are_of_this_pack_and_of_what_the_way_home_takes(field):
    made = make_export(field, ExportOptions("ardupilot"))
    values, (uas,) = values_of(made.files["uas_1.param"]), made.data["uas"]
    battery = field.scenario.vehicles[0].battery
    assert values["BATT_CAPACITY"] == 1000.0 * battery.capacity_Ah
    worst_mAh = 1000.0 * battery.capacity_Ah * max(leg["home"] for leg in uas["legs"])
    reserve_mAh = 1000.0 * battery.capacity_Ah * uas["soc_reserve"]
    assert worst_mAh + reserve_mAh <= values["BATT_LOW_MAH"] < 1.2 * worst_mAh + reserve_mAh + 50.0
    assert 0.0 < values["BATT_CRT_MAH"] < values["BATT_LOW_MAH"]  # else the vehicle does not arm
    assert battery.voltage_min_V <= values["BATT_CRT_VOLT"] < values["BATT_LOW_VOLT"]
    vehicle = field.scenario.vehicles[0]
    landed = 1.0 - uas["soc_landed"]
    assert values["BATT_LOW_VOLT"] < open_circuit_voltage(vehicle, landed) - 0.3
    assert values["BATT_LOW_VOLT"] < values["BATT_ARM_VOLT"] < battery.ocv_V[0]
    assert values["BATT_LOW_MAH"] < 1000.0 * battery.capacity_Ah * uas["soc_landed"]


@pytest.mark.parametrize("soc", [1.0, 0.6])
def test_a_pack_that_is_not_full_is_counted_as_what_is_in_it(soc):
    values = values_of(files_of(flown(soc_0=soc))["uas_1.param"])
    assert values["BATT_CAPACITY"] == pytest.approx(5000.0 * soc)
    assert values["BATT_LOW_MAH"] < values["BATT_CAPACITY"]


@pytest.mark.parametrize("obstacles", [(), (SCHOOL,)], ids=["return", "retrace"])
def test_actions_go_with_the_way_that_was_checked(obstacles):
    values = values_of(files_of(flown(obstacles))["uas_1.param"])
    retraces = bool(obstacles)
    assert values["BATT_FS_LOW_ACT"] == (4 if retraces else 2)
    assert values["FS_THR_ENABLE"] == (5 if retraces else 1)
    assert values["FS_GCS_ENABLE"] == (4 if retraces else 1)
    assert values["FENCE_ACTION"] == (5 if retraces else 1)
    assert int(values["FS_OPTIONS"]) & 0b1011 == 0b1011
    assert ("SRTL_POINTS" in values) == retraces
    text = files_of(flown(obstacles), "qgc", firmware=PX4)["uas_1.params"]
    px4 = as_qgroundcontrol_reads(text, 1)
    assert px4["RTL_TYPE"][0] == (4 if retraces else 0)
    assert px4["COM_RCL_EXCEPT"][0] == 3
    assert px4["NAV_DLL_ACT"][0] == 0


def test_the_circle_stays_and_holds_the_fence_and_the_ceiling_leaves_room_to_return():
    tower = box("tower", (90.0, 70.0, -44.0), (110.0, 130.0, 0.0), 3.0)
    flight = flown((tower,))
    values = values_of(files_of(flight)["uas_1.param"])
    assert int(values["FENCE_TYPE"]) & 0b111 == 0b111
    corners_m = flight.scenario.fence.vertices_m[:, :2]
    away_m = np.linalg.norm(corners_m - flight.scenario.uas[0].start_m[:2], axis=1).max()
    assert away_m < values["FENCE_RADIUS"] < away_m + 3.0
    assert values["RTL_ALT_M"] > 44.0
    # ArduCopter lowers a return that is nearer to the ceiling than the margin
    assert values["RTL_ALT_M"] <= values["FENCE_ALT_MAX"] - values["FENCE_MARGIN"]


def test_the_fence_file_holds_the_polygons_of_the_plan_as_mavproxy_loads_them(tmp_path):
    flight = flown((SCHOOL,))
    (tmp_path / "fence").write_text(files_of(flight)["uas_1.fence"])
    loader = mavwp.MissionItemProtocol_Fence()
    assert loader.load(str(tmp_path / "fence")) == loader.count()
    plan = json.loads(files_of(flight, "qgc")["uas_1.plan"])
    wanted = [
        (5001 if polygon["inclusion"] else 5002, len(polygon["polygon"]), *corner)
        for polygon in plan["geoFence"]["polygons"]
        for corner in polygon["polygon"]
    ]
    found = [loader.item(n) for n in range(loader.count())]
    for item, (command, corners, latitude, longitude) in zip(found, wanted, strict=True):
        assert (item.command, item.param1) == (command, corners)
        assert (item.x, item.y) == pytest.approx((latitude, longitude), abs=2e-7)
    assert {command for command, *_ in wanted} == {5001, 5002}
    _, _, latitude, longitude = wanted[-1]
    north_m, east_m = LocalFrame(HERE).to_ned(latitude, longitude, 0.0)[:2]
    assert (round(north_m), round(east_m)) in {(n, e) for n in (90, 110) for e in (70, 130)}


def test_north_is_told_once_by_an_item_that_arducopter_heeds_and_by_waypoints_to_px4():
    flight = flown(waypoints=BEYOND[:3])
    items = json.loads(files_of(flight, "qgc")["uas_1.plan"])["mission"]["items"]
    commands = [item["command"] for item in items]
    assert commands.count(115) == 1
    assert commands.index(22) < commands.index(115) < commands.index(16)
    # nothing may stand between it and its waypoint: it would wait until the vehicle has turned
    assert commands[commands.index(115) + 1] == 16
    assert items[commands.index(115)]["params"][:4] == [0.0, 0.0, 0.0, 0.0]
    assert {item["params"][3] for item in items if item["command"] == 16} == {None}
    px4 = json.loads(files_of(flight, "qgc", firmware=PX4)["uas_1.plan"])["mission"]["items"]
    assert 115 not in [item["command"] for item in px4]
    assert {item["params"][3] for item in px4 if item["command"] == 16} == {0.0}


@pytest.fixture
def small(tmp_path, monkeypatch):
    """A small area, drawn, imported and flown by the commands."""
    monkeypatch.chdir(tmp_path)
    ring = {"type": "Polygon", "coordinates": [SMALL]}
    areas = [{"type": "Feature", "properties": {}, "geometry": ring}]
    (tmp_path / "small.geojson").write_text(
        json.dumps({"type": "FeatureCollection", "features": areas})
    )
    told = ["--fleet", "s500_v2:1", "--height", "40", "--home", "48.9998,8.9997"]
    assert main(["import", "small.geojson", *told, "--out", "small.toml"]) == 0
    assert main(["run", "small.toml", "--planner", "lawnmower", "--out", "plan"]) == 0
    return tmp_path


def test_a_drawn_area_comes_out_with_names_of_4_7_and_levels_of_the_four_cell_pack(small, capsys):
    assert main(["export", "plan", "--format", "ardupilot", "--out", "e"]) == 0
    values = values_of((small / "e" / "uas_1.param").read_text())
    assert values["RTL_ALT_M"] == 15.0
    assert values["WP_RADIUS_M"] == 2.0
    assert values["BATT_CAPACITY"] == 5000.0
    assert 1000.0 < values["BATT_LOW_MAH"] < 2000.0
    assert values["BATT_LOW_VOLT"] >= 13.2
    capsys.readouterr()
    assert main(["export", "--help"]) == 0
    assert "copter-4.7" in capsys.readouterr().out
