"""Pictures of a person with a cover, against the same sums written out."""

import numpy as np
import pytest

from tts2face.picture.baked.cut_out import compose_over, find_covers
from tts2face.picture.baked.surface import COVER_SHIFT, OPAQUE, stack_pages

HEIGHT, WIDTH, N_SAMPLES = 6, 7, 4
FRAGMENTS = (
    np.array([0, *np.cumsum(np.tile([1, 0, 2, 1, 2, 1, 0], HEIGHT))], np.int32),
    np.array([4, 1, 2, 3, 1, 3, 2] * HEIGHT, np.int32),
)  # first fragment of each pixel, and samples: whole, partly covered and empty pixels


@pytest.mark.parametrize("channels", [3, 4])
def test_pixels_are_the_mean_of_fragments_before_the_wall(channels: int) -> None:
    rng = np.random.default_rng(3)
    first, samples = FRAGMENTS
    colour = rng.uniform(-20, 280, (3, len(samples))).astype(np.float32)
    covers = rng.random(len(samples)).astype(np.float32)
    wall = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    picture = rng.integers(0, 256, (HEIGHT, WIDTH, channels), np.uint8)
    drawn = picture.copy()
    compose_over((first, samples, N_SAMPLES), colour, covers, wall, drawn)
    for row in range(HEIGHT):
        for column in range(WIDTH):
            span = slice(*first[row * WIDTH + column : row * WIDTH + column + 2])
            share = samples[span] / N_SAMPLES
            own, before = share * covers[span], picture[row, column].astype(float)
            rest = 1 - share.sum()
            light = (colour[:, span].clip(0, 255) * own).sum(axis=1)
            if channels == 3:
                wanted = light + (share - own).sum() * wall[row, column] + rest * before
            else:
                cover = own.sum() + rest * before[3] / 255
                mixed = (light + rest * before[3] / 255 * before[:3]) / max(cover, 1e-3)
                wanted = np.append(mixed, 255 * cover)
            np.testing.assert_allclose(drawn[row, column], wanted if share.size else before, atol=0.51)


def test_texels_hold_colours_and_cover_between_which_a_place_lies() -> None:
    rng = np.random.default_rng(4)
    pages, covers = rng.integers(0, 256, (2, 128, 128, 3), np.uint8), rng.integers(0, 256, (2, 128, 128), np.uint8)
    texels, (width, height) = stack_pages(pages, 0, covers)
    rows = texels.reshape(height, width)
    np.testing.assert_array_equal(rows[:128] & 255, pages[0, :, :, 0])
    np.testing.assert_array_equal(rows[128:256] >> 16 & 255, pages[1, :, :, 2])
    np.testing.assert_array_equal(rows[:256] >> COVER_SHIFT & OPAQUE, covers.reshape(256, 128))
    assert (rows[256:] >> COVER_SHIFT & OPAQUE == OPAQUE).all()
    halved, _ = stack_pages(pages, 1, covers)
    mean = covers[0].reshape(64, 2, 64, 2).mean(axis=(1, 3))
    np.testing.assert_array_equal(halved.reshape(-1, 64)[:64] >> COVER_SHIFT & OPAQUE, np.rint(mean))
    corners = np.array([[rows[5, 6]], [rows[5, 7]], [rows[6, 6]], [rows[6, 7]]], np.int32)
    found = np.zeros(1, np.float32)
    find_covers(corners, np.array([[0.25], [0.5]], np.float32), 1, found)
    around = covers[0, 5:7, 6:8] / 255
    assert found[0] == pytest.approx((0.75 * around[:, 0] + 0.25 * around[:, 1]).mean(), abs=1e-6)
