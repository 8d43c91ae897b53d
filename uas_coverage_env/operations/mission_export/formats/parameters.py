"""Parameters of autopilots: what a file of legs relies upon, and what to do when something fails.

`PARAMETERS` is the one table: files, and a table of the docs, follow from it. Whatever a promise of
the report hangs on is set, defaults of the firmware included. Names, units and types are those of
the firmware's sources: ArduPilot renamed and rescaled some in 4.7 (ArduPilot/ardupilot, pull
requests 31970 and 32147; its wiki, "Parameter Name Changes").
"""

import math
from collections.abc import Callable, Mapping
from typing import NamedTuple

from uas_coverage_env.operations.mission_export.formats.firmware import (
    COPTER_46,
    COPTER_47,
    FLOAT,
    INT8,
    INT16,
    INT32,
    Named,
    copter,
    copter_cm,
    px4,
)
from uas_coverage_env.operations.mission_export.mission_file import MissionFile
from uas_coverage_env.operations.mission_export.return_paths import CEILING_MARGIN_M, RETURN
from uas_coverage_env.operations.mission_export.tracks import Tolerances
from uas_coverage_env.planning.execution.leg_model import LAND_BELOW_M, LAND_MPS, Autopilot
from uas_coverage_env.scenario import Scenario

ALL_FENCES = 7
"""Ceiling, circle around home and polygons: the circle is there where no polygon was loaded."""

_LAND, _RTL, _SMART_RTL_OR_LAND = 1, 2, 4
_FENCE_RTL_OR_LAND, _FENCE_SMART_RTL_OR_LAND = 1, 5
_FS_RTL, _THR_SMART_RTL_OR_LAND, _GCS_SMART_RTL_OR_LAND = 1, 5, 4
_GOES_ON = 1 + 2 + 8 + 16
"""FS_OPTIONS: an AUTO mission goes on without radio control (1) and without ground station (2),
landings go on (8), a pilot who flies needs no ground station (16)."""

_YAW_AS_TOLD, _YAW_ALONG_COURSE = 0, 3
_LEAST_RADIUS_M = 30.0
_PX4_DIRECT, _PX4_BY_MISSION = 0, 4
_PX4_WARNS_EARLIER = 0.05
_CELL_V = 3.7


class Facts(NamedTuple):
    """What values follow from: the mission, the file, and how far from a corner it may pass."""

    scenario: Scenario
    one: MissionFile
    tolerances: Tolerances

    @property
    def by(self) -> Autopilot:
        """The settings with which the file was checked."""
        return Autopilot.of(self.one.vehicle, self.tolerances.corner_m)

    @property
    def ceiling_m(self) -> float:
        """Top of the fence [m]."""
        return -float(self.scenario.fence.vertices_m[:, 2].min())

    @property
    def circle_m(self) -> float:
        """Radius of a circle around home that holds the fence [m]."""
        away = self.scenario.fence.vertices_m[:, :2] - self.one.track.home_m[:2]
        return max(math.ceil(float((away**2).sum(axis=1).max()) ** 0.5) + 1.0, _LEAST_RADIUS_M)

    @property
    def returns(self) -> bool:
        """Whether it flies straight home when something fails."""
        return self.one.home.action == RETURN

    @property
    def return_m(self) -> float:
        """Height of a return; where none is clear, that of a pilot who chooses it anyhow [m]."""
        height_m = self.one.home.height_m
        return self.ceiling_m - CEILING_MARGIN_M if height_m is None else height_m


class Parameter(NamedTuple):
    """One thing that is set.

    Attributes:
        purpose: What it is.
        value: From what the file is, in SI units; None: not set.
        names: Firmware -> its parameter.
    """

    purpose: str
    value: Callable[[Facts], float | None]
    names: Mapping[str, Named]


def _in_mAh(soc: float, facts: Facts) -> int:
    return facts.one.levels.mAh(soc, facts.one.vehicle)


def _cells(facts: Facts) -> int:
    return max(round(facts.one.vehicle.battery.voltage_nominal_V / _CELL_V), 1)


