"""A training between two rounds: one file of plain arrays, with a JSON text about them.

It is written as a whole or not at all, so that a kill leaves the one before.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import JsonValue
from safetensors import SafetensorError
from safetensors import numpy as safetensors

from uas_coverage_agents.training.curve import CurvePoint
from uas_coverage_agents.training.settings import Count
from uas_coverage_env.files.plain_files import read_bytes, write_atomically
from uas_coverage_env.files.strict_toml import InputError, StrictModel, parse
from uas_coverage_env.runner.store import difference

CHECKPOINT = "checkpoint.safetensors"

_ABOUT = "training"
_LENGTH = 8  # bytes that say how long the header of a safetensors file is


class TrainingState(StrictModel):
    """How far a training has come.

    Attributes:
        format: "uas-coverage-checkpoint".
        version: Of the format.
        order: What was asked for, as plain data.
        rounds: Done.
        process_s: Processor time of the rounds [s].
        wall_s: [s].
        curve: The learning curve so far.
    """

    format: Literal["uas-coverage-checkpoint"] = "uas-coverage-checkpoint"
    version: Literal[2] = 2
    order: dict[str, JsonValue]
    rounds: Count
    process_s: float
    wall_s: float
    curve: tuple[CurvePoint, ...]


@dataclass(frozen=True, eq=False)
class Checkpoint:
    """A training between two rounds.

    Attributes:
        state: How far it has come.
        arrays: What was learned.
    """

    state: TrainingState
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)

    def write(self, directory: Path) -> None:
        """Take the place of the one before."""
        directory.mkdir(parents=True, exist_ok=True)
        about = json.dumps(self.state.model_dump(mode="json"), allow_nan=False)
        arrays = {name: np.array(array, order="C") for name, array in self.arrays.items()}
        write_atomically(directory / CHECKPOINT, safetensors.save(arrays, {_ABOUT: about}))


def checkpoint_in(directory: Path, order: Mapping[str, Any]) -> Checkpoint | None:
    """The checkpoint of a directory; None: there is none.

    Args:
        directory: Of the training.
        order: What is asked for, as plain data.

    Raises:
        InputError: It cannot be read, or is that of another training.
    """
    path = directory / CHECKPOINT
    if not path.exists():
        return None
    try:
        content = read_bytes(path)
        size = int.from_bytes(content[:_LENGTH], "little")
        about = json.loads(content[_LENGTH : _LENGTH + size])["__metadata__"][_ABOUT]
        data = json.loads(about)
        arrays = safetensors.load(content)
    except InputError:
        raise
    except (OSError, SafetensorError, KeyError, ValueError, TypeError, RecursionError) as error:
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"{path}: cannot be read ({reason}); begin anew with --overwrite"
        ) from None
    if not isinstance(data, dict):
        raise InputError(f"{path}: should tell an object; begin anew with --overwrite")
    state = parse(data, TrainingState, str(path))
    if apart := difference(state.order, json.loads(json.dumps(order))):
        raise InputError(f"{directory}: holds another training: {apart}; give another --out")
    return Checkpoint(state, arrays)
