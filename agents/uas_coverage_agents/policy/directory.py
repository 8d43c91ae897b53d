"""A policy on disk: `policy.json` and `policy.safetensors`; nothing in it can be executed."""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors import numpy as safetensors

from uas_coverage_agents.policy.description import PolicyDescription
from uas_coverage_agents.policy.tensors import LARGEST_WEIGHT, Tensors
from uas_coverage_env.files.plain_files import read_bytes, write_atomically
from uas_coverage_env.files.strict_toml import InputError, parse

DESCRIPTION = "policy.json"
WEIGHTS = "policy.safetensors"

_MOST_BYTES = {DESCRIPTION: 2**20, WEIGHTS: 2**26}


@dataclass(frozen=True, eq=False)
class Policy:
    """A trained policy.

    Attributes:
        description: Everything but the weights.
        tensors: The weights, read only; float64 holds those of the file exactly.
    """

    description: PolicyDescription
    tensors: Tensors

    def forward(self, inputs: NDArray[np.floating]) -> NDArray[np.float64]:
        """Run the network: (..., inputs) -> (..., outputs)."""
        return self.description.network.forward(self.tensors, inputs)


def save_policy(
    directory: str | Path,
    description: PolicyDescription,
    tensors: Mapping[str, NDArray[np.floating]],
) -> None:
    """Write a policy; an older one in the directory is replaced.

    Each file is complete or not there at all, whenever the power goes. The description comes last:
    between the two, its checksum tells that the weights are another's.

    Args:
        directory: Made where it does not exist.
        description: Its checksum is filled in.
        tensors: All that the network needs; kept as float32.

    Raises:
        ValueError: The tensors are not those of the network.
        OSError: The directory cannot be written.
    """
    directory = Path(directory)
    arrays = _as_kept(tensors)
    _check_tensors(arrays, description, str(directory / WEIGHTS))
    weights = safetensors.save(arrays)
    checksum = hashlib.sha256(weights).hexdigest()
    description = description.model_copy(update={"weights_sha256": checksum})
    text = json.dumps(description.model_dump(mode="json"), indent=1, allow_nan=False)
    directory.mkdir(parents=True, exist_ok=True)
    write_atomically(directory / WEIGHTS, weights)
    write_atomically(directory / DESCRIPTION, f"{text}\n".encode())


def weights_sha256(tensors: Mapping[str, NDArray[np.floating]]) -> str:
    """The checksum of weights as `save_policy` writes them."""
    return hashlib.sha256(safetensors.save(_as_kept(tensors))).hexdigest()


def _as_kept(tensors: Mapping[str, NDArray[np.floating]]) -> dict[str, NDArray[np.float32]]:
    return {name: np.array(each, np.float32, order="C") for name, each in tensors.items()}


def load_policy(directory: str | Path) -> Policy:
    """Read a policy from an untrusted source: it is checked in full, and nothing in it is executed.

    Args:
        directory: Holds `policy.json` and `policy.safetensors`.

    Raises:
        InputError: Anything is missing or wrong: one line that names file and field.
    """
    directory = Path(directory)
    try:
        found = directory.is_dir()
    except OSError as error:  # a name that is too long, a folder above that is closed to us
        reason = (error.strerror or str(error)).lower()
        raise InputError(f"{directory}: cannot be read ({reason}); check the path") from None
    if not found:
        raise InputError(f"{directory}: no such directory; give one with {DESCRIPTION}")
    source = str(directory / DESCRIPTION)
    description = parse(_object(_bytes(directory, DESCRIPTION), source), PolicyDescription, source)
    weights = _bytes(directory, WEIGHTS)
    source = str(directory / WEIGHTS)
    if hashlib.sha256(weights).hexdigest() != description.weights_sha256:
        raise InputError(
            f"{source}: its SHA-256 is not the weights_sha256 of {DESCRIPTION}; "
            f"the two files belong together: copy both again"
        )
    try:
        arrays = safetensors.load(weights)
    except (SafetensorError, KeyError, ValueError, TypeError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: is no safetensors file ({reason})") from None
    _check_tensors(arrays, description, source)
    tensors = {name: array.astype(np.float64) for name, array in arrays.items()}
    for tensor in tensors.values():
        tensor.flags.writeable = False
    return Policy(description, tensors)


def _bytes(directory: Path, name: str) -> bytes:
    """Read a plain file of the directory that is not larger than a policy can be."""
    path = directory / name
    try:
        if not path.resolve(strict=True).is_relative_to(directory.resolve()):
            raise InputError(f"{path}: is a link out of the directory; put the file itself there")
        return read_bytes(path, _MOST_BYTES[name])
    except InputError:
        raise
    except FileNotFoundError:
        raise InputError(f"{path}: is missing; a policy is {DESCRIPTION} and {WEIGHTS}") from None
    except (OSError, RuntimeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{path}: cannot be read ({reason.lower()}); check its rights") from None


def _object(content: bytes, source: str) -> dict[str, object]:
    try:
        data = json.loads(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"{source}: byte {error.start} is not UTF-8; it should be JSON") from None
    except RecursionError:
        raise InputError(f"{source}: is nested too deeply; it is no policy of ours") from None
    except ValueError as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: is not valid JSON ({reason})") from None
    if not isinstance(data, dict):
        raise InputError(f"{source}: should be an object {{...}}, not {type(data).__name__}")
    return data


def _check_tensors(
    arrays: Mapping[str, NDArray[np.generic]], description: PolicyDescription, source: str
) -> None:
    shapes = description.network.shapes()
    for name in arrays:
        if name not in shapes:
            raise InputError(f"{source}: unknown tensor {name[:80]!r}; the network has none such")
    for name, shape in shapes.items():
        if name not in arrays:
            raise InputError(f"{source}: tensor {name!r} is missing; the network needs {shape}")
        array = arrays[name]
        if array.shape != shape:
            raise InputError(
                f"{source}: tensor {name!r} has shape {array.shape}; the network needs {shape}"
            )
        if array.dtype != np.float32:
            raise InputError(f"{source}: tensor {name!r} is {array.dtype}; it should be float32")
        # NaN is not below any bound
        if not (np.abs(array) <= LARGEST_WEIGHT).all():
            raise InputError(
                f"{source}: tensor {name!r} holds numbers that are not finite or beyond "
                f"±{LARGEST_WEIGHT:g}"
            )
