import json
import os
import pickle

import numpy as np
import pytest
from uas_coverage_agents.training.checkpoint import (
    Checkpoint,
    TrainingState,
    newest_checkpoint,
    write_checkpoint,
)

from uas_coverage_env.files.strict_toml import InputError


def checkpoint_in(directory, steps: int) -> Checkpoint:
    state = TrainingState(steps=steps, updates=1, process_s=0.5, wall_s=1, done=False, curve=())
    tensors = {
        "weights": np.full((2, 3), steps, np.float32),
        "a single number": np.array(float(steps)),
        "counters": np.arange(steps),
        "flags": np.array([True, False]),
        "generator": np.array([2**32 - 1], np.uint32),
    }
    checkpoint = Checkpoint(state, tensors)
    write_checkpoint(directory, checkpoint)
    return checkpoint


def files(directory) -> list[str]:
    return sorted(path.name for path in directory.iterdir())


def test_what_was_put_aside_is_taken_up_again(tmp_path):
    written = checkpoint_in(tmp_path / "checkpoints", 5)
    read = newest_checkpoint(tmp_path / "checkpoints")
    assert read.state.model_copy(update={"tensors_sha256": ""}) == written.state
    assert set(read.tensors) == set(written.tensors)
    for name, array in written.tensors.items():
        assert np.array_equal(read.tensors[name], array)
        assert read.tensors[name].dtype == array.dtype
        assert read.tensors[name].shape == array.shape


def test_the_last_two_are_kept(tmp_path):
    for steps in range(1, 6):
        (tmp_path / f".{steps:06}.safetensors.77").write_bytes(b"half written when it was killed")
        checkpoint_in(tmp_path, steps)
    assert files(tmp_path) == [
        "000004.json",
        "000004.safetensors",
        "000005.json",
        "000005.safetensors",
    ]
    assert newest_checkpoint(tmp_path).state.steps == 5


def test_where_nothing_was_put_aside_there_is_none(tmp_path):
    assert newest_checkpoint(tmp_path / "nowhere") is None
    (tmp_path / "000001.safetensors").write_bytes(b"torn before its description was written")
    assert newest_checkpoint(tmp_path) is None


@pytest.mark.parametrize("name", ["000002.json", "000002.safetensors"])
@pytest.mark.parametrize("spoilt", ["torn", "empty", "other", "pickle", "deep", "gone"])
def test_a_torn_checkpoint_gives_way_to_the_one_before(tmp_path, name, spoilt):
    checkpoint_in(tmp_path, 1)
    checkpoint_in(tmp_path, 2)
    path = tmp_path / name
    content = {
        "torn": path.read_bytes()[:-3],
        "empty": b"",
        "other": b"[1, 2]",
        "pickle": pickle.dumps(os.getcwd),
        "deep": b"[" * 100_000,
    }
    if spoilt == "gone":
        path.unlink()
    else:
        path.write_bytes(content[spoilt])
    assert newest_checkpoint(tmp_path).state.steps == 1
    checkpoint_in(tmp_path, 3)
    assert newest_checkpoint(tmp_path).state.steps == 3


def test_where_no_checkpoint_is_whole_the_line_says_what_to_do(tmp_path):
    checkpoint_in(tmp_path, 1)
    data = json.loads((tmp_path / "000001.json").read_text())
    (tmp_path / "000001.json").write_text(json.dumps(data | {"steps": "many"}))
    with pytest.raises(InputError, match=r"000001\.json: steps: .*start anew with --overwrite"):
        newest_checkpoint(tmp_path)
