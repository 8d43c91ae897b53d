"""What the signs of a picture mean, in rows to be put under it."""

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import colours, marks
from uas_coverage_env.draw.frame import SMOOTHING, Frame
from uas_coverage_env.draw.terrain import height_places
from uas_coverage_env.draw.text import width_of, write
from uas_coverage_env.scenario import Scenario

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw

Sign = Callable[["ImageDraw", Frame, float, float], None]

_LETTER, _ROW, _SIGN, _GAP, _EDGE = 11.0, 25.0, 30.0, 10.0, 8.0
"""Of the writing, a row, a sign, between columns and at the edges, in pixels of the design."""

_UAS = colours.UAS[0]
_NUMBERS = "Numbers on obstacles are their heights."


def _ring(*, open_: bool, heavy: bool = False) -> Sign:
    return lambda draw, frame, x, y: marks.waypoint(
        draw, frame, x, y, 8 * frame.unit, heavy=heavy, open_=open_
    )


def _flown(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    reach = 10 * frame.unit
    draw.line((x - reach, y, x + reach, y), fill=_UAS, width=round(1.7 * frame.unit))


def _planned(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    for k in (-1, 0, 1):
        marks.planned(draw, frame, x + 8 * k * frame.unit, y, _UAS)


def _moving(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    marks.moving_obstacle(draw, frame, x, y, 5 * frame.unit, 0.0)


def _kept_off(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    marks.safe_distance(draw, frame, x, y, 9 * frame.unit)


def _moved(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    reach = 10 * frame.unit
    marks.moving_path(draw, frame, [(x - reach, y), (x + reach, y)])


def _fence(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    _box(draw, frame, x, y, colours.GROUND, colours.INK)


def _box(
    draw: "ImageDraw",
    frame: Frame,
    x: float,
    y: float,
    fill: colours.Colour,
    edge: colours.Colour | None,
) -> None:
    a, b = 10 * frame.unit, 5.5 * frame.unit
    draw.rectangle((x - a, y - b, x + a, y + b), fill, edge, round(1.2 * frame.unit))


def _patch(tint: colours.Colour, *, edged: bool) -> Sign:
    edge = colours.shaded(tint, 0.55) if edged else None
    return lambda draw, frame, x, y: _box(draw, frame, x, y, tint, edge)


SIGNS: Mapping[str, tuple[str, Sign]] = {
    "open": ("waypoint", _ring(open_=True)),
    "covered": ("covered", _ring(open_=False)),
    "heavy": ("weighs more", _ring(open_=True, heavy=True)),
    "home": ("start, home", marks.pad),
    "flying": (
        "UAS and its charge",
        lambda draw, frame, x, y: marks.flying(draw, frame, x, y, 0.0, 0.8, _UAS),
    ),
    "landed": ("landed", lambda draw, frame, x, y: marks.landed(draw, frame, x, y, _UAS)),
    "lost": ("lost", marks.lost),
    "flown": ("path flown", _flown),
    "planned": ("path planned", _planned),
    "moving": ("moving obstacle", _moving),
    "kept_off": ("its safe distance", _kept_off),
    "moved": ("its path", _moved),
}
"""Name -> words and mark; what stands still is added by kind."""


def legend(scenario: Scenario, signs: Iterable[str], size_px: int) -> NDArray[np.uint8]:
    """The legend of a picture, as wide as it.

    Args:
        scenario: The scenario drawn.
        signs: Which of `SIGNS` are on the picture.
        size_px: Side of the picture.

    Returns:
        (height, size_px, 3) red, green, blue.
    """
    from PIL import Image, ImageDraw

    frame = Frame.around(scenario.fence.vertices_m, size_px)
    unit, size = frame.unit, _LETTER * frame.letter
    asked = set(signs)
    entries = [entry for name, entry in SIGNS.items() if name in asked]
    entries += [("geofence", _fence), *_kinds(scenario)]
    widest = max(width_of(words, size) for words, _ in entries) + (_SIGN + _GAP) * unit
    columns = max(1, int((frame.side - 2 * _EDGE * unit) / widest))
    rows = -(-len(entries) // columns)
    numbers = any(place is not None for place in height_places(scenario, frame))
    height = SMOOTHING * round(((rows + numbers) * _ROW + _EDGE) * unit / SMOOTHING)
    image = Image.new("RGB", (frame.side, height), colours.PAPER)
    draw = ImageDraw.Draw(image)
    width = (frame.side - 2 * _EDGE * unit) / columns
    for n, (words, sign) in enumerate(entries):
        x = _EDGE * unit + (n % columns) * width
        y = (n // columns + 0.5) * _ROW * unit
        sign(draw, frame, x + 0.5 * _SIGN * unit, y)
        write(image, (x + _SIGN * unit, y), words, size, colours.INK)
    if numbers:
        place = (_EDGE * unit, (rows + 0.4) * _ROW * unit)
        write(image, place, _NUMBERS, size, colours.FAINT)
    return np.asarray(image.reduce(SMOOTHING))


def obstacle_kinds(scenario: Scenario) -> dict[str, colours.Colour]:
    """Words and tint of each kind of obstacle."""
    return {
        in_words(item.kind or "obstacle"): colours.of_obstacle(item.kind)
        for item in scenario.obstacles
    }


def decoration_kinds(scenario: Scenario) -> dict[str, colours.Colour]:
    """Words and tint of each kind of what lies on the ground and is no obstacle."""
    return {
        in_words(item.kind): colours.of_decoration(item.kind)
        for item in scenario.decorations
        if item.kind
    }


def in_words(kind: str) -> str:
    """A kind as a legend says it."""
    return {"no_fly": "no-fly zone"}.get(kind, kind.replace("_", " "))


def _kinds(scenario: Scenario) -> list[tuple[str, Sign]]:
    standing = obstacle_kinds(scenario).items()
    lying = decoration_kinds(scenario).items()
    return [
        *((words, _patch(tint, edged=True)) for words, tint in standing),
        *((words, _patch(tint, edged=False)) for words, tint in lying),
    ]
