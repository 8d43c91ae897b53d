"""What flying a file takes of the battery, and at what charge its UAS has to come home."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from uas_coverage_env.features.steady_wind import mean_wind_mps
from uas_coverage_env.flight import Flight
from uas_coverage_env.operations.mission_export.return_paths import ReturnPath
from uas_coverage_env.operations.mission_export.tracks import Track
from uas_coverage_env.planning.execution.leg_model import Followed
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.battery import (
    open_circuit_voltage,
    steady_current_A,
    steady_voltage_V,
)
from uas_coverage_env.vehicle.range import dod_per_s, level_power_W

_LEAST_HEADWAY_MPS = 0.1
"""Over the ground: a UAS that cannot fly against a wind comes home in it by no battery."""


@dataclass(frozen=True)
class LegCharge:
    """What the battery holds at the end of a leg, as an autopilot flies it.

    Attributes:
        time_s: Since the command to start [s].
        planned_s: The same in the sortie that was planned [s].
        soc: State of charge [-].
        planned_soc: The same in the planned flight [-].
        home: What coming home from there takes by the way that is flown when the charge is low,
            with margin (`ReturnPath`) [-].
        spare: What is left beyond that and the reserve [-].
        spare_s: How long it can fly on before it has to turn home [s].
    """

    time_s: float
    planned_s: float
    soc: float
    planned_soc: float
    home: float
    spare: float
    spare_s: float


class BatteryUse(NamedTuple):
    """What a file takes of the battery.

    Attributes:
        legs: One entry per leg.
        soc_landed: State of charge after landing [-].
        headwind_mps: That was counted with [m/s].
        most_home: The most that the way home takes, from wherever it begins [-].
    """

    legs: tuple[LegCharge, ...]
    soc_landed: float
    headwind_mps: float
    most_home: float

    @property
    def point_of_no_return(self) -> int | None:
        """The first leg after which the charge does not suffice to come home for sure."""
        return next((n for n, leg in enumerate(self.legs) if leg.spare < 0.0), None)

    @property
    def tightest(self) -> int:
        """The leg after which least is left."""
        return min(range(len(self.legs)), key=lambda n: self.legs[n].spare)


def worst_wind_mps(scenario: Scenario, track: Track) -> float:
    """The mean wind at the greatest height of a file and the largest gust at once [m/s]."""
    wind = scenario.wind
    if wind is None:
        return 0.0
    peaks = [gust.peak_mps for gust in wind.gusts]
    if wind.random_gusts is not None:
        peaks.append(wind.random_gusts.peak_mps)
    return mean_wind_mps(wind, -float(track.corners_m[:, 2].min())) + max(peaks, default=0.0)


def battery_use(
    flight: Flight,
    track: Track,
    followed: Followed,
    speeds_mps: tuple[float, ...],
    home: ReturnPath,
    soc_0: float,
    headwind_mps: float = 0.0,
) -> BatteryUse:
    """Charge after each leg, of level flight at full speed all the time: a careful estimate.

    A wind comes from ahead on every leg and all the way home: over the ground, no UAS is
    faster than its top speed less the wind.

    Args:
        flight: What was flown.
        track: A sortie of it.
        followed: How an autopilot flies it.
        speeds_mps: (legs,) as the file sets them [m/s].
        home: Its way home.
        soc_0: State of charge at the start [-].
        headwind_mps: The wind [m/s].
    """
    scenario, i = flight.scenario, track.uas
    dod_landed, vehicle = scenario.dod_landed[i], scenario.vehicles[i]
    top_mps = vehicle.limits.v_xy_max_mps
    over_ground_mps = max(top_mps - headwind_mps, _LEAST_HEADWAY_MPS)
    against = top_mps / over_ground_mps
    ends = followed.corner_s
    dod, legs, later_s = 1.0 - soc_0, [], 0.0
    dod += dod_per_s(vehicle, min(dod, 1.0)) * ends[0]
    for leg, speed_mps, start_s, end_s in zip(track.legs, speeds_mps, ends, ends[1:], strict=False):
        # a hold at the end of a leg is counted with the next one
        takes_s = (end_s - start_s) * max(1.0, speed_mps / over_ground_mps)
        later_s += takes_s - (end_s - start_s)
        dod += dod_per_s(vehicle, min(dod, 1.0)) * takes_s
        per_s = dod_per_s(vehicle, min(dod, 1.0))
        needed = per_s * home.needs_at(float(end_s)) * against
        spare = dod_landed - dod - needed
        legs.append(
            LegCharge(
                time_s=float(end_s) + later_s,
                planned_s=(leg.sample - track.sortie.first) * scenario.dt_s,
                soc=1.0 - dod,
                planned_soc=float(flight.soc[leg.sample, i]),
                home=needed,
                spare=spare,
                spare_s=spare / per_s,
            )
        )
    landing_s = followed.duration_s - float(ends[-1])
    soc_landed = 1.0 - dod - dod_per_s(vehicle, min(dod, 1.0)) * landing_s
    most_home = dod_per_s(vehicle, dod_landed) * float(home.needs_s.max()) * against
    return BatteryUse(tuple(legs), soc_landed, headwind_mps, most_home)


class FailsafeLevels(NamedTuple):
    """At what charge a vehicle acts on its own.

    Attributes:
        low_soc: It comes home [-].
        low_V: The same as a voltage in level flight [V]; reached earlier by a pack that holds less
            than it should.
        critical_soc: It lands where it is [-].
        critical_V: Likewise: the least voltage of the vehicle file, late, since it lands anywhere
            then [V].
        capacity_mAh: Of the pack from how full it was put in until it is empty [mAh].
        rest_V: At which it is no longer as full as it is said to be at the start, at rest [V].
        suffices: Whether that brings it home from everywhere without ending a flight that goes
            as planned.
    """

    low_soc: float
    low_V: float
    critical_soc: float
    critical_V: float
    capacity_mAh: int
    rest_V: float
    suffices: bool

    def mAh(self, soc: float, vehicle: VehicleParams) -> int:
        """A charge as an autopilot counts it, rounded up [mAh]."""
        return math.ceil(1000.0 * vehicle.battery.capacity_Ah * soc)


_UNEVEN = 0.02
"""How far below its lowest charge before the landing a flight as planned may come unnoticed [-]."""

_WORN = np.linspace(0.3, 1.0, 15)
"""Shares of its capacity that a pack may have left: a monitor that counts ampere-hours does not
know, but the voltage falls."""

_EARLIER = 1.0 / 3.0
"""Of what a flight as planned has left above the low level, what the voltage comes before it at
least."""

_NOTICED = 0.05
"""How far above that of a worn pack the state of charge of a sound one is kept [-]."""

_NOT_FULL = 0.2
_STEP_V = 0.1


def levels(
    vehicle: VehicleParams,
    charge: BatteryUse,
    landing_s: float,
    *,
    dod_max: float,
    soc_start: float,
    soc_fresh: float,
) -> FailsafeLevels:
    """At what charge a UAS has to come home, and at what it has to land.

    Low is what the way home takes at the worst point of the flight, and the reserve. Where a flight
    as planned has less left before its landing, less of the reserve; never less than what is
    critical: the battery's own limit, or what landing takes.

    Args:
        vehicle: Its vehicle.
        charge: What the file takes.
        landing_s: How long landing takes from its greatest height, with margin [s].
        dod_max: Depth of discharge to be kept [-].
        soc_start: State of charge at the start [-].
        soc_fresh: The same when the pack was put in [-].
    """
    battery = vehicle.battery
    critical = max(1.0 - battery.dod_cutoff, dod_per_s(vehicle, battery.dod_cutoff) * landing_s)
    least = charge.most_home + critical
    most = max(charge.most_home + 1.0 - dod_max, least)
    last = charge.legs[-1].soc
    low = min(max(last - _UNEVEN, least), most)
    critical_V = battery.voltage_min_V
    low_V = _loaded_V(vehicle, _worn_soc(charge, soc_start, low))
    return FailsafeLevels(
        low_soc=low,
        low_V=max(low_V, critical_V + _STEP_V),
        critical_soc=critical,
        critical_V=critical_V,
        capacity_mAh=round(1000.0 * battery.capacity_Ah * soc_fresh),
        rest_V=_rest_V(vehicle, soc_start - _NOT_FULL),
        suffices=bool(low <= last),
    )


def _worn_soc(charge: BatteryUse, soc_start: float, low: float) -> float:
    """The lowest state of charge, of its own, at which a worn pack still brings its UAS home [-].

    Not so high that a sound one gets there.
    """
    legs = charge.legs
    used = np.array([0.0, *(soc_start - leg.soc for leg in legs)])
    home = np.array([legs[0].home, *(leg.home for leg in legs)])
    most = legs[-1].soc - _NOTICED
    least = low + _EARLIER * max(legs[-1].soc - low, 0.0)
    for soc in np.arange(least, most, 0.01).tolist():
        drawn = (soc_start - soc) * _WORN
        on_its_way = drawn <= used[-1]
        if (soc * _WORN >= np.interp(drawn, used, home))[on_its_way].all():
            return soc
    return max(most, low)


def _rest_V(vehicle: VehicleParams, soc: float) -> float:
    return float(open_circuit_voltage(vehicle, 1.0 - soc))


def _loaded_V(vehicle: VehicleParams, soc: float) -> float:
    """Voltage in level flight at full speed [V]."""
    battery, dod = vehicle.battery, 1.0 - soc
    current_A = steady_current_A(battery, dod, level_power_W(vehicle))
    return float(steady_voltage_V(battery, dod, current_A))
