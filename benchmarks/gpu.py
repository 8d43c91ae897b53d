"""Missions on a GPU: whether they are those of the processor, and how many rows a second.

    python benchmarks/gpu.py               check, and measure: at most eight minutes
    python benchmarks/gpu.py --registers   what the compiler says of each launch; needs no GPU

Each set of missions is flown on the GPU and as a batch under the same random actions, and then
alone for every number of missions; `ppo-waypoint` is trained there on missions drawn from `hard`,
environment, network and learning together; beside them VMAS and JaxMARL on the GPU, where this
Python has them. A row is a UAS and a step, whatever it does; of the training, a decision that was
learned from. What does not fit into the time is left out, and named. With NUMBA_ENABLE_CUDASIM=1
and NUMBA_DISABLE_JIT=1 numba's simulator is taken for a GPU.
"""

import itertools
import json
import os
import re
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any
from unittest.mock import patch

import numpy as np
import typer
from numba import cuda, typeof
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from throughput import Case, CaseFailedError, CaseProcess

from uas_coverage_env import generate_scenario
from uas_coverage_env.env import CoverageBatch
from uas_coverage_env.env.gpu import missions as on_gpu
from uas_coverage_env.env.gpu.device import on_device, on_host
from uas_coverage_env.env.gpu.missions import CudaMissions
from uas_coverage_env.env.versions import version_named
from uas_coverage_env.files.strict_toml import InputError

N_DRAWN = 64
"""Scenarios that drawn missions come from."""

N_ACTIONS = 4
"""Joint actions, which lie on the GPU as those of a learner there would, and take turns."""

MOST_APART, MOST_PARTED = 1e-4, 0.02
"""Numbers of an observation differ by rounding; a mission in which one differs by more has parted
from the batch's, as where a waypoint is covered a step later. So many may [-]."""

TRAINING = "train ppo-waypoint, hard"
TRAINING_S, MOST_TRAINED = 120.0, 16_384
"""It is begun only with so much time left, of which most is compiling [s]; and with so many
missions at most, whose decisions fit into the memory."""

TURNS, TURN_S = 5, 0.4
PEERS = {"vmas": "vmas-cuda", "jaxmarl": "jaxmarl"}
"""Module -> case of `throughput_case.py`, on the GPU."""

COMPUTE_CAPABILITY = (9, 0)

console = Console(width=120)


def sets_of(scenario: str) -> dict[str, tuple[Any, dict[str, Any]]]:
    """Name -> what is flown, and its settings."""
    drawn = [generate_scenario(k) for k in range(N_DRAWN)] if scenario == "village" else [scenario]
    guided = {"action": "waypoint", "version": version_named("v1")}
    return {
        "velocity": (scenario, {}),
        "v1, waypoint": (scenario, guided),
        "v1, waypoint, drawn": (drawn, guided),
    }


def random_actions(missions: CudaMissions, rng: np.random.Generator) -> NDArray[Any]:
    """(N, U · size) of one step: choices, or float32."""
    shape, choices = missions.asked.shape, missions.settings.kind.choices
    if choices:
        return rng.integers(0, choices, shape)
    return rng.uniform(-1.0, 1.0, shape).astype(np.float32)


def compared(what: Any, settings: dict[str, Any], n: int, n_steps: int) -> tuple[str, bool]:
    """How missions on the GPU differ from those of a batch: in words, and whether by little."""
    missions, batch = CudaMissions(n, what, **settings), CoverageBatch(n, what, **settings)
    begun_s = time.perf_counter()
    missions.reset(seed=0)
    on_host(missions.observation)
    first_s = time.perf_counter() - begun_s
    batch.reset(0)
    rng, apart = np.random.default_rng(0), np.zeros(n)
    for _ in range(n_steps):
        actions = random_actions(missions, rng)
        missions.step(actions)
        seen = on_host(missions.observation)
        batch.step(actions)
        apart = np.maximum(apart, np.abs(seen - batch.observation.reshape(n, -1)).max(axis=1))
    parted = (apart > MOST_APART).mean()
    together = apart[apart <= MOST_APART]
    words = (
        f"{n} missions, {n_steps} steps: {parted:.1%} parted, the others differ by "
        f"{together.max(initial=0.0):.1e} at most; first reset {first_s:.0f} s"
    )
    return words, bool(parted <= MOST_PARTED)


