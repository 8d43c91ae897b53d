"""A feature is one file: what lies in the folder, or a package announces, is known everywhere."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

RAIN = '''
import numpy as np
from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.compiled.memory import record_dtype
from uas_coverage_env.compiled.random import counted, uniform
from uas_coverage_env.compiled.views import record_view
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.features.table import FeatureTable

RAIN_DTYPE = record_dtype([("share_per_s", "f8")])
WET_DTYPE = record_dtype([("exposure", "f8"), ("random", "u8", (1,))])
rain_of, wet_of = record_view(RAIN_DTYPE), record_view(WET_DTYPE)


@rare_kernel
def draw(arena, state, f, seed):
    wet = wet_of(state.memory, arena.features[f].memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        wet[i].random[0] = counted(seed, i)
        wet[i].exposure = 0.5 + uniform(wet[i].random[:])


@rare_kernel
def drain(arena, state, outcome, f):
    own = arena.features[f]
    rain = rain_of(arena.feature_words, own.first, own.n)
    wet = wet_of(state.memory, own.memory, state.uas.shape[0])
    for i in range(state.uas.shape[0]):
        outcome[i].dod_lost += rain[0].share_per_s * wet[i].exposure * arena.rules[0].dt_s


class Rain(FeatureTable):
    """Rain that drains batteries.

    Attributes:
        share_per_s: Of the capacity [1/s].
    """

    table = "rain"
    share_per_s: float

    def features(self):
        records = np.array([(self.share_per_s,)], dtype=RAIN_DTYPE)
        return (MissionFeature("rain", {Point.BEGIN: draw, Point.ACT: drain}, records, WET_DTYPE),)
'''

ICING = '''
from typing import ClassVar, Literal
from uas_coverage_env.compiled.kernels import rare_kernel
from uas_coverage_env.features.event import OfUas, concerns, lasts
from uas_coverage_env.features.feature import MissionFeature, Point
from uas_coverage_env.vehicle import LIFT


@rare_kernel
def lose_thrust(arena, state, outcome, f):
    for e in range(arena.events.shape[0]):
        for i in range(state.uas.shape[0]):
            if concerns(arena, state, e, f, i) and lasts(arena, state, e):
                outcome[i].u[LIFT] -= arena.events[e].values[0] * arena.vehicles[i].weight_N


class Icing(OfUas):
    """Ice on the rotors.

    Attributes:
        kind: `"icing"`.
        for_s: How long [s].
        thrust_lost: Of the weight [-].
    """

    feature: ClassVar = MissionFeature("icing", {Point.ACT: lose_thrust})
    kind: Literal["icing"]
    for_s: float
    thrust_lost: float = 0.05

    @property
    def lasts_s(self):
        return self.for_s

    @property
    def values(self):
        return (self.thrust_lost,)
'''

PROGRAM = """
import json, sys
import numpy as np
import uas_coverage_env.features as features
features.__path__.extend(sys.argv[1:])
from uas_coverage_env import load_scenario
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.files.strict_toml import parse
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.simulation import World
from uas_coverage_env.world import Velocity

field = load_scenario("open_field").model_dump(mode="json", by_alias=True)
icing = {"kind": "icing", "at_s": 4.0, "uas": "uas_1", "for_s": 5.0, "thrust_lost": 0.1}
rain = {"rain": {"share_per_s": 1e-3}} if sys.argv[1:] else {}
eventful = parse({**field, **rain, "events": [icing]}, Scenario, "own")
hover = {uas.name: Velocity(0.0, 0.0, 25.0) for uas in eventful.uas}


def flown(scenario, seed):
    world = World(scenario, seed=seed)
    for _ in range(8):
        world.step(hover)
    return world.state.x.copy()


plain = flown(parse(field, Scenario, "plain"), 1)
one = flown(eventful, 1)
again, other = flown(eventful, 1), flown(eventful, 2)
batch = CoverageBatch(3, eventful)
batch.reset(seed=[5, 6, 7])
singles = [CoverageParallelEnv(eventful) for _ in range(3)]
for seed, env in zip((5, 6, 7), singles):
    env.reset(seed=seed)
same = True
rng = np.random.default_rng(0)
for _ in range(10):
    actions = rng.uniform(-0.3, 0.3, (3, len(eventful.uas), 3)).astype(np.float32)
    batch.step(actions)
    for lane, env in enumerate(singles):
        env.step({agent: actions[lane, i] for i, agent in enumerate(env.agents)})
        seen = env.swarm_state()
        same &= bool((seen.x == batch.worlds.x[lane, : len(seen.x)]).all())
print(json.dumps({
    "sinks_m": float(one[0, 2] - plain[0, 2]),
    "other_sinks_m": float(one[-1, 2] - plain[-1, 2]),
    "drained": (one[:, 12] - plain[:, 12]).tolist(),
    "repeats": bool((one == again).all()),
    "draws": bool((one[:, 12] != other[:, 12]).all()),
    "same": same,
    "kept": sorted(set(eventful.model_dump(by_alias=True)) - set(field)),
}))
"""


def found(arguments, env=None):
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *arguments],
        capture_output=True, text=True, env=env, timeout=600,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.slow
def test_a_file_in_the_folder_is_all_that_a_table_and_a_kind_of_event_take(tmp_path):
    (tmp_path / "rain.py").write_text(RAIN)
    (tmp_path / "icing.py").write_text(ICING)
    seen = found([str(tmp_path)])
    # where something may act, missions begin with a hover: the other climbs later, too
    assert seen["sinks_m"] > seen["other_sinks_m"] + 1.0
    # eight seconds of a thousandth each, times an exposure from 0.5 to 1.5
    assert all(0.003 < drained < 0.02 for drained in seen["drained"])
    assert seen["repeats"]
    assert seen["draws"]
    assert seen["same"]
    assert seen["kept"] == ["events", "rain"]


@pytest.mark.slow
def test_a_kind_of_event_may_come_from_another_package(tmp_path, monkeypatch):
    (tmp_path / "own_icing.py").write_text(ICING)
    told = tmp_path / "own_icing-1.0.dist-info"
    told.mkdir()
    (told / "METADATA").write_text("Metadata-Version: 2.1\nName: own-icing\nVersion: 1.0\n")
    (told / "entry_points.txt").write_text("[uas_coverage.events]\nicing = own_icing:Icing\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    seen = found([])
    assert seen["sinks_m"] > seen["other_sinks_m"] + 1.0
    assert seen["same"]
    assert seen["kept"] == ["events"]


def test_each_feature_of_the_package_has_a_file_that_says_what_it_is():
    folder = Path(__file__).parents[2] / "uas_coverage_env" / "features"
    for file in folder.glob("*.py"):
        assert file.read_text().startswith('"""'), file.name
