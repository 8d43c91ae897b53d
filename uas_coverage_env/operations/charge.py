"""What flying a file takes of the battery, in still air and against a wind."""

from dataclasses import dataclass
from typing import NamedTuple

from uas_coverage_env.disturbances.wind import mean_wind_mps
from uas_coverage_env.flight import Flight
from uas_coverage_env.mission import MissionBrief, Range
from uas_coverage_env.mission.leg_model import Followed
from uas_coverage_env.operations.tracks import Track
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import DOD
from uas_coverage_env.vehicle.range import dod_per_s

_IDLE_SHARE = 0.1
"""Of what level flight takes, what motors take that idle while a UAS waits to take off."""

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
        home: What flying home from there and landing takes, with margin (`mission.Range`) [-].
        spare: What is left beyond that and the reserve that `dod_max` leaves [-].
        spare_s: How long it can fly on before it has to turn home [s].
    """

    time_s: float
    planned_s: float
    soc: float
    planned_soc: float
    home: float
    spare: float
    spare_s: float


class Charged(NamedTuple):
    """What a file takes of the battery.

    Attributes:
        legs: One entry per leg.
        soc_landed: State of charge after landing [-].
        headwind_mps: That was counted with [m/s].
    """

    legs: tuple[LegCharge, ...]
    soc_landed: float
    headwind_mps: float

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


def charged(
    flight: Flight,
    track: Track,
    followed: Followed,
    speeds_mps: tuple[float, ...],
    idle_s: float,
    soc_0: float,
    headwind_mps: float = 0.0,
) -> Charged:
    """Charge after each leg, of level flight at full speed all the time: a careful estimate.

    A wind is counted as a headwind on every leg and all the way home: over the ground, no UAS is
    faster than its top speed less the wind.

    Args:
        flight: What was flown.
        track: A sortie of it.
        followed: How an autopilot flies it.
        speeds_mps: (legs,) as the file sets them [m/s].
        idle_s: How long it waits on the ground, its motors idling [s].
        soc_0: State of charge at the start [-].
        headwind_mps: The wind [m/s].
    """
    scenario, i = flight.scenario, track.uas
    uas, vehicle = scenario.uas[i], scenario.vehicles[i]
    top_mps = vehicle.limits.v_xy_max_mps
    over_ground_mps = max(top_mps - headwind_mps, _LEAST_HEADWAY_MPS)
    ways_home = Range(MissionBrief.of(scenario))
    ends = followed.corner_s
    began_s = ends[0] - (1.0 - _IDLE_SHARE) * idle_s
    dod, legs, later_s = 1.0 - soc_0, [], 0.0
    dod += dod_per_s(vehicle, min(dod, 1.0)) * began_s
    for leg, speed_mps, start_s, end_s in zip(track.legs, speeds_mps, ends, ends[1:], strict=False):
        # a hold at the end of a leg is counted with the next one
        takes_s = (end_s - start_s) * max(1.0, speed_mps / over_ground_mps)
        later_s += takes_s - (end_s - start_s)
        dod += dod_per_s(vehicle, min(dod, 1.0)) * takes_s
        x = flight.x[leg.sample, i].copy()
        x[:] = 0.0
        x[:3], x[DOD] = leg.end_m, min(dod, 1.0)
        home = ways_home.home(i, x)
        needed = (home.dod + home.dod_margin) * (top_mps / over_ground_mps)
        spare = uas.dod_max - dod - needed
        legs.append(
            LegCharge(
                time_s=float(end_s) + later_s,
                planned_s=(leg.sample - track.sortie.first) * scenario.dt_s,
                soc=1.0 - dod,
                planned_soc=float(flight.soc[leg.sample, i]),
                home=needed,
                spare=spare,
                spare_s=spare / dod_per_s(vehicle, min(dod, 1.0)),
            )
        )
    landing_s = followed.duration_s - float(ends[-1])
    soc_landed = 1.0 - dod - dod_per_s(vehicle, min(dod, 1.0)) * landing_s
    return Charged(tuple(legs), soc_landed, headwind_mps)
