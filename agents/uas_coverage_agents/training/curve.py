"""The learning curve as a table and as a picture."""

import csv
import io
from collections.abc import Sequence
from pathlib import Path

from matplotlib.figure import Figure

from uas_coverage_agents.policy.directory import write_atomically
from uas_coverage_agents.training.checkpoint import CurvePoint

TABLE = "learning_curve.csv"
PICTURE = "learning_curve.png"


def write(points: Sequence[CurvePoint], directory: Path) -> None:
    """Write `learning_curve.csv` and `learning_curve.png`."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CurvePoint.model_fields, lineterminator="\n")
    table.writeheader()
    table.writerows(point.model_dump() for point in points)
    write_atomically(directory / TABLE, text.getvalue().encode())
    picture = io.BytesIO()
    draw({"": points}).savefig(picture, format="png", dpi=120)
    write_atomically(directory / PICTURE, picture.getvalue())


def draw(runs: dict[str, Sequence[CurvePoint]]) -> Figure:
    """Coverage, energy and duration over the steps learned from, a line per run."""
    figure = Figure(figsize=(9.0, 2.8), layout="constrained")
    measures = (
        ("coverage", "covered"),
        ("energy_Wh", "energy, Wh"),
        ("flight_steps", "steps until all are home"),
    )
    axes = figure.subplots(1, len(measures))
    for axis, (name, label) in zip(axes, measures, strict=True):
        for run, points in runs.items():
            steps = [point.steps / 1e6 for point in points]
            axis.plot(steps, [getattr(point, name) for point in points], ".-", label=run or None)
        axis.set_xlabel("million steps")
        axis.set_ylabel(label)
        axis.grid(alpha=0.3)
    if any(runs):
        axes[0].legend()
    return figure
