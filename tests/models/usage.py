"""Use of a loaded model file, and a process that tries it on mutations of a file.

``python -m tests.models.usage KIND FILE FIRST LAST`` prints one JSON line for each mutation from FIRST to LAST,
after one for the unchanged file (seed -1); seconds are processor time.
"""

import faulthandler
import json
import sys
import tempfile
import time
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np

from corpus_tools.describe_talker import describe
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.fuzz.mutations import mutate_model
from tts2face.gestures.noise import NoiseStream
from tts2face.gestures.stream import GestureFields, GestureStream
from tts2face.gestures.timeline import Timeline
from tts2face.lips.exemplar import (
    appearance_trajectory,
    blend_trajectory,
    build_appearance_exemplars,
    build_exemplar_model,
    select_tokens,
)
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face_file import read_face
from tts2face.models.face_loading import load_face
from tts2face.models.palette_file import read_palette
from tts2face.models.talker import speech_channels
from tts2face.models.talker_file import load_talker, read_talker
from tts2face.picture.options import Picture
from tts2face.picture.own_face import draw_video_frame, own_face_renderer
from tts2face.picture.renderer import mesh_renderer
from tts2face.session.catalogue import identities
from tts2face.types import Trajectory, Waveform

HANG_S = 60.0  # after which the process ends itself
PHONES = PhoneSequence([SILENCE, "b", "ɑ", "m", "i", "t", "f", "u", SILENCE], np.arange(10) * 0.1)
SOUND = Waveform(0.1 * np.sin(np.arange(24_000) ** 1.2), 16_000)


def use_face(path: Path) -> None:
    """Draw a small frame and retarget a few frames; with an identity where there is one."""
    identity = next((entry.name for entry in identities(str(path))), None)
    face = read_face(path, identity)
    talker = load_talker("grid_s1")
    n_speech = talker.model.n_speech
    values = talker.utterances[0].shape[:5, :n_speech]
    lips = build_retargeter(talker, face, contact=np.zeros(11)).retarget(
        Trajectory(speech_channels(talker.model), values, 25.0)
    )
    renderer = mesh_renderer(face, Picture(size="64x64", supersampling=1))
    renderer.draw(lips.values[2])
    renderer.draw(face.limits.max(axis=1), np.array([0.1, 0.2, 0.1, 1, 2, 3], np.float32))


def use_palette(path: Path) -> None:
    """Make a short stream of gestures, by a style and by noise."""
    palette = read_palette(path)
    fields = GestureFields(palette, with_pitch=True)
    for name in (palette.names[0], palette.names[-1]):
        for stream in (GestureStream, NoiseStream):
            gestures = stream(fields, style=name, seed=3, fps=30.0).next(SOUND, 45, Timeline())
            assert all(np.isfinite(values).all() for values in gestures.values())


def use_talker(path: Path) -> None:
    """Describe a talker, animate a few phones, retarget them, apply its audio maps, and draw its own face."""
    talker = read_talker(path)
    assert describe(talker).text()
    exemplars = build_exemplar_model(talker)
    selection = select_tokens(PHONES, exemplars)
    lips = blend_trajectory(selection, exemplars, fps=25.0, n_frames=22)
    build_retargeter(talker, load_face("head")).retarget(lips)
    for audio_map in talker.audio_maps.values():
        assert np.isfinite(audio_map.parameters(np.ones((5, len(audio_map.mean)), np.float32))).all()
    if talker.appearance is not None:
        looks = appearance_trajectory(selection, build_appearance_exemplars(talker, exemplars), fps=25.0, n_frames=22)
        renderer = own_face_renderer(talker, Picture(size="64x64", supersampling=1))
        for number in (0, 10):
            motion = np.concatenate([lips.values[number], looks.values[number]])
            draw_video_frame(renderer, motion, renderer.plate_frame(number / 25.0))


USES: dict[str, Callable[[Path], None]] = {"face": use_face, "palette": use_palette, "talker": use_talker}


def outcome(kind: str, path: Path) -> str:
    """``used``, the DataError, or the traceback of anything else."""
    try:
        USES[kind](path)
    except DataError as refused:
        return f"DataError: {refused}"
    except Exception:  # noqa: BLE001 - any other error is what is looked for
        return traceback.format_exc()
    return "used"


def main(kind: str, file: str, first: int, last: int) -> None:
    """Try the unchanged file, then its mutations."""
    warnings.simplefilter("ignore")
    source = Path(file)
    USES[kind](source)  # compiles
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / f"mutated.{kind}"
        for seed in (-1, *range(first, last)):
            faulthandler.dump_traceback_later(HANG_S, exit=True)
            what = "nothing" if seed < 0 else mutate_model(source, kind, out, seed)
            begin = time.process_time()
            answer = outcome(kind, source if seed < 0 else out)
            row = {"seed": seed, "what": what, "seconds": time.process_time() - begin, "answer": answer}
            sys.stdout.write(json.dumps(row) + "\n")
            sys.stdout.flush()
    faulthandler.cancel_dump_traceback_later()


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]))
