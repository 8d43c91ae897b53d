"""What a velocity learner reads and is paid for."""

from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, model_validator

from uas_coverage_agents.policy.tensors import Width
from uas_coverage_env.files.strict_toml import StrictModel


def _present_name(network: Any) -> Any:
    return "attention" if network == "gaze" else network  # as version 0.2 called it


class VelocitySettings(StrictModel):
    """One network for all UAS: the observation of the environment in, a velocity out.

    Attributes:
        interface: "velocity".
        network: "layers", one after the other; or "attention", see `policy.attention.Attention`.
        hidden: Widths of the layers of actor and of critic; of "attention" the one of its actor.
        keys: Of "attention", see there.
        activation: Of the layers of "layers".
        first_deviation: Of the actions before training, 1: the largest action. In PPO it falls as
            the learning rate does.
        safety_filter: Whether the filter flies along while learning.
        return_mode: Whether return mode flies along while learning.
        moving_share: Share of the scenarios that get moving obstacles.
        rewards: Reward term -> weight, see `REWARD_TERMS`; the others keep their defaults.
        nearing: Paid for every 68 m that it comes nearer to the nearest open waypoint.
    """

    interface: Literal["velocity"]
    network: Annotated[Literal["layers", "attention"], BeforeValidator(_present_name)] = "layers"
    hidden: Annotated[tuple[Width, ...], Field(min_length=1, max_length=8)] = (128, 128)
    keys: Width = 32
    activation: Literal["tanh", "relu"] = "tanh"
    first_deviation: Annotated[float, Field(gt=0.0, le=2.0)] = 0.6
    safety_filter: bool = True
    return_mode: bool = True
    moving_share: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    rewards: dict[str, float] = Field(default_factory=dict)
    nearing: Annotated[float, Field(ge=0.0)] = 0.5

    @model_validator(mode="after")
    def _fits(self) -> Self:
        if self.network == "attention" and len(self.hidden) != 1:
            raise ValueError(f"hidden is {list(self.hidden)}; 'attention' has one width")
        return self
