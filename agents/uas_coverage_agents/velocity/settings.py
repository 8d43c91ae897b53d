"""What a velocity learner reads and is paid for."""

from typing import Annotated, Literal

from pydantic import Field

from uas_coverage_agents.policy.tensors import Width
from uas_coverage_env.strict_toml import StrictModel


class VelocitySettings(StrictModel):
    """One network for all UAS: the observation of the environment in, a velocity out.

    Attributes:
        interface: "velocity".
        hidden: Widths of the layers of actor and of critic.
        activation: Of these layers.
        first_deviation: Of the actions before training, 1: the largest action.
        safety_filter: Whether the filter flies along while learning.
        return_mode: Whether return mode flies along while learning.
        rewards: Reward term -> weight, see `REWARD_TERMS`; the others keep their defaults.
        nearing: Paid for every 68 m that it comes nearer to the nearest open waypoint.
    """

    interface: Literal["velocity"]
    hidden: Annotated[tuple[Width, ...], Field(min_length=1, max_length=8)] = (128, 128)
    activation: Literal["tanh", "relu"] = "tanh"
    first_deviation: Annotated[float, Field(gt=0.0, le=2.0)] = 0.6
    safety_filter: bool = True
    return_mode: bool = True
    rewards: dict[str, float] = Field(default_factory=dict)
    nearing: Annotated[float, Field(ge=0.0)] = 0.5
