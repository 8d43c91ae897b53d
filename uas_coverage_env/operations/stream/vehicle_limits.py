"""What a vehicle can follow, by the parameters that its autopilot has set."""

from __future__ import annotations

from dataclasses import dataclass

_REACTS_S = 0.5
"""Until a target is late, and braking has set in: of ArduCopter's jerk, 5 m/s³, and a message."""


@dataclass(frozen=True)
class Limits:
    """How a vehicle flies by targets; the defaults are ArduCopter's.

    Attributes:
        speed_mps: Its largest level speed [m/s].
        up_mps: Its largest rate of climb [m/s].
        down_mps: Its largest rate of descent [m/s].
        acceleration_mps2: Horizontal [m/s²].
        vertical_mps2: Vertical [m/s²].
        return_m: Height at which it returns, where it is not higher [m].
        blind_s: So long it flies on as it was told last, once it hears no target [s].
    """

    speed_mps: float = 10.0
    up_mps: float = 2.5
    down_mps: float = 1.5
    acceleration_mps2: float = 2.5
    vertical_mps2: float = 1.0
    return_m: float = 15.0
    blind_s: float = 0.5

    def stops_m(self, speed_mps: float) -> float:
        """How far it flies on from when its link is cut until it stands [m]."""
        braking_s = speed_mps / (2.0 * self.acceleration_mps2)
        return speed_mps * (self.blind_s + _REACTS_S + braking_s)
