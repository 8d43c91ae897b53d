"""An open field: nothing in the way."""

import math

from uas_coverage_env.scenario.families.site import (
    MARGIN_M,
    Rng,
    Site,
    Size,
    Wanted,
    grid,
    outline,
    strip_m,
    tag,
)
from uas_coverage_env.scenario.model import Scenario

_PITCH_M = 50.0


def open_field(rng: Rng, size: Size) -> Scenario:
    """Waypoints on a field without obstacles."""
    n_uas, n_waypoints = size.draw(rng)
    side_m = _PITCH_M * math.sqrt(n_waypoints) + 2.0 * MARGIN_M
    west_m = strip_m(n_uas, side_m)
    site = Site(outline((0.0, side_m), (0.0, west_m + side_m)))
    inner = MARGIN_M, side_m - MARGIN_M
    places = grid(rng, inner, (west_m + inner[0], west_m + inner[1]), n_waypoints)
    wanted = [Wanted(place) for place in places]
    return site.scenario(rng, f"open-field-{tag(rng)}", n_uas, wanted, size)
