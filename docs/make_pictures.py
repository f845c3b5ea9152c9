"""The pictures of the README and the docs: ``python docs/make_pictures.py [--own-face me.talker]``."""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from corpus_tools.gesture_study.analysis import Options as GestureOptions
from corpus_tools.gesture_study.write import write_gestures
from corpus_tools.similarity.analysis import Options
from corpus_tools.similarity.write import write_similarity
from lexicon.phones import ipa_to_arpabet
from lexicon.sequence import SILENCE
from tts2face.catalogue import identities
from tts2face.models.face_loading import load_face
from tts2face.models.talker import load_talker
from tts2face.render.draw import draw
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.session import Session

HERE = Path(__file__).parent / "pictures"
SENTENCE = "We were away a year ago, but Bob may move five big maps."
SPOKEN = ("w", "ɝ", "eɪ", "oʊ", "b", "ɑ", "m", "u", "f", "aɪ", "v", "æ")  # one frame for each, in the order of speech
NEW_SENTENCES = (
    "The quick brown fox jumps over the lazy dog.",
    "She sells sea shells, please believe me.",
    "My mother baked five big apple pies for Bob.",
)
SIDE = 240
WORD_PIXELS = 16


def labelled(pixels: NDArray[np.uint8], text: str) -> Image.Image:
    """A picture with a word in its corner."""
    picture = Image.fromarray(pixels)
    pen = ImageDraw.Draw(picture)
    pen.text((8, 6), text, fill="white", font=ImageFont.load_default(WORD_PIXELS))
    return picture


def sheet(pictures: list[Image.Image], columns: int) -> Image.Image:
    """Pictures in rows."""
    rows = -(-len(pictures) // columns)
    whole = Image.new("RGB", (columns * SIDE, rows * SIDE), "#39424e")
    for at, picture in enumerate(pictures):
        whole.paste(picture, (at % columns * SIDE, at // columns * SIDE))
    return whole


def clip_sheet() -> Image.Image:
    """Frames of one clip at the middle of twelve of its phones."""
    ready, request = Session(load_talker("grid_s1"), load_face("head")), Request(text=SENTENCE)
    renderer = ready.renderer(Picture(size=f"{SIDE}x{SIDE}", camera="close"))
    (piece,) = ready.stream(request)
    phones, pictures, after = piece.clip.speech.phones, [], 0
    for wanted in SPOKEN:
        at = phones.phones.index(wanted, after)
        after = at + 1
        middle = round((phones.edges[at] + phones.edges[at + 1]) / 2 * piece.clip.fps)
        word = next((word.text for word in piece.clip.speech.words if word.first <= at < word.last), SILENCE)
        pictures.append(labelled(renderer.frame(piece.clip, middle), f"{ipa_to_arpabet(wanted)}  {word}"))
    return sheet(pictures, 6)


def faces_sheet() -> Image.Image:
    """The shipped faces and the identities of the head, at rest."""
    chosen: list[tuple[str, str | None]] = [("head", None), ("cartoon", None)]
    chosen += [("head", name) for name in (entry.name for entry in identities())]
    pictures = []
    for name, identity in chosen:
        face = load_face(name, identity)
        still = np.zeros(len(face.shape_names), np.float32)
        pixels = draw(face, still, picture=Picture(size=f"{SIDE}x{SIDE}"))
        pictures.append(labelled(pixels, identity or name))
    return sheet(pictures, 6)


def own_face_sheet(talker: Path) -> Image.Image:
    """Frames of new sentences on the talker's own face, in the order of speech."""
    ready = Session(load_talker(str(talker)), "self")
    pictures = []
    for text in NEW_SENTENCES:
        request = Request(text=text, fps=25.0)
        renderer = ready.renderer(Picture(size=f"{SIDE}x{SIDE}"))
        (piece,) = ready.stream(request)
        phones = piece.clip.speech.phones
        for instant in np.linspace(phones.edges[1], phones.edges[-2], 6, endpoint=False):
            label = ipa_to_arpabet(phones.phones[phones.index_at(instant)])
            pictures.append(labelled(renderer.frame(piece.clip, round(instant * piece.clip.fps)), label))
    return sheet(pictures, 6)


def main() -> None:
    """Write the sheets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--own-face", type=Path, help="a talker with an appearance, for own_face.jpg")
    talker = parser.parse_args().own_face
    HERE.mkdir(exist_ok=True)
    if talker is not None:
        own_face_sheet(talker).save(HERE / "own_face.jpg", quality=85)
    write_similarity("grid_s1", HERE / "similarity.png", Options())
    write_gestures("starter", HERE / "gestures.png", GestureOptions())
    clip_sheet().save(HERE / "clip.png", optimize=True)
    faces_sheet().save(HERE / "faces.png", optimize=True)


if __name__ == "__main__":
    main()
