"""`uas-coverage planner list`: what can fly, and how it can be set."""

import json
from dataclasses import asdict
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from uas_coverage_env.cli.options import JsonOption, planners_like
from uas_coverage_env.cli.output import console
from uas_coverage_env.flight import describe_planners
from uas_coverage_env.flight.registry import PlannerDescription, describe_planner


def list_planners(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME",
            help="Describe this one alone, and at length.",
            autocompletion=planners_like,
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """List the planners and their options (set them with `run --option key=value`)."""
    out = console()
    if as_json:
        found = [describe_planner(name)] if name else describe_planners()
        typer.echo(json.dumps([asdict(planner) for planner in found], indent=2))
        return
    if name is not None:
        _describe(out, describe_planner(name))
        return
    for planner in describe_planners():
        out.print(_title(planner))
        width = max((len(option.name) for option in planner.options), default=0)
        for option in planner.options:
            out.print(
                f"    {option.name:<{width}}  {option.description} "
                f"({option.values}, default {option.default})",
                markup=False,
            )


def _title(planner: PlannerDescription) -> str:
    if planner.missing:
        return f"[bold]{escape(planner.name)}[/]  [dim]not here: {escape(planner.missing)}[/]"
    return f"[bold]{escape(planner.name)}[/]  {escape(planner.summary)}"


def _describe(out: Console, planner: PlannerDescription) -> None:
    out.print(_title(planner))
    if planner.text:
        out.print(f"\n{planner.text}", markup=False)
    if not planner.options:
        return
    table = Table("option", "default", "values", "meaning", box=None)
    for option in planner.options:
        table.add_row(option.name, option.default, option.values, escape(option.description))
    out.print()
    out.print(table, soft_wrap=False)
    first = planner.options[0]
    out.print(
        f"\nuas-coverage run village --planner {planner.name} "
        f"--option {first.name}={first.default}",
        markup=False,
    )
