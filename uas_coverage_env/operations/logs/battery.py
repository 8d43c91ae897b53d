"""Charge, voltage and current of a flight that was flown: what was measured, and what was not."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.flight.of_log import Estimate
from uas_coverage_env.operations.logs.logged import Logged
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.battery import steady_voltage_V
from uas_coverage_env.vehicle.range import dod_per_s

FloatArray = NDArray[np.float64]

_S_PER_H = 3_600.0
_CONTRADICTION = 0.15
_LEAST_AH = 0.02


@dataclass(frozen=True, eq=False)
class BatteryRecord:
    """What the battery of a UAS did, at T samples.

    Attributes:
        dod: (T,) depth of discharge [-].
        voltage_V: (T,).
        current_A: (T,) from a sample to the next.
        measured_V: Whether the voltage was measured.
        estimates: What was not.
        notes: What is to be said.
    """

    dod: FloatArray
    voltage_V: FloatArray
    current_A: FloatArray
    measured_V: bool
    estimates: tuple[Estimate, ...] = ()
    notes: tuple[str, ...] = ()


def battery_of(
    scenario: Scenario, i: int, log: Logged, times_s: FloatArray, in_air: NDArray[np.bool_]
) -> BatteryRecord:
    """What the battery of UAS i did.

    Args:
        scenario: The mission.
        i: Which UAS.
        log: Its samples.
        times_s: (T,) on the clock of the log [s].
        in_air: (T,) whether it flies then.
    """
    uas, vehicle = scenario.uas[i], scenario.vehicles[i]
    estimates, notes = [], []
    dod = _measured_dod(1.0 - uas.soc_0, vehicle.battery.capacity_Ah, log, times_s)
    if dod is None:
        per_s = dod_per_s(vehicle, 1.0 - uas.soc_0)
        used = per_s * scenario.dt_s * np.append(0.0, np.cumsum(in_air[:-1]))
        # an estimate takes no UAS away
        dod = np.minimum(1.0 - uas.soc_0 + used, max(uas.dod_max, 1.0 - uas.soc_0))
        how = "as of level flight at full speed: its log has none"
        estimates.append(Estimate(uas.name, "charge", how))
    if log.current_A is not None:
        current_A = np.interp(times_s, log.time_s, log.current_A)
        notes += _contradictions(log)
    else:
        capacity_As = _S_PER_H * vehicle.battery.capacity_Ah
        current_A = np.append(np.diff(dod), 0.0) * capacity_As / scenario.dt_s
        estimates.append(Estimate(uas.name, "current", "from the charge"))
    if log.voltage_V is not None:
        voltage_V = np.interp(times_s, log.time_s, log.voltage_V)
    else:
        voltage_V = _model_V(vehicle, dod, current_A)
        estimates.append(Estimate(uas.name, "voltage", "by the model of its battery"))
    return BatteryRecord(
        dod, voltage_V, current_A, log.voltage_V is not None, tuple(estimates), tuple(notes)
    )


def unused(scenario: Scenario, i: int, samples: int) -> BatteryRecord:
    """That of a UAS that stays at its start."""
    none = np.zeros(samples)
    return BatteryRecord(
        np.full(samples, 1.0 - scenario.uas[i].soc_0), none, none, measured_V=False
    )


def _measured_dod(
    full: float, capacity_Ah: float, log: Logged, times_s: FloatArray
) -> FloatArray | None:
    """(T,) by the ampere-hours, or the share that is left; None: neither was logged."""
    if log.used_Ah is not None:
        used_Ah = np.interp(times_s, log.time_s, log.used_Ah)
        if log.soc is not None:  # counted from what was left then
            full, used_Ah = 1.0 - float(log.soc[0]), used_Ah - log.used_Ah[0]
        return np.minimum(full + used_Ah / capacity_Ah, 1.0)
    if log.soc is None:
        return None
    # a share in whole percent does not fall in steps
    new = np.append(True, np.diff(log.soc) != 0.0)
    new[-1] = True
    return 1.0 - np.interp(times_s, log.time_s[new], log.soc[new])


def _contradictions(log: Logged) -> list[str]:
    """Whether the logged current is not that of the logged charge."""
    if log.used_Ah is None or log.current_A is None or log.soc is not None:
        return []
    mean_A = 0.5 * (log.current_A[1:] + log.current_A[:-1])
    by_current_Ah = float((mean_A * np.diff(log.time_s)).sum()) / _S_PER_H
    counted_Ah = float(log.used_Ah[-1] - log.used_Ah[0])
    if abs(by_current_Ah - counted_Ah) <= max(_CONTRADICTION * counted_Ah, _LEAST_AH):
        return []
    return [
        f"its current makes {by_current_Ah:.2f} A h, its counter says {counted_Ah:.2f}: the energy "
        f"is by the one, the charge by the other"
    ]


def _model_V(vehicle: VehicleParams, dod: FloatArray, current_A: FloatArray) -> FloatArray:
    return steady_voltage_V(vehicle.battery, dod, current_A)
