"""The pixels of a picture in the making: Pillow draws on them, a compiled loop averages them."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw.frame import SMOOTHING
from uas_coverage_env.kernels import kernel


class Canvas:
    """A square to draw on, `SMOOTHING` times as large as the picture that it becomes.

    Its pixels are shared between Pillow and NumPy: Pillow alone would copy all of them twice for
    each picture, which takes longer than to draw it.

    Args:
        side: Of the canvas.

    Attributes:
        image: What Pillow draws on.
    """

    def __init__(self, side: int) -> None:
        from PIL import Image

        self._pixels = np.zeros((side, side, 4), dtype=np.uint8)
        self.image = Image.frombuffer("RGBX", (side, side), self._pixels, "raw", "RGBX", 0, 1)
        # else Pillow would draw on a copy
        self.image.readonly = 0

    def smoothed(self) -> NDArray[np.uint8]:
        """(side / SMOOTHING, side / SMOOTHING, 3) the average of each block, a new array."""
        size_px = len(self._pixels) // SMOOTHING
        picture = np.empty((size_px, size_px, 3), dtype=np.uint8)
        _average(self._pixels, picture)
        return picture


@kernel
def _average(pixels, picture):
    """Mean over blocks of 2 x 2 pixels, the last of the four channels left out.

    Args:
        pixels: (2R, 2C, 4) bytes.
        picture: (R, C, 3) bytes, filled.
    """
    for r in range(picture.shape[0]):
        for c in range(picture.shape[1]):
            # a count that the compiler knows: three times as fast
            for k in range(3):
                upper = np.uint32(pixels[2 * r, 2 * c, k]) + pixels[2 * r, 2 * c + 1, k]
                lower = np.uint32(pixels[2 * r + 1, 2 * c, k]) + pixels[2 * r + 1, 2 * c + 1, k]
                picture[r, c, k] = (upper + lower + 2) >> 2
