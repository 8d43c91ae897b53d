"""One UAS of a log, whatever file it comes from."""

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.files.errors import InputError

FloatArray = NDArray[np.float64]

_LONGEST_S = 24 * 3_600.0


class Span(NamedTuple):
    """From a time to another, of the clock of the log [s]."""

    begins_s: float
    ends_s: float
    is_open: bool = False
    """Whether it lasts on where the log ends."""


class Said(NamedTuple):
    """Something that the autopilot said, and when [s]."""

    time_s: float
    text: str


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
        soc: (N,) state of charge [-]; None: not logged. Beside `used_Ah`, what that is counted
            from at the first sample.
        used_Ah: (N,) taken from the battery [A h]: without `soc`, since it was full; None: not
            logged.
        voltage_V: (N,) of the battery [V]; None: not logged.
        current_A: (N,) of the battery [A]; None: not logged.
        system: Of telemetry, which vehicle of the link it is.
        armed: When it was armed; None: not logged.
        in_air: When its autopilot took it to be in the air; None: not logged.
        glitches: When its autopilot took its position to be wrong.
        said: Failsafes and the like.
        notes: What its reader has to say of it.
        source: The file.
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
    system: int | None = None
    armed: tuple[Span, ...] | None = None
    in_air: tuple[Span, ...] | None = None
    glitches: tuple[Span, ...] = ()
    said: tuple[Said, ...] = ()
    notes: tuple[str, ...] = ()
    source: str = ""

    def at(self, samples: NDArray[np.bool_]) -> Self:
        """The same with some of its samples (N,)."""
        changes = {
            field.name: value[samples]
            for field in dataclasses.fields(self)
            if isinstance(value := getattr(self, field.name), np.ndarray)
        }
        return dataclasses.replace(self, **changes)


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
