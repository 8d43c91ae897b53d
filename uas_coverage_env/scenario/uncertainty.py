"""How far the vehicles that fly may be from the files that planners believe."""

from typing import Annotated

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel

Share = Annotated[float, Field(ge=0.0, le=0.5)]


class Uncertainty(StrictModel):
    """Bounds within which the true vehicle of each UAS is drawn in each mission, uniformly.

    Attributes:
        mass: Largest relative error of mass, either way [-].
        thrust: Likewise, of the motors' thrust at the same speed [-].
        drag: Likewise, of the drag [-].
        power: Likewise, of the electrical power at the same speed of the motors [-].
        capacity_lost: Largest share of the battery's capacity that is lost with age [-].
        resistance_gained: Largest share by which its resistances have grown with age [-].
    """

    mass: Share = 0.0
    thrust: Share = 0.0
    drag: Share = 0.0
    power: Share = 0.0
    capacity_lost: Share = 0.0
    resistance_gained: Annotated[float, Field(ge=0.0, le=5.0)] = 0.0
