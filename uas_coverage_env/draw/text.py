"""Writing on a picture. Rendered words are kept: the same few come back in every picture."""

from functools import lru_cache
from typing import TYPE_CHECKING

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.colours import Colour

if TYPE_CHECKING:
    from PIL.Image import Image

# Share of the font size from the baseline up to the middle of a digit.
_MIDDLE = 0.36


def write(
    image: "Image",
    place: tuple[float, float],
    words: str,
    size: float,
    colour: Colour,
    *,
    align: float = 0.0,
    halo: float = 0.0,
) -> None:
    """Write one line, vertically centred on a place.

    Args:
        image: Where to write.
        place: On the canvas.
        words: What to write.
        size: Of the font, in canvas pixels.
        colour: Of the words.
        align: Share of the line that lies left of the place: 0 starts, 0.5 centres, 1 ends there.
        halo: Width of a white edge that keeps words readable on any ground, in canvas pixels.
    """
    if halo:
        _paste(image, place, words, size, colours.WHITE, align, round(halo))
    _paste(image, place, words, size, colour, align, 0)


def _paste(
    image: "Image",
    place: tuple[float, float],
    words: str,
    size: float,
    colour: Colour,
    align: float,
    edge: int,
) -> None:
    shape, left, top = _shape(words, round(size), edge)
    # the edge widens both sides: it does not move the line
    width = shape.width - 2 * edge
    corner = (round(place[0] - align * width) + left, round(place[1] + _MIDDLE * size) + top)
    image.paste(colour, corner, shape)


@lru_cache(maxsize=1024)
def _shape(words: str, size: int, edge: int) -> tuple["Image", int, int]:
    """The words as a mask, and where its corner lies from the start of the baseline."""
    from PIL import Image, ImageDraw

    font = _font(size)
    left, top, right, bottom = font.getbbox(words, anchor="ls", stroke_width=edge)
    left, top = int(left), int(top)
    shape = Image.new("L", (max(1, int(right) - left), max(1, int(bottom) - top)), 0)
    draw = ImageDraw.Draw(shape)
    draw.text((-left, -top), words, fill=255, font=font, anchor="ls", stroke_width=edge)
    return shape, left, top


@lru_cache(maxsize=32)
def _font(size: int):
    from PIL import ImageFont

    return ImageFont.load_default(size)
