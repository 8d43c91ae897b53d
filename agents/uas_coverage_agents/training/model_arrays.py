"""A training as plain arrays and back: model, optimisers, random numbers and lanes.

Stable-Baselines3 saves models by pickle; here only tensors and numbers are kept, so that reading a
checkpoint can execute nothing.
"""

from collections.abc import Iterator
from typing import Any, cast

import numpy as np
import torch
from numpy.typing import NDArray
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm
from stable_baselines3.common.vec_env import VecEnv

from uas_coverage_agents.training.learner import StatefulVecEnv
from uas_coverage_env.env.batch.state_dict import check_values
from uas_coverage_env.files.strict_toml import InputError

Arrays = dict[str, NDArray[np.generic]]

_KEYS = 624  # of NumPy's global generator
_REMEMBERED = ("observations", "next_observations", "actions", "rewards", "dones", "timeouts")


def to_arrays(model: BaseAlgorithm, lanes: VecEnv) -> Arrays:
    """Everything that decides how the training goes on, in arrays of its own.

    To be called between two updates: what a rollout has collected so far is not kept.
    """
    arrays = learned(model)
    # Stable-Baselines3 draws from the global generators
    numbers = np.random.get_state(legacy=False)  # noqa: NPY002
    arrays["random/torch"] = torch.get_rng_state().numpy().copy()
    arrays["random/numpy"] = np.array(numbers["state"]["key"])
    arrays["random/numpy.place"] = np.array([numbers["state"]["pos"], numbers["has_gauss"]])
    arrays["random/numpy.gauss"] = np.array([numbers["gauss"]])
    arrays["last/observation"] = np.array(model._last_obs)
    arrays["last/episode_starts"] = np.array(model._last_episode_starts)
    for name, array in cast(StatefulVecEnv, lanes).state_dict().items():
        arrays[f"lanes/{name}"] = np.array(array)
    return arrays


def learned(model: BaseAlgorithm) -> Arrays:
    """What a model has learned so far: weights, optimisers, counters, and what it remembers."""
    arrays = {name: tensor.detach().cpu().numpy().copy() for name, tensor in _tensors(model)}
    arrays["last/counters"] = np.array([model.num_timesteps, model._n_updates, model._episode_num])
    if isinstance(model, OffPolicyAlgorithm):
        buffer = cast(Any, model.replay_buffer)
        filled = buffer.buffer_size if buffer.full else buffer.pos
        arrays["memory/place"] = np.array([buffer.pos, buffer.full])
        for name in _REMEMBERED:
            arrays[f"memory/{name}"] = getattr(buffer, name)[:filled].copy()
    return arrays


def from_arrays(arrays: Arrays, model: BaseAlgorithm, lanes: VecEnv) -> None:
    """Put a freshly made model and its lanes where they were when `to_arrays` was called.

    Raises:
        InputError: The arrays are those of another model.
    """
    try:
        _from_arrays(arrays, model, lanes)
    except (KeyError, ValueError, IndexError, RuntimeError, TypeError, OverflowError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"the checkpoint does not fit this version ({reason}); start anew with --overwrite"
        ) from error


def take_over(arrays: Arrays, model: BaseAlgorithm) -> None:
    """Give a freshly made model what another one of its kind has learned.

    Raises:
        InputError: The arrays are those of another model.
    """
    try:
        _check(arrays, model, None)
        _take_over(arrays, model)
    except (KeyError, ValueError, IndexError, RuntimeError, TypeError, OverflowError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"the weights do not fit this learner ({reason})") from error


def _check(arrays: Arrays, model: BaseAlgorithm, lanes: VecEnv | None) -> None:
    """Refuse what no later check finds: NumPy reads its keys at whatever position is stored."""
    expected: dict[str, tuple[tuple[int, ...], str]] = {"last/counters": ((3,), "i")}
    limits: dict[str, Any] = {"last/counters": (0, np.inf)}
    if lanes is not None:
        seen = (lanes.num_envs, *cast(tuple[int, ...], model.observation_space.shape))
        expected |= {
            "last/observation": (seen, "f"),
            "last/episode_starts": ((lanes.num_envs,), "b"),
            "random/numpy": ((_KEYS,), "u"),
            "random/numpy.place": ((2,), "i"),
        }
        limits["random/numpy.place"] = (0, [_KEYS, 1])
    if isinstance(model, OffPolicyAlgorithm):
        buffer = cast(Any, model.replay_buffer)
        expected["memory/place"] = ((2,), "i")
        limits["memory/place"] = (0, [buffer.buffer_size - 1, 1])
    for name, (shape, kind) in expected.items():
        if arrays[name].shape != shape or arrays[name].dtype.kind != kind:
            raise ValueError(f"{name} has shape {arrays[name].shape} and {arrays[name].dtype}")
    ours = ("last/", "random/", "memory/")
    check_values({k: array for k, array in arrays.items() if k.startswith(ours)}, limits)


