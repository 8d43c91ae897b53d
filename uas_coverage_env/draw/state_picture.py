"""The picture of a state, seen from above: north up, east to the right."""

from collections.abc import Iterable, Mapping
from copy import copy
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import colours, marks
from uas_coverage_env.draw.canvas import Canvas
from uas_coverage_env.draw.frame import Frame
from uas_coverage_env.draw.labels import Box, metres, overlap, short_name
from uas_coverage_env.draw.terrain import terrain
from uas_coverage_env.draw.text import fitted, width_of, write
from uas_coverage_env.entities.state import FLYING, LANDED, STATUS_NAMES
from uas_coverage_env.scenario import Scenario
from uas_coverage_env.vehicle.layout import DOD, Z
from uas_coverage_env.world import SwarmState

if TYPE_CHECKING:
    from PIL.Image import Image
    from PIL.ImageDraw import ImageDraw

_SMALLEST_PX, _LARGEST_PX = 128, 4096
# More do not fit below the map; a larger swarm is summed up.
_NAMED_UAS = 4
_LABELLED_UAS = 12
_SIZE_OF_MANY = 0.6
_NAME_ROWS = (0, 1, -1, 2)


def picture(
    scenario: Scenario,
    swarm: SwarmState,
    *,
    paths_m: NDArray[np.float64] | None = None,
    planned_m: Mapping[str, NDArray[np.float64]] | None = None,
    size_px: int = 512,
) -> NDArray[np.uint8]:
    """One picture of one state.

    For many pictures of one scenario, keep a `Picture`: it draws the background only once.

    Args:
        scenario: The scenario flown.
        swarm: The state.
        paths_m: (T, U, 3) [m] where the UAS have been.
        planned_m: Name of a UAS -> (N, 3) [m], where it means to fly.
        size_px: Side of the picture.

    Returns:
        (size_px, size_px, 3) red, green, blue.
    """
    return Picture(scenario, size_px=size_px).draw(swarm, paths_m=paths_m, planned_m=planned_m)


