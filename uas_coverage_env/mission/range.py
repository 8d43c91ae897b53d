"""How long and how much charge from here to home, with what margin: calibrated (docs/range.md)."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.autopilot.return_path import flight_home
from uas_coverage_env.mission.brief import MissionBrief
from uas_coverage_env.vehicle.layout import DOD
from uas_coverage_env.vehicle.range import dod_per_s
from uas_coverage_env.world import build_arena


@dataclass(frozen=True)
class ReturnEstimate:
    """What flying home and landing takes from a state.

    Expected values, and what to add to them to be on the safe side: with the margin, fewer than 1
    in 200 flown returns took longer, or more charge, than estimated.

    Attributes:
        time_s: Expected time until it has landed [s].
        time_margin_s: To be added to it [s].
        dod: Depth of discharge that is expected to be used [-].
        dod_margin: To be added to it [-].
    """

    time_s: float
    time_margin_s: float
    dod: float
    dod_margin: float


class Range:
    """Answers, for every UAS of a mission, what coming home takes.

    For a UAS that `GoTo(None)` or return mode flies home at once, past the fixed obstacles. To be
    held up by other UAS or by something that moves is not part of it, nor is wind.

    Args:
        brief: The mission.
    """

    def __init__(self, brief: MissionBrief) -> None:
        self._brief = brief
        self._arena = build_arena(brief.as_scenario())

    def home(self, uas: int, x: NDArray[np.float64]) -> ReturnEstimate:
        """What coming home takes from a state.

        Args:
            uas: Index of the UAS.
            x: (14,) its state, in the order of `vehicle.layout`.
        """
        time_s, time_margin_s = flight_home(self._arena, uas, x)
        per_s = dod_per_s(self._brief.vehicles[uas], float(x[DOD]))
        return ReturnEstimate(time_s, time_margin_s, per_s * time_s, per_s * time_margin_s)

    def spare_dod(self, uas: int, x: NDArray[np.float64]) -> float:
        """Charge that is left beyond the way home with margin; 0 at the point of no return.

        Args:
            uas: Index of the UAS.
            x: (14,) its state.

        Returns:
            Depth of discharge [-]; negative where coming home with the reserve is not sure.
        """
        home = self.home(uas, x)
        return self._brief.dod_landed[uas] - float(x[DOD]) - home.dod - home.dod_margin
