"""Missions that a learner flies, as tensors that lie where they fly: the processor, or a GPU.

What an environment holds is read in place (`tensor_of`), so on a GPU no array comes to the host in
a step.
"""

from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from torch import Tensor

from uas_coverage_env.entities.state import FLYING
from uas_coverage_env.env import K_WAYPOINTS, CoverageBatch
from uas_coverage_env.env.report import STATUS
from uas_coverage_env.files.strict_toml import InputError

if TYPE_CHECKING:
    from uas_coverage_env.env.gpu.missions import CudaMissions

CPU, CUDA = "cpu", "cuda"


def device_of(name: str) -> torch.device:
    """Where weights and decisions lie.

    Raises:
        InputError: There is no such GPU, or a package is missing; one line.
    """
    if name == CPU:
        return torch.device(CPU)
    from uas_coverage_env.env.gpu.device import check_gpu, is_simulated

    try:
        check_gpu()
    except (ImportError, RuntimeError) as error:
        raise InputError(f"training on a GPU: {error}") from error
    if is_simulated():
        return torch.device(CPU)  # as the arrays of the simulator
    if not torch.cuda.is_available():
        raise InputError(
            f"training on a GPU: PyTorch {torch.__version__} finds none; install its build for "
            'CUDA (https://pytorch.org/get-started/locally/), or take device="cpu"'
        )
    return torch.device(CUDA)


def tensor_of(array: Any) -> Tensor:
    """An array of an environment, read in place."""
    return torch.as_tensor(array, device=CPU if isinstance(array, np.ndarray) else CUDA)


class FlownMissions:
    """Missions that have begun, L of them with U UAS each.

    Args:
        flown: A batch, or missions on a GPU.
        same_step: Whether a mission that ends begins anew in the same step.

    Attributes:
        shape: (L, U).
    """

    def __init__(self, flown: "CoverageBatch | CudaMissions", same_step: bool) -> None:
        self._flown, self._same_step = flown, same_step
        self._kind = flown.settings.kind
        self.shape = flown.num_envs, flown.n_uas

    @property
    def chooses(self) -> bool:
        """Whether actions are choices."""
        return self._flown.settings.chooses

    @property
    def deciding(self) -> Tensor:
        """(L, U) which UAS decide in the coming step: they fly, in a mission that goes on."""
        flying = tensor_of(self._flown.missions.learners.report)[:, :, STATUS] == FLYING
        return flying if self._same_step else flying & ~self.over[:, None]

    @property
    def over(self) -> Tensor:
        """(L,) which missions the latest step has ended."""
        lanes = self._flown.missions.lanes
        return tensor_of(lanes.terminated) | tensor_of(lanes.truncated)

    @property
    def observation(self) -> Tensor:
        """(L, U, V), which the steps to come overwrite."""
        return tensor_of(self._flown.observation).view(*self.shape, -1)

    @property
    def masks(self) -> Tensor:
        """(L, U, choices) which exist now."""
        candidates = self._flown.missions.learners.candidates
        if isinstance(self._flown, CoverageBatch):
            return torch.from_numpy(self._kind.masks(candidates))
        there = tensor_of(candidates) >= 0
        always = there.new_ones((*self.shape, self._kind.choices - K_WAYPOINTS))
        return torch.cat([there, always], 2)

    @property
    def rewards(self) -> Tensor:
        """(L, U) of the latest step."""
        return tensor_of(self._flown.missions.lanes.rewards)

    @property
    def status(self) -> Tensor:
        """(L, U) after the latest step; of a mission that it has ended, at its end."""
        report = tensor_of(self._flown.missions.learners.report)
        if self._same_step:
            final = tensor_of(self._flown.missions.final.report)
            report = torch.where(self.over[:, None, None], final, report)
        return report[:, :, STATUS]

    def step(self, decided: Tensor, actions: Tensor) -> None:
        """Fly on.

        Args:
            decided: (L, U) which UAS the actions are of; the others have none.
            actions: (N,) choices or (N, numbers), of these one after the other.

        Raises:
            ValueError: One is not finite.
        """
        asked = self._flown.missions.learners.asked
        size = asked.shape[-1]
        given = torch.zeros((*self.shape, size), dtype=actions.dtype, device=actions.device)
        given[decided] = actions.reshape(-1, size)
        if isinstance(self._flown, CoverageBatch):
            self._flown.step(given[..., 0].numpy() if self.chooses else given.numpy())
        else:
            tensor_of(asked).copy_(given)
            self._flown.step()

    def check(self) -> None:
        """See that no action was refused in the latest step, of which a GPU says nothing.

        Raises:
            ValueError: One was.
        """
        if isinstance(self._flown, CoverageBatch):
            return
        if bool(tensor_of(self._flown.refused).any()):
            raise ValueError("an action is not finite")