class Picture:
    """Draws the states of one scenario; keeps the background between them.

    Args:
        scenario: The scenario flown.
        size_px: Side of the square pictures.

    Raises:
        ValueError: The size is no whole number between 128 and 4096.
    """

    def __init__(self, scenario: Scenario, *, size_px: int = 512) -> None:
        whole = isinstance(size_px, int | np.integer) and not isinstance(size_px, bool)
        if not whole or not _SMALLEST_PX <= size_px <= _LARGEST_PX:
            raise ValueError(
                f"size_px is {size_px!r}; give a whole number from {_SMALLEST_PX} to {_LARGEST_PX}"
            )
        self._scenario = scenario
        self._frame = frame = Frame.around(scenario.fence.vertices_m, int(size_px))
        positions_m = np.array([point.position_m for point in scenario.waypoints]).reshape(-1, 3)
        self._waypoints = frame.pixels(positions_m).tolist()
        self._heavy = marks.heavy_waypoints(scenario)
        self._radii = [point.radius_m * frame.scale for point in scenario.waypoints]
        self._labels = [short_name(uas.name) for uas in scenario.uas]
        self._canvas = Canvas(frame.side)
        self._terrain = terrain(scenario, frame).convert("RGBX")
        unit = frame.unit
        # the strips around the map
        self._margins = [
            (self._terrain.crop(box), box[:2])
            for box in (
                (0, 0, frame.side, round(frame.header - unit)),
                (0, round(frame.footer), frame.side, frame.side),
                (round(frame.gauge - 4 * unit), 0, frame.side, frame.side),
            )
        ]
        # the waypoints whose marks may share pixels with that of each one
        reach = np.array(self._radii) + 4 * frame.unit
        places = np.array(self._waypoints)
        apart = np.abs(places[:, None] - places).max(axis=2)
        self._touching = [np.flatnonzero(row).tolist() for row in apart < reach[:, None] + reach]
        # which were open when the map was drawn, and the map
        self._map: tuple[NDArray[np.bool_], Image] | None = None

    def draw(
        self,
        swarm: SwarmState,
        *,
        paths_m: NDArray[np.float64] | None = None,
        planned_m: Mapping[str, NDArray[np.float64]] | None = None,
        moving_paths_m: NDArray[np.float64] | None = None,
    ) -> NDArray[np.uint8]:
        """The picture of a state.

        Args:
            swarm: The state.
            paths_m: (T, U, 3) [m] where the UAS have been.
            moving_paths_m: (T, M, 3) [m] where the moving obstacles have been.
            planned_m: Name of a UAS -> (N, 3) [m], where it means to fly.

        Returns:
            (size_px, size_px, 3) red, green, blue; an array of its own.
        """
        from PIL import ImageDraw

        image = self._canvas.image
        image.paste(self._map_with_waypoints(swarm.uncovered))
        draw = ImageDraw.Draw(image)
        if moving_paths_m is not None and len(moving_paths_m) > 1:
            for pixels in self._frame.pixels(moving_paths_m).swapaxes(0, 1).tolist():
                marks.moving_path(draw, self._frame, [(x, y) for x, y in pixels])
        if paths_m is not None and len(paths_m) > 1:
            self._paths(draw, paths_m)
        if planned_m:
            self._plans(draw, swarm.names, planned_m)
        self._moving_obstacles(draw, swarm)
        self._swarm(image, draw, swarm)
        # a helicopter that has left the map, and its dotted circle, are covered again
        for strip, corner in self._margins:
            image.paste(strip, corner)
        self._altitudes(draw, swarm)
        self._captions(image, draw, swarm)
        return self._canvas.smoothed()

    def clone(self) -> "Picture":
        """Another one for the same scenario that shares background and canvas.

        It is for states that take turns with those of this one, such as another mission's.
        """
        clone = copy(self)
        clone._map = None
        return clone

    def _map_with_waypoints(self, uncovered: NDArray[np.bool_]) -> "Image":
        if self._map is None:
            self._map = (uncovered.copy(), self._terrain.copy())
            self._mark(self._map[1], range(len(uncovered)), uncovered)
        before, image = self._map
        # mostly none, seldom one: not worth drawing the other waypoints again
        for j in np.flatnonzero(before != uncovered).tolist():
            (x, y), reach = self._waypoints[j], self._radii[j] + 2 * self._frame.unit
            box = (int(x - reach), int(y - reach), int(x + reach) + 1, int(y + reach) + 1)
            patch = self._canvas.image
            patch.paste(self._terrain.crop(box), box[:2])
            self._mark(patch, self._touching[j], uncovered)
            image.paste(patch.crop(box), box[:2])
        before[:] = uncovered
        return image

    def _mark(self, image: "Image", waypoints: Iterable[int], uncovered: NDArray[np.bool_]) -> None:
        from PIL import ImageDraw

        draw = ImageDraw.Draw(image)
        for j in waypoints:
            (x, y), radius, heavy = self._waypoints[j], self._radii[j], self._heavy[j]
            open_ = bool(uncovered[j])
            marks.waypoint(draw, self._frame, x, y, radius, heavy=heavy, open_=open_)

    def _paths(self, draw: "ImageDraw", paths_m: NDArray[np.float64]) -> None:
        pixels = self._frame.pixels(paths_m)
        for i in range(pixels.shape[1]):
            line = pixels[:, i].ravel().tolist()
            draw.line(line, fill=_colour(i), width=round(1.7 * self._frame.unit))

    def _plans(
        self,
        draw: "ImageDraw",
        names: tuple[str, ...],
        planned_m: Mapping[str, NDArray[np.float64]],
    ) -> None:
        for name, positions_m in planned_m.items():
            colour = _colour(names.index(name))
            for x, y in self._frame.pixels(np.asarray(positions_m)).tolist():
                marks.planned(draw, self._frame, x, y, colour)

    def _moving_obstacles(self, draw: "ImageDraw", swarm: SwarmState) -> None:
        scale = self._frame.scale
        centres = self._frame.pixels(swarm.moving_position_m).tolist()
        for (x, y), moving in zip(centres, self._scenario.moving_obstacles, strict=True):
            radius = moving.radius_m * scale
            safe_radius = radius + moving.safe_distance_m * scale
            marks.moving_obstacle(draw, self._frame, x, y, radius, safe_radius)

    def _swarm(self, image: "Image", draw: "ImageDraw", swarm: SwarmState) -> None:
        frame, unit = self._frame, self._frame.unit
        centres = frame.pixels(swarm.x[:, :2]).tolist()
        spots: list[tuple[float, float, float, float]] = []
        size = 1.0 if len(centres) <= _LABELLED_UAS else _SIZE_OF_MANY
        for i, (x, y) in enumerate(centres):
            colour = _colour(i)
            if swarm.status[i] == FLYING:
                yaw, soc = float(swarm.heading_rad[i]), 1 - float(swarm.x[i, DOD])
                marks.flying(draw, frame, x, y, yaw, soc, colour, size)
                beside, up = 13 * unit, 9 * unit
            elif swarm.status[i] == LANDED:
                marks.landed(draw, frame, x, y, colour)
                beside, up = 7 * unit, 0.0
            else:
                marks.lost(draw, frame, x, y)
                beside, up = 11 * unit, 0.0
            spots.append((x, y, beside, up))
        if len(spots) <= _LABELLED_UAS:
            self._names(image, spots)

    def _names(self, image: "Image", spots: list[tuple[float, float, float, float]]) -> None:
        """The number of each UAS beside its mark, over all marks; no number lies on another."""
        unit, size = self._frame.unit, 11 * self._frame.letter
        taken: list[Box] = []
        for i, (x, y, beside, up) in enumerate(spots):
            name, colour = self._labels[i], colours.of_words(_colour(i))
            width = width_of(name, size)
            # no room at the edge of the map: write to the left
            left = x > self._frame.gauge - 35 * unit
            at = x - beside if left else x + beside
            for row in _NAME_ROWS:
                y_name = y - up + row * size
                box = (at - width if left else at, y_name, width, size)
                if not any(overlap(box, it) for it in taken):
                    taken.append(box)
                    place, halo = (at, y_name), 1.5 * unit
                    write(image, place, name, size, colour, align=float(left), halo=halo)
                    break

    def _altitudes(self, draw: "ImageDraw", swarm: SwarmState) -> None:
        """Where the flying UAS are on the altitude scale."""
        frame, unit = self._frame, self._frame.unit
        x = frame.gauge + 6 * unit
        for i, z in enumerate(swarm.x[:, Z].tolist()):
            if swarm.status[i] == FLYING:
                y = frame.gauge_height(-z)
                mark = [x, y, x - 8 * unit, y - 4 * unit, x - 8 * unit, y + 4 * unit]
                draw.polygon(mark, fill=_colour(i))

    def _captions(self, image: "Image", draw: "ImageDraw", swarm: SwarmState) -> None:
        frame, unit = self._frame, self._frame.unit
        y = frame.header / 2
        covered, waypoints = int((~swarm.uncovered).sum()), len(swarm.uncovered)
        middle = f"covered {covered} / {waypoints}"
        write(image, (frame.side / 2, y), middle, 14 * frame.letter, colours.INK, align=0.5)
        end = f"step {swarm.step} / {self._scenario.max_steps}"
        write(image, (frame.side - 8 * unit, y), end, 14 * frame.letter, colours.INK, align=1.0)
        y = (frame.footer + frame.side) / 2
        if len(swarm.names) > _NAMED_UAS:
            write(image, (8 * unit, y), _summed_up(swarm), 12 * frame.letter, colours.INK)
            return
        size, room = 10.5 * frame.letter, 496 / _NAMED_UAS * unit
        # as for the longest words, so that a name does not change while it flies
        longest = "  100 %, landed" if frame.detailed else "  100 %"
        room_for_name = room - 20 * unit - width_of(longest, size)
        for i, name in enumerate(swarm.names):
            x = 8 * unit + i * room
            draw.ellipse((x, y - 4 * unit, x + 8 * unit, y + 4 * unit), fill=_colour(i))
            words = f"{fitted(name, size, room_for_name)}  {100 * (1 - swarm.x[i, DOD]):.0f} %"
            if frame.detailed:
                status = swarm.status[i]
                high = metres(-swarm.x[i, Z], frame.ceiling_m - frame.floor_m)
                doing = f"{high} m" if status == FLYING else STATUS_NAMES[status]
                words += f", {doing}"
            write(image, (x + 11 * unit, y), words, size, colours.INK)


def _colour(i: int) -> colours.Colour:
    return colours.of_uas(i)


def _summed_up(swarm: SwarmState) -> str:
    counts = [int((swarm.status == status).sum()) for status in range(len(STATUS_NAMES))]
    parts = [f"{n} {name}" for n, name in zip(counts, STATUS_NAMES, strict=True) if n]
    lowest = 100 * (1 - swarm.x[:, DOD].max())
    return f"{len(swarm.names)} UAS: {', '.join(parts)}; lowest charge {lowest:.0f} %"
