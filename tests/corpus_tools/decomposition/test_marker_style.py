"""A marker recording with marker stills becomes a style, from end to end."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.build_palette import StyleSource, build_style
from corpus_tools.decomposition.capture_files import MarkerOptions
from corpus_tools.decomposition.marker_sets import MarkerSet
from corpus_tools.decomposition.stills import Still, find_stills
from corpus_tools.run_options import RunOptions
from lexicon.errors import InputError
from tests.corpus_tools.decomposition.made_markers import Made, made_take, write_c3d, write_table
from tts2face.face.expressions import add_expression_shapes, expression_weights
from tts2face.face.landmarks import moved_landmarks
from tts2face.face.lip_constraints import build_lip_constraints
from tts2face.models.face import Face
from tts2face.models.palette import EXPRESSIONS
from tts2face.models.palette_file import load_palette, read_palette
from tts2face.types import Trajectory


@pytest.fixture
def recorded(made: Made, face: Face, marker_set: MarkerSet, tmp_path: Path) -> StyleSource:
    """Four seconds of markers at 120 frames a second with sound, and a folder of static captures."""
    whole = add_expression_shapes(face)
    shown = expression_weights(whole, build_lip_constraints(whole))[:, : len(face.shape_names)]
    weights = np.concatenate([np.zeros((1, shown.shape[1])), shown])
    stills = made_take(
        moved_landmarks(face, Trajectory(face.shape_names, weights, 30.0)), np.zeros((6, 6)), face, marker_set
    )
    folder = tmp_path / "stills"
    folder.mkdir()
    for row, name in enumerate(("neutral", *EXPRESSIONS)):
        write_table(folder / f"{name}.csv", stills.names, stills.points[row : row + 1].repeat(3, axis=0))
    sound = 0.2 * np.sin(np.arange(len(made.points) * 100) / 8.0)
    write_c3d(tmp_path / "take.c3d", made.names, made.points, sound=sound)
    options = MarkerOptions(neutral=folder / "neutral.csv")
    return StyleSource(recordings=tmp_path / "take.c3d", stills=find_stills(folder), marker_options=options)


def test_markers_and_their_stills_become_a_style(recorded: StyleSource, made: Made, tmp_path: Path) -> None:
    out = tmp_path / "worn.palette"
    built = build_style(
        recorded, "worn", out, base=load_palette("starter"), run_options=RunOptions(tmp_path / "cache", 1)
    )
    style = read_palette(out).styles["worn"]
    assert (built.n_kept, int(style.lengths.sum())) == (1, 120)
    assert "gaze" not in style.motion
    assert style.intensity.max() > -5
    true = made.head[::4, 1] - np.median(made.head[::4, 1])
    np.testing.assert_allclose(style.motion["head"][5:-5, 1], true[5:-5], atol=0.015)  # radians; smoothed at the ends
    raised = made.landmarks[::4, [105, 334], 1].mean(axis=1)
    modes = read_palette(out).regions["brows"]
    moved = np.einsum("tk,klc->tlc", style.motion["brows"], modes.modes)[..., 1].mean(axis=1)
    assert np.corrcoef(moved[10:-10], raised[10:-10])[0, 1] > 0.6  # the rest is in the expressions


def test_a_style_is_learnt_from_the_pieces_between_long_gaps(recorded: StyleSource, made: Made, tmp_path: Path) -> None:
    points = made.points.copy()
    points[200:240, made.names.index("LBRO2")] = np.nan
    write_c3d(recorded.recordings, made.names, points)
    out = tmp_path / "worn.palette"
    built = build_style(
        recorded, "worn", out, base=load_palette("starter"), run_options=RunOptions(tmp_path / "cache", 1)
    )
    assert read_palette(out).styles["worn"].lengths.tolist() == [50, 60]
    assert any(note.startswith("take: the marker LBRO2 is hidden from 1.67 to 2.00 s") for note in built.notes)


def test_epsilon_widens_the_limits_of_the_weights(recorded: StyleSource, tmp_path: Path) -> None:
    weights = {}
    for epsilon in (0.0, 0.5):
        out = tmp_path / f"{epsilon}.palette"
        build_style(recorded, "worn", out, base=None, epsilon=epsilon, run_options=RunOptions(tmp_path / "cache", 1))
        style = read_palette(out).styles["worn"]
        weights[epsilon] = style.motion["expression"]
        assert ("--epsilon 0.5" in style.metadata["command"]) == (epsilon == 0.5)
    assert weights[0.0].min() >= -1e-3  # steps of 16 bits
    assert -0.5 - 1e-3 <= weights[0.5].min() < -0.01
    with pytest.raises(InputError, match=r"epsilon must lie between 0 and 1, not 1\.1"):
        build_style(recorded, "x", tmp_path / "x.palette", base=None, epsilon=1.1)


def test_stills_of_two_kinds(recorded: StyleSource, tmp_path: Path) -> None:
    mixed = {**recorded.stills, "sad": Still(tmp_path / "sad.png")}
    with pytest.raises(InputError, match="marker stills cannot be mixed with pictures"):
        build_style(
            replace(recorded, stills=mixed), "x", tmp_path / "x.palette", base=None, run_options=RunOptions(tmp_path, 1)
        )
    assert not (tmp_path / "x.palette").exists()
