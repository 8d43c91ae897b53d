"""A vehicle as one structured record, the form in which the compiled kernels take it."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.geometry import cylinder_faces
from uas_coverage_env.vehicle import battery, parts
from uas_coverage_env.vehicle import layout as S
from uas_coverage_env.vehicle.governor import (
    N_ROW_COLUMNS,
    ORDER,
    design_velocity_loop,
    horizontal_axis,
)
from uas_coverage_env.vehicle.limits import N_LIMITS, limit_bounds
from uas_coverage_env.vehicle.linear import rigid_body, taylor
from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.true_vehicle import N_PERTURBATIONS

MAX_GOVERNOR_ROWS = 128
GOVERNOR_BLOCK = 8
"""So many governor rows are looked at together."""

MAX_MOTORS = 32
OF_THRUST, OF_ROLL, OF_PITCH, OF_YAW = range(4)
"""Columns of the mixer: of the thrust, and of the torques about the three axes."""

N_MIXED = OF_YAW + 1
PHYSICAL_SIDES = 8
"""H_P, the sides of the polygons that stand for norms in the thrust correction."""

COUNTS = {
    "n_segments": (0, parts.MAX_SEGMENTS),
    "n_governor_rows": (0, MAX_GOVERNOR_ROWS),
    "n_motors": (0, MAX_MOTORS),
    "n_further": (0, parts.MAX_FURTHER_PAIRS),
}
"""How many rows of a record are in use, and how few and many these may be."""

_DT_MIN_S = 0.02  # so that MAX_GOVERNOR_ROWS suffice

_f8, _i8 = "f8", "i8"
_PARTS = (parts.Airframe, parts.Rotor, parts.Motor, parts.Esc, parts.ThrustCorrection, parts.Limits)
VEHICLE_DTYPE = record_dtype(
    [
        ("dt_s", _f8),
        # one-step map of the axes; a horizontal axis is position, velocity, tilt, rate
        # with the angular acceleration as input, tilt positive forward
        ("axis_A", _f8, (4, 4)),
        ("axis_B", _f8, (4,)),
        ("vertical_A", _f8, (2, 2)),
        ("vertical_B", _f8, (2,)),
        # position and velocity under a horizontal force
        ("horizontal_force_B", _f8, (2,)),
        ("yaw_B", _f8, (2,)),
        ("inertia_kgm2", _f8, (3,)),
        *(field for part in _PARTS for field in part.record_fields()),
        ("auxiliary_W", _f8),
        # what lift is counted from: the nominal weight, see `true_vehicle`
        ("weight_N", _f8),
        # thrust and power over those of the nominal vehicle at the same speed of the motors, and
        # lift beyond the own weight where none is asked for; by how much each parameter is another
        ("thrust_factor", _f8),
        ("power_factor", _f8),
        ("lift_surplus_N", _f8),
        ("perturbation", _f8, (N_PERTURBATIONS,)),
        *battery.RECORD_FIELDS,
        # thrust correction
        ("faces", _f8, (PHYSICAL_SIDES, 2)),
        ("trim_rad_per_mps", _f8),
        ("fitted_trim_rad_per_mps", _f8),
        # the LPV model takes the power of level flight from the rotor model, where that needs more
        # than the fit does
        ("rotor_power", "?"),
        ("torque_max_Nm", _f8, (3,)),
        # a UAS that looks where it flies, see `layout`; the arena says which do
        ("follows_course", "?"),
        # one whose height is fixed, in a planar mission; likewise
        ("holds_height", "?"),
        # what a sample must not exceed, see `limits`
        ("bounds", _f8, (N_LIMITS,)),
        # velocity loop
        ("reference_max_mps", _f8),
        ("gain", _f8, (3,)),
        ("n_governor_rows", _i8),
        # row by row side by side, so that a processor takes several at a time; zero beyond
        ("governor_rows", _f8, (N_ROW_COLUMNS, MAX_GOVERNOR_ROWS)),
        # motor thrusts from (thrust, torques), and torques from each motor's thrust
        ("mixer", _f8, (MAX_MOTORS, N_MIXED)),
        ("rotor_map", _f8, (MAX_MOTORS, 3)),
    ]
)
"""A vehicle at one sampling time."""


def compile_vehicle(vehicle: VehicleParams, dt_s: float) -> NDArray[np.void]:
    """The record of a vehicle for the kernels.

    Args:
        vehicle: parameters.
        dt_s: [s] sampling time in [0.02, 10].

    Returns:
        Array of shape () and type VEHICLE_DTYPE; kernels take its element, `record[()]`.

    Raises:
        ValueError: dt_s out of range, or limits that no inner loop can keep.
    """
    battery.check_step(dt_s)
    if dt_s < _DT_MIN_S:
        raise ValueError(f"dt_s is {dt_s}; the vehicle's inner loop needs {_DT_MIN_S} s at least")
    record = np.zeros(1, VEHICLE_DTYPE)
    A, B = taylor(*rigid_body(vehicle), dt_s, ORDER)
    record["dt_s"] = dt_s
    record["axis_A"], record["axis_B"] = horizontal_axis(vehicle, dt_s)
    record["vertical_A"] = A[np.ix_([S.Z, S.VZ], [S.Z, S.VZ])]
    record["vertical_B"] = B[[S.Z, S.VZ], S.LIFT]
    record["horizontal_force_B"] = horizontal_force(vehicle, dt_s)
    record["yaw_B"] = 0.5 * dt_s * dt_s, dt_s
    scalars = vehicle.kernel_scalars() | vehicle.thrust_correction.in_record()
    for name, value in (scalars | vehicle.limits.in_record()).items():
        record[name] = value
    record["inertia_kgm2"] = vehicle.airframe.inertia_kgm2
    battery.write_battery(record, vehicle, dt_s)
    record["faces"] = cylinder_faces(PHYSICAL_SIDES)[:, :2]
    record["trim_rad_per_mps"] = vehicle.trim_tilt_rad_per_mps
    record["fitted_trim_rad_per_mps"] = vehicle.trim_tilt_rad_per_mps
    record["thrust_factor"] = record["power_factor"] = 1.0
    record["torque_max_Nm"] = vehicle.torque_max_Nm
    record["bounds"] = limit_bounds(vehicle)
    gain, rows, record["reference_max_mps"] = design_velocity_loop(vehicle, float(dt_s))
    if len(rows) > MAX_GOVERNOR_ROWS:
        raise ValueError(f"dt_s is {dt_s}; too short for the limits of {vehicle.name!r}")
    record["gain"] = gain
    record["n_governor_rows"] = len(rows)
    record["governor_rows"][0, :, : len(rows)] = rows.T
    torques = _rotor_map(vehicle)
    record["rotor_map"][0, : len(torques)] = torques
    record["mixer"][0, : len(torques)] = _mixer(torques)
    return record.reshape(())


def horizontal_force(vehicle: VehicleParams, dt_s: float) -> NDArray[np.float64]:
    """(2,) what a horizontal force of 1 N, held over a step, adds to position and velocity."""
    A, B = rigid_body(vehicle)
    B = np.zeros_like(B[:, :1])
    B[S.VX] = 1.0 / vehicle.airframe.mass_kg
    return taylor(A, B, dt_s, ORDER)[1][[S.X, S.VX], 0]


def _rotor_map(vehicle: VehicleParams) -> NDArray[np.float64]:
    """(N_M, 3) torques per thrust of each rotor about forward, right and down [m].

    Rotors equally spaced around the centre, neighbours turning against each other.
    """
    body, rotor = vehicle.airframe, vehicle.rotor
    number = np.arange(body.n_motors)
    angle = body.first_arm_angle_rad + 2.0 * np.pi * number / body.n_motors
    reaction_m = rotor.torque_Nm_per_radps2 / rotor.thrust_N_per_radps2
    spin = np.where(number % 2 == 0, 1.0, -1.0) * (body.n_motors > 3)
    return np.column_stack(
        [-body.arm_m * np.sin(angle), body.arm_m * np.cos(angle), reaction_m * spin]
    )


def _mixer(rotor_map: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N_M, 4) pseudo-inverse of the map from motor thrusts to thrust and torques."""
    whole = np.column_stack([np.ones(len(rotor_map)), rotor_map])
    return np.asarray(np.linalg.pinv(whole.T), np.float64)
