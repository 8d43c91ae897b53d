"""What planners and learners take a flight for, and what they keep for the way home.

Each number with the command that gave it. Where that says "chosen by hand", no record of a
measurement exists; the command then shows how far off it is today. Models of flight time that are
rules of the world stand with them: `vehicle.range.CALIBRATED` and `ROUTED`,
`autopilot.return_mode.RETURN_MODE`, `scenario.endurance.GENERATED`,
`env.observation.home.OBSERVED`.
"""

from typing import NamedTuple

from uas_coverage_env.vehicle.params import VehicleParams
from uas_coverage_env.vehicle.range import TravelTimeModel
from uas_coverage_env.vehicle.scale import braking_s

MILP_RESERVE = TravelTimeModel(speed_share=0.9, detour=1.1, in_turn=True, landing_s=6.0)
"""Of the reserve of `milp-mpc`: linear in the place, hence no look at what stands in the way.
Chosen by hand; `benchmarks/returns.py` shows by how much it errs."""

LAWNMOWER = TravelTimeModel(speed_share=0.8)
"""Of `lawnmower`: the legs of its runs, straight, at a share of the cruise speed. Chosen by hand:
it only compares runs."""


class Reserve(NamedTuple):
    """What a planner's routes allow for, and leave in the battery or before the mission ends."""

    of: str
    """What it is for."""
    measured: str
    """The command that gave the numbers, or shows what they cost; and what is not known of them."""
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


TOUR = Reserve(
    "routes of `tour`: what return mode asks for beyond the way home at full speed",
    "`benchmarks/reserves.py --planners tour --seeds 3000:3005`: legs 1.04, which it finds out in "
    "flight, landing 4.7 s, at least 234 s left; the seconds were chosen by hand",
    kept_s=30.0,
    spare_s=10.0,
    landing_s=3.0,
)
TOUR_SCARCE = TOUR._replace(
    of="the same, once charge does not suffice for all",
    measured="`benchmarks/reserves.py --planners tour --scenarios low-charge --seeds 5000:5010`; "
    "with other changes of 0.3.0 it covered 23 to 52 % instead of 0 to 13 % of such missions",
    kept_s=20.0,
    spare_s=3.0,
)
BY_LEGS = Reserve(
    "routes that an autopilot flies, which are not searched again for a delay",
    "`benchmarks/reserves.py --planners by-legs --seeds 3000:3005`: legs 1.05, landing 9.9 s, at "
    "least 127 s left; the seconds are those of `tour` and of return mode",
    kept_s=30.0,
    landing_s=12.0,
)
TRAJECTORY = Reserve(
    "routes of `trajectory`, whose flights keep a backup besides",
    "`benchmarks/reserves.py --planners trajectory --seeds 3000:3005`: legs 0.986 and landing "
    "1.0 s, at least 254 s left; the seconds were chosen by hand",
    kept_s=6.0,
    landing_s=4.0,
    legs_share=0.96,
)
TRAJECTORY_WITH_ROOM = TRAJECTORY._replace(
    of="the same where the plant is not the model: flights are slower, and come some steps later",
    measured="`uas-coverage compare --scenarios test --planners trajectory --seeds 0:1 "
    "--dynamics nonlinear --out nonlinear`; "
    "the share was chosen by hand",
    time_share=0.91,
)
TRAJECTORY_LATER = Reserve(
    "besides, flights of `trajectory` with later packs, not planned yet: they differ from routes "
    "by 1.6 %",
    "`benchmarks/sorties.py`; the share was chosen by hand",
    kept_s=0.0,
    time_share=0.96,
)
LEARNED_ROUTE = TRAJECTORY._replace(
    of="routes of `learned-route`, which are like those its networks learnt from: inputs of them",
    measured="`benchmarks/reserves.py --planners learned-route`; `spare_s` was chosen by hand",
    spare_s=8.0,
)
ORDER_GUIDE = Reserve(
    "the order of `milp-mpc` (`order=search`, and in wind): somewhat more than `MILP_RESERVE` and "
    "`milp_braking_s` hold back",
    "`uas-coverage compare --scenarios test --planners milp-mpc --seeds 0:1 --out test`; "
    "chosen by hand",
    kept_s=25.0,
    landing_s=4.0,
)
ROUTE_HOME_RESERVE = Reserve(
    "UAS that `milp-mpc` flies home along a route: others may be in the way",
    "`benchmarks/returns.py`; chosen by hand",
    kept_s=30.0,
)

RESERVES = {name: value for name, value in globals().items() if isinstance(value, Reserve)}
"""All of them, by name."""

_TURNING_HOME_S = 2.0


def milp_braking_s(vehicle: VehicleParams, dt_s: float) -> float:
    """Of `milp-mpc`: braking to a hover where a plan ends, and turning home [s].

    16 s for the shipped vehicles, twice the 8 s of its first version, in which braking did not fit;
    the command is not recorded. What it is enough for: `tests/milp_mpc/test_battery_reserve.py`.
    """
    return braking_s((vehicle,), dt_s) + _TURNING_HOME_S
