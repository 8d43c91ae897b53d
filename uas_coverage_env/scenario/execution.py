"""How a mission is going to be flown outside of the simulator: `[execution]`."""

from typing import Annotated, Literal

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel


class Execution(StrictModel):
    """What a plan becomes: `flown_by = "autopilot"`, a file of straight legs for each UAS.

    Planners that know it plan long straight legs, from rest to rest, as an autopilot flies them, so
    that the file takes as long as the flight. In the world nothing is different.

    Attributes:
        flown_by: What flies it.
        tolerance_m: How far legs may be from the flight, that much less than its radius from a
            waypoint [m].
        corner_m: How far from a corner the autopilot may pass [m].
        min_slack_s: How late any UAS has to be able to be before two come too close; plans hold
            UAS on the ground for it [s].
    """

    flown_by: Literal["autopilot"]
    tolerance_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    corner_m: Annotated[float, Field(ge=0.1, le=50.0)] = 2.0
    min_slack_s: Annotated[float, Field(ge=0.0, le=3_600.0)] = 20.0
