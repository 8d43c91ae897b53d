"""How a mission is going to be flown outside of the simulator: `[execution]`."""

from typing import Annotated, Literal

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.vehicle import VehicleParams


class Execution(StrictModel):
    """How an autopilot will fly the mission: by straight legs, from files or streamed.

    Planners that know it plan long straight legs, from rest to rest, as an autopilot flies them, so
    that the file takes as long as the flight. The simulation does not change.

    Attributes:
        flown_by: What flies it.
        tolerance_m: How far legs may be from the flight [m]. They pass waypoints nearer than their
            radius by as much.
        corner_m: How far from a corner the autopilot may pass [m].
        min_slack_s: How late any UAS may be before two come too close; plans hold UAS on the
            ground to allow it [s].
        speed_mps: The level speed that it is set to; without it, the vehicle's largest [m/s].
    """

    flown_by: Literal["autopilot"]
    tolerance_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    corner_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    min_slack_s: Annotated[float, Field(ge=0.0, le=3_600.0)] = 20.0
    speed_mps: Annotated[float, Field(ge=0.5, le=100.0)] | None = None

    def set_to(self, vehicle: VehicleParams) -> VehicleParams:
        """A vehicle whose autopilot keeps it to the speed."""
        if self.speed_mps is None or self.speed_mps >= vehicle.limits.v_xy_max_mps:
            return vehicle
        data = vehicle.model_dump()
        data["limits"]["v_xy_max_mps"] = self.speed_mps
        data["limits"]["v_cruise_mps"] = min(vehicle.limits.v_cruise_mps, self.speed_mps)
        del data["thrust_correction"]["speed_N_per_mps"]  # of the largest speed: computed anew
        return VehicleParams.model_validate(data)
