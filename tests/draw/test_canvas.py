"""The canvas: what is drawn is averaged over blocks of 2 x 2 pixels."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

from uas_coverage_env.draw.canvas import Canvas


@settings(max_examples=30, deadline=None, derandomize=True)
@given(size_px=st.integers(1, 40), seed=st.integers(0, 2**32 - 1))
def test_a_pixel_is_the_rounded_mean_of_four(size_px, seed):
    side = 2 * size_px
    drawn = np.random.default_rng(seed).integers(0, 256, (side, side, 3), dtype=np.uint8)
    canvas = Canvas(side)
    canvas.image.paste(Image.fromarray(drawn))
    sums = drawn.reshape(size_px, 2, size_px, 2, 3).astype(int).sum(axis=(1, 3))
    np.testing.assert_array_equal(canvas.smoothed(), (sums + 2) // 4)


@pytest.mark.parametrize("size_px", [4, 5])
def test_a_picture_is_an_array_of_its_own(size_px):
    canvas = Canvas(2 * size_px)
    picture = canvas.smoothed()
    assert picture.shape == (size_px, size_px, 3)
    assert picture.flags.c_contiguous
    canvas.image.paste((255, 255, 255), (0, 0, *canvas.image.size))
    assert not picture.any()
    assert (canvas.smoothed() == 255).all()
