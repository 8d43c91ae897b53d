"""Networks of torch as plain arrays, and back."""

from collections.abc import Mapping
from typing import Any

import torch
from numpy.typing import NDArray
from torch import nn

from uas_coverage_agents.training.learner import Arrays
from uas_coverage_env.files.strict_toml import InputError


class Modules:
    """Some networks of a learner.

    Args:
        **modules: By name.
    """

    def __init__(self, **modules: nn.Module) -> None:
        self._modules: Mapping[str, nn.Module] = modules

    def state_dict(self) -> Arrays:
        """Their weights: NETWORK/TENSOR -> array."""
        return {
            f"{owner}/{name}": tensor.detach().cpu().numpy().copy()
            for owner, module in self._modules.items()
            for name, tensor in module.state_dict().items()
        }

    def load_state_dict(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Take them over.

        Raises:
            InputError: They are those of other networks.
        """
        try:
            for owner, module in self._modules.items():
                names = module.state_dict()
                module.load_state_dict(
                    {name: torch.from_numpy(state[f"{owner}/{name}"].copy()) for name in names}
                )
        except (KeyError, RuntimeError, TypeError) as error:
            reason = " ".join(str(error).split())[:200]
            raise InputError(f"the checkpoint does not fit this learner ({reason})") from error
