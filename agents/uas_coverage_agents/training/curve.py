"""The learning curve as a table and as a picture."""

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated

from matplotlib.figure import Figure
from pydantic import Field

from uas_coverage_env.files.plain_files import read_text, write_atomically
from uas_coverage_env.files.strict_toml import StrictModel
from uas_coverage_env.replay.figures import png_of, training_figure
from uas_coverage_env.replay.figures.training import CURVE, Curve, baseline_curves

TABLE = CURVE
PICTURE = "learning_curve.png"

Seconds = Annotated[float, Field(ge=0.0)]


class CurvePoint(StrictModel):
    """How the policy flew the validation missions at one moment of its training; means.

    Steps are flown steps: decisions that were learned from. The return is that of the environments'
    default reward, whatever is learned from; None where a version flew it that did not keep it.
    """

    steps: Annotated[int, Field(ge=0)]
    process_s: Seconds
    wall_s: Seconds
    coverage: float
    all_home: float
    violations: float
    energy_Wh: float
    flight_steps: float
    episode_return: float | None = None


_HEADINGS = {"episode_return": "return"}  # Python has another use for the word


def write(points: Sequence[CurvePoint], directory: Path) -> None:
    """Write `learning_curve.csv` and `learning_curve.png`, beside the baselines that lie there."""
    write_table(points, directory)
    baselines = baseline_curves(directory)
    runs: dict[str, Curve] = {"policy" if baselines else "": _columns(points)}
    write_atomically(directory / PICTURE, png_of(training_figure({**runs, **baselines})))


def write_table(points: Sequence[CurvePoint], directory: Path) -> None:
    """Write `learning_curve.csv` alone."""
    columns = _columns(points)
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(columns)
    table.writerows(zip(*columns.values(), strict=True))
    write_atomically(directory / TABLE, text.getvalue().encode())


def read(directory: Path) -> list[CurvePoint]:
    """The points of a `learning_curve.csv` that `write_table` has written."""
    fields = {heading: field for field, heading in _HEADINGS.items()}
    lines = read_text(directory / TABLE).splitlines()
    return [
        CurvePoint.model_validate(
            {fields.get(k, k): int(v) if k == "steps" else float(v) for k, v in row.items()}
        )
        for row in csv.DictReader(lines)
    ]


def draw(runs: Mapping[str, Sequence[CurvePoint]]) -> Figure:
    """The figure of `uas-coverage figure --kind training`, a line per run."""
    return training_figure({name: _columns(points) for name, points in runs.items()})


def _columns(points: Sequence[CurvePoint]) -> dict[str, list[float]]:
    """Heading -> values; the return only where all points have one."""
    columns = {
        _HEADINGS.get(name, name): [getattr(point, name) for point in points]
        for name in CurvePoint.model_fields
    }
    return {name: values for name, values in columns.items() if None not in values}
