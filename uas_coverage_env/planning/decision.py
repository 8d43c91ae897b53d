"""What a planner may tell about a decision."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import NDArray

GUIDANCE: Final = "guidance"
"""Who flew: the world's guidance, to a waypoint that the planner named."""

LEGS: Final = "legs"
"""Who flew: an autopilot's legs along the planner's order (`[execution]`)."""


@dataclass(frozen=True)
class Decision:
    """What a planner may tell about its last decision.

    Attributes:
        predicted_m: Name of a UAS -> (N+1, 3) [m] positions, n = 0 is now.
        fallback: Whether the decision was flown on a fallback.
        mip_gap: Relative to what the plan can influence; None where there is none.
        reason: Why there was a fallback, in a few words; None where the planner does not say.
        flown_by: Who flew any UAS in its place: names of other planners, or `LEGS`. `GUIDANCE` is
            added to the record where a `GoTo` names a waypoint.
    """

    predicted_m: Mapping[str, NDArray[np.float64]] = field(default_factory=dict)
    fallback: bool = False
    mip_gap: float | None = None
    reason: str | None = None
    flown_by: tuple[str, ...] = ()