PARAMETERS: tuple[Parameter, ...] = (
    Parameter(
        "speed",
        lambda f: f.by.speed_mps,
        copter_cm("WPNAV_SPEED", "WP_SPD", unit="m/s") | px4("MPC_XY_CRUISE", unit="m/s"),
    ),
    Parameter("largest speed", lambda f: f.by.speed_mps, px4("MPC_XY_VEL_MAX", unit="m/s")),
    Parameter(
        "speed up",
        lambda f: f.by.up_mps,
        copter_cm("WPNAV_SPEED_UP", "WP_SPD_UP", unit="m/s") | px4("MPC_Z_V_AUTO_UP", unit="m/s"),
    ),
    Parameter(
        "speed down",
        lambda f: f.by.down_mps,
        copter_cm("WPNAV_SPEED_DN", "WP_SPD_DN", unit="m/s") | px4("MPC_Z_V_AUTO_DN", unit="m/s"),
    ),
    Parameter(
        "acceleration",
        lambda f: f.by.acceleration_mps2,
        copter_cm("WPNAV_ACCEL", "WP_ACC", unit="m/s/s") | px4("MPC_ACC_HOR", unit="m/s/s"),
    ),
    Parameter(
        "vertical acceleration",
        lambda f: f.by.vertical_mps2,
        copter_cm("WPNAV_ACCEL_Z", "WP_ACC_Z", unit="m/s/s"),
    ),
    Parameter(
        "jerk: what the leg model was fitted with",
        lambda _: 1.0,
        {
            COPTER_46: Named("WPNAV_JERK", FLOAT, "m/s/s/s"),
            COPTER_47: Named("WP_JERK", FLOAT, "m/s/s/s"),
        },
    ),
    Parameter(
        "how far from a corner it may pass",
        lambda f: f.tolerances.corner_m,
        copter_cm("WPNAV_RADIUS", "WP_RADIUS_M") | px4("NAV_ACC_RAD", unit="m"),
    ),
    Parameter(
        "last part of a landing: speed",
        lambda _: LAND_MPS,
        copter_cm("LAND_SPEED", "LAND_SPD_MS", INT16, "m/s") | px4("MPC_LAND_SPEED", unit="m/s"),
    ),
    Parameter(
        "last part of a landing: height",
        lambda _: LAND_BELOW_M,
        copter_cm("LAND_ALT_LOW", "LAND_ALT_LOW_M", INT16),
    ),
    Parameter(
        "before it: speed down, as everywhere",
        lambda _: 0.0,
        copter_cm("LAND_SPEED_HIGH", "LAND_SPD_HIGH_MS", INT16, "m/s"),
    ),
    Parameter(
        "heading: as the mission says (0), or along its course (3)",
        lambda f: _YAW_ALONG_COURSE if f.one.looks_ahead else _YAW_AS_TOLD,
        copter("WP_YAW_BEHAVIOR", INT8),
    ),
    Parameter(
        "heading: along its course, where the mission says none",
        lambda f: _YAW_ALONG_COURSE if f.one.looks_ahead else None,
        px4("MPC_YAW_MODE", INT32),
    ),
    Parameter("fence: on", lambda _: 1, copter("FENCE_ENABLE", INT8)),
    Parameter(
        "fence: ceiling, circle and polygons", lambda _: ALL_FENCES, copter("FENCE_TYPE", INT8)
    ),
    Parameter(
        "ceiling",
        lambda f: f.ceiling_m,
        copter("FENCE_ALT_MAX", FLOAT, "m") | px4("GF_MAX_VER_DIST", unit="m"),
    ),
    Parameter(
        "circle around home that holds the fence",
        lambda f: f.circle_m,
        copter("FENCE_RADIUS", FLOAT, "m") | px4("GF_MAX_HOR_DIST", unit="m"),
    ),
    Parameter(
        "below the ceiling, where returns are flown at the highest",
        lambda _: CEILING_MARGIN_M,
        copter("FENCE_MARGIN", FLOAT, "m"),
    ),
    Parameter(
        "outside of the fence or in a zone: RTL (1) or SmartRTL (5), else land",
        lambda f: _FENCE_RTL_OR_LAND if f.returns else _FENCE_SMART_RTL_OR_LAND,
        copter("FENCE_ACTION", INT8),
    ),
    Parameter("outside of the fence or in a zone: return", lambda _: 3, px4("GF_ACTION", INT32)),
    Parameter(
        "return: height",
        lambda f: f.return_m,
        copter_cm("RTL_ALT", "RTL_ALT_M", INT32) | px4("RTL_RETURN_ALT", unit="m"),
    ),
    Parameter(
        "return: no lower close to home",
        lambda _: 0.0,
        copter("RTL_CONE_SLOPE") | px4("RTL_CONE_ANG", INT32, "deg"),
    ),
    Parameter("return: above home", lambda _: 0, copter("RTL_ALT_TYPE", INT8)),
    Parameter(
        "return: no further climb",
        lambda _: 0.0,
        copter_cm("RTL_CLIMB_MIN", "RTL_CLIMB_MIN_M", INT16),
    ),
    Parameter(
        "return: at the speed above",
        lambda _: 0.0,
        copter_cm("RTL_SPEED", "RTL_SPEED_MS", INT16, "m/s"),
    ),
    Parameter("return: land", lambda _: 0.0, copter_cm("RTL_ALT_FINAL", "RTL_ALT_FINAL_M", INT16)),
    Parameter(
        "return: land at once",
        lambda _: 0.0,
        copter("RTL_LOIT_TIME", INT32, "ms", 1000.0) | px4("RTL_LAND_DELAY", unit="s"),
    ),
    Parameter(
        "return: height from which it lands",
        lambda f: min(LAND_BELOW_M, f.return_m),
        px4("RTL_DESCEND_ALT", unit="m"),
    ),
    Parameter(
        "return: straight (0), or along the mission (4)",
        lambda f: _PX4_DIRECT if f.returns else _PX4_BY_MISSION,
        px4("RTL_TYPE", INT32),
    ),
    Parameter(
        "return: to home; 0 where it lands elsewhere",
        lambda f: 0 if f.one.track.lands_elsewhere else 1,
        copter("RALLY_INCL_HOME", INT8),
    ),
    Parameter(
        "return: to the rally point, however far, where it lands elsewhere",
        lambda f: 0.0 if f.one.track.lands_elsewhere else None,
        copter("RALLY_LIMIT_KM", FLOAT, "km"),
    ),
    Parameter(
        "SmartRTL: how close to its way it flies back",
        lambda f: None if f.returns else 2.0,
        copter("SRTL_ACCURACY", FLOAT, "m"),
    ),
    Parameter(
        "SmartRTL: points that it remembers (restart the vehicle once)",
        lambda f: None if f.returns else 500,
        copter("SRTL_POINTS", INT16),
    ),
    Parameter(
        "battery: what is in the pack when it is put in",
        lambda f: f.one.levels.capacity_mAh,
        copter("BATT_CAPACITY", INT32, "mAh"),
    ),
    Parameter(
        "low: what the way home takes at its worst, and a reserve",
        lambda f: _in_mAh(f.one.levels.low_soc, f),
        copter("BATT_LOW_MAH", FLOAT, "mAh"),
    ),
    Parameter(
        "low: as a voltage, for a pack that holds less than it should",
        lambda f: math.ceil(100.0 * f.one.levels.low_V) / 100.0,
        copter("BATT_LOW_VOLT", FLOAT, "V"),
    ),
    Parameter(
        "low: RTL (2), or SmartRTL or land (4)",
        lambda f: _RTL if f.returns else _SMART_RTL_OR_LAND,
        copter("BATT_FS_LOW_ACT", INT8),
    ),
    Parameter(
        "critical: what a landing takes",
        lambda f: _in_mAh(f.one.levels.critical_soc, f),
        copter("BATT_CRT_MAH", FLOAT, "mAh"),
    ),
    Parameter(
        "critical: as a voltage",
        lambda f: math.ceil(100.0 * f.one.levels.critical_V - 1e-9) / 100.0,
        copter("BATT_CRT_VOLT", FLOAT, "V"),
    ),
    Parameter("critical: land", lambda _: _LAND, copter("BATT_FS_CRT_ACT", INT8)),
    Parameter("voltages count after so long", lambda _: 10, copter("BATT_LOW_TIMER", INT8, "s")),
    Parameter("voltages are those measured", lambda _: 0, copter("BATT_FS_VOLTSRC", INT8)),
    Parameter(
        "no arming with a pack less full than planned, at rest",
        lambda f: math.floor(100.0 * f.one.levels.rest_V) / 100.0,
        copter("BATT_ARM_VOLT", FLOAT, "V"),
    ),
    Parameter(
        "battery: capacity",
        lambda f: 1000.0 * f.one.vehicle.battery.capacity_Ah,
        px4("BAT1_CAPACITY", unit="mAh"),
    ),
    Parameter("battery: cells", _cells, px4("BAT1_N_CELLS", INT32)),
    Parameter(
        "battery: a cell that is full",
        lambda f: f.one.vehicle.battery.ocv_V[0] / _cells(f),
        px4("BAT1_V_CHARGED", unit="V"),
    ),
    Parameter(
        "battery: a cell that is empty, in flight",
        lambda f: f.one.vehicle.battery.voltage_min_V / _cells(f),
        px4("BAT1_V_EMPTY", unit="V"),
    ),
    Parameter(
        "warning, before it is low",
        lambda f: f.one.levels.low_soc + _PX4_WARNS_EARLIER,
        px4("BAT_LOW_THR"),
    ),
    Parameter(
        "low: what the way home takes at its worst, and a reserve",
        lambda f: f.one.levels.low_soc,
        px4("BAT_CRIT_THR"),
    ),
    Parameter(
        "critical: what a landing takes",
        lambda f: f.one.levels.critical_soc,
        px4("BAT_EMERGEN_THR"),
    ),
    Parameter("low: return; critical: land", lambda _: 3, px4("COM_LOW_BAT_ACT", INT32)),
    Parameter(
        "no radio control, in any mode but AUTO: RTL (1), or SmartRTL or land (5)",
        lambda f: _FS_RTL if f.returns else _THR_SMART_RTL_OR_LAND,
        copter("FS_THR_ENABLE", INT8),
    ),
    Parameter(
        "no ground station, likewise: RTL (1), or SmartRTL or land (4)",
        lambda f: _FS_RTL if f.returns else _GCS_SMART_RTL_OR_LAND,
        copter("FS_GCS_ENABLE", INT8),
    ),
    Parameter(
        "no ground station: after so long", lambda _: 5.0, copter("FS_GCS_TIMEOUT", FLOAT, "s")
    ),
    Parameter(
        "without either, a mission in AUTO and a landing go on",
        lambda _: _GOES_ON,
        copter("FS_OPTIONS", INT32),
    ),
    Parameter("no radio control: return", lambda _: 2, px4("NAV_RCL_ACT", INT32)),
    Parameter(
        "but a mission and a return go on without it", lambda _: 3, px4("COM_RCL_EXCEPT", INT32)
    ),
    Parameter("no ground station: fly on", lambda _: 0, px4("NAV_DLL_ACT", INT32)),
    Parameter("no way of its own round zones", lambda _: 0, copter("OA_TYPE", INT8)),
    Parameter("place not known: land", lambda _: 1, copter("FS_EKF_ACTION", INT8)),
    Parameter("place not known: from when on", lambda _: 0.8, copter("FS_EKF_THRESH")),
    Parameter("no flight by dead reckoning", lambda _: 0, copter("FS_DR_ENABLE", INT8)),
)