def rates_of(what: Any, settings: dict[str, Any], n: int, turn_s: float) -> list[float]:
    """Rows per second of so many missions, turn by turn."""
    missions = CudaMissions(n, what, **settings)
    missions.reset(seed=0)
    rng = np.random.default_rng(0)
    actions = [on_device(random_actions(missions, rng)) for _ in range(N_ACTIONS)]

    def stepped_s(n_steps: int) -> float:
        begun_s = time.perf_counter()
        for step in range(n_steps):
            missions.step(actions[step % N_ACTIONS])
        cuda.synchronize()
        return time.perf_counter() - begun_s

    stepped_s(1)
    n_steps = max(1, int(turn_s / stepped_s(2) * 2))
    return [n_steps * n * missions.n_uas / stepped_s(n_steps) for _ in range(TURNS)]


def training_rates(scenario: str, n: int, n_steps: int) -> list[float]:
    """Decisions per second that `ppo-waypoint` learns from, from update to update.

    The first one, in which all is compiled, counts for none.
    """
    from uas_coverage_agents.training.learner import Told
    from uas_coverage_agents.training.missions import Missions
    from uas_coverage_agents.training.rounds import learner_of
    from uas_coverage_agents.training.settings import settings_of

    level = "hard" if scenario == "village" else scenario
    changes = [
        *(f"num_envs={n}", f"learning.n_steps={n_steps}", f"total_timesteps={8 * n * n_steps}"),
        *("rounds=1", f"learning.missions={N_DRAWN}", f"learning.batch_size={max(2048, n)}"),
        *("environment.return_mode=false", "environment.safety_filter=false", "device=cuda"),
    ]
    settings = settings_of("ppo-waypoint", scenario=level, changes=changes)
    seen: list[tuple[float, int]] = []

    class Timed(Told):
        def add(self, steps: int, **numbers: float) -> None:
            cuda.synchronize()
            seen.append((time.perf_counter(), steps))

    learner_of(settings, Missions.of(settings), 0).learn(0, Timed())
    return [
        (steps - before) / (now_s - before_s)
        for (before_s, before), (now_s, steps) in itertools.pairwise(seen)
    ]


def peer_rates(peer: str, n: int, turn_s: float) -> list[float]:
    """Likewise of another library, in a process of its own.

    Raises:
        CaseFailedError: It ended instead of answering.
    """
    os.environ["XLA_PYTHON_CLIENT_PREALLOCATE"] = "false"
    case = Case(PEERS[peer], n, 1, peer)
    process = CaseProcess(case, sys.executable)
    try:
        process.answer()
        process.play(turn_s / 2, "wall")
        case.row_rates.clear()
        for _ in range(TURNS):
            process.play(turn_s, "wall")
    finally:
        process.close()
    return case.row_rates


def _ptxas() -> str:
    """NVIDIA's assembler: in the path, or as pip installs it."""
    found = find_spec("nvidia")
    folders = found.submodule_search_locations or [] if found else []
    beside = (Path(folder) / "cuda_nvcc" / "bin" / "ptxas" for folder in folders)
    program = shutil.which("ptxas") or next((str(each) for each in beside if each.exists()), None)
    if program is None or find_spec("numba_cuda") is None:
        console.print(
            '--registers needs numba-cuda and ptxas: pip install "uas-coverage-env[gpu]" '
            "nvidia-cuda-nvcc-cu12"
        )
        raise typer.Exit(2)
    return program


def registers_table(scenario: str) -> Table:
    """What the compiler says of each launch of each set of missions, without a GPU."""
    ptxas = _ptxas()
    from numba.cuda import compile_ptx, dispatcher

    table = Table("missions", "launch", "a thread for each", "registers", "local bytes", "spilled")
    there = SimpleNamespace(compute_capability=COMPUTE_CAPABILITY)
    with (
        patch.object(on_gpu, "check_gpu", lambda: None),
        patch.object(on_gpu, "on_device", lambda arrays: arrays),
        patch.object(dispatcher, "get_current_device", lambda: there),
        tempfile.TemporaryDirectory() as folder,
    ):
        for name, (what, settings) in list(sets_of(scenario).items())[:2]:
            missions = CudaMissions(2, what, **settings)
            for k, launch in enumerate(missions.launches, 1):
                types = (typeof(missions.numbers),)
                code, _ = compile_ptx(launch.kernel.py_func, types, cc=COMPUTE_CAPABILITY)
                file = Path(folder) / "step.ptx"
                file.write_text(code)
                architecture = "sm_{}{}".format(*COMPUTE_CAPABILITY)
                command = [ptxas, "-v", "-arch", architecture, "-o", os.devnull, str(file)]
                said = subprocess.run(command, capture_output=True, text=True, check=True).stderr
                numbers = (
                    [int(number) for number in re.findall(pattern, said)]
                    for pattern in (
                        r"Used (\d+) registers", r"(\d+) bytes stack", r"(\d+) bytes spill stores",
                    )
                )  # fmt: skip
                used, local, spilled = numbers
                cells = (k, "UAS" if launch.of_uas else "mission", max(used), max(local))
                table.add_row(name, *map(str, cells), str(sum(spilled)))
    return table


