"""The learning curve as a table and as a picture."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

from matplotlib.figure import Figure

from uas_coverage_agents.training.checkpoint import CurvePoint
from uas_coverage_env.files.plain_files import write_atomically
from uas_coverage_env.replay.figures import CURVE, png_of, training_figure

TABLE = CURVE
PICTURE = "learning_curve.png"


def write(points: Sequence[CurvePoint], directory: Path) -> None:
    """Write `learning_curve.csv` and `learning_curve.png`."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CurvePoint.model_fields, lineterminator="\n")
    table.writeheader()
    table.writerows(point.model_dump() for point in points)
    write_atomically(directory / TABLE, text.getvalue().encode())
    write_atomically(directory / PICTURE, png_of(draw({"": points})))


def draw(runs: Mapping[str, Sequence[CurvePoint]]) -> Figure:
    """The figure of `uas-coverage figure --kind training`, a line per run."""
    columns = CurvePoint.model_fields
    return training_figure(
        {
            name: {column: [getattr(point, column) for point in points] for column in columns}
            for name, points in runs.items()
        }
    )
