"""One environment that steps when told to, in the virtual environment of its library.

    python throughput_case.py CASE NUM_ENVS THREADS

It makes the environment, says so on standard output with a line of JSON, and then obeys lines on
standard input: for "5.0" it steps for about five seconds with random actions, drawn beforehand,
restarts included, and answers with another line: agent-steps, rows, seconds of the wall clock and
of the processor, peak memory in MB. An agent-step is a step of an agent that acts: one that is lost
or home does not count. Rows are what arrays of agents hold, whatever the agents do: what libraries
count whose agents always act. `throughput.py` starts these programs; they know nothing of each
other.
"""

import json
import os
import resource
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

N_DRAWN = 32
N_AGENTS = 2
N_SCENARIOS = 64
"""So many are drawn, before the clock starts, from which the missions of a batch are drawn."""

Steps = Callable[[int], Callable[[], tuple[float, float]]]
"""Steps so many times; what it returns counts agent-steps and rows, when the clock has stopped."""


def use_threads(threads: int) -> None:
    """Limit all libraries that may be imported later; a single thread stays on one core."""
    for library in ("OMP", "OPENBLAS", "MKL", "NUMBA"):
        os.environ[f"{library}_NUM_THREADS"] = str(threads)
    if threads == 1:
        os.environ["XLA_FLAGS"] = (
            "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
        )
        if hasattr(os, "sched_setaffinity"):
            os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def _parallel(env: Any) -> Steps:
    """A PettingZoo environment: dictionaries in, dictionaries out."""
    env.reset(seed=0)
    for number, agent in enumerate(env.possible_agents):
        env.action_space(agent).seed(number)
    drawn = [
        {agent: env.action_space(agent).sample() for agent in env.possible_agents}
        for _ in range(N_DRAWN)
    ]

    def steps(n_steps: int) -> Callable[[], tuple[float, float]]:
        acted = 0
        for step in range(n_steps):
            actions, agents = drawn[step % N_DRAWN], env.agents
            acted += len(agents)
            if len(agents) < len(actions):
                actions = {agent: actions[agent] for agent in agents}
            env.step(actions)
            if not env.agents:
                env.reset()
        return lambda: (acted, acted)

    return steps


def _village_dict(num_envs: int, threads: int) -> Steps:
    from uas_coverage_env import uas_coverage_v0

    return _parallel(uas_coverage_v0.parallel_env())


def _vector(env: Any, count: Callable[[dict[str, Any]], float], rows: int) -> Steps:
    """A Gymnasium vector environment whose infos tell which UAS fly."""
    latest = env.reset(seed=0)[1]
    env.action_space.seed(0)
    drawn = [env.action_space.sample() for _ in range(N_DRAWN)]

    def steps(n_steps: int) -> Callable[[], tuple[float, float]]:
        nonlocal latest
        infos = []
        for step in range(n_steps):
            infos.append(latest)
            *_, latest = env.step(drawn[step % N_DRAWN])
        return lambda: (sum(map(count, infos)), n_steps * rows)

    return steps


def _batch(num_envs: int, threads: int, **settings: Any) -> Steps:
    import gymnasium

    import uas_coverage_env  # noqa: F401  # registers the names

    env = gymnasium.make_vec(
        "UASCoverage-v0",
        num_envs=num_envs,
        vectorization_mode="vector_entry_point",
        threads=threads,
        copy=False,
        **settings,
    )
    _, infos = env.reset(seed=0)
    return _vector(env, lambda infos: float((infos["status"] == 0).sum()), infos["status"].size)


def _village(num_envs: int, threads: int) -> Steps:
    return _batch(num_envs, threads)


def _generated(num_envs: int, threads: int) -> Steps:
    from uas_coverage_env import generate_scenario

    return _batch(num_envs, threads, scenario=[generate_scenario(k) for k in range(N_SCENARIOS)])


def _own_scenes(num_envs: int, threads: int) -> Steps:
    """As many scenarios as missions: few fly in the same one."""
    from uas_coverage_env import generate_scenario

    return _batch(num_envs, threads, scenario=[generate_scenario(k) for k in range(num_envs)])


def _of(draw: Callable[[Any], Any]) -> list[Any]:
    import numpy as np

    return [draw(np.random.default_rng(k)) for k in range(N_SCENARIOS)]


def _streets(num_envs: int, threads: int) -> Steps:
    from uas_coverage_env.tasks.levels import LEVELS

    families = LEVELS["medium"].families
    (streets,) = (each for each in families if each.draw.__name__ == "streets")
    return _batch(num_envs, threads, scenario=_of(streets))


def _hard(num_envs: int, threads: int) -> Steps:
    from uas_coverage_env.tasks.levels import LEVELS

    scenarios = _of(LEVELS["hard"].missions("training").generator)
    return _batch(num_envs, threads, scenario=scenarios, return_mode=True, safety_filter=True)


