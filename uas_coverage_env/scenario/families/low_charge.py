"""Low charge: streets with batteries for 30 to 50 % of what a flight back and forth takes."""

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import Rng, Size
from uas_coverage_env.scenario.families.streets import streets
from uas_coverage_env.scenario.feasibility import back_and_forth
from uas_coverage_env.scenario.model import Scenario

_SHARE = (0.3, 0.5)
_LEAST = 0.05  # of a battery, above what must be left: a minute in the air


def low_charge(rng: Rng, size: Size) -> Scenario:
    """What to leave out is part of the task; every UAS can fly out for a minute at least."""
    scenario = streets(rng, size)
    lacking = with_charge_for(scenario, float(rng.uniform(*_SHARE)))
    return lacking.model_copy(update={"name": scenario.name.replace("streets", "low-charge")})


FAMILIES = {"low-charge": Family(low_charge)}


def with_charge_for(scenario: Scenario, share: float) -> Scenario:
    """A scenario with batteries that last for a share of what back and forth takes.

    Args:
        scenario: Its charges tell in which proportion UAS have more or less.
        share: Time in the air of all batteries over that which the plan takes [-].
    """
    plan = back_and_forth(scenario)
    factor = share * float(plan.flight_s.sum()) / float(plan.air_time_s.sum())
    fleet = []
    for uas in scenario.uas:
        left = 1.0 - uas.dod_max
        usable = min(max(_LEAST, factor * (uas.soc_0 - left)), uas.dod_max)
        fleet.append(uas.model_copy(update={"soc_0": round(left + usable, 3)}))
    return scenario.model_copy(update={"uas": tuple(fleet)})
