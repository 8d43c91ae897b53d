"""The short way to many missions at once, on the processor or on a GPU."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Unpack, overload

from gymnasium.vector import AutoresetMode

from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.env.episode.settings import MissionKeywords, takes_settings
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.scenario.source import ScenarioLike

if TYPE_CHECKING:
    from uas_coverage_env.env.gpu.missions import CudaMissions


@overload
def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
    *,
    device: Literal["cuda"],
    **settings: Unpack[MissionKeywords],
) -> "CudaMissions": ...


@overload
def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
    *,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    threads: int = 1,
    copy: bool = True,
    render_mode: str | None = None,
    device: Literal["cpu"] = "cpu",
    **settings: Unpack[MissionKeywords],
) -> CoverageVectorEnv: ...


@takes_settings
def vector_env(
    num_envs: int = 1,
    scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
    *,
    autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
    threads: int = 1,
    copy: bool = True,
    render_mode: str | None = None,
    device: Literal["cpu", "cuda"] = "cpu",
    **settings: Unpack[MissionKeywords],
) -> "CoverageVectorEnv | CudaMissions":
    """Many missions at once; what `gymnasium.make_vec` makes of the id of the version.

    Args:
        num_envs: How many.
        scenario: See `CoverageVectorEnv`; likewise the others.
        autoreset_mode: An `AutoresetMode`, or its value.
        threads: How many of numba's threads share the missions.
        copy: Whether observations are arrays of their own.
        render_mode: None, "rgb_array", "rgb_array_tiled" or "human".
        device: "cpu"; or "cuda": on a GPU (extra `gpu`), see `CudaMissions`, whose arrays stay
            there and are always overwritten.
        action: "velocity", "acceleration", "wrench" or "waypoint"; or an `ActionKind`.
        dynamics: "lpv", or "nonlinear": six degrees of freedom, powertrain, exact power.
        return_mode: The world flies a UAS home in time, whatever its actions.
        safety_filter: The world replaces commands after which a UAS could not brake in time.
        reward_weights: Mapping from reward term to weight; the other terms keep theirs.
        max_cycles: Time limit of the mission [steps]; None: the scenario's `max_steps`.
        observation: Blocks that the observation is made of, see `ObservationBlock`; the name of an
            observation (`default`, `local`, `grid`); None: those of the version.
        reward: Terms that the reward is made of, see `RewardTerm`; None: those of the version.
        disturbances: Blocks that act on the world, see `Disturbance`; None: those of the scenario;
            (): none.
        mask_in_observation: With discrete actions (`waypoint`), an observation is a dictionary of
            `observation` and `action_mask`, and the infos have no mask. For libraries that do not
            read infos.
        images_apart: An observation with pictures (`grid`) is a dictionary of `observation` and a
            uint8 `Box` (channels, rows, columns; 255 for 1) for each of them; a picture alone is
            that `Box`.
        flat_infos: Infos have `reward_terms_home` and so on instead of sub-dictionaries. For
            libraries that make an array of every info (TorchRL). None: as in the version.

    Raises:
        ValueError: An argument is none of what is allowed; says what is.
        ImportError: "cuda", and numba-cuda is not installed.
        RuntimeError: "cuda", and there is no GPU.
    """
    given: dict[str, Any] = {
        "autoreset_mode": autoreset_mode, "threads": threads, "render_mode": render_mode,
        "copy": copy, **settings,
    }  # fmt: skip
    return many_of(CoverageVectorEnv, num_envs, scenario, device=device, **given)


def many_of(
    kind: type[CoverageVectorEnv],
    num_envs: int = 1,
    scenario: ScenarioLike | Sequence[str | Path | Scenario] = "village",
    *,
    device: str = "cpu",
    **given: Any,
) -> "CoverageVectorEnv | CudaMissions":
    """Many missions at once, of the version of a class; see `vector_env`."""
    if device == "cuda":
        from uas_coverage_env.env.gpu.missions import CudaMissions

        there = {name: value for name, value in given.items() if name != "copy"}
        return CudaMissions(num_envs, scenario, version=kind.version, **there)
    if device != "cpu":
        raise ValueError(f"device is {device!r}; it is one of cpu, cuda")
    return kind(num_envs, scenario, **given)
