"""Displacements of skin in the user's cache folder."""

from pathlib import Path

import numpy as np
import pytest

from tts2face.face import shape_transfer
from tts2face.face.shape_transfer import spread_landmark_motion
from tts2face.models.face_loading import load_face


def test_displacements_are_the_same_with_any_cache_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    face = load_face("ada")
    landmarks = face.landmarks[:20]
    motion = np.random.default_rng(0).normal(size=(1, len(landmarks), 3))
    folder = tmp_path / "tts2face" / "displacements"
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with monkeypatch.context() as patch:
        patch.setattr(shape_transfer, "MIN_CACHED_POINTS", 10**9)
        computed = spread_landmark_motion(face, landmarks, motion)
    assert np.abs(computed).max() > 0.1
    assert not folder.exists()

    np.testing.assert_array_equal(spread_landmark_motion(face, landmarks, motion), computed)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    np.testing.assert_array_equal(spread_landmark_motion(face, landmarks, motion), computed)
    assert path.read_bytes() == whole

    with monkeypatch.context() as patch:
        patch.setattr(shape_transfer, "fit_local_interpolant", lambda *_: pytest.fail("computed again"))
        np.testing.assert_array_equal(spread_landmark_motion(face, landmarks, motion), computed)
        with pytest.raises(pytest.fail.Exception, match="computed again"):
            spread_landmark_motion(face, landmarks, 2 * motion)
    path.unlink()
    folder.rmdir()
    folder.write_bytes(b"a file where the folder should be")
    np.testing.assert_array_equal(spread_landmark_motion(face, landmarks, motion), computed)
