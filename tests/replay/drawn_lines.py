"""What a figure has drawn."""

import numpy as np
from matplotlib.axes import Axes


def lines(axes: Axes) -> list[np.ndarray]:
    """The points of each line."""
    return [np.asarray(line.get_xydata()) for line in axes.get_lines()]
