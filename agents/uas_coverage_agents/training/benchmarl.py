"""The environment as a task of BenchMARL: `Experiment(task=CoverageTask(scenario="village"), …)`.

BenchMARL is no dependency of this package: `pip install benchmarl` beside it.
"""

from collections.abc import Callable
from typing import Any

from benchmarl.environments.pettingzoo.common import (
    PettingZooClass,
)
from torchrl.envs import EnvBase, PettingZooWrapper

from uas_coverage_env.env import CoverageParallelEnv
from uas_coverage_env.env.versions import V0


class CoverageTask(PettingZooClass):
    """A mission for any algorithm of BenchMARL: one group `uas`, of which members may end early.

    Algorithms for continuous actions fly velocities, those for discrete ones choose waypoints under
    masks; where an algorithm can do both, `prefer_continuous_actions` of its experiment decides.
    The state is `state()` of the environment. All missions must have fleets of one size.

    Args:
        **config: The arguments of `CoverageParallelEnv`; with `action` that action alone is flown.
    """

    def __init__(self, **config: Any) -> None:
        super().__init__(name="COVERAGE", config=config)

    def get_env_fun(
        self, num_envs: int, continuous_actions: bool, seed: int | None, device: Any
    ) -> Callable[[], EnvBase]:
        """What makes an environment of TorchRL."""
        usual = {"action": "velocity" if continuous_actions else "waypoint", "flat_infos": True}
        config: dict[str, Any] = {**usual, **self.config}
        masked = V0.kind_of(config["action"]).choices > 0

        def make() -> EnvBase:
            return PettingZooWrapper(
                CoverageParallelEnv(**config, mask_in_observation=masked),
                return_state=True,
                use_mask=True,
                done_on_any=False,
                seed=seed,
                device=device,
            )

        return make

    def supports_continuous_actions(self) -> bool:
        """Whether the action asked for is made of numbers, or none is asked for."""
        return "action" not in self.config or not V0.kind_of(self.config["action"]).choices

    def supports_discrete_actions(self) -> bool:
        """Whether the action asked for is a choice, or none is asked for."""
        return "action" not in self.config or V0.kind_of(self.config["action"]).choices > 0

    def has_state(self) -> bool:
        """There is one, for central critics."""
        return True

    def max_steps(self, env: EnvBase) -> int:
        """The time limit of a mission."""
        return env.max_cycles

    @staticmethod
    def env_name() -> str:
        """The name under which results are filed."""
        return "uas_coverage"
