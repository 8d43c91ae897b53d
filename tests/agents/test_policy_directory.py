import hashlib
import json
import os
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from safetensors.numpy import load, save
from tiny_policies import describe, weights, write
from uas_coverage_agents.policy import load_policy, save_policy
from uas_coverage_agents.route.planner import SHIPPED as LEARNED_ROUTE
from uas_coverage_agents.velocity.planner import SHIPPED as LEARNED_VELOCITY

from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.files.strict_toml import InputError


@pytest.fixture
def directory(tmp_path):
    write(tmp_path / "policy")
    return tmp_path / "policy"


def refusal(directory) -> str:
    """The one line that answers a directory that is no policy."""
    with pytest.raises(InputError) as error:
        load_policy(directory)
    line = str(error.value)
    assert "\n" not in line
    assert len(line) < 600
    return line


def change(directory, **fields) -> None:
    """Write other values into the description."""
    path = directory / "policy.json"
    path.write_text(json.dumps(json.loads(path.read_text()) | fields))


def change_weights(directory, tensors) -> None:
    """Write other weights, with the checksum that belongs to them."""
    content = tensors if isinstance(tensors, bytes) else save(tensors)
    (directory / "policy.safetensors").write_bytes(content)
    change(directory, weights_sha256=hashlib.sha256(content).hexdigest())


def test_what_was_saved_is_loaded_again(directory):
    policy = load_policy(directory)
    expected = describe()
    assert policy.description.model_copy(update={"weights_sha256": ""}) == expected
    for name, tensor in weights(expected).items():
        assert np.array_equal(policy.tensors[name], tensor)
        assert not policy.tensors[name].flags.writeable


@pytest.mark.parametrize("shipped", [LEARNED_ROUTE, LEARNED_VELOCITY], ids=lambda p: p.name)
def test_a_shipped_policy_is_whole_and_what_it_was_trained_by_is_told(shipped):
    described = load_policy(shipped).description
    assert described.interface in ("route", "route-velocity")
    assert described.training.settings


def test_the_network_computes_layer_after_layer(directory):
    policy = load_policy(directory)
    t = policy.tensors
    x = np.random.default_rng(1).normal(size=(5, policy.description.network.inputs))
    hidden = np.tanh(x @ t["layers.0.weight"].T + t["layers.0.bias"])
    expected = hidden @ t["layers.1.weight"].T + t["layers.1.bias"]
    assert np.allclose(policy.forward(x), expected, rtol=1e-12)


def test_the_largest_network_with_the_largest_weights_stays_finite():
    network = describe().network.model_copy(update={"hidden": (64,) * 8, "activation": "relu"})
    tensors = {name: np.full(shape, 1e6) for name, shape in network.shapes().items()}
    # as wide as allowed, every layer could add a factor of 4096 / 64 to this
    outputs = network.forward(tensors, np.full(network.inputs, 2.0))
    assert np.isfinite(outputs * 64.0**9).all()


def test_saving_again_replaces_the_policy_and_leaves_nothing_else(directory):
    before = load_policy(directory)
    write(directory, seed=7)
    assert sorted(path.name for path in directory.iterdir()) == [
        "policy.json",
        "policy.safetensors",
    ]
    after = load_policy(directory)
    assert after.description.weights_sha256 != before.description.weights_sha256


def test_weights_that_do_not_fit_the_network_are_not_saved(tmp_path):
    description = describe()
    tensors = weights(description)
    del tensors["layers.1.bias"]
    with pytest.raises(ValueError, match=r"'layers\.1\.bias' is missing"):
        save_policy(tmp_path / "policy", description, tensors)
    assert not (tmp_path / "policy").exists()


def test_a_file_that_cannot_be_written_in_full_leaves_the_old_one(tmp_path, monkeypatch):
    path = tmp_path / "file"
    write_atomically(path, b"old")

    def fail(_):
        raise OSError("disk full")

    monkeypatch.setattr(os, "fsync", fail)
    with pytest.raises(OSError, match="disk full"):
        write_atomically(path, b"new")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"format": "pickle"}, ["format", "uas-coverage-policy"]),
        ({"version": 2}, ["version", "1"]),
        ({"version": "1"}, ["version"]),
        ({"version": True}, ["version"]),
        ({"interface": "rudder"}, ["interface", "route-velocity"]),
        ({"interface": None}, ["interface"]),
        ({"network": {"kind": "exec"}}, ["network"]),
        ({"network": []}, ["network"]),
        ({"payload": "!!python/object"}, ["payload", "unknown key"]),
        ({"observation": {}}, ["observation.layout", "is missing"]),
        ({"scenarios": {"name": ""}}, ["scenarios.name"]),
        ({"versions": {"numpy": 2}}, ["versions.numpy"]),
        ({"weights_sha256": "../../etc"}, ["weights_sha256"]),
        ({"weights_sha256": ""}, ["SHA-256", "weights_sha256"]),
        ({"weights_sha256": "0" * 64}, ["SHA-256", "weights_sha256"]),
        ({"weights_sha256": 10**4000}, ["weights_sha256"]),
        ({"training": {"seed": 1e999}}, ["training.seed", "finite"]),
        ({"score": "\ud800"}, ["policy.json"]),
    ],
)
def test_a_wrong_field_is_named(directory, fields, words):
    change(directory, **fields)
    line = refusal(directory)
    assert "policy.json" in line
    assert all(word in line for word in words), line


