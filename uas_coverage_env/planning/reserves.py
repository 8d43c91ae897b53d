"""What planners and learners take a flight for, and what they keep for the way home.

Each number with the command that gave it. Where that says "chosen by hand", no record of a
measurement exists; the command then shows what it costs today. Models of flight time that are
rules of the world stand with them: `vehicle.range.CALIBRATED` and `ROUTED`,
`autopilot.return_mode.RETURN_MODE`, `scenario.endurance.GENERATED`,
`env.observation.home.OBSERVED`.
"""

from typing import NamedTuple

from uas_coverage_env.vehicle.range import TravelTimeModel

MILP_RESERVE = TravelTimeModel(speed_share=0.9, detour=1.1, in_turn=True, landing_s=6.0)
"""Of the reserve of `milp-mpc`: linear in the place, hence no look at what stands in the way.
Chosen by hand; `benchmarks/returns.py` shows by how much it errs."""

LAWNMOWER = TravelTimeModel(speed_share=0.8)
"""Of `lawnmower`: the legs of its runs, straight, at a share of the cruise speed. Chosen by hand:
it only compares runs."""


class Reserve(NamedTuple):
    """What a planner's routes allow for, and leave in the battery or before the mission ends."""

    kept_s: float
    """Still left when the UAS is at home [s]."""
    spare_s: float = 0.0
    """Left beside it in a new order, so that not every delay upsets the order [s]."""
    landing_s: float = 0.0
    """Of the landing, beyond the leg home [s]."""
    legs_share: float = 1.0
    """Of their legs, that flights along a route take."""
    time_share: float = 1.0
    """Of the flying time that is left, that may be planned."""


TOUR = Reserve(kept_s=30.0, spare_s=10.0, landing_s=3.0)
"""Of `tour`: what return mode asks for beyond the way home at full speed; and a landing from full
speed over the start to rest on it. Chosen by hand."""

TOUR_SCARCE = Reserve(kept_s=20.0, spare_s=3.0, landing_s=3.0)
"""Of `tour` once charge does not suffice for all. With it and other changes of 0.3.0 it covered
23 to 52 % instead of 0 to 13 % of missions of the family `low-charge`; the command and what else
was tried are not recorded."""

BY_LEGS = Reserve(kept_s=30.0, landing_s=12.0)
"""Of `LegOrder`: that of `tour`, and as long a landing as return mode's. Chosen by hand; without
`spare_s`, as its plans are not made anew for a delay. `benchmarks/flown_by.py` sets promised times
beside those of the files."""

TRAJECTORY = Reserve(kept_s=6.0, landing_s=4.0, legs_share=0.96)
"""Of the routes of `trajectory`, whose flights keep a backup besides, and come to rest above the
start. `legs_share` was measured on generated towns, the others were chosen by hand;
`uas-coverage compare` shows what harm is done."""

TRAJECTORY_WITH_ROOM = TRAJECTORY._replace(time_share=0.91)
"""The same where the plant is not the model: flights are slower, and come some steps later."""

TRAJECTORY_LATER = Reserve(kept_s=0.0, time_share=0.96)
"""Beside it, of the budgets of flights with later packs, which are not planned yet: flights differ
from their routes by 1.6 %."""

LEARNED_ROUTE = TRAJECTORY._replace(spare_s=8.0)
"""Of `learned-route`: that of the routes its networks learnt from; they read these numbers."""

ORDER_GUIDE = Reserve(kept_s=25.0, landing_s=4.0)
"""Of the order of `milp-mpc` (`order=search`, and in wind), somewhat more than `MILP_RESERVE` and
`MILP_BRAKING_S` hold back for braking and landing. Chosen by hand."""

BRAKING_S = 14.0
"""Braking with the inner loop has ended after this time, from any speed [s]. What it is enough for:
`tests/milp_mpc/test_plan_verification.py`."""

MILP_BRAKING_S = 16.0
"""Of `milp-mpc`: braking to a hover where a plan ends, and turning home [s]. Twice the 8 s of its
first version, in which braking did not fit; the command is not recorded. What it is enough for:
`tests/milp_mpc/test_battery_reserve.py`."""

ROUTE_HOME_RESERVE = Reserve(kept_s=30.0)
"""Of UAS that `milp-mpc` flies home along a route: others may be in the way. Chosen by hand."""
