"""The Thevenin battery: discharge curve, linearised current, replay of a current."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uas_coverage_env.vehicle.parts import Battery, Parts, Power

_SERIES_HOLDS = 2.0  # steps longer than this many time constants need the exponential itself
_SOC_ROUNDING = 1e-9


class BatterySegment(NamedTuple):
    """One straight piece of the discharge curve and the current linearised on it.

    OCV = ocv_V - ocv_slope_V DoD and
    i_b = current_A + current_A_per_V (ocv_slope_V DoD + u_th - drop_V) + current_A_per_N dT.
    """

    dod_end: float
    ocv_V: float
    ocv_slope_V: float
    current_A: float
    current_A_per_V: float
    current_A_per_N: float
    drop_V: float


def battery_current_A(voltage_V: float, resistance_ohm: float, power_W: float) -> float:
    """Current at which a voltage behind a resistance delivers a power: (E - √(E² - 4RP)) / 2R [A].

    More power than it has is not delivered: then the current of its largest power flows, E / 2R.
    Also compiled, as part of the power train.
    """
    root = math.sqrt(max(voltage_V * voltage_V - 4.0 * resistance_ohm * power_W, 0.0))
    return (voltage_V - root) / (2.0 * resistance_ohm)


@lru_cache(maxsize=64)
def battery_segments(vehicle: Parts) -> tuple[BatterySegment, ...]:
    """The straight pieces of the discharge curve of a vehicle, see `segments_of`."""
    return segments_of(vehicle.battery, vehicle.power)


def segments_of(battery: Battery, power: Power) -> tuple[BatterySegment, ...]:
    """The straight pieces of the discharge curve, by depth of discharge.

    The current at constant power P, i = (E - sqrt(E² - 4 R_0 P)) / (2 R_0) with E the voltage
    behind R_0, is linearised at hover power, at the segment's own linearisation point and a fixed
    polarisation: the only choice that fits the published hover currents (docs/deviations.md).
    """
    R0 = battery.resistance_0_ohm
    segments = []
    points = list(zip(battery.ocv_dod, battery.ocv_V, strict=True))
    for (dod, volt), (dod_end, volt_end), E in zip(
        points, points[1:], battery.voltages_linearised_V, strict=False
    ):
        slope = (volt - volt_end) / (dod_end - dod)
        ocv = volt + slope * dod
        current = battery_current_A(E, R0, power.hover_W)
        stiffness = E - 2.0 * R0 * current
        segments.append(
            BatterySegment(
                dod_end=dod_end,
                ocv_V=ocv,
                ocv_slope_V=slope,
                current_A=current,
                current_A_per_V=current / stiffness,
                current_A_per_N=power.slope_W_per_N / stiffness,
                drop_V=ocv - E,
            )
        )
    return tuple(segments)


def segment_at(vehicle: Parts, dod: float) -> BatterySegment:
    """The segment that holds at a depth of discharge; the last one beyond its end."""
    segments = battery_segments(vehicle)
    return next((s for s in segments if dod < s.dod_end), segments[-1])


def open_circuit_voltage(vehicle: Parts, dod: ArrayLike) -> NDArray[np.float64]:
    """OCV(DoD), the discharge curve [V].

    Args:
        vehicle: parameters.
        dod: (...) depth of discharge; beyond 0 and 1 the curve stays flat.

    Returns:
        (...) [V].
    """
    battery = vehicle.battery
    return np.asarray(np.interp(np.asarray(dod, float), battery.ocv_dod, battery.ocv_V))


def polarisation_decay(vehicle: Parts, dt_s: float, order: int = 4) -> float:
    """What a step leaves of u_th when no current flows: the series of exp(-dt/tau_th).

    The series of a pole that is fast for the step is no contraction any more; there the
    exponential takes its place.
    """
    z = -dt_s / vehicle.battery.time_constant_th_s
    series = sum(z**k / math.factorial(k) for k in range(order + 1))
    return series if z >= -_SERIES_HOLDS and 0.0 < series < 1.0 else math.exp(z)


def simulate_battery(
    vehicle: Parts, current_A: ArrayLike, soc_0: float, dt_s: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Replay a current through the battery (Gasche et al., Sec. II, Thevenin model).

    Args:
        vehicle: parameters.
        current_A: (T,) [A] held over each step, positive when discharging.
        soc_0: state of charge at the start, in [0, 1]; the polarisation starts at 0.
        dt_s: [s] in (0, 2].

    Returns:
        soc (T,) and voltage_V (T,): sample k is the state before the current of step k acts, and
        the voltage under that current.

    Raises:
        ValueError: no vehicle, current not one-dimensional or not finite, soc_0 or dt_s out of
            range, or a battery that the current empties or overcharges.
    """
    check_vehicle(vehicle)
    given = np.asarray(current_A)
    if given.dtype.kind not in "iufb":
        raise ValueError(f"current_A has dtype {given.dtype}; give real numbers")
    current = given.astype(float)
    if current.ndim != 1:
        raise ValueError(f"current_A has shape {current.shape}; give one value per step")
    if not np.isfinite(current).all():
        sample = int(np.argmin(np.isfinite(current)))
        raise ValueError(f"current_A[{sample}] is {current[sample]}; give finite values")
    if not is_number(soc_0) or not 0.0 <= soc_0 <= 1.0:
        raise ValueError(f"soc_0 is {soc_0!r}; give a state of charge in [0, 1]")
    check_step(dt_s)
    battery = vehicle.battery
    drawn = np.concatenate([[0.0], np.cumsum(current)])[: len(current)]
    soc = soc_0 - drawn * dt_s / (3600.0 * battery.capacity_Ah)
    outside = (soc < -_SOC_ROUNDING) | (soc > 1.0 + _SOC_ROUNDING)
    if outside.any():
        sample = int(np.argmax(outside))
        raise ValueError(
            f"current_A takes the state of charge to {soc[sample]:.4g} at sample {sample}; "
            "end the series before, or correct soc_0"
        )
    decay = polarisation_decay(vehicle, dt_s)
    u_th = np.empty(len(current))
    polarisation = 0.0
    for k, amperes in enumerate(current.tolist()):
        u_th[k] = polarisation
        polarisation = decay * polarisation + (1.0 - decay) * battery.resistance_th_ohm * amperes
    ocv = open_circuit_voltage(vehicle, 1.0 - soc)
    return soc, ocv - u_th - battery.resistance_0_ohm * current


def check_step(dt_s: float) -> None:
    """Refuse a step for which the discrete model does not hold.

    Raises:
        ValueError: dt_s outside (0, 2].
    """
    if not is_number(dt_s) or not 0.0 < dt_s <= 2.0:
        raise ValueError(f"dt_s is {dt_s!r}; give a step in (0, 2] seconds")


def check_vehicle(vehicle: object) -> None:
    """Refuse what is no vehicle: its name, most often.

    Raises:
        ValueError: It has no parameters.
    """
    if not isinstance(vehicle, Parts):
        raise ValueError(f"vehicle is {vehicle!r}; give parameters, as load_vehicle(name) does")


def is_number(value: object) -> bool:
    """Whether it can be compared with others."""
    return isinstance(value, int | float | np.integer | np.floating)
