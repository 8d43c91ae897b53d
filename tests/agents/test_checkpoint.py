"""A checkpoint is whole or it is the one before, holds nothing that runs, and is no other's."""

import json
import os
import pickle

import numpy as np
import pytest
from uas_coverage_agents.training.checkpoint import (
    CHECKPOINT,
    Checkpoint,
    TrainingState,
    checkpoint_in,
)

from uas_coverage_env.files import plain_files
from uas_coverage_env.files.strict_toml import InputError

ORDER = {"settings": {"algorithm": "ppo", "rounds": 4}, "seed": 3}


def written(directory, rounds: int = 1) -> Checkpoint:
    state = TrainingState(order=ORDER, rounds=rounds, process_s=0.5, wall_s=1.0, curve=())
    arrays = {
        "weights": np.full((2, 3), rounds, np.float32),
        "a single number": np.array(float(rounds)),
        "turned": np.arange(6).reshape(2, 3).T,
        "flags": np.array([True, False]),
    }
    checkpoint = Checkpoint(state, arrays)
    checkpoint.write(directory)
    return checkpoint


def test_what_was_put_aside_is_taken_up_again(tmp_path):
    wrote = written(tmp_path / "run")
    read = checkpoint_in(tmp_path / "run", ORDER)
    assert read.state == wrote.state
    assert set(read.arrays) == set(wrote.arrays)
    for name, array in wrote.arrays.items():
        assert np.array_equal(read.arrays[name], array)
        assert read.arrays[name].dtype == array.dtype
        assert read.arrays[name].shape == array.shape


def test_where_nothing_was_put_aside_there_is_none(tmp_path):
    assert checkpoint_in(tmp_path / "nowhere", ORDER) is None


def test_a_kill_while_it_is_written_leaves_the_one_before(tmp_path, monkeypatch):
    written(tmp_path, 1)

    def torn(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(plain_files.os, "replace", torn)
    with pytest.raises(KeyboardInterrupt):
        written(tmp_path, 2)
    assert checkpoint_in(tmp_path, ORDER).state.rounds == 1


@pytest.mark.parametrize("spoilt", ["torn", "empty", "other", "pickle", "deep", "no object"])
def test_a_damaged_one_is_refused_in_a_line_that_says_what_to_do(tmp_path, spoilt):
    written(tmp_path)
    path = tmp_path / CHECKPOINT
    whole = path.read_bytes()
    about = json.dumps({"__metadata__": {"training": "[" * 99_999}}).encode()
    path.write_bytes(
        {
            "torn": whole[:-3],
            "empty": b"",
            "other": b"[1, 2]",
            "pickle": pickle.dumps(os.getcwd),
            "deep": len(about).to_bytes(8, "little") + about,
            "no object": whole.replace(b'"training":"{', b'"training":"[', 1),
        }[spoilt]
    )
    with pytest.raises(InputError, match="begin anew with --overwrite") as caught:
        checkpoint_in(tmp_path, ORDER)
    assert "\n" not in str(caught.value)


def test_that_of_another_training_is_refused_with_what_differs(tmp_path):
    written(tmp_path)
    other = {**ORDER, "settings": {"algorithm": "ppo", "rounds": 5}}
    with pytest.raises(InputError, match="settings: rounds is 4 there, 5 asked for"):
        checkpoint_in(tmp_path, other)
