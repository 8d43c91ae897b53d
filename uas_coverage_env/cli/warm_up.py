"""`uas-coverage planner warm-up`: compile before the first flight."""

import time
from typing import Annotated

import typer

from uas_coverage_env.cli.compilation import compilation_shown, compile_flight
from uas_coverage_env.cli.output import console
from uas_coverage_env.compiled.progress import COMPILATIONS
from uas_coverage_env.compiled.purpose import compiling_for
from uas_coverage_env.compiled.shipped import compiling_for_this_processor
from uas_coverage_env.draw import picture
from uas_coverage_env.env.api.parallel import CoverageParallelEnv
from uas_coverage_env.env.api.vector import CoverageVectorEnv
from uas_coverage_env.flight import Planner, load_planner, rollout
from uas_coverage_env.mission import MissionBrief
from uas_coverage_env.scenario import Scenario, load_scenario
from uas_coverage_env.simulation import World

_SCENARIO = "village"
_PLANNERS = ("nearest-waypoint", "trajectory", "milp-mpc")
"""Those of the README's first commands."""
_LANES = 2


def warm_up(
    planner: Annotated[
        list[str] | None,
        typer.Option(
            help="Compile for this planner, see `planner list`; may be repeated. Default: "
            f"{', '.join(_PLANNERS)}, and the environments.",
            show_default=False,
        ),
    ] = None,
    environments: Annotated[
        bool,
        typer.Option("--environments", help="With --planner: the learning environments, too."),
    ] = False,
) -> None:
    """Compile the simulation for this machine, so that the first flight begins at once.

    Otherwise the first flight of each planner does it, which takes up to a minute. What is compiled
    stays on disk until the package changes, and is not compiled again.
    """
    scenario = load_scenario(_SCENARIO)
    names, learning = planner or list(_PLANNERS), environments or not planner
    planners = {f"planner {name}": load_planner(name) for name in names}
    started, before = time.perf_counter(), COMPILATIONS.n_compiled
    with compilation_shown(), compiling_for_this_processor():
        with compiling_for("flights and maps"):
            compile_flight(scenario, return_mode=True, safety_filter=True)
            picture(scenario, World(scenario).swarm_state())  # of the flight directory
        for purpose, each in planners.items():
            with compiling_for(purpose):
                _compile_planner(each, scenario)
        if learning:
            with compiling_for("the environments"):
                _compile_environments()
    n = COMPILATIONS.n_compiled - before
    took_s = time.perf_counter() - started
    done = f"compiled {n} kernels in {took_s:.0f} s" if n else "everything is compiled already"
    what = ", ".join([*names, *(["environments"] if learning else [])])
    console().print(f"{done}: {what}", markup=False)
    if not planner:
        others = "other planners: `uas-coverage planner warm-up --planner NAME`"
        console().print(others, markup=False)


def _compile_planner(planner: Planner, scenario: Scenario) -> None:
    prepare = getattr(planner, "warm_up", None)
    if prepare is None:
        rollout(scenario, planner, max_steps=1)
    else:
        brief = MissionBrief.of(scenario)
        prepare(brief)
        planner.reset(brief, 0)


def _compile_environments() -> None:
    for action in ("velocity", "waypoint"):
        single = CoverageParallelEnv(_SCENARIO, action=action)
        many = CoverageVectorEnv(_LANES, _SCENARIO, action=action)
        for env in (single, many):
            env.reset(seed=0)
            env.close()