def test_a_network_of_another_size_than_the_observation_is_refused(directory):
    data = json.loads((directory / "policy.json").read_text())
    change(directory, network=data["network"] | {"inputs": 7})
    assert "network.inputs is 7" in refusal(directory)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "not valid JSON"),
        (b"{", "not valid JSON"),
        (b"[1, 2]", "should be an object"),
        (b'"text"', "should be an object"),
        (b"\xff\xfe", "not UTF-8"),
        (b"[" * 100_000, "nested too deeply"),
        (b'{"a":' * 100_000, "nested too deeply"),
        (b'{"format":' + b"[" * 500 + b"]" * 500 + b"}", "format"),
        (b'{"version": ' + b"9" * 5000 + b"}", "not valid JSON"),
        (b" " * (2**20 + 1), "larger than"),
        (pickle.dumps({"format": "uas-coverage-policy"}), "not UTF-8"),
    ],
)
def test_a_description_that_is_no_object_is_refused(directory, content, words):
    (directory / "policy.json").write_bytes(content)
    assert words in refusal(directory)


def test_weights_are_checked_name_by_name(directory):
    good = load((directory / "policy.safetensors").read_bytes())
    name = "layers.0.bias"
    spoilt = good[name].copy()
    spoilt[3] = np.nan
    endless = good[name].copy()
    endless[0] = -np.inf
    mistakes = {
        "is missing": {k: v for k, v in good.items() if k != name},
        "unknown tensor 'more'": good | {"more": good[name]},
        "has shape (7,)": good | {name: good[name][:7].copy()},
        "is float64": good | {name: good[name].astype(np.float64)},
        "is int32": good | {name: good[name].astype(np.int32)},
        "not finite": good | {name: spoilt},
        "are not finite or beyond": good | {name: endless},
        "or beyond ±1e+06": good | {name: good[name] + np.float32(2e6)},
    }
    for words, tensors in mistakes.items():
        change_weights(directory, tensors)
        line = refusal(directory)
        assert "policy.safetensors" in line
        assert words in line


class Payload:
    """Pickled, it runs code when it is read."""

    def __reduce__(self):
        return os.system, (f"{sys.executable} -c \"open('ran', 'w')\"",)


def test_weights_that_are_a_pickle_run_nothing(directory, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bomb = pickle.dumps(Payload())
    change_weights(directory, bomb)
    assert "no safetensors file" in refusal(directory)
    (directory / "policy.json").write_bytes(bomb)
    refusal(directory)
    assert not Path("ran").exists()
    pickle.loads(bomb)
    assert Path("ran").exists(), "the payload works: it has only not been executed before"


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\x00" * 7,
        b"\xff" * 64,
        (2**63).to_bytes(8, "little") + b"{}",
        (2).to_bytes(8, "little") + b"[]",
        (200_000).to_bytes(8, "little") + b'{"a":' * 40_000,
        b"PK\x03\x04" + b"\x00" * 60,
    ],
)
def test_weights_that_are_no_safetensors_are_refused(directory, content):
    change_weights(directory, content)
    assert "no safetensors file" in refusal(directory)


def test_a_header_that_promises_more_than_there_is_is_refused(directory):
    header = json.dumps(
        {"layers.0.bias": {"dtype": "F32", "shape": [2**40], "data_offsets": [0, 2**42]}}
    ).encode()
    change_weights(directory, len(header).to_bytes(8, "little") + header)
    assert "no safetensors file" in refusal(directory)


def test_missing_parts_are_named(directory, tmp_path):
    assert "no such directory" in refusal(tmp_path / "nowhere")
    assert "no such directory" in refusal(directory / "policy.json")
    assert "too long" in refusal(tmp_path / ("n" * 300))
    (directory / "policy.safetensors").unlink()
    assert "policy.safetensors: is missing" in refusal(directory)
    (directory / "policy.json").unlink()
    assert "policy.json: is missing" in refusal(directory)


def test_only_plain_files_of_the_directory_itself_are_read(directory, tmp_path):
    weights_file = directory / "policy.safetensors"
    elsewhere = tmp_path / "elsewhere"
    weights_file.rename(elsewhere)
    weights_file.symlink_to(elsewhere)
    assert "link out of the directory" in refusal(directory)
    weights_file.unlink()
    weights_file.symlink_to(weights_file.name)
    assert "policy.safetensors" in refusal(directory)
    weights_file.unlink()
    os.mkfifo(weights_file)
    assert "not a plain file" in refusal(directory)
    weights_file.unlink()
    weights_file.mkdir()
    assert "policy.safetensors" in refusal(directory)
    weights_file.rmdir()
    with weights_file.open("wb") as file:
        file.truncate(2**26 + 1)
    assert "larger than" in refusal(directory)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(data=st.data())
def test_a_policy_with_spoilt_bytes_is_refused_in_one_line_or_is_the_same(tmp_path_factory, data):
    directory = tmp_path_factory.mktemp("spoilt")
    write(directory)
    name = data.draw(st.sampled_from(["policy.json", "policy.safetensors"]))
    content = bytearray((directory / name).read_bytes())
    for _ in range(data.draw(st.integers(1, 8))):
        place = data.draw(st.integers(0, len(content) - 1))
        length = data.draw(st.integers(0, 20))
        content[place : place + length] = data.draw(st.binary(max_size=20))
    (directory / name).write_bytes(bytes(content))
    if name == "policy.safetensors":
        # the checksum alone would catch it: what lies behind it is to hold as well
        change(directory, weights_sha256=hashlib.sha256(bytes(content)).hexdigest())
    try:
        policy = load_policy(directory)
    except InputError as error:
        line = str(error)
        assert "\n" not in line
        line.encode()
    else:
        assert all(np.isfinite(tensor).all() for tensor in policy.tensors.values())
