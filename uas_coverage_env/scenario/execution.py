"""How a mission is going to be flown outside of the simulator: `[execution]`."""

from typing import Annotated, Literal

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel


class Execution(StrictModel):
    """How an autopilot will fly the mission: from a file of straight legs for each UAS.

    Planners that know it plan long straight legs, from rest to rest, as an autopilot flies them, so
    that the file takes as long as the flight. The simulation does not change.

    Attributes:
        flown_by: What flies it.
        tolerance_m: How far legs may be from the flight [m]. They pass waypoints nearer than their
            radius by as much.
        corner_m: How far from a corner the autopilot may pass [m].
        min_slack_s: How late any UAS may be before two come too close; plans hold UAS on the
            ground to allow it [s].
    """

    flown_by: Literal["autopilot"]
    tolerance_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    corner_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    min_slack_s: Annotated[float, Field(ge=0.0, le=3_600.0)] = 20.0
