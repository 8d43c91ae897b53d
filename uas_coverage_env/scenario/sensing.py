"""What planners and autopilots are told of a UAS, where that is not what is true: `[sensing]`."""

from typing import Annotated

from pydantic import Field

from uas_coverage_env.files.strict_toml import StrictModel

LONGEST_DELAY = 7
"""Steps by which what is sensed may lag behind."""


class Sensing(StrictModel):
    """Errors with which a UAS knows its position, velocity and charge. The rest is known exactly.

    Noise is normal and new at every sample. A bias is normal, too, and drawn once for each UAS and
    mission. The inner loop uses the state with biases; return mode, guidance and safety filter use
    it with biases and noise; planners and learners get the latter `delay_steps` later. Rules judge
    the true state.

    Attributes:
        position_noise_m: Standard deviation on each axis [m].
        position_bias_m: Likewise of a constant error [m].
        velocity_noise_mps: Standard deviation on each axis [m/s].
        velocity_bias_mps: Likewise of a constant error [m/s].
        charge_bias: Standard deviation of a constant error of the depth of discharge [-].
        delay_steps: How many steps later planners and learners get it.
    """

    position_noise_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    position_bias_m: Annotated[float, Field(ge=0.0, le=100.0)] = 0.0
    velocity_noise_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    velocity_bias_mps: Annotated[float, Field(ge=0.0, le=10.0)] = 0.0
    charge_bias: Annotated[float, Field(ge=0.0, le=0.5)] = 0.0
    delay_steps: Annotated[int, Field(ge=0, le=LONGEST_DELAY)] = 0
