"""Films of flights from the pictures of `draw`: MP4 (extra `view`) and GIF (Pillow)."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import zip_longest
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from uas_coverage_env.draw import colours
from uas_coverage_env.files.plain_files import written_by
from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import Flight
from uas_coverage_env.flight.picture import flight_pictures

if TYPE_CHECKING:
    from PIL.Image import Image

# Video codecs work on blocks of 16 pixels.
_VIDEO_PX = 896
_GIF_PX = 512
# A GIF starts again after its last picture: time to see how the flight ended.
_LAST_PICTURE_S = 2.0
_GIF_COLOURS = 96


def write_video(flights: Sequence[Flight], path: Path, *, fps: int) -> Path:
    """Write an MP4 (H.264), one picture per sample; two flights side by side.

    Args:
        flights: The flights; the shorter one is held at its last picture.
        path: Where to write; replaced where it exists.
        fps: Pictures per second.

    Raises:
        InputError: imageio-ffmpeg is not installed, or the file cannot be written.
    """
    try:
        from imageio_ffmpeg import write_frames
    except ImportError as error:
        raise InputError(
            'a video needs imageio-ffmpeg: pip install "uas-coverage-env[view]" (or take --gif)'
        ) from error
    size = (_VIDEO_PX * len(flights), _VIDEO_PX)
    with _written(path) as place:
        writer = write_frames(
            str(place), size, fps=fps, codec="libx264", quality=7, ffmpeg_log_level="quiet"
        )
        try:
            writer.send(None)
            for picture in _pictures(flights, _VIDEO_PX, round(_LAST_PICTURE_S * fps)):
                writer.send(picture.tobytes())
        except OSError as error:
            raise InputError(f"{path}: ffmpeg stopped before the end of the film") from error
        finally:
            writer.close()
    return path


def write_gif(flights: Sequence[Flight], path: Path, *, fps: int) -> Path:
    """Write an animated GIF, one picture per sample; two flights side by side.

    Args:
        flights: The flights; the shorter one stands still in the end.
        path: Where to write; replaced where it exists.
        fps: Pictures per second; a GIF counts in hundredths of a second.

    Raises:
        InputError: The file cannot be written.
    """
    from PIL import Image

    duration_ms = 10 * max(2, round(100 / fps))
    held = round(_LAST_PICTURE_S * 1000 / duration_ms)
    colours_used = _palette(flights)
    frames = (
        Image.fromarray(picture).quantize(palette=colours_used, dither=Image.Dither.NONE)
        for picture in _pictures(flights, _GIF_PX, held)
    )
    with _written(path) as place:
        next(frames).save(
            place,
            format="GIF",
            save_all=True,
            append_images=frames,
            duration=duration_ms,
            loop=0,
            # what has not changed is left out, and packs better
            optimize=True,
        )
    return path


@contextmanager
def _written(path: Path) -> Iterator[Path]:
    try:
        with written_by(path) as place:
            yield place
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from error


def _palette(flights: Sequence[Flight]) -> "Image":
    """One set of colours for all pictures, so that what stands still costs nothing.

    Those of the map are taken from the last picture; those of small marks, which come and go, are
    added.
    """
    from PIL import Image

    last = [next(flight_pictures(flight, [flight.steps], _GIF_PX)) for flight in flights]
    of_map = Image.fromarray(np.hstack(last)).quantize(_GIF_COLOURS, dither=Image.Dither.NONE)
    marks = (colours.GREEN, colours.YELLOW, colours.RED, colours.INK, colours.WHITE, *colours.UAS)
    palette = Image.new("P", (1, 1))
    palette.putpalette([*(of_map.getpalette() or []), *(part for mark in marks for part in mark)])
    return palette


def _pictures(flights: Sequence[Flight], size_px: int, held: int) -> Iterator[NDArray[np.uint8]]:
    """Every sample of all flights side by side; the last picture is held."""
    films = [flight_pictures(flight, range(flight.steps + 1), size_px) for flight in flights]
    latest = [np.empty(0, np.uint8)] * len(films)
    picture = np.empty(0, np.uint8)
    for pictures in zip_longest(*films):
        latest = [
            now if now is not None else old for now, old in zip(pictures, latest, strict=True)
        ]
        picture = np.hstack(latest)
        yield picture
    for _ in range(held):
        yield picture
