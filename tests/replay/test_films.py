"""Films of flights, read back."""

import dataclasses
import re
import subprocess

import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

from uas_coverage_env.files.strict_toml import InputError
from uas_coverage_env.flight import flight_picture
from uas_coverage_env.replay import write_gif, write_video

STEPS = 6


def shortened(flight, steps):
    """The first steps of a flight."""
    series = ("x", "u", "voltage_V", "current_A", "mode", "covered", "moving_position_m")
    return dataclasses.replace(
        flight,
        **{name: getattr(flight, name)[: steps + 1] for name in series},
        plan=flight.plan[flight.plan["step"] < steps],
        decisions=flight.decisions[:steps],
    )


@pytest.fixture(scope="module")
def short(flight):
    return shortened(flight, STEPS)


def distance(one, other) -> float:
    return float(np.abs(one.astype(float) - other.astype(float)).mean())


def test_a_video_has_a_picture_per_sample_and_holds_the_last(short, tmp_path):
    path = write_video([short], tmp_path / "film.mp4", fps=5)
    decoder = [imageio_ffmpeg.get_ffmpeg_exe(), "-i", str(path)]
    decoder += ["-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    decoded = subprocess.run(decoder, capture_output=True, check=True)
    assert re.search(r"Video: h264 .* yuv420p.* 896x896.* 5 fps", decoded.stderr.decode())
    pictures = np.frombuffer(decoded.stdout, np.uint8).reshape(-1, 896, 896, 3)
    assert len(pictures) == STEPS + 1 + 10
    assert distance(pictures[3], flight_picture(short, 3, 896)) < 6
    assert distance(pictures[-1], flight_picture(short, STEPS, 896)) < 6


def test_a_gif_has_a_picture_per_sample_and_plays_for_ever(short, tmp_path):
    path = write_gif([short], tmp_path / "film.gif", fps=5)
    with Image.open(path) as film:
        assert film.info["loop"] == 0
        durations = []
        for k in range(getattr(film, "n_frames", 1)):
            film.seek(k)
            durations.append(film.info["duration"])
            if k == 3:
                picture = np.array(film.convert("RGB"))
    # pictures that are alike are one that lasts longer
    assert sum(durations) == (STEPS + 1) * 200 + 2000
    assert picture.shape == (512, 512, 3)
    assert distance(picture, flight_picture(short, 3, 512)) < 6


def test_two_flights_stand_side_by_side_and_the_shorter_one_waits(short, plain, tmp_path):
    path = write_gif([short, shortened(plain, 3)], tmp_path / "film.gif", fps=50)
    with Image.open(path) as film:
        assert film.size == (1024, 512)
        film.seek(STEPS)
        right = np.array(film.convert("RGB"))[:, 512:]
    assert distance(right, flight_picture(plain, 3, 512)) < 6


@pytest.mark.parametrize("write", [write_video, write_gif])
def test_a_film_that_cannot_be_written_is_refused_in_one_line(write, short, tmp_path):
    suffix = ".mp4" if write is write_video else ".gif"
    with pytest.raises(InputError) as refusal:
        write([short], tmp_path / "missing" / f"film{suffix}", fps=5)
    assert "\n" not in str(refusal.value)