def main(
    envs: Annotated[str, typer.Option(help="Numbers of missions.")] = "1024,16384,131072",
    checked: Annotated[int, typer.Option(min=1, help="Missions that are compared.")] = 64,
    steps: Annotated[int, typer.Option(min=1, help="Their steps.")] = 40,
    minutes: Annotated[float, typer.Option(help="Nothing is begun after this time.")] = 7.0,
    turn_s: Annotated[float, typer.Option(min=0.0, help="Length of a turn [s].")] = TURN_S,
    scenario: Annotated[str, typer.Option(help="Name of a shipped scenario.")] = "village",
    registers: Annotated[bool, typer.Option("--registers", help="Only compile.")] = False,
    json_file: Annotated[Path | None, typer.Option("--json", help="Also write it.")] = None,
) -> None:
    """Check missions on the GPU of this machine, and measure them."""
    if registers:
        console.print(registers_table(scenario))
        return
    try:
        on_gpu.check_gpu()
    except (ImportError, RuntimeError) as error:
        console.print(str(error), markup=False, soft_wrap=True)
        raise typer.Exit(2) from None
    until_s, numbers = time.monotonic() + 60.0 * minutes, [int(part) for part in envs.split(",")]
    table = Table("missions", *(f"{n:,}: M rows/s" for n in numbers))
    found: dict[str, dict[str, Any]] = {}
    equal, left_out = True, []

    def in_time(what: str, takes_s: float = 0.0) -> bool:
        if time.monotonic() + takes_s < until_s:
            return True
        left_out.append(what)
        return False

    def measure(
        name: str, rates: Callable[[int], list[float]], takes_s: float = 0.0, most: int = 10**9
    ) -> None:
        cells = []
        for n in numbers:
            own = rates(n) if n <= most and in_time(f"{name}, {n:,}", takes_s) else []
            found.setdefault(name, {})[str(n)] = own
            cells.append(_spread([rate / 1e6 for rate in own]))
        table.add_row(name, *cells)

    for name, (what, settings) in sets_of(scenario).items():
        if in_time(name):
            words, little = compared(what, settings, checked, steps)
            equal &= little
            console.print(f"{name}: {words}")
            measure(name, lambda n, given=(what, settings): rates_of(*given, n, turn_s))
    if find_spec("torch") is None:
        console.print("torch is not installed here: nothing is trained")
    else:
        try:
            measure(
                TRAINING, lambda n: training_rates(scenario, n, steps), TRAINING_S, MOST_TRAINED
            )
        except InputError as error:
            console.print(f"not trained: {error}", markup=False)
    for peer in PEERS:
        if find_spec(peer) is None:
            console.print(f"{peer} is not installed here")
            continue
        try:
            measure(peer, lambda n, peer=peer: peer_rates(peer, n, turn_s))
        except CaseFailedError as error:
            console.print(f"failed: {error}", markup=False)
    console.print(table)
    if left_out:
        console.print(f"left out, for lack of time: {'; '.join(left_out)}")
    if json_file is not None:
        json_file.write_text(json.dumps({"equal": equal, "rows_per_s": found}, indent=1) + "\n")
    if not equal:
        console.print("missions on the GPU are not those of the processor")
    raise typer.Exit(0 if equal else 1)


def _spread(values: list[float]) -> str:
    if not values:
        return "-"
    return f"{statistics.median(values):,.2f} [{min(values):,.2f} .. {max(values):,.2f}]"


if __name__ == "__main__":
    typer.run(main)
