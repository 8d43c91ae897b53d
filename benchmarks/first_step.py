"""How long a newcomer waits for the first step, and how much memory that takes.

    python benchmarks/first_step.py [--version v0]

Numba compiles what is flown when it is first flown, and keeps it beside the sources. Each row is a
process of its own: first with an empty cache, then again with what the first has kept. What is not
asked for (return mode, safety filter, the waypoint action's guidance) is not compiled. From a wheel
that brings kernels (hatch_build.py) nothing is, as long as the sources are not in the way:
start it outside of them then.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile

PROGRAM = """
import json, resource, sys, time
start = time.perf_counter(), time.process_time()
settings, version = json.loads(sys.argv[2]), sys.argv[3]
if sys.argv[1] == "one mission":
    from importlib import import_module
    env = import_module(f"uas_coverage_env.uas_coverage_{version}").parallel_env(**settings)
    env.reset(seed=0)
    env.step({agent: env.action_space(agent).sample() for agent in env.agents})
else:
    import gymnasium, uas_coverage_env
    env = gymnasium.make_vec(
        f"UASCoverage-{version}", num_envs=64, vectorization_mode="vector_entry_point", **settings
    )
    env.reset(seed=0)
    env.step(env.action_space.sample())
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
print(json.dumps([time.perf_counter() - start[0], time.process_time() - start[1], peak]))
"""

KINDS = ("one mission", "64 missions")
VERSIONS = ("v0", "v1")

SETTINGS: dict[str, dict[str, object]] = {
    "velocity": {},
    "waypoint": {"action": "waypoint"},
    "velocity, return mode and filter": {"return_mode": True, "safety_filter": True},
}


def measured(kind: str, settings: dict[str, object], version: str, cache: str) -> list[float]:
    """Wall clock and processor time to the first step [s], and peak memory [MB]."""
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, kind, json.dumps(settings), version],
        env={**os.environ, "NUMBA_CACHE_DIR": cache},
        stdout=subprocess.PIPE,
        check=True,
        text=True,
    )
    return json.loads(done.stdout.splitlines()[-1])


def main(version: str) -> None:
    """Print the table, row by row: a row takes minutes."""
    row = "| {:12} | {:34} | {:>9} | {:>13} | {:>9} | {:>9} |".format
    print(row("environment", "settings", "first, s", "processor, s", "peak MB", "again, s"))
    print("| --- | --- | ---: | ---: | ---: | ---: |")
    for kind in KINDS:
        for name, settings in SETTINGS.items():
            with tempfile.TemporaryDirectory() as cache:
                wall_s, cpu_s, peak_mb = measured(kind, settings, version, cache)
                again_s = measured(kind, settings, version, cache)[0]
            print(
                row(
                    kind, name, f"{wall_s:.0f}", f"{cpu_s:.0f}", f"{peak_mb:.0f}", f"{again_s:.1f}"
                ),
                flush=True,
            )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument(
        "--version", choices=VERSIONS, default="v0", help="of the environments (default: v0)"
    )
    main(parser.parse_args().version)
