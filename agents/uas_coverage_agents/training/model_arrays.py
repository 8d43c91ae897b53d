"""What a model has learned as plain arrays, and back.

Stable-Baselines3 saves models by pickle; here only arrays are kept, so that reading a checkpoint
can execute nothing. What belongs to a model its class says itself (`_get_torch_save_params`), and
of a replay buffer all arrays are kept. A class of another kind has `state_dict` and
`load_state_dict`; one of the library that has them as well keeps both.
"""

from collections.abc import Iterator, Mapping
from operator import attrgetter
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from uas_coverage_env.env.batch.state_dict import check_values
from uas_coverage_env.files.strict_toml import InputError

Arrays = dict[str, NDArray[Any]]

_COUNTERS, _OWN, _MEMORY = "counters", "own/", "memory/"
_MISTAKES = (KeyError, ValueError, IndexError, RuntimeError, TypeError, OverflowError)


def learned(model: Any) -> Arrays:
    """Weights, optimisers, counters, and what a model remembers; copies."""
    arrays: Arrays = {}
    if hasattr(model, "_get_torch_save_params"):
        arrays |= {name: tensor.detach().cpu().numpy().copy() for name, tensor in _tensors(model)}
        arrays[_COUNTERS] = np.array([model.num_timesteps, model._n_updates, model._episode_num])
    else:
        arrays[_COUNTERS] = np.array([model.num_timesteps, 0, 0])
    buffer = getattr(model, "replay_buffer", None)
    if buffer is not None:
        filled = buffer.buffer_size if buffer.full else buffer.pos
        arrays[f"{_MEMORY}place"] = np.array([buffer.pos, buffer.full])
        for name, array in _remembered(buffer):
            arrays[_MEMORY + name] = array[:filled].copy()
    if hasattr(model, "state_dict"):
        arrays |= {_OWN + name: np.array(array) for name, array in model.state_dict().items()}
    return arrays


def take_over(arrays: Mapping[str, NDArray[Any]], model: Any) -> None:
    """Give a freshly made model what another one of its kind has learned.

    Raises:
        InputError: The arrays are those of another model.
    """
    try:
        _take_over(arrays, model)
    except _MISTAKES as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"the checkpoint does not fit this learner ({reason}); begin anew with --overwrite"
        ) from error


def _take_over(arrays: Mapping[str, NDArray[Any]], model: Any) -> None:
    buffer = getattr(model, "replay_buffer", None)
    limits: dict[str, Any] = {_COUNTERS: (0, np.inf)}
    if buffer is not None:
        limits[f"{_MEMORY}place"] = (0, [buffer.buffer_size - 1, 1])
    for name, size in ((_COUNTERS, 3), (f"{_MEMORY}place", 2)):
        if name in limits and (arrays[name].shape != (size,) or arrays[name].dtype.kind != "i"):
            raise ValueError(f"{name} has shape {arrays[name].shape} and {arrays[name].dtype}")
    check_values(dict(arrays), limits)  # finite, too
    if hasattr(model, "_get_torch_save_params"):
        with torch.no_grad():
            _make_optimiser_state(arrays, model)
            for name, tensor in _tensors(model):
                if arrays[name].shape != tuple(tensor.shape):
                    shape = tuple(tensor.shape)
                    raise ValueError(f"{name} has shape {arrays[name].shape}, not {shape}")
                tensor.copy_(torch.from_numpy(arrays[name].copy()))
        model._n_updates, model._episode_num = arrays[_COUNTERS][1:].tolist()
    model.num_timesteps = int(arrays[_COUNTERS][0])
    if buffer is not None:
        pos, full = arrays[f"{_MEMORY}place"].tolist()
        buffer.pos, buffer.full = pos, bool(full)
        for name, array in _remembered(buffer):
            filled, kept = array[: buffer.buffer_size if full else pos], arrays[_MEMORY + name]
            if kept.shape != filled.shape:
                raise ValueError(f"memory/{name} has shape {kept.shape}, not {filled.shape}")
            filled[:] = kept
    if hasattr(model, "load_state_dict"):
        own = {k.removeprefix(_OWN): v.copy() for k, v in arrays.items() if k.startswith(_OWN)}
        model.load_state_dict(own)


def _remembered(buffer: Any) -> Iterator[tuple[str, NDArray[Any]]]:
    """The arrays of a replay buffer that have a row for each step, those in dictionaries too."""
    for name, value in sorted(vars(buffer).items()):
        parts = value.items() if isinstance(value, dict) else [("", value)]
        for part, array in parts:
            if isinstance(array, np.ndarray) and array.shape[:1] == (buffer.buffer_size,):
                yield f"{name}.{part}" if part else name, array


def _parts(model: Any) -> Iterator[tuple[str, Any]]:
    """What a model says it consists of: name -> network, optimiser or tensor."""
    with_state, tensors = model._get_torch_save_params()
    for name in (*with_state, *tensors):
        yield name, attrgetter(name)(model)


def _tensors(model: Any) -> Iterator[tuple[str, torch.Tensor]]:
    """All tensors that training changes, by name, the same in every process."""
    for owner, part in _parts(model):
        if isinstance(part, torch.optim.Optimizer):
            for number, parameter in enumerate(_parameters(part)):
                for name, value in sorted(part.state.get(parameter, {}).items()):
                    if isinstance(value, torch.Tensor):
                        yield f"{owner}/{number}/{name}", value
        elif isinstance(part, torch.Tensor):
            yield owner, part
        else:
            for name, tensor in part.state_dict(keep_vars=True).items():
                yield f"{owner}/{name}", tensor


def _parameters(optimiser: torch.optim.Optimizer) -> list[torch.Tensor]:
    return [parameter for group in optimiser.param_groups for parameter in group["params"]]


def _make_optimiser_state(arrays: Mapping[str, NDArray[Any]], model: Any) -> None:
    """Give each optimiser room for what it remembered; a new one remembers nothing."""
    for owner, part in _parts(model):
        if not isinstance(part, torch.optim.Optimizer):
            continue
        for number, parameter in enumerate(_parameters(part)):
            start = f"{owner}/{number}/"
            remembered = {
                name.removeprefix(start): torch.from_numpy(array.copy())
                for name, array in arrays.items()
                if name.startswith(start)
            }
            for name, value in remembered.items():
                if value.shape not in ((), parameter.shape):
                    raise ValueError(f"{start}{name} has shape {tuple(value.shape)}")
            if remembered:
                part.state[parameter] = remembered
