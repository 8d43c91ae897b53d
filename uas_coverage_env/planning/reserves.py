"""What planners and learners take a flight for, and what they keep for the way home.

Each number with the command that gave it. Where that says "chosen by hand", no record of a
measurement exists; the command then shows what it costs today. Models of flight time that are
rules of the world stand with them: `vehicle.range.CALIBRATED` and `ROUTED`,
`autopilot.return_mode.RETURN_MODE`, `scenario.endurance.GENERATED`,
`env.observation.home.OBSERVED`.
"""

from typing import NamedTuple

from uas_coverage_env.vehicle.range import TravelTimeModel

TOUR = TravelTimeModel(landing_s=3.0)
"""Of `tour`: `ROUTED`, and from full speed over the start to rest on it. Chosen by hand;
`benchmarks/tour.py` sets the times of its orders beside those that are flown."""

BY_LEGS = TravelTimeModel(landing_s=12.0)
"""Of `LegMission`: `ROUTED`, and as long a landing as return mode's. Chosen by hand;
`benchmarks/flown_by.py` sets promised times beside those of the files."""

TRAJECTORY = TravelTimeModel(landing_s=4.0)
"""Of `trajectory` and `learned-route`: `ROUTED`, and coming to rest above the start. Chosen by
hand; `benchmarks/route_legs.py` shows the landing's part of flights along the same routes."""

ORDER_GUIDE = TravelTimeModel(landing_s=4.0)
"""Of the order that `milp-mpc-guided` follows: `ROUTED`, and coming to rest above the start. Chosen
by hand; `benchmarks/missions.py` shows what is flown."""

MILP_RESERVE = TravelTimeModel(speed_share=0.9, detour=1.1, in_turn=True, landing_s=6.0)
"""Of the reserve of `milp-mpc`: linear in the place, hence no look at what stands in the way.
Chosen by hand; `benchmarks/returns.py` shows by how much it errs."""

LAWNMOWER = TravelTimeModel(speed_share=0.8)
"""Of `lawnmower`: the legs of its runs, straight, at a share of the cruise speed. Chosen by hand:
it only compares runs."""


class Reserve(NamedTuple):
    """Flight time that a plan leaves in the battery, or before the mission ends."""

    kept_s: float
    """Still left when the UAS is at home [s]."""
    spare_s: float = 0.0
    """Left beside it in a new order, so that not every delay upsets the order [s]."""


TOUR_RESERVE = Reserve(kept_s=30.0, spare_s=10.0)
"""Of `tour`: what return mode asks for beyond the way home at full speed. Chosen by hand."""

TOUR_SCARCE_RESERVE = Reserve(kept_s=20.0, spare_s=3.0)
"""Of `tour` once charge does not suffice for all. With it and other changes of 0.3.0 it covered
23 to 52 % instead of 0 to 13 % of missions of the family `low-charge`; the command and what else
was tried are not recorded."""

BY_LEGS_RESERVE = Reserve(kept_s=30.0)
"""Of `LegMission`: that of `tour`. Chosen by hand; without `spare_s`, as its plans are not made
anew for a delay."""

TRAJECTORY_RESERVE = Reserve(kept_s=6.0)
"""Of the routes of `trajectory` and `learned-route`, whose flights keep a backup besides. Chosen by
hand; `benchmarks/trajectory.py` shows what harm is done."""

ORDER_GUIDE_RESERVE = Reserve(kept_s=25.0)
"""Of the order that `milp-mpc-guided` follows, somewhat more than `MILP_RESERVE` and `BRAKING_S`
hold back for braking and landing. Chosen by hand."""

BRAKING_S = 16.0
"""Of `milp-mpc`: braking to a hover where a plan ends, and turning home [s]. Twice the 8 s of its
first version, in which braking did not fit; the command is not recorded. What it is enough for:
`tests/milp_mpc/test_battery_reserve.py`."""

ROUTE_HOME_RESERVE = Reserve(kept_s=30.0)
"""Of UAS that `milp-mpc` flies home along a route: others may be in the way. Chosen by hand."""
