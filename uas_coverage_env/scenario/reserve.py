"""Charge that is still there when a UAS has landed: `[reserve]`."""

from __future__ import annotations

from typing import Annotated, Any, Self

from pydantic import Field, SerializerFunctionWrapHandler, model_serializer, model_validator

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.vehicle import VehicleParams
from uas_coverage_env.vehicle.battery import steady_current_A


class LandingReserve(StrictModel):
    """What a battery still holds when its UAS lands: less is a breach, and no loss.

    Planners plan to it, and return mode begins by it. Of both, one is given.

    Attributes:
        share: State of charge [-].
        minutes: For how long the UAS could hover on, until its `dod_max`, at the current that a
            hover takes there [min].
    """

    share: Annotated[float, Field(gt=0.0, lt=1.0)] | None = None
    minutes: Annotated[float, Field(gt=0.0, le=1_000.0)] | None = None

    @model_validator(mode="after")
    def _is_one_of_both(self) -> Self:
        if (self.share is None) == (self.minutes is None):
            given = "neither is given" if self.share is None else "both are given"
            raise ValueError(f"share or minutes: {given}; give one of them")
        return self

    @model_serializer(mode="wrap")
    def _without_what_is_absent(self, serialise: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {name: value for name, value in serialise(self).items() if value is not None}

    def dod(self, vehicle: VehicleParams, dod_max: float) -> float:
        """Depth of discharge with which a UAS lands at the latest.

        Args:
            vehicle: Its vehicle.
            dod_max: Depth of discharge beyond which it is lost.

        Returns:
            At most `dod_max`; negative where a full battery does not hold the reserve.
        """
        if self.minutes is None:
            return min(1.0 - float(self.share or 0.0), dod_max)
        battery = vehicle.battery
        current_A = steady_current_A(battery, dod_max, vehicle.power.hover_W)
        return dod_max - self.minutes * current_A / (60.0 * battery.capacity_Ah)
