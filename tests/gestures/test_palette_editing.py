"""Derived styles by mixing, new names and removal: laws with known answers, and refusals."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.models.palette import FeatureChange, Palette
from tts2face.models.palette_editing import (
    StyleMix,
    add_derivation,
    check_new_style,
    mix_styles,
    remove_style,
    rename_style,
)
from tts2face.models.palette_file import load_palette, read_palette, write_palette


def test_one_style_in_full_is_that_style():
    starter = load_palette("starter")
    for name, derived in starter.derivations.items():
        mixed = mix_styles(starter, StyleMix("grid_s1", {name: 1.0})).changes
        for feature in {*mixed, *derived.changes}:
            wanted, found = derived.changes.get(feature, FeatureChange()), mixed.get(feature, FeatureChange())
            assert (found.gain, found.tempo) == pytest.approx((wanted.gain, wanted.tempo)), (name, feature)
            assert found.offset == pytest.approx(dict(wanted.offset)), (name, feature)


def test_nothing_mixed_changes_nothing(palette: Palette):
    assert mix_styles(palette, StyleMix("wild", {"double": 0.0})).changes == {}


def test_values_of_a_mix(palette: Palette):
    mix = StyleMix("wild", {"double": 0.5}, {"happy": 0.1, "sad": -0.2}, {"head": 1.5}, 0.8)
    derived = mix_styles(palette, mix)
    assert derived.source == "wild"
    head, expression, brows = (derived.changes[name] for name in ("head", "expression", "brows"))
    assert (head.gain, head.tempo, head.offset) == (pytest.approx(1.5 * 2**0.5), 0.8, {})
    assert (expression.gain, expression.offset) == (1.0, pytest.approx({"happy": 0.35, "sad": -0.2}))
    assert brows.tempo == pytest.approx(0.8 * 2**0.5)
    assert derived.summary == "derived from wild: double 50%, happy +0.1, sad -0.2, head x 1.5, tempo x 0.8"


def test_a_motion_without_size_fades_with_its_share(palette: Palette):
    still = replace(palette.derivations["double"], changes={"head": FeatureChange(gain=0.0)})
    quiet = replace(palette, derivations={"still": still})
    assert mix_styles(quiet, StyleMix("calm", {"still": 0.25})).changes["head"].gain == 0.75


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"shares": {"double": 1.1}}, "the share of double must lie between 0 and 1"),
        ({"expressions": {"bored": 0.1}}, "no expression 'bored'"),
        ({"expressions": {"happy": 2.0}}, "the weight of happy must lie"),
        ({"sizes": {"ears": 1.0}}, "no feature 'ears'"),
        ({"sizes": {"head": -1.0}}, "the size of head must lie"),
        ({"tempo": float("nan")}, "tempo must be a number, not NaN"),
        ({"tempo": 3.0}, "the tempo must lie between 0.5 and 2"),
        ({"shares": {"calm": 1.0}}, "no derived style 'calm'"),
        ({"source": "double"}, "no recorded style 'double'"),
    ],
)
def test_wrong_mixes(palette: Palette, change: dict, reason: str):
    with pytest.raises(InputError, match=reason):
        mix_styles(palette, StyleMix(**({"source": "calm"} | change)))


@pytest.mark.parametrize("name", ["", "  ", "x" * 41, "a=b", "a,b", "a\nb\0", "../up"])
def test_names_that_mean_something_else(palette: Palette, name: str):
    with pytest.raises(InputError, match="cannot be called"):
        check_new_style(palette, name)


@pytest.mark.parametrize("name", ["calm", "double", " measured "])
def test_names_that_are_taken(palette: Palette, name: str):
    with pytest.raises(InputError, match="has a style"):
        add_derivation(palette, name, palette.derivations["double"])


def test_a_new_name_keeps_order_motion_and_what_is_derived(palette: Palette):
    renamed = rename_style(palette, "calm", "my calm")
    assert renamed.names == ("double", "my calm", "wild", "measured")
    assert renamed.derivations["double"].source == "my calm"
    assert renamed.styles["my calm"] is palette.styles["calm"]
    assert rename_style(palette, "double", "twice").names == ("twice", "calm", "wild", "measured")
    with pytest.raises(InputError, match="no style 'measured' that can be changed"):
        rename_style(palette, "measured", "mine")


def test_removal(palette: Palette):
    with pytest.raises(InputError, match="double is derived from calm"):
        remove_style(palette, "calm")
    less = remove_style(remove_style(palette, "double"), "calm")
    assert less.names == ("wild", "measured")
    with pytest.raises(InputError, match="the only recorded style"):
        remove_style(less, "wild")


def test_a_palette_that_was_read_is_written_unchanged(palette: Palette, tmp_path):
    """Otherwise adding a style would change the motion of the others by rounding."""
    write_palette(tmp_path / "one.palette", palette)
    read = read_palette(tmp_path / "one.palette")
    write_palette(tmp_path / "two.palette", read)
    assert (tmp_path / "one.palette").read_bytes() == (tmp_path / "two.palette").read_bytes()
    again = read_palette(tmp_path / "two.palette")
    for feature, values in read.styles["wild"].motion.items():
        np.testing.assert_array_equal(again.styles["wild"].motion[feature], values)
