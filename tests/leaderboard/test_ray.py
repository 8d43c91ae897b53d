"""A Ray cluster of two nodes, one of which is taken away while it flies."""

import os
import subprocess
import sys
import time

import pytest
from leaderboard_rows import flights_in

from uas_coverage_env.flight import Demonstrations

pytest.importorskip("ray")
pytestmark = pytest.mark.slow

RUN = "import sys; from uas_coverage_env.cli import main; sys.exit(main())"
DEADLINE_S = 180.0
TINY = ["--set", "rounds=1", "--steps", "32", "--set", "learning.n_steps=32",
        "--set", "learning.batch_size=32"]  # fmt: skip

# hovers slowly enough to be caught in the middle, and says on which node
SLOW = """
import os, time
from pathlib import Path

from uas_coverage_env.flight import load_planner

NOTES = Path(os.environ["SLOW_NOTES"])


class Slow:
    def __init__(self):
        self._hovers = load_planner("hover")

    def reset(self, brief, seed):
        import ray
        if ray.is_initialized():
            node = ray.get_runtime_context().get_node_id()
            (NOTES / f"{node} {brief.name} {time.monotonic_ns()}").touch()
        self._hovers.reset(brief, seed)
        self._until = time.monotonic() + float(os.environ.get("SLOW_S", 0.0))

    def act(self, swarm):
        while time.monotonic() < self._until:
            time.sleep(0.01)
        return self._hovers.act(swarm)
"""

COMMANDS = {
    "compare": ["compare", "--scenarios", "{yards}", "--seeds", "0:3", "--no-bounds"],
    "score": ["score", "--level", "easy", "--split", "validation", "--missions", "6"],
    "demonstrate": [
        "planner",
        "demonstrate",
        *(f"generated:{seed}" for seed in range(900000, 900004)),
    ],
    "train": ["train", "ppo", "--missions", "6", *TINY],
}
PLANNER = {"demonstrate": "--planner", "train": "--baselines"}
FLOWN = {"compare": 6, "score": 6, "demonstrate": 4, "train": 6}


@pytest.fixture(scope="module")
def cluster(tmp_path_factory):
    """A head with one core; what it starts finds the slow planner."""
    from ray.cluster_utils import Cluster

    folder = tmp_path_factory.mktemp("planner")
    (folder / "slow_planner.py").write_text(SLOW)
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SLOW_NOTES", str(folder))
        patch.setenv("SLOW_S", "1.0")
        patch.setenv("PYTHONPATH", os.pathsep.join([str(folder), *filter(None, sys.path)]))
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1})
        yield cluster, folder
        cluster.shutdown()


def words(name, yards, out, *more):
    asked = [word.format(yards=yards) for word in COMMANDS[name]]
    planner = [PLANNER.get(name, "--planners"), "slow_planner:Slow"]
    return [sys.executable, "-c", RUN, *asked, *planner, "--out", str(out), *more]


@pytest.mark.parametrize("name", COMMANDS)
def test_what_a_node_that_goes_has_not_flown_is_flown_by_the_other(
    cluster, two_yards, tmp_path, name
):
    nodes, notes = cluster
    for note in notes.glob("* *"):
        note.unlink()
    second = nodes.add_node(num_cpus=1)
    nodes.wait_for_nodes()
    command = words(name, two_yards, tmp_path / "ray", "--backend", "ray")
    with subprocess.Popen(
        command, env={**os.environ, "RAY_ADDRESS": nodes.address}, stdout=subprocess.DEVNULL
    ) as flying:
        until = time.monotonic() + DEADLINE_S
        while not list(notes.glob(f"{second.node_id} *")) and time.monotonic() < until:
            assert flying.poll() is None
            time.sleep(0.01)
        assert list(notes.glob(f"{second.node_id} *")), "the second node flies"
        nodes.remove_node(second, allow_graceful=False)
        assert flying.wait(DEADLINE_S) == 0
    begun = [path.name.split()[1] for path in notes.glob("* *")]
    assert len(begun) > FLOWN[name], "what was under way there was begun again"

    here = words(name, two_yards, tmp_path / "here", "--jobs", "1")
    subprocess.run(here, env={**os.environ, "SLOW_S": "0"}, check=True, stdout=subprocess.DEVNULL)
    flown = flights_in(tmp_path / "ray")
    assert sum(row.label == "slow_planner:Slow" for row in flown) == FLOWN[name]
    assert flown == flights_in(tmp_path / "here"), "none is lost, none is there twice"
    if name == "demonstrate":
        ours, theirs = (Demonstrations.load(tmp_path / kind) for kind in ("ray", "here"))
        assert (ours.observation == theirs.observation).all()
        assert ours.missions == theirs.missions


def test_a_local_ray_gives_what_this_process_gives(two_yards, tmp_path):
    command = ["compare", "--scenarios", two_yards, "--planners", "hover,random-walk"]
    command += ["--seeds", "0:3", "--no-bounds"]
    for more in (["--jobs", "1"], ["--jobs", "2", "--backend", "ray"]):
        asked = [sys.executable, "-c", RUN, *command, *more, "--out", str(tmp_path / more[-1])]
        subprocess.run(asked, check=True, timeout=DEADLINE_S)
    assert len(flights_in(tmp_path / "1")) == 12
    assert flights_in(tmp_path / "1") == flights_in(tmp_path / "ray")
