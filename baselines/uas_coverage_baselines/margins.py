"""Margins that planners with programs add to clearances, as options."""

from typing import Annotated

from pydantic import Field

MarginM = Annotated[
    float,
    Field(ge=0.0, le=10.0, description="added to every clearance, for the path between samples"),
]

MovingMarginM = Annotated[
    float,
    Field(ge=0.0, le=50.0, description="added for a moving obstacle's next change of velocity"),
]
