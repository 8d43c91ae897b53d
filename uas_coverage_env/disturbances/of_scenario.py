"""The disturbances that a scenario asks for."""

from collections.abc import Iterator, Sequence

from uas_coverage_env.disturbances.dryden import turbulence
from uas_coverage_env.disturbances.gusts import discrete_gusts, random_gusts
from uas_coverage_env.disturbances.motor import motor_degraded
from uas_coverage_env.disturbances.parameter_errors import uncertainty
from uas_coverage_env.disturbances.wind import mean_wind
from uas_coverage_env.scenario import Scenario, Uncertainty, Wind
from uas_coverage_env.scenario.events import MotorDegraded
from uas_coverage_env.world.disturbance import Disturbance, checked_disturbances


def disturbances_of(scenario: Scenario) -> tuple[Disturbance, ...]:
    """What acts in a scenario; empty where nothing does.

    Raises:
        ValueError: The table of another package makes no disturbance, or two have one name.
    """
    found: list[Disturbance] = []
    if scenario.wind is not None:
        found += _of_wind(scenario.wind)
    if scenario.uncertainty is not None and scenario.uncertainty != Uncertainty():
        found.append(uncertainty(scenario.uncertainty))
    found += [table.disturbance() for _, table in scenario.disturbances]
    found += [
        motor_degraded(e, event)
        for e, event in enumerate(scenario.events)
        if isinstance(event, MotorDegraded)
    ]
    return checked_disturbances(found)


def disturbances_in(
    scenario: Scenario, given: Sequence[Disturbance] | None
) -> tuple[Disturbance, ...]:
    """What acts in a mission.

    Args:
        scenario: Of the mission.
        given: In place of what the scenario asks for; None: what it asks for.

    Raises:
        ValueError: See `disturbances_of`; or one belongs to an event that the scenario does not
            have.
    """
    if given is None:
        return disturbances_of(scenario)
    given = checked_disturbances(given)
    for disturbance in given:
        if disturbance.of_event and disturbance not in disturbances_of(scenario):
            raise ValueError(
                f"disturbance {disturbance.name!r} belongs to an event that scenario "
                f"{scenario.name!r} does not have; leave it out"
            )
    return given


def _of_wind(wind: Wind) -> Iterator[Disturbance]:
    """The mean comes first: turbulence is flown through with the airspeed in it."""
    unsteady = bool((wind.turbulence and wind.mean_mps) or wind.gusts or wind.random_gusts)
    if wind.mean_mps or wind.up_mps or (unsteady and wind.power == "rotor"):
        yield mean_wind(wind)
    if wind.turbulence and wind.mean_mps:
        yield turbulence(wind)
    if wind.gusts:
        yield discrete_gusts(wind)
    if wind.random_gusts is not None:
        yield random_gusts(wind)