def _village_sync(num_envs: int, threads: int) -> Steps:
    import gymnasium

    import uas_coverage_env  # noqa: F401  # registers the names

    env = gymnasium.make_vec("UASCoverage-v0", num_envs=num_envs, vectorization_mode="sync")

    def flying(infos: dict[str, Any]) -> float:
        fleet = (uas for name, uas in infos["uas"].items() if not name.startswith("_"))
        return float(sum((uas["status"] == 0).sum() for uas in fleet))

    return _vector(env, flying, num_envs * N_AGENTS)


def _mpe2_dict(num_envs: int, threads: int) -> Steps:
    from mpe2 import simple_spread_v3

    return _parallel(
        simple_spread_v3.parallel_env(N=N_AGENTS, max_cycles=100, continuous_actions=True)
    )


def _vmas(num_envs: int, threads: int, device: str = "cpu") -> Steps:
    import torch
    import vmas

    torch.set_num_threads(threads)
    env = vmas.make_env(
        "simple_spread", num_envs=num_envs, device=device, continuous_actions=True, max_steps=100,
        seed=0, n_agents=N_AGENTS,
    )  # fmt: skip
    env.reset()
    drawn = [[env.get_random_action(agent) for agent in env.agents] for _ in range(N_DRAWN)]
    since_reset = 0

    def steps(n_steps: int) -> Callable[[], tuple[float, float]]:
        nonlocal since_reset
        for step in range(n_steps):
            env.step(drawn[step % N_DRAWN])
            since_reset += 1
            if since_reset == 100:
                env.reset()
                since_reset = 0
        if device == "cuda":
            torch.cuda.synchronize()
        rows = n_steps * num_envs * N_AGENTS
        return lambda: (rows, rows)

    return steps


def _jaxmarl(num_envs: int, threads: int) -> Steps:
    import jax
    import jaxmarl

    env = jaxmarl.make("MPE_simple_spread_v3", num_agents=N_AGENTS, num_landmarks=N_AGENTS)

    def one(key: Any, state: Any) -> Any:
        # it restarts by itself; its actions are drawn inside, which costs it next to nothing
        key, draw = jax.random.split(key)
        actions = {
            agent: env.action_space(agent).sample(part)
            for agent, part in zip(env.agents, jax.random.split(draw, N_AGENTS), strict=True)
        }
        return env.step(key, state, actions)

    step_all = jax.jit(jax.vmap(one))
    keys = [jax.random.split(jax.random.PRNGKey(draw), num_envs) for draw in range(N_DRAWN)]
    _, state = jax.jit(jax.vmap(env.reset))(keys[0])

    def steps(n_steps: int) -> Callable[[], tuple[float, float]]:
        nonlocal state
        answer = None
        for step in range(n_steps):
            answer = step_all(keys[step % N_DRAWN], state)
            state = answer[1]
        jax.block_until_ready(answer)
        rows = n_steps * num_envs * N_AGENTS
        return lambda: (rows, rows)

    return steps


CASES: dict[str, Callable[[int, int], Steps]] = {
    "village-dict": _village_dict,
    "village-sync": _village_sync,
    "village": _village,
    "generated": _generated,
    "streets": _streets,
    "hard": _hard,
    "own-scenes": _own_scenes,
    "mpe2-dict": _mpe2_dict,
    "vmas": _vmas,
    "vmas-cuda": partial(_vmas, device="cuda"),
    "jaxmarl": _jaxmarl,
}


def _peak_mb() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / (1024 if sys.platform != "darwin" else 1024 * 1024)


def main() -> None:
    """Make the environment, then step as often as asked."""
    _, case, *numbers = sys.argv
    num_envs, threads = map(int, numbers)
    # what libraries print must not come between the answers
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    use_threads(threads)
    steps = CASES[case](num_envs, threads)
    steps(3)()
    n_steps = 4
    answers.write(json.dumps({"ready": case}) + "\n")
    answers.flush()
    for line in sys.stdin:
        seconds = float(line)
        wall_s = cpu_s = acted = rows = 0.0
        while wall_s < 0.9 * seconds:
            wall, cpu = time.perf_counter(), time.process_time()
            count = steps(n_steps)
            took_s = time.perf_counter() - wall
            wall_s += took_s
            cpu_s += time.process_time() - cpu
            now_acted, now_rows = count()
            acted += now_acted
            rows += now_rows
            wanted_s = min(max(seconds - wall_s, 0.1 * seconds), 0.25 * seconds)
            n_steps = max(1, min(int(n_steps * wanted_s / max(took_s, 1e-6)), 4 * n_steps))
        answer = {"agent_steps": acted, "rows": rows, "wall_s": wall_s, "cpu_s": cpu_s}
        answer["peak_mb"] = _peak_mb()
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
