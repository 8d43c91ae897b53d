"""One UAS of a log, whatever file it comes from."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError

FloatArray = NDArray[np.float64]

_LONGEST_S = 24 * 3_600.0


@dataclass(frozen=True, eq=False)
class Logged:
    """What was logged of one UAS; N samples in order of time.

    Attributes:
        uas: Its name; empty where the log does not say.
        time_s: (N,) of any clock that the logs of a mission share [s].
        latitude_deg: (N,) [degrees].
        longitude_deg: (N,) [degrees].
        height_m: (N,) above the ground of home [m].
        attitude_rad: (N, 3) roll, pitch, yaw [rad]; None: not logged.
        soc: (N,) state of charge [-]; None: not logged.
        used_Ah: (N,) taken from the battery since the start [A h]; None: not logged.
        voltage_V: (N,) of the battery [V]; None: not logged.
        current_A: (N,) of the battery [A]; None: not logged.
    """

    uas: str
    time_s: FloatArray
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_m: FloatArray
    attitude_rad: FloatArray | None = None
    soc: FloatArray | None = None
    used_Ah: FloatArray | None = None
    voltage_V: FloatArray | None = None
    current_A: FloatArray | None = None


def limited(path: Path, logged: Logged) -> Logged:
    """The same, if it can be a flight.

    Raises:
        InputError: It holds what no flight can hold.
    """
    of = f"{path}: {logged.uas}: " if logged.uas else f"{path}: "
    times_s = logged.time_s
    if len(times_s) < 2:
        raise InputError(f"{of}holds fewer than two positions")
    if not (np.diff(times_s) > 0.0).all():
        after = int((np.diff(times_s) <= 0.0).argmax()) + 1
        raise InputError(
            f"{of}time {times_s[after]:.3f} s follows {times_s[after - 1]:.3f} s; give the "
            f"positions of one flight in order of time"
        )
    if times_s[-1] - times_s[0] > _LONGEST_S:
        raise InputError(f"{of}is longer than a day; cut out one flight")
    for name, values, most in (
        ("latitude", logged.latitude_deg, 90.0),
        ("longitude", logged.longitude_deg, 180.0),
        ("height", logged.height_m, 10_000.0),
    ):
        if not (np.abs(values) <= most).all():
            wrong = values[~(np.abs(values) <= most)][0]
            raise InputError(f"{of}{name} {wrong:g} should be within {most:g} of 0")
    if logged.soc is not None and not ((logged.soc >= 0.0) & (logged.soc <= 1.0)).all():
        raise InputError(f"{of}soc should be between 0 and 1")
    for name, values in (("voltage", logged.voltage_V), ("current", logged.current_A)):
        if values is not None and not (np.abs(values) <= 10_000.0).all():
            raise InputError(f"{of}{name} is beyond that of any battery")
    return logged
