"""Checkpoints: a training as plain tensors, so that it goes on after it was killed.

Two files each, `NUMBER.safetensors` and `NUMBER.json`; the JSON is written last and holds the
checksum of the other. What a kill has torn is not read: the one before takes its place.
"""

import hashlib
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field
from safetensors import SafetensorError
from safetensors import numpy as safetensors

from uas_coverage_env.files.plain_files import read_bytes, write_atomically
from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse

KEPT = 2

Count = Annotated[int, Field(ge=0)]
Seconds = Annotated[float, Field(ge=0.0)]


class CurvePoint(StrictModel):
    """How the policy flew the validation scenarios at one moment of its training; means.

    The return is that of the environments' default reward, whatever is learned from; None where a
    version flew it that did not keep it.
    """

    steps: Count
    process_s: Seconds
    wall_s: Seconds
    coverage: float
    all_home: float
    violations: float
    energy_Wh: float
    flight_steps: float
    episode_return: float | None = None


class TrainingState(StrictModel):
    """How far a training has come.

    Attributes:
        format: "uas-coverage-checkpoint".
        version: Of the format.
        steps: Learned from.
        updates: Counter of the algorithm.
        process_s: Processor time so far, in all sessions [s].
        wall_s: [s].
        done: Whether the training is complete.
        curve: The learning curve so far.
        tensors_sha256: Of the file with the tensors.
    """

    format: Literal["uas-coverage-checkpoint"] = "uas-coverage-checkpoint"
    version: Literal[1] = 1
    steps: Count
    updates: Count
    process_s: Seconds
    wall_s: Seconds
    done: bool
    curve: tuple[CurvePoint, ...]
    tensors_sha256: str = ""


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A training between two updates.

    Attributes:
        state: How far it has come.
        tensors: Model, optimisers, random numbers and environments, see `to_arrays`.
    """

    state: TrainingState
    tensors: dict[str, NDArray[np.generic]]


def write_checkpoint(directory: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint and remove those that are no longer kept."""
    directory.mkdir(parents=True, exist_ok=True)
    for torn in directory.glob(".*"):
        torn.unlink()  # a kill has left it half written
    content = safetensors.save(
        {name: np.array(array, order="C") for name, array in checkpoint.tensors.items()}
    )
    checksum = hashlib.sha256(content).hexdigest()
    state = checkpoint.state.model_copy(update={"tensors_sha256": checksum})
    numbers = _numbers(directory)
    number = (numbers[-1] if numbers else 0) + 1
    write_atomically(directory / f"{number:06}.safetensors", content)
    text = json.dumps(state.model_dump(mode="json"), allow_nan=False)
    write_atomically(directory / f"{number:06}.json", text.encode())
    for old in _numbers(directory)[:-KEPT]:
        # the description goes first: without it the rest is no checkpoint
        (directory / f"{old:06}.json").unlink(missing_ok=True)
        (directory / f"{old:06}.safetensors").unlink(missing_ok=True)


def newest_checkpoint(directory: Path) -> Checkpoint | None:
    """The newest checkpoint that is whole; None where there is none at all.

    Raises:
        InputError: There are checkpoints, but not one of them is whole.
    """
    mistake: InputError | None = None
    for number in reversed(_numbers(directory)):
        try:
            return _read(directory / f"{number:06}.json")
        except InputError as error:
            mistake = error
    if mistake is not None:
        raise InputError(f"{mistake}; nothing to go on from: start anew with --overwrite")
    return None


def _numbers(directory: Path) -> list[int]:
    return sorted(int(path.stem) for path in directory.glob("[0-9]*.json") if path.stem.isdecimal())


def _read(path: Path) -> Checkpoint:
    source = str(path)
    tensors_path = path.with_suffix(".safetensors")
    try:
        data = json.loads(read_bytes(path))
        content = read_bytes(tensors_path)
    except InputError:
        raise
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{source}: cannot be read ({' '.join(str(error).split())})") from None
    if not isinstance(data, dict):
        raise InputError(f"{source}: should be an object, not {type(data).__name__}")
    state = parse(data, TrainingState, source)
    if hashlib.sha256(content).hexdigest() != state.tensors_sha256:
        raise InputError(f"{tensors_path}: is not what {path.name} was written with")
    try:
        return Checkpoint(state, safetensors.load(content))
    except (SafetensorError, KeyError, ValueError, TypeError) as error:
        raise InputError(f"{tensors_path}: is no safetensors file ({error})") from None
