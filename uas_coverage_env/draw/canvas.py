"""The pixels of a picture in the making: Pillow draws on them, a compiled loop averages them."""

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.compiled.kernels import kernel
from uas_coverage_env.draw.frame import SMOOTHING

# Every second byte of a pixel; half of the divisor in these, to round; three bytes of a pixel.
_EVEN, _HALF, _RGB = np.uint32(0x00FF00FF), np.uint32(0x00020002), np.uint32(0x00FFFFFF)
_TWO_BITS, _BYTE = np.uint32(2), np.uint32(8)
_TWO_BYTES, _THREE_BYTES = np.uint32(16), np.uint32(24)
_GROUP = 4


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

        self._size_px = side // SMOOTHING
        # whole groups of pixels in each row, so that the loop has no remainder
        self._groups = -(-self._size_px // _GROUP)
        self._pixels = np.zeros((side, SMOOTHING * _GROUP * self._groups), dtype=np.uint32)
        stride = self._pixels.strides[0]
        self.image = Image.frombuffer("RGBX", (side, side), self._pixels, "raw", "RGBX", stride, 1)
        # else Pillow would draw on a copy
        self.image.readonly = 0
        self._row = np.empty(_GROUP * self._groups, dtype=np.uint32)

    def smoothed(self) -> NDArray[np.uint8]:
        """(side / SMOOTHING, side / SMOOTHING, 3) the average of each block, a new array."""
        packed = np.empty((self._size_px, 3 * self._groups), dtype=np.uint32)
        _average(self._pixels, self._row, packed)
        picture = packed.view(np.uint8).reshape(self._size_px, -1, 3)
        return np.ascontiguousarray(picture[:, : self._size_px])


@kernel
def _average(pixels, row, packed):
    """Mean over blocks of 2 x 2 pixels, two bytes of each at a time; three times as fast as bytes.

    Args:
        pixels: (2R, 2C) red, green, blue and a byte that is left out, from the lowest on.
        row: (C,) room for a row of the picture.
        packed: (R, 3C/4) the same without the bytes that are left out, filled.
    """
    for r in range(packed.shape[0]):
        for c in range(row.shape[0]):
            a, b = pixels[2 * r, 2 * c], pixels[2 * r, 2 * c + 1]
            d, e = pixels[2 * r + 1, 2 * c], pixels[2 * r + 1, 2 * c + 1]
            even = (a & _EVEN) + (b & _EVEN) + (d & _EVEN) + (e & _EVEN) + _HALF
            a, b, d, e = a >> _BYTE, b >> _BYTE, d >> _BYTE, e >> _BYTE
            odd = (a & _EVEN) + (b & _EVEN) + (d & _EVEN) + (e & _EVEN) + _HALF
            row[c] = ((even >> _TWO_BITS) & _EVEN) | (((odd >> _TWO_BITS) & _EVEN) << _BYTE)
        for g in range(row.shape[0] // _GROUP):
            a, b, d = row[4 * g] & _RGB, row[4 * g + 1] & _RGB, row[4 * g + 2] & _RGB
            packed[r, 3 * g] = a | (b << _THREE_BYTES)
            packed[r, 3 * g + 1] = (b >> _BYTE) | (d << _TWO_BYTES)
            packed[r, 3 * g + 2] = (d >> _TWO_BYTES) | (row[4 * g + 3] << _BYTE)
