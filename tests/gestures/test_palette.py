"""The palette's file: what is written is read, and what is wrong is refused."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tts2face.models.palette import Derivation, Palette, Style
from tts2face.models.palette_file import KIND, load_palette, read_palette, write_palette
from tts2face.storage.tensors import read_tensors, write_tensors


def test_what_is_written_is_read(palette, tmp_path):
    file = tmp_path / "my.palette"
    write_palette(file, palette)
    read = read_palette(file)
    assert read.names == palette.names == ("double", "calm", "wild", "measured")
    assert read.derivations == palette.derivations
    np.testing.assert_array_equal(read.neutral, palette.neutral)
    for name, style in palette.styles.items():
        there = read.styles[name]
        np.testing.assert_array_equal(there.lengths, style.lengths)
        np.testing.assert_allclose(there.intensity, style.intensity, atol=0.02)  # dB, of 16-bit floats
        for feature, values in style.motion.items():
            step = values.std(axis=0) / 2000
            assert (np.abs(there.motion[feature] - values) <= 0.51 * step).all(), feature
    write_palette(tmp_path / "again.palette", read)
    assert (tmp_path / "again.palette").stat().st_size == file.stat().st_size


def test_another_rate(palette, tmp_path):
    file = tmp_path / "my.palette"
    write_palette(file, palette)
    arrays, header = read_tensors(file, KIND, 1)
    write_tensors(file, KIND, 1, arrays, header | {"fps": 60.0})
    with pytest.raises(DataError, match="recorded at 60 frames/s, not 30"):
        read_palette(file)


def test_a_part_is_missing(palette, tmp_path):
    file = tmp_path / "my.palette"
    write_palette(file, palette)
    arrays, header = read_tensors(file, KIND, 1)
    del arrays["style.calm.lengths"]
    write_tensors(file, KIND, 1, arrays, header)
    with pytest.raises(DataError, match=r"lacks the array style.calm.lengths"):
        read_palette(file)


def test_an_unknown_style(palette):
    with pytest.raises(InputError, match="no style 'angry' in the palette; it has double, calm, wild, measured"):
        palette.require("angry")


def test_no_such_palette():
    with pytest.raises(InputError, match="no palette 'nobody'"):
        load_palette("nobody")
    with pytest.raises(InputError, match="no palette file nobody"):
        load_palette("nobody.palette")


def test_a_derivation_from_nothing(palette):
    with pytest.raises(DataError, match="the style ghost is derived from nobody, which is missing"):
        replace(palette, derivations={"ghost": Derivation("nobody", {}, "")})


def test_no_style(palette):
    with pytest.raises(DataError, match="holds no style"):
        Palette(palette.neutral, palette.regions, {}, {})


def test_motion_of_other_lengths(palette):
    style = palette.styles["calm"]
    with pytest.raises(DataError, match="a style's head does not fit its 1800 frames"):
        replace(style, motion={"head": style.motion["head"][:-1]})
    with pytest.raises(DataError, match="differ in length"):
        Style(style.lengths, style.intensity[:-1], style.pitch, {})


def test_motion_with_other_channels(palette):
    style = replace(palette.styles["calm"], motion={"gaze": np.zeros((1800, 3), np.float32)})
    with pytest.raises(DataError, match="gaze of the style odd has 3 channels"):
        replace(palette, styles={"odd": style}, derivations={})
