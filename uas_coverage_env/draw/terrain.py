"""What stays the same in all pictures of a scenario: ground, obstacles, fence, pads, scales."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import colours, marks
from uas_coverage_env.draw.frame import Frame
from uas_coverage_env.draw.labels import free_place, metres
from uas_coverage_env.draw.text import fitted, width_of, write
from uas_coverage_env.geometry import ConvexPolytope
from uas_coverage_env.geometry.outline import outline_of
from uas_coverage_env.scenario import Scenario

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

# Towards the light, north-west and up (NED): the common direction on maps.
_LIGHT = np.array([0.45, -0.45, -0.77])
# Metres of shadow per metre of height, towards the south-east.
_SHADOW = np.array([-0.32, 0.32])
_TALL_M = 50.0
_OVERHEAD_M = 1.0  # under what hangs higher, one walks
# Sum of red, green and blue below which dark words cannot be read.
_DARK = 400
# Of the letters of heights, in pixels of the design.
_HEIGHT = 8.5


def terrain(scenario: Scenario, frame: Frame) -> "Image":
    """The background of all pictures of a scenario.

    Args:
        scenario: What is drawn.
        frame: Where it is drawn.
    """
    from PIL import Image, ImageDraw

    image = Image.new("RGB", (frame.side, frame.side), colours.PAPER)
    draw = ImageDraw.Draw(image)
    fence = outline_of(scenario.fence.vertices_m)
    draw.polygon(_flat(frame.pixels(fence)), fill=colours.GROUND)
    _grid(draw, frame, fence)
    for decoration in scenario.decorations:
        fill = colours.of_decoration(decoration.kind)
        corners = _flat(frame.pixels(np.array(decoration.polygon_m)))
        draw.polygon(corners, fill=fill)
        if decoration.kind == "pad":
            draw.line([*corners, *corners[:2]], fill=colours.FAINT, width=round(frame.unit))
    overhead = lintels(scenario)
    if not is_plan(scenario):
        _shadows(image, frame, scenario.hulls)
    places = height_places(scenario, frame)
    for o, (obstacle, hull, place) in enumerate(
        zip(scenario.obstacles, scenario.hulls, places, strict=True)
    ):
        if overhead[o]:
            edge = outline_of(hull.vertices_m)
            edge = _flat(frame.pixels(np.vstack([edge, edge[:1]])))
            draw.line(edge, fill=colours.FAINT, width=round(frame.unit))
        else:
            words = height_words(hull, scenario.fence)
            _obstacle(image, draw, frame, obstacle.kind or "", hull, words, place)
    edge = _flat(frame.pixels(np.vstack([fence, fence[:2]])))
    draw.line(edge, fill=colours.INK, width=round(1.5 * frame.unit), joint="curve")
    _scale_and_north(image, draw, frame, fence)
    _pads(draw, frame, np.array([(uas.start_m, uas.home_m) for uas in scenario.uas]).reshape(-1, 3))
    _margins(image, draw, frame, scenario.name)
    return image


def is_plan(scenario: Scenario) -> bool:
    """Whether it is drawn as the plan of a building, so that doors are seen: without shadows."""
    return scenario.planar is not None or bool(scenario.doors_m)


def lintels(scenario: Scenario) -> list[bool]:
    """Of each obstacle, whether a plan shows its outline alone: what hangs above a doorway."""
    ground_m = float(scenario.fence.vertices_m[:, 2].max())
    plan = is_plan(scenario)
    return [
        plan and ground_m - float(hull.vertices_m[:, 2].max()) > _OVERHEAD_M
        for hull in scenario.hulls
    ]


def height_places(scenario: Scenario, frame: Frame) -> list[tuple[float, float] | None]:
    """Where on each obstacle its height stands, hidden by no waypoint; None: nowhere."""
    points = scenario.waypoints
    centres = frame.pixels(np.array([point.position_m for point in points]))
    discs = np.column_stack([centres, [point.radius_m * frame.scale for point in points]])
    size = _HEIGHT * frame.letter
    return [
        free_place(
            frame.pixels(outline_of(hull.vertices_m)),
            np.array([width_of(height_words(hull, scenario.fence), size), size]) + frame.unit,
            discs,
        )
        for hull in scenario.hulls
    ]


def scale_step_m(extent_m: float) -> float:
    """The length of the scale bar of a map: 1, 2 or 5 × 10^k, a quarter of the map at most."""
    power = 10.0 ** np.floor(np.log10(extent_m / 4))
    return float(power * max(factor for factor in (1, 2, 5) if factor * power <= extent_m / 4))


def _grid(draw: "ImageDraw", frame: Frame, fence: NDArray[np.float64]) -> None:
    """Lines every 1, 2 or 5 × 10^k metres, about five over the map."""
    step_m = scale_step_m(np.ptp(fence, axis=0).max())
    low, high = fence.min(axis=0), fence.max(axis=0)
    for axis in (0, 1):
        for at in np.arange(np.ceil(low[axis] / step_m), high[axis] / step_m) * step_m:
            ends = np.array([low, high])
            ends[:, axis] = at
            draw.line(_flat(frame.pixels(ends)), fill=colours.GRID, width=round(frame.unit))


def _scale_and_north(
    image: "Image", draw: "ImageDraw", frame: Frame, fence: NDArray[np.float64]
) -> None:
    """Below the map: how far apart the lines of the grid are, and an arrow to the north."""
    unit, size = frame.unit, 9 * frame.letter
    step_m = scale_step_m(np.ptp(fence, axis=0).max())
    x, y = (frame.pixels(fence.min(axis=0)) + np.array([0, 11 * unit])).tolist()
    end = x + step_m * frame.scale
    draw.line((x, y, end, y), fill=colours.INK, width=round(2 * unit))
    words = f"{step_m:g} m"
    write(image, (end + 5 * unit, y), words, size, colours.INK)
    x = end + width_of(words, size) + 22 * unit
    arrow = (x, y - 5 * unit, x - 4 * unit, y + 5 * unit, x + 4 * unit, y + 5 * unit)
    draw.polygon(arrow, fill=colours.INK)
    write(image, (x + 7 * unit, y), "N", size, colours.INK)


def _shadows(image: "Image", frame: Frame, hulls: tuple[ConvexPolytope, ...]) -> None:
    """All shadows in one layer, so that where two meet they do not add up."""
    from PIL import Image, ImageDraw

    mask = Image.new("L", image.size, 0)
    draw = ImageDraw.Draw(mask)
    for hull in hulls:
        ground_z = hull.vertices_m[:, 2].max()
        height_m = ground_z - hull.vertices_m[:, 2]
        shadow = hull.vertices_m[:, :2] + height_m[:, None] * _SHADOW
        outline = outline_of(np.vstack([shadow, hull.vertices_m[:, :2]]))
        draw.polygon(_flat(frame.pixels(outline)), fill=60)
    image.paste(colours.INK, mask=mask)


def _obstacle(
    image: "Image",
    draw: "ImageDraw",
    frame: Frame,
    kind: str,
    hull: ConvexPolytope,
    words: str,
    place: tuple[float, float] | None,
) -> None:
    """The faces that can be seen from above, lit, in the tint of the kind; darker where taller.

    Its height, in `words`, stands at `place`.
    """
    height_m = float(np.ptp(hull.vertices_m[:, 2]))
    tint = colours.of_obstacle(kind)
    tint = colours.shaded(tint, 1.08 - 0.3 * min(1.0, height_m / _TALL_M))
    distances = hull.face_distances(hull.vertices_m)
    for face in np.flatnonzero(hull.normals[:, 2] < -1e-6):
        corners = hull.vertices_m[np.abs(distances[:, face]) < 1e-6]
        light = 0.62 + 0.5 * max(0.0, float(hull.normals[face] @ _LIGHT))
        draw.polygon(_flat(frame.pixels(outline_of(corners))), fill=colours.shaded(tint, light))
    outline = outline_of(hull.vertices_m)
    edge = _flat(frame.pixels(np.vstack([outline, outline[:1]])))
    width = round((1 + min(1.0, height_m / _TALL_M)) * frame.unit)
    draw.line(edge, fill=colours.shaded(tint, 0.55), width=width, joint="curve")
    ink = colours.WHITE if sum(tint) < _DARK else colours.shaded(tint, 0.35)
    if place is not None:
        write(image, place, words, _HEIGHT * frame.letter, ink, align=0.5)


def height_words(hull: ConvexPolytope, fence: ConvexPolytope) -> str:
    """How high an obstacle is, as it stands on maps of what a fence is around."""
    height_m, most_m = (float(np.ptp(body.vertices_m[:, 2])) for body in (hull, fence))
    return f"{metres(height_m, most_m)} m"


def _pads(draw: "ImageDraw", frame: Frame, pads_m: NDArray[np.float64]) -> None:
    for x, y in np.unique(frame.pixels(pads_m), axis=0).tolist():
        marks.pad(draw, frame, x, y)


def _margins(image: "Image", draw: "ImageDraw", frame: Frame, name: str) -> None:
    """The name above the map and the altitude scale beside it."""
    unit = frame.unit
    size = 14 * frame.letter
    name = fitted(name, size, frame.side / 2 - 20 * unit - width_of("covered 100 / 100", size) / 2)
    write(image, (8 * unit, frame.header / 2), name, size, colours.INK)
    x = frame.gauge + 8 * unit
    top, bottom = frame.gauge_height(frame.ceiling_m), frame.gauge_height(frame.floor_m)
    draw.line((x, top, x, bottom), fill=colours.FAINT, width=round(1.5 * unit))
    for altitude_m in np.linspace(frame.floor_m, frame.ceiling_m, 6).tolist():
        y = frame.gauge_height(altitude_m)
        draw.line((x, y, x + 4 * unit, y), fill=colours.FAINT, width=round(unit))
        words = metres(altitude_m, frame.ceiling_m - frame.floor_m)
        write(image, (x + 7 * unit, y), words, 9 * frame.letter, colours.FAINT)
    write(image, (x - 4 * unit, top - 12 * unit), "alt [m]", 9 * frame.letter, colours.FAINT)


def _flat(pixels: NDArray[np.float64]) -> list[float]:
    return pixels.ravel().tolist()
