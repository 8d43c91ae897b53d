"""`uas-coverage planner demonstrate`: what a planner does, as data to learn from."""

import json
import sys
from pathlib import Path
from typing import Annotated, Any

import typer
from joblib import Parallel, delayed
from rich.progress import track

from uas_coverage_env.cli.compilation import compilation_shown
from uas_coverage_env.cli.options import LAST_SEED, typed_options
from uas_coverage_env.cli.output import DONE, FAILED, console, one_line
from uas_coverage_env.files.output_dir import prepare_folder, write_files
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import PlannerError, demonstrate, load_planner
from uas_coverage_env.flight.demonstrations import written
from uas_coverage_env.leaderboard import jobs_of, scenarios_of
from uas_coverage_env.scenario import Scenario

HEAD = "demonstrations.json"


def demonstrate_command(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO...",
            help="As `--scenarios` of `compare`: names, files, sets, `generated:FIRST:END`.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder of the missions; resumed if it exists.")],
    planner: Annotated[
        str, typer.Option(metavar="NAME", help="The planner that demonstrates; see `planner list`.")
    ] = "trajectory",
    option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Set a planner option; may be repeated."),
    ] = None,
    seed: Annotated[int, typer.Option(help="Of the planner.", min=0, max=LAST_SEED)] = 0,
    jobs: Annotated[
        int | None,
        typer.Option(
            min=1, help="Missions in parallel; default: one per core.", show_default=False
        ),
    ] = None,
) -> None:
    """Fly missions and keep observations and what was done, for imitation.

    A compressed file of NumPy arrays for each mission; `Demonstrations.load` reads them all
    (docs/imitation.md). Ctrl-C or a kill loses no mission that was flown: the same command goes on.
    """
    missions, options = scenarios_of(scenarios), typed_options(option or ())
    load_planner(planner, options)  # what is wrong is refused before anything is flown
    head = {"planner": planner, "options": options, "seed": seed}
    _keep_head(out, head)
    names = {f"{name}.npz": scenario for name, scenario in missions.items()}
    todo = {name: scenario for name, scenario in names.items() if not (out / name).exists()}
    screen = console()
    if len(todo) < len(names):
        screen.print(f"{len(names) - len(todo)} of {len(names)} missions are there")
    failed = 0
    with compilation_shown():
        flown = Parallel(jobs_of(jobs, "process"), return_as="generator_unordered")(
            delayed(_flown)(scenario, head, out / name) for name, scenario in todo.items()
        )
        for trouble in track(flown, "flying", total=len(todo), console=screen, transient=True):
            if trouble:
                failed += 1
                sys.stderr.write(f"error: {one_line(trouble)}\n")
    screen.print(f"{len(names) - failed} missions in {out}", markup=False)
    raise typer.Exit(FAILED if failed else DONE)


def _keep_head(out: Path, head: dict[str, Any]) -> None:
    if HEAD in prepare_folder(out):
        try:
            there = json.loads((out / HEAD).read_text("utf-8"))
        except (OSError, ValueError) as error:
            raise InputError(f"{out / HEAD}: cannot be read ({error})") from error
        if there != head:
            raise InputError(
                f"{out}: holds demonstrations of {there}; give another --out for {head}"
            )
    write_files(out, {HEAD: json.dumps(head, sort_keys=True).encode()})


def _flown(scenario: Scenario, head: dict[str, Any], path: Path) -> str:
    """Fly a mission and keep it; returns what went wrong, empty where nothing did."""
    try:
        planner = load_planner(head["planner"], head["options"])
        shown = demonstrate(scenario, planner, head["seed"])
        write_files(path.parent, {path.name: written(shown)})
    except (InputError, PlannerError) as error:
        return f"{scenario.name}: {error}"
    return ""
