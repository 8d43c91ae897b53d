"""What stands for a waypoint, a moving obstacle and a UAS."""

import math
from typing import TYPE_CHECKING

from uas_coverage_env.draw import colours
from uas_coverage_env.draw.colours import Colour
from uas_coverage_env.draw.frame import Frame
from uas_coverage_env.scenario import Scenario

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw


def heavy_waypoints(scenario: Scenario) -> list[bool]:
    """Of each waypoint whether it weighs more than the lightest: on all maps, two rings."""
    weights = [point.weight for point in scenario.waypoints]
    return [weight > min(weights) for weight in weights]


def waypoint(
    draw: "ImageDraw", frame: Frame, x: float, y: float, radius: float, *, heavy: bool, open_: bool
) -> None:
    """A ring of the true radius while open, a filled disc once covered; two rings for more weight.

    Args:
        draw: Where to draw.
        frame: The picture.
        x: Centre on the canvas.
        y: Centre on the canvas.
        radius: On the canvas.
        heavy: As `heavy_waypoints` says.
        open_: Still to be covered.
    """
    edge = colours.INK if open_ else colours.COVERED_EDGE
    width = max(1, round(1.2 * frame.unit))
    box = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, fill=None if open_ else colours.COVERED, outline=edge, width=width)
    if heavy:
        inner = radius - 3 * frame.unit
        if inner > frame.unit:
            box = (x - inner, y - inner, x + inner, y + inner)
            draw.ellipse(box, outline=edge, width=width)
    if not open_:
        # a tick, for eyes and printers without colour
        tick = min(radius, 7 * frame.unit) * 0.5
        corners = [x - tick, y, x - 0.25 * tick, y + 0.75 * tick, x + tick, y - 0.75 * tick]
        draw.line(corners, fill=colours.COVERED_EDGE, width=round(1.6 * frame.unit))


def moving_obstacle(
    draw: "ImageDraw", frame: Frame, x: float, y: float, radius: float, safe_radius: float
) -> None:
    """A disc for the cylinder and a dotted circle for the distance to be kept from it."""
    box = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, fill=colours.RED, outline=colours.INK, width=round(frame.unit))
    safe_distance(draw, frame, x, y, safe_radius)


def safe_distance(draw: "ImageDraw", frame: Frame, x: float, y: float, safe_radius: float) -> None:
    """A dotted circle around a moving obstacle."""
    # chords: an arc takes Pillow three times as long
    dashes = min(240, max(12, 3 * round(safe_radius / (4 * frame.unit))))
    for dash in range(dashes):
        ends = []
        for angle in (2 * math.pi * dash / dashes, 2 * math.pi * (dash + 0.5) / dashes):
            ends += [x + safe_radius * math.cos(angle), y + safe_radius * math.sin(angle)]
        draw.line(ends, fill=colours.RED, width=round(1.5 * frame.unit))


def flying(
    draw: "ImageDraw",
    frame: Frame,
    x: float,
    y: float,
    yaw: float,
    soc: float,
    colour: Colour,
    size: float = 1.0,
) -> None:
    """A cross turned to the heading, in a ring that is as long and as green as the charge.

    Args:
        draw: Where to draw.
        frame: The picture.
        x: Centre on the canvas.
        y: Centre on the canvas.
        yaw: [rad] clockwise from north.
        soc: State of charge, 0..1.
        colour: Colour of the UAS.
        size: Of the usual size.
    """
    unit = size * frame.unit
    radius = 11.5 * unit
    box = left, top, right, bottom = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, outline=colours.WHITE, width=round(4.5 * unit))
    inner = (left + unit, top + unit, right - unit, bottom - unit)
    draw.ellipse(inner, outline=colours.FAINT, width=round(unit))
    end = -90 + 360 * min(1.0, max(0.0, soc))
    draw.arc(box, -90, end, fill=colours.of_charge(soc), width=round(4 * unit))
    arm = 7.5 * unit
    for turned in (math.pi / 4, -math.pi / 4):
        dx, dy = arm * math.sin(yaw + turned), -arm * math.cos(yaw + turned)
        line = (x - dx, y - dy, x + dx, y + dy)
        draw.line(line, fill=colours.INK, width=round(2.2 * unit))
    nose = (x + arm * math.sin(yaw), y - arm * math.cos(yaw))
    draw.line((x, y, *nose), fill=colour, width=round(2.2 * unit))


def pad(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    """A small ring where a UAS starts, and lands."""
    radius = 5 * frame.unit
    box = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, fill=colours.WHITE, outline=colours.BLUE, width=round(1.5 * frame.unit))


def planned(draw: "ImageDraw", frame: Frame, x: float, y: float, colour: Colour) -> None:
    """A dot where a UAS means to be."""
    radius = 2 * frame.unit
    box = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, fill=colour, outline=colours.WHITE)


def moving_path(draw: "ImageDraw", frame: Frame, pixels: list[tuple[float, float]]) -> None:
    """A thin line where a moving obstacle has been."""
    draw.line(pixels, fill=colours.RED, width=round(frame.unit))


def landed(draw: "ImageDraw", frame: Frame, x: float, y: float, colour: Colour) -> None:
    """A small filled disc on its pad."""
    radius = 4 * frame.unit
    box = (x - radius, y - radius, x + radius, y + radius)
    draw.ellipse(box, fill=colour, outline=colours.WHITE, width=round(frame.unit))


def lost(draw: "ImageDraw", frame: Frame, x: float, y: float) -> None:
    """A red cross where the flight ended."""
    arm = 8 * frame.unit
    for ends in ((x - arm, y - arm, x + arm, y + arm), (x - arm, y + arm, x + arm, y - arm)):
        draw.line(ends, fill=colours.WHITE, width=round(6 * frame.unit))
    for ends in ((x - arm, y - arm, x + arm, y + arm), (x - arm, y + arm, x + arm, y - arm)):
        draw.line(ends, fill=colours.RED, width=round(3.2 * frame.unit))
