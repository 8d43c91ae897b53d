"""What a learner of waypoints is paid for, and how large it is."""

from typing import Annotated, Literal

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel

Price = Annotated[float, Field(ge=0.0, le=1000.0)]
Share = Annotated[float, Field(ge=0.0, le=1.0)]


class WaypointSettings(StrictModel):
    """A learner that chooses where to go next.

    Energy alone would be saved best by one UAS that does all: the time of the team has a price.

    Attributes:
        interface: "waypoint".
        hidden: Width of the network's layers.
        prior: See `policy.pointer.Pointer`.
        safety_filter: Whether the filter flies along while learning.
        return_mode: Whether return mode flies along while learning.
        price_per_Wh: Of all the energy that is used.
        price_per_s: Of the time until the last is home.
        price_left: Of a waypoint that is left in the end.
        price_lost: Of a UAS that is lost, or not home in the end.
        price_filtered: Of a step in which the filter changed the command of a UAS: what the
            filter prevents is not free.
        moving_share: Share of the scenarios that get moving obstacles.
        covered_share: Share of the missions in which some waypoints are covered already.
        discharged_share: Share of the missions that begin with less charge.
    """

    interface: Literal["waypoint"]
    hidden: Annotated[int, Field(ge=4, le=512)] = 64
    prior: Annotated[float, Field(ge=0.0, le=100.0)] = 6.0
    safety_filter: bool = True
    return_mode: bool = True
    price_per_Wh: Price = 0.1
    price_per_s: Price = 0.01
    price_left: Price = 1.0
    price_lost: Price = 5.0
    price_filtered: Price = 0.01
    moving_share: Share = 0.3
    covered_share: Share = 0.4
    discharged_share: Share = 0.3