def _from_arrays(arrays: Arrays, model: BaseAlgorithm, lanes: VecEnv) -> None:
    _check(arrays, model, lanes)
    _take_over(arrays, model)
    torch.set_rng_state(torch.from_numpy(arrays["random/torch"].copy()))
    pos, has_gauss = arrays["random/numpy.place"].tolist()
    np.random.set_state(  # noqa: NPY002
        {
            "bit_generator": "MT19937",
            "state": {"key": arrays["random/numpy"], "pos": pos},
            "has_gauss": has_gauss,
            "gauss": arrays["random/numpy.gauss"].item(),
        }
    )
    model._last_obs = arrays["last/observation"].copy()
    model._last_episode_starts = arrays["last/episode_starts"].copy()
    own = "lanes/"
    state = {name.removeprefix(own): a for name, a in arrays.items() if name.startswith(own)}
    cast(StatefulVecEnv, lanes).load_state_dict(state)
    if isinstance(model, OffPolicyAlgorithm):
        model._last_original_obs = model._last_obs


def _take_over(arrays: Arrays, model: BaseAlgorithm) -> None:
    with torch.no_grad():
        _make_optimiser_state(arrays, model)
        for name, tensor in _tensors(model):
            array = arrays[name]
            if array.shape != tuple(tensor.shape):
                raise ValueError(f"{name} has shape {array.shape}, not {tuple(tensor.shape)}")
            if not np.isfinite(array).all():
                raise ValueError(f"{name} holds a number that is not finite")
            tensor.copy_(torch.from_numpy(array.copy()))
    steps, updates, episodes = arrays["last/counters"].tolist()
    model.num_timesteps, model._n_updates, model._episode_num = steps, updates, episodes
    if isinstance(model, OffPolicyAlgorithm):
        buffer = cast(Any, model.replay_buffer)
        pos, full = arrays["memory/place"].tolist()
        buffer.pos, buffer.full = pos, bool(full)
        for name in _REMEMBERED:
            remembered = arrays[f"memory/{name}"]
            filled = getattr(buffer, name)[: buffer.buffer_size if full else pos]
            if remembered.shape != filled.shape:
                raise ValueError(f"memory/{name} has shape {remembered.shape}, not {filled.shape}")
            filled[:] = remembered


def _optimisers(model: BaseAlgorithm) -> Iterator[tuple[str, torch.optim.Optimizer]]:
    for owner in ("policy", "actor", "critic"):
        optimiser = getattr(getattr(model, owner, None), "optimizer", None)
        if isinstance(optimiser, torch.optim.Optimizer):
            yield owner, optimiser
    optimiser = getattr(model, "ent_coef_optimizer", None)
    if isinstance(optimiser, torch.optim.Optimizer):
        yield "entropy", optimiser


def _tensors(model: BaseAlgorithm) -> Iterator[tuple[str, torch.Tensor]]:
    """All tensors that training changes, by name, the same in every process."""
    for name, tensor in model.policy.state_dict(keep_vars=True).items():
        yield f"policy/{name}", tensor
    log_entropy = getattr(model, "log_ent_coef", None)
    if isinstance(log_entropy, torch.Tensor):
        yield "entropy/log", log_entropy
    for owner, optimiser in _optimisers(model):
        parameters = [p for group in optimiser.param_groups for p in group["params"]]
        for number, parameter in enumerate(parameters):
            for name, value in sorted(optimiser.state.get(parameter, {}).items()):
                yield f"optimiser/{owner}/{number}/{name}", value


def _make_optimiser_state(arrays: Arrays, model: BaseAlgorithm) -> None:
    """Give each optimiser room for what it remembered; a new one remembers nothing."""
    for owner, optimiser in _optimisers(model):
        parameters = [p for group in optimiser.param_groups for p in group["params"]]
        for number, parameter in enumerate(parameters):
            start = f"optimiser/{owner}/{number}/"
            remembered = {
                name[len(start) :]: torch.from_numpy(array.copy())
                for name, array in arrays.items()
                if name.startswith(start)
            }
            for name, value in remembered.items():
                if value.shape not in ((), parameter.shape):
                    raise ValueError(f"{start}{name} has shape {tuple(value.shape)}")
            optimiser.state[parameter] = remembered
