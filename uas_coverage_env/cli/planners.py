"""`uas-coverage planners`: what can fly, and how it can be set."""

from uas_coverage_env.cli.output import console
from uas_coverage_env.flight import describe_planners


def planners() -> None:
    """List the planners and their options (set them with `run --option key=value`)."""
    out = console()
    for planner in describe_planners():
        if planner.missing:
            out.print(f"[bold]{planner.name}[/]  [dim]not available here: {planner.missing}[/]")
            continue
        out.print(f"[bold]{planner.name}[/]  {planner.summary}")
        width = max((len(option.name) for option in planner.options), default=0)
        for option in planner.options:
            out.print(
                f"    {option.name:<{width}}  {option.description} "
                f"({option.values}, default {option.default})",
                markup=False,
            )
