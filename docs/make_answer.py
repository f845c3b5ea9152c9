"""Write docs/pictures/answer.jpg: frames of a language model's answer, at the peaks of its gestures and between them.

Run: python docs/make_answer.py [--film FILE]
"""

import argparse
from pathlib import Path

import numpy as np
from make_pictures import JPEG_QUALITY, SIDE, labelled, peak_s, sheet
from PIL import Image

from tts2face.picture.options import Picture
from tts2face.session.session import Session

PICTURE = Path(__file__).parent / "pictures/answer.jpg"
FACE, MARKUP = "tomas", "llm"
ANSWER = """<think>They want a reason. Keep it short.</think>[happy] **Great** question! 😊

1. *nods* The sky is blue because air scatters short waves most. (thinking) That is Rayleigh's law.
2. At sunset light crosses more air, *looks away* so that only red is left. 😮

*laughs* And no, it is not the sea. [sad] You cannot touch it, *sighs* but you can watch it.

<smile>Any other questions?</smile> 😉"""
# What shows each gesture, in their order.
TAGS = (
    "**Great**", "smiling emoji", "*nods*", "(thinking)", "*looks away*", "astonished emoji", "*laughs*", "*sighs*",
    "<smile>", "winking emoji",
)  # fmt: skip
N_FRAMES, COLUMNS = 24, 6
WORD_PIXELS = 26


def answer_sheet(session: Session) -> Image.Image:
    """Frames at the peaks of all gestures and between them, in order of time."""
    pieces = list(session.stream(ANSWER, markup=MARKUP))
    gestures = [gesture for piece in pieces for gesture in piece.timeline.gestures]
    shown = {
        gesture.time + peak_s(gesture.name): f"{tag}: {gesture.name.replace('_', ' ')}"
        for tag, gesture in zip(TAGS, gestures, strict=True)
    }
    clip = session.clip(ANSWER, markup=MARKUP)
    seconds = len(clip.motion) / clip.fps
    while len(shown) < N_FRAMES:  # the middle of the longest time without a frame
        times = np.array([0.0, *sorted(shown), seconds])
        at = int(np.diff(times).argmax())
        middle = float(times[at : at + 2].mean())
        shown[middle] = f"{middle:.1f} s"
    renderer = session.renderer(Picture(size=f"{SIDE}x{SIDE}"))
    last = len(clip.motion) - 1
    cells = [
        labelled(renderer.frame(clip, min(round(time * clip.fps), last)), words, WORD_PIXELS)
        for time, words in sorted(shown.items())
    ]
    whole = sheet(cells, COLUMNS)
    return whole.resize((whole.width // 2, whole.height // 2), Image.Resampling.LANCZOS)


def main() -> None:
    """Write the sheet, and the film if it has a path."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--film", type=Path, help="film of the whole answer")
    given = parser.parse_args()
    session = Session(face=FACE)
    answer_sheet(session).save(PICTURE, quality=JPEG_QUALITY, optimize=True)
    if given.film is not None:
        session.write(ANSWER, given.film, markup=MARKUP)


if __name__ == "__main__":
    main()
