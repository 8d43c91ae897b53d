"""An open field: nothing in the way."""

from uas_coverage_env.scenario.families.family import Family
from uas_coverage_env.scenario.families.site import Rng, Size, Square, Wanted, tag
from uas_coverage_env.scenario.model import Scenario

_PITCH_M = 50.0


def open_field(rng: Rng, size: Size) -> Scenario:
    """Waypoints on a field without obstacles."""
    n_uas, n_waypoints = size.draw(rng)
    square = Square.at_pitch(n_uas, n_waypoints, _PITCH_M)
    wanted = [Wanted(place) for place in square.spread_places(rng, n_waypoints)]
    return square.site().scenario(rng, f"open-field-{tag(rng)}", n_uas, wanted, size)


FAMILIES = {"open-field": Family(open_field)}
