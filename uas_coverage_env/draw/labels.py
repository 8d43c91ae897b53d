"""Where a label can stand so that nothing hides it."""

import numpy as np
from numpy.typing import NDArray

_TRIED = 15

_LOW_M = 10.0  # heights of what is no higher have decimals

Box = tuple[float, float, float, float]
"""Left, least height, width, height."""


def overlap(box: Box, other: Box) -> bool:
    """Whether two boxes have a place in common."""
    return all(
        box[axis] < other[axis] + other[axis + 2] and other[axis] < box[axis] + box[axis + 2]
        for axis in (0, 1)
    )


def metres(value_m: float, most_m: float) -> str:
    """A height in words, with as many decimals as it takes where none is more than `most_m`."""
    return f"{value_m:.{int(most_m < _LOW_M)}f}"


def short_name(name: str) -> str:
    """What a UAS is called on a crowded picture: the end of its name."""
    return name.rpartition("_")[2][:3]


def free_place(
    outline: NDArray[np.float64], box: NDArray[np.float64], marks: NDArray[np.float64]
) -> tuple[float, float] | None:
    """The place nearest to the middle of an area where a label lies in it and under no mark.

    Args:
        outline: (C, 2) corners of the area, convex, in their order.
        box: (2,) width and height of the label.
        marks: (W, 3) x, y and radius of discs that may be drawn over it.

    Returns:
        Where the centre of the label stands; None where there is no such place.
    """
    low, high = outline.min(axis=0), outline.max(axis=0)
    axes = [np.linspace(low[axis], high[axis], _TRIED) for axis in (0, 1)]
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    places = np.vstack([outline.mean(axis=0), grid])
    signs = np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]])
    corners = places[:, None] + signs * box / 2

    edges = np.roll(outline, -1, axis=0) - outline
    from_edges = corners[:, :, None] - outline
    turns = edges[:, 0] * from_edges[..., 1] - edges[:, 1] * from_edges[..., 0]
    inside = (turns >= 0).all(axis=(1, 2)) | (turns <= 0).all(axis=(1, 2))

    beside = np.maximum(0.0, np.abs(places[:, None] - marks[:, :2]) - box / 2)
    free = (np.hypot(beside[..., 0], beside[..., 1]) > marks[:, 2]).all(axis=1)

    candidates = places[inside & free]
    if not len(candidates):
        return None
    off = np.hypot(*(candidates - places[0]).T)
    x, y = candidates[np.argmin(off)].tolist()
    return x, y
