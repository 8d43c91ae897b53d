"""Vehicle files: what is read, what is refused and how."""

import pickle
from pathlib import Path

import pytest
from pydantic import ValidationError

import uas_coverage_env.vehicle
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.vehicle import compile_vehicle, load_vehicle, vehicle_names
from uas_coverage_env.vehicle.params import return_threshold

SHIPPED = Path(uas_coverage_env.vehicle.__file__).with_name("s500_v2.toml")


def changed_file(folder: Path, key: str, line: str) -> Path:
    """A vehicle file whose line with the key is replaced."""
    lines = SHIPPED.read_text(encoding="utf-8").splitlines()
    matching = [k for k, old in enumerate(lines) if old.split("=")[0].strip() == key]
    assert len(matching) == 1
    lines[matching[0]] = line
    path = folder / "drone.toml"
    path.write_text("\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["s500_v2", "hexacopter"])
def test_the_shipped_vehicles_load_by_name(name):
    assert name in vehicle_names()
    assert load_vehicle(name).airframe.n_motors == {"s500_v2": 4, "hexacopter": 6}[name]


@pytest.mark.parametrize("as_type", [str, Path])
def test_a_vehicle_loads_by_path(tmp_path, as_type):
    path = changed_file(tmp_path, "mass_kg", "mass_kg = 1.6")
    vehicle = load_vehicle(as_type(path))
    assert vehicle.airframe.mass_kg == 1.6
    assert vehicle.battery == load_vehicle("s500_v2").battery


def test_an_unknown_name_lists_the_names_that_exist():
    with pytest.raises(ValueError, match=r"unknown vehicle 'kite'.*hexacopter, s500_v2"):
        load_vehicle("kite")


@pytest.mark.parametrize("missing", ["nowhere.toml", "no/such/file"])
def test_a_missing_file_is_named(missing, tmp_path):
    with pytest.raises(InputError, match="no such file") as caught:
        load_vehicle(tmp_path / missing)
    assert missing in str(caught.value)


MISTAKES = {
    "unknown key": ("mass_kg", "mass = 1.58", r"airframe\.mass: unknown key"),
    "not a number": ("mass_kg", "mass_kg = nan", r"airframe\.mass_kg.*nan"),
    "infinite": ("mass_kg", "mass_kg = inf", r"airframe\.mass_kg.*inf"),
    "negative mass": ("mass_kg", "mass_kg = -1.0", r"airframe\.mass_kg.*-1"),
    "text for a number": ("mass_kg", 'mass_kg = "1.58"', r"airframe\.mass_kg.*1\.58"),
    "truth for a number": ("mass_kg", "mass_kg = true", r"airframe\.mass_kg.*true"),
    "key is missing": ("mass_kg", "", r"airframe\.mass_kg: is missing"),
    "section is missing": ("[return_rule]", "", r"distance_over_speed_s|return_rule"),
    "half a motor": ("n_motors", "n_motors = 4.5", r"airframe\.n_motors.*4\.5"),
    "two motors": ("n_motors", "n_motors = 2", r"airframe\.n_motors.*2"),
    "two inertias": ("inertia_kgm2", "inertia_kgm2 = [0.1, 0.1]", r"airframe\.inertia_kgm2"),
    "no lower bound": ("lift_min_N", "lift_min_N = 4.65", r"limits\.lift_min_N.*4\.65"),
    "curve does not fall": (
        "ocv_V",
        "ocv_V = [16.8, 16.8, 14.6, 13.2]",
        r"battery.*must fall",
    ),
    "curve goes back": (
        "ocv_dod",
        "ocv_dod = [0.0, 0.9, 0.3, 1.0]",
        r"battery.*must increase",
    ),
    "curve is cut short": ("ocv_dod", "ocv_dod = [0.0, 0.3, 0.6, 0.9]", r"battery.*from 0 to 1"),
    "curve lacks a voltage": ("ocv_V", "ocv_V = [16.8, 15.0, 13.2]", r"battery.*same number"),
    "curve of ten points": (
        "ocv_dod",
        f"ocv_dod = {[k / 9 for k in range(10)]}",
        r"battery.*same number|at most 9",
    ),
    "no tangent for a segment": (
        "ocv_dod_linearised",
        "ocv_dod_linearised = [0.0, 0.0]",
        r"battery.*ocv_dod_linearised has 2",
    ),
    "dod_max beyond cutoff": ("dod_max", "dod_max = 0.95", r"dod_max 0\.95 exceeds"),
    "dod_max beyond 1": ("dod_max", "dod_max = 1.2", r"battery\.dod_max.*1\.2"),
    "cruise beyond maximum": ("v_cruise_mps", "v_cruise_mps = 13", r"v_cruise_mps 13.*exceeds"),
    "tilt too small for the speed": (
        "tilt_max_rad",
        "tilt_max_rad = 0.3",
        r"tilt_max_rad 0\.3.*v_xy_max_mps",
    ),
    "next to no tilt": (
        "tilt_max_rad",
        "tilt_max_rad = 1e-308",
        r"tilt_max_rad 1e-308.*v_xy_max_mps",
    ),
    "rotors too weak": ("speed_max_radps", "speed_max_radps = 600", r"speed_max_radps"),
    "lift beyond free fall": ("lift_min_N", "lift_min_N = -16", r"lift_min_N -16.*weight"),
    "tangent beyond empty": (
        "ocv_dod_linearised",
        "ocv_dod_linearised = [0.0, 0.0, 1.5]",
        r"battery.*ocv_dod_linearised.*1\.5",
    ),
    "voltage_min beyond full": ("voltage_min_V", "voltage_min_V = 17", r"voltage_min_V 17"),
    "weight taken away": ("delta_thrust_min_N", "delta_thrust_min_N = -16", r"-16.*weight"),
    "battery too weak": ("resistance_0_ohm", "resistance_0_ohm = 0.3", r"resistance_0_ohm 0\.3"),
    # beyond any multicopter: these made NaN of a flight, or a traceback of a load
    "inertia of an atom": (
        "inertia_kgm2",
        "inertia_kgm2 = [1e-300, 0.0165, 0.0275]",
        r"airframe\.inertia_kgm2\[0\].*greater than or equal to",
    ),
    "air like rock": (
        "drag_vertical_kgps",
        "drag_vertical_kgps = 1e9",
        r"airframe\.drag_vertical_kgps.*less than or equal to 1000",
    ),
    "rotors like light": ("speed_max_radps", "speed_max_radps = 1e300", r"rotor\.speed_max_radps"),
    "a battery of no memory": (
        "time_constant_th_s",
        "time_constant_th_s = 1e-300",
        r"battery\.time_constant_th_s",
    ),
    "lightning": ("ocv_V", "ocv_V = [1e300, 15.0, 14.0, 13.2]", r"battery\.ocv_V\[0\]"),
    "not TOML": ("mass_kg", "mass_kg 1.58", r"not valid TOML"),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_every_mistake_in_a_file_is_one_line_that_names_file_and_field(mistake, tmp_path):
    key, line, message = MISTAKES[mistake]
    path = changed_file(tmp_path, key, line)
    with pytest.raises(InputError, match=message) as caught:
        load_vehicle(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_linearisation_point_at_which_the_battery_cannot_hover_is_refused(tmp_path):
    path = changed_file(tmp_path, "polarisation_linearised_V", "polarisation_linearised_V = 14.0")
    with pytest.raises(ValueError, match=r"polarisation_linearised_V|ocv|hover") as caught:
        load_vehicle(path)
    assert isinstance(caught.value, InputError)


def test_parameters_cannot_be_changed():
    vehicle = load_vehicle("s500_v2")
    with pytest.raises(ValidationError, match="frozen"):
        vehicle.airframe.mass_kg = 1.0


def test_parameters_travel_to_other_processes_and_are_keys():
    vehicle = load_vehicle("s500_v2")
    assert vehicle.torque_max_Nm[0] == pytest.approx(0.0165 * 0.5)
    again = pickle.loads(pickle.dumps(vehicle))
    assert again == vehicle
    assert {vehicle: "here"}[again] == "here"
    assert again != load_vehicle("hexacopter")


def test_a_changed_copy_is_checked_like_a_file():
    vehicle = load_vehicle("s500_v2")
    with pytest.raises(ValidationError, match="mass_kg"):
        vehicle.airframe.model_copy(update={"mass_kg": -1.0})


@pytest.mark.parametrize(("name", "threshold"), [("s500_v2", 0.619), ("hexacopter", 0.6385)])
def test_the_return_threshold_leaves_the_way_home(name, threshold):
    vehicle = load_vehicle(name)
    digits = len(str(threshold)) - 2
    assert round(return_threshold(vehicle), digits) == threshold
    lower = vehicle.battery.dod_max - 0.1
    assert return_threshold(vehicle, lower) == pytest.approx(return_threshold(vehicle) - 0.1)


@pytest.mark.parametrize("dt_s", [0.0, -1.0, float("nan"), float("inf"), 0.01, 10.5])
def test_a_sampling_time_out_of_range_is_refused(dt_s):
    with pytest.raises(ValueError, match="dt_s is"):
        compile_vehicle(load_vehicle("s500_v2"), dt_s)


@pytest.mark.parametrize("dt_s", [0.25, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("name", ["s500_v2", "hexacopter"])
def test_a_compiled_vehicle_is_finite_throughout(name, dt_s):
    record = compile_vehicle(load_vehicle(name), dt_s)
    assert record.shape == ()
    assert record["dt_s"] == dt_s
    for field in record.dtype.names:
        assert (abs(record[field]) < float("inf")).all(), field