def parameters_of(facts: Facts, firmware: str | None) -> list[tuple[Named, float]]:
    """What is set, each in the unit of its parameter.

    Args:
        facts: The file.
        firmware: Key of `FIRMWARES`; None: for ArduPilot of any version, each knows its own.
    """
    wanted = (COPTER_46, COPTER_47) if firmware is None else (firmware,)
    found: dict[str, tuple[Named, float]] = {}
    for parameter in PARAMETERS:
        value = parameter.value(facts)
        if value is None:
            continue
        for key in wanted:
            if key in parameter.names:
                named = parameter.names[key]
                scaled = named.scale * value
                found[named.name] = named, scaled if named.kind == FLOAT else round(scaled)
    return list(found.values())


def param_text(facts: Facts, firmware: str | None) -> str:
    """`NAME,VALUE` a line: for Mission Planner and MAVProxy, and QGroundControl since 2026.

    Args:
        facts: The file.
        firmware: As for `parameters_of`.
    """
    return "".join(f"{named.name},{value:.7g}\n" for named, value in parameters_of(facts, firmware))


def params_text(facts: Facts, firmware: str | None, system_id: int) -> str:
    """QGroundControl's own form, which it reads in every version: five columns, tabs between.

    Args:
        facts: The file.
        firmware: As for `parameters_of`.
        system_id: Of the vehicle; QGroundControl refuses the file for another.
    """
    lines = [
        f"# Onboard parameters for Vehicle {system_id}\n#\n",
        "# Vehicle-Id Component-Id Name Value Type\n",
    ]
    lines += [
        f"{system_id}\t1\t{named.name}\t{value:.7g}\t{named.kind}\n"
        for named, value in parameters_of(facts, firmware)
    ]
    return "".join(lines)
