"""What commands that fly do with a flight: keep it, and say what came of it."""

from pathlib import Path

from rich.console import Console
from rich.table import Table

from uas_coverage_env.cli.figures_of_flight import (
    ENDED,
    beside_the_best,
    by_uas,
    failed_figures,
    left_open,
    verdict,
)
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.figures import summary
from uas_coverage_env.flight.metrics import (
    accomplished,
)
from uas_coverage_env.flight.picture import draw_flight
from uas_coverage_env.interruptions import signals_noted


def keep_flight(flight: Flight, directory: Path, *, overwrite: bool) -> bool:
    """Write a flight directory with its map; one Ctrl-C meanwhile does not lose the flight.

    Returns:
        Whether one has come.
    """
    with signals_noted() as interrupted:
        flight.save(directory, overwrite=overwrite)
        draw_flight(flight, directory / "map.png")
        return interrupted()


def report_flight(screen: Console, flight: Flight, directory: Path) -> None:
    """Print what a flight gave, whether it is good, and where to look next."""
    table = Table("UAS", "end", "steps", "energy, Wh", "charge left", box=None)
    for row in by_uas(flight):
        table.add_row(*row)
    screen.print(table)
    for violation in flight.violations:
        screen.print(f"violation: {violation}", markup=False, style="red")
    for line in left_open(flight):
        screen.print(line, markup=False, style="yellow")
    result = summary(flight)
    low = f", {flight.height_breaches} of them too low" if flight.height_breaches else ""
    low += f", {n} below the reserve" if (n := flight.reserve_breaches) else ""
    steps = ", ".join(filter(None, (f"{flight.steps} steps", ENDED[flight.ended])))
    screen.print(
        f"covered {result['coverage']:.0%} in {steps}; "
        f"{'all home' if result['all_home'] else 'not all home'}; "
        f"{result['energy_Wh']:.2f} Wh; {len(flight.violations)} violations, "
        f"{flight.breaches} breaches{low}",
        markup=False,
    )
    if flight.swaps:
        used = ", ".join(f"{name} {packs}" for name, packs in result["packs"].items())
        screen.print(f"{len(flight.swaps)} swaps; packs used: {used}", markup=False)
    if any(decision.duration_s for decision in flight.decisions):  # none in a log
        times = ", ".join(
            f"{1e3 * t:.2f} ms {name}" for name, t in result["decision_time_s"].items()
        )
        counts = result.get("fallback_reasons", {}).items()
        why = f" ({', '.join(f'{n} {reason}' for reason, n in counts)})" if counts else ""
        screen.print(f"decisions: {times}; {result['fallbacks']} fallbacks{why}", markup=False)
    if flew := result.get("flown_by"):
        who = ", ".join(f"{name} in {share:.0%}" for name, share in flew.items())
        screen.print(f"flown by others than the planner: {who} of the decisions", markup=False)
    if flight.safety_filter:
        share = result["filtered_share"]
        screen.print(f"the safety filter replaced {share:.1%} of the commands", markup=False)
    for line in failed_figures(flight):
        screen.print(line, markup=False, style="yellow")
    screen.print(verdict(flight), markup=False, style="green" if accomplished(flight) else "red")
    if best := beside_the_best(flight):
        screen.print(best, markup=False)
    screen.print(f"flight in {directory}", markup=False)
    screen.print(f"to watch it: uas-coverage replay {directory}", markup=False)
    screen.print(f"beside the least energy: uas-coverage show {directory} --bound", markup=False)
    screen.print(f"its map for print: uas-coverage figure {directory} --kind map", markup=False)
