"""The Thevenin battery, and all that knows its inside; its kernels are in `discharge`.

u_b = OCV(DoD) - sum of u_p - R_0 i behind any number of RC pairs, tau_p u_p' = R_p i - u_p. The
first pair is the paper's, its voltage the state U_TH. Those of further pairs (`[[battery.rc]]`) are
memory beside the state: `further_V` of the record that flies. What predicts with the nominal record
or a linear model takes them as settled in a hover.
"""

import math
from functools import lru_cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from uas_coverage_env.vehicle.parts import MAX_FURTHER_PAIRS, MAX_SEGMENTS, Battery, Parts, Power

_SERIES_HOLDS = 2.0  # steps longer than this many time constants need the exponential itself
_SOC_ROUNDING = 1e-9
_DOD_POINTS = 201

_f8, _i8 = "f8", "i8"
RECORD_FIELDS = [
    # a row per segment of the discharge curve
    ("n_segments", _i8),
    ("dod_end", _f8, (MAX_SEGMENTS,)),
    ("ocv_V", _f8, (MAX_SEGMENTS,)),
    ("ocv_slope_V", _f8, (MAX_SEGMENTS,)),
    ("current_A", _f8, (MAX_SEGMENTS,)),
    ("current_A_per_V", _f8, (MAX_SEGMENTS,)),
    ("current_A_per_N", _f8, (MAX_SEGMENTS,)),
    ("drop_V", _f8, (MAX_SEGMENTS,)),
    ("capacity_As", _f8),
    ("resistance_0_ohm", _f8),
    ("resistance_th_ohm", _f8),
    ("time_constant_th_s", _f8),
    ("polarisation_decay", _f8),
    ("hover_W", _f8),
    # further RC pairs, and their voltages now
    ("n_further", _i8),
    ("further_resistance_ohm", _f8, (MAX_FURTHER_PAIRS,)),
    ("further_time_constant_s", _f8, (MAX_FURTHER_PAIRS,)),
    ("further_V", _f8, (MAX_FURTHER_PAIRS,)),
]
"""What the record of a vehicle holds of its battery."""


class BatterySegment(NamedTuple):
    """One straight piece of the discharge curve and the current linearised on it.

    OCV = ocv_V - ocv_slope_V DoD and, u the voltage of all RC pairs,
    i_b = current_A + current_A_per_V (ocv_slope_V DoD + u - drop_V) + current_A_per_N dT.
    """

    dod_end: float
    ocv_V: float
    ocv_slope_V: float
    current_A: float
    current_A_per_V: float
    current_A_per_N: float
    drop_V: float


class BatteryState(NamedTuple):
    """A battery at a moment.

    Attributes:
        dod: Depth of discharge.
        pairs_V: Voltages of its RC pairs, the paper's first [V].
    """

    dod: float
    pairs_V: tuple[float, ...]

    @classmethod
    def rested(cls, battery: Battery, dod: float) -> "BatteryState":
        """One from which nothing has been drawn for long."""
        return cls(dod, (0.0,) * len(battery.pairs))

    def after(self, battery: Battery, current_A: float, step_s: float) -> "BatteryState":
        """The battery after a current, held over a step."""
        left = [math.exp(-step_s / pair.time_constant_s) for pair in battery.pairs]
        return BatteryState(
            self.dod + current_A * step_s / (3600.0 * battery.capacity_Ah),
            tuple(
                kept * volt + (1.0 - kept) * pair.resistance_ohm * current_A
                for kept, volt, pair in zip(left, self.pairs_V, battery.pairs, strict=True)
            ),
        )


