"""What importing the package does: it registers the environments, and nothing else."""

import importlib
import json
import subprocess
import sys

import pytest

import uas_coverage_env


def run(code: str) -> str:
    command = [sys.executable, "-W", "error", "-c", code]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    return result.stdout


def test_importing_is_silent_and_pulls_nothing_heavy():
    out = run("import sys, json, uas_coverage_env; print(json.dumps(sorted(sys.modules)))")
    loaded = {name.partition(".")[0] for name in json.loads(out)}
    heavy = {
        "highspy",
        "PIL",
        "matplotlib",
        "torch",
        "pygame",
        "stable_baselines3",
        "ray",
        "typer",
        "pyscipopt",
        "gurobipy",
    }
    assert not loaded & heavy
    assert not loaded & {"uas_coverage_baselines", "uas_coverage_agents"}


def test_importing_touches_no_environment_variable_and_no_random_state():
    out = run(
        "import os, random, numpy as np, pettingzoo, gymnasium\n"
        "before = (dict(os.environ), random.getstate(), np.random.get_state()[1].tolist())\n"
        "import uas_coverage_env\n"
        "after = (dict(os.environ), random.getstate(), np.random.get_state()[1].tolist())\n"
        "print(before == after)"
    )
    assert out == "True\n"


def test_making_an_environment_is_silent():
    out = run(
        "import gymnasium, pettingzoo, uas_coverage_env\n"
        "from uas_coverage_env import uas_coverage_v0\n"
        "for env in (uas_coverage_v0.parallel_env(), uas_coverage_v0.env(),\n"
        "            gymnasium.make('UASCoverage-v1', scenario='village'),\n"
        "            pettingzoo.make('parallel', 'uas/coverage-v1')):\n"
        "    env.reset(seed=0)\n"
    )
    assert out == ""


def test_importing_twice_registers_once():
    run("import importlib, uas_coverage_env; importlib.reload(uas_coverage_env)")


def test_the_public_names_are_those_that_exist():
    assert sorted(set(uas_coverage_env.__all__)) == sorted(uas_coverage_env.__all__)
    for name in uas_coverage_env.__all__:
        assert hasattr(uas_coverage_env, name)


@pytest.mark.parametrize(
    "name",
    [
        "load_scenario",
        "generate_scenario",
        "load_vehicle",
        "simulate_battery",
        "linear_model",
        "rollout",
        "Flight",
    ],
)
def test_the_contract_names_are_public(name):
    assert name in uas_coverage_env.__all__


def test_the_door_is_a_module_of_the_package():
    door = importlib.import_module("uas_coverage_env.uas_coverage_v0")
    assert callable(door.parallel_env)