def battery_current_A(voltage_V: float, resistance_ohm: float, power_W: float) -> float:
    """Current at which a voltage behind a resistance delivers a power: (E - √(E² - 4RP)) / 2R [A].

    More power than it has is not delivered: then the current of its largest power flows, E / 2R.
    Also compiled, see `discharge`.
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


def write_battery(record: Any, vehicle: Parts, dt_s: float) -> None:
    """Write `RECORD_FIELDS` of the record of a vehicle, the further pairs settled in a hover."""
    battery, segments = vehicle.battery, battery_segments(vehicle)
    record["n_segments"] = len(segments)
    for row, segment in enumerate(segments):
        for name, value in segment._asdict().items():
            record[name][0, row] = value
    record["capacity_As"] = 3600.0 * battery.capacity_Ah
    for name in ("resistance_0_ohm", "resistance_th_ohm", "time_constant_th_s"):
        record[name] = getattr(battery, name)
    record["polarisation_decay"] = polarisation_decay(vehicle, dt_s)
    record["hover_W"] = vehicle.power.hover_W
    record["n_further"] = len(battery.rc)
    for p, (pair, volt) in enumerate(zip(battery.rc, further_settled_V(vehicle), strict=True)):
        record["further_resistance_ohm"][0, p] = pair.resistance_ohm
        record["further_time_constant_s"][0, p] = pair.time_constant_s
        record["further_V"][0, p] = volt


def further_settled_V(vehicle: Parts) -> tuple[float, ...]:
    """Voltages of the further pairs in a hover that has lasted for a while [V]."""
    hover_A = vehicle.power.hover_W / vehicle.battery.voltage_nominal_V
    return tuple(hover_A * pair.resistance_ohm for pair in vehicle.battery.rc)


def open_circuit_voltage(vehicle: Parts, dod: ArrayLike) -> NDArray[np.float64]:
    """OCV(DoD), the discharge curve [V].

    Args:
        vehicle: parameters.
        dod: (...) depth of discharge; beyond 0 and 1 the curve stays flat.

    Returns:
        (...) [V].
    """
    return _open_circuit_V(vehicle.battery, dod)


def _open_circuit_V(battery: Battery, dod: ArrayLike) -> NDArray[np.float64]:
    return np.asarray(np.interp(np.asarray(dod, float), battery.ocv_dod, battery.ocv_V))


def steady_current_A(battery: Battery, dod: float, power_W: float) -> float:
    """Current of a power that has been drawn for a while, all RC pairs settled [A]."""
    open_V = float(_open_circuit_V(battery, dod))
    return battery_current_A(open_V, battery.resistance_ohm, power_W)


def steady_voltage_V(battery: Battery, dod: ArrayLike, current_A: ArrayLike) -> NDArray[np.float64]:
    """Voltage under a current that has flowed for a while [V], of the shape of both."""
    return _open_circuit_V(battery, dod) - battery.resistance_ohm * np.asarray(current_A)


@lru_cache(maxsize=64)  # a vehicle is looked at again in every record that holds it
def mean_voltage_V(battery: Battery, power_W: float, dod_end: float = 1.0) -> float:
    """Mean voltage, by charge, while a power is drawn from a full battery until dod_end [V]."""
    dod = np.linspace(0.0, dod_end, _DOD_POINTS)
    current = np.array([steady_current_A(battery, depth, power_W) for depth in dod.tolist()])
    return float(np.trapezoid(steady_voltage_V(battery, dod, current), dod)) / dod_end


def around_hover(battery: Battery, hover_W: float) -> dict[str, Any]:
    """Nominal voltage of a battery, and where the current is linearised for hover.

    In the middle of each segment of the discharge curve, with the polarisation of a hover.
    """
    voltage_V = mean_voltage_V(battery, hover_W)
    polarisation_ohm = sum(pair.resistance_ohm for pair in battery.pairs)
    return {
        "voltage_nominal_V": voltage_V,
        "polarisation_linearised_V": polarisation_ohm * hover_W / voltage_V,
        "ocv_dod_linearised": tuple(0.5 * (a + b) for a, b in pairwise(battery.ocv_dod)),
    }


def polarisation_decay(vehicle: Parts, dt_s: float, order: int = 4) -> float:
    """What a step leaves of u_th when no current flows: the series of exp(-dt/tau_th).

    The series of a pole that is fast for the step is no contraction any more; there the
    exponential takes its place.
    """
    z = -dt_s / vehicle.battery.time_constant_th_s
    series = sum(z**k / math.factorial(k) for k in range(order + 1))
    return series if z >= -_SERIES_HOLDS and 0.0 < series < 1.0 else math.exp(z)


def pair_decays(vehicle: Parts, dt_s: float, order: int = 4) -> tuple[float, ...]:
    """What a step leaves of the voltage of each RC pair: `polarisation_decay` of the first."""
    further = (math.exp(-dt_s / pair.time_constant_s) for pair in vehicle.battery.rc)
    return (polarisation_decay(vehicle, dt_s, order), *further)


def simulate_battery(
    vehicle: Parts, current_A: ArrayLike, soc_0: float, dt_s: float = 1.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Replay a current through the battery (Gasche et al., Sec. II, Thevenin model).

    Args:
        vehicle: parameters.
        current_A: (T,) [A] held over each step, positive when discharging.
        soc_0: state of charge at the start, in [0, 1]; the polarisation starts at 0.
        dt_s: [s] in (0, 10].

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
    voltage_V = open_circuit_voltage(vehicle, 1.0 - soc)
    for pair, decay in zip(battery.pairs, pair_decays(vehicle, dt_s), strict=True):
        polarisation = 0.0
        for k, amperes in enumerate(current.tolist()):
            voltage_V[k] -= polarisation
            polarisation = decay * polarisation + (1.0 - decay) * pair.resistance_ohm * amperes
    return soc, voltage_V - battery.resistance_0_ohm * current


def check_step(dt_s: float) -> None:
    """Refuse a step for which the discrete model does not hold.

    Raises:
        ValueError: dt_s outside (0, 10].
    """
    if not is_number(dt_s) or not 0.0 < dt_s <= 10.0:
        raise ValueError(f"dt_s is {dt_s!r}; give a step in (0, 10] seconds")


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
