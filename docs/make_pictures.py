"""The pictures of the README and the docs: ``python docs/make_pictures.py [--own-face me.talker]``."""

import argparse
import tempfile
from collections.abc import Iterator, Sequence
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
from tts2face.catalogue import haircuts, identities
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.palette import load_palette
from tts2face.models.talker import load_talker
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.render.draw import draw, mesh_renderer
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
SHAPES_TEXT = "My father thinks she saw you leave the old red boat."
SHAPES = ("m", "f", "ɑ", "ð", "θ", "ʃ", "u", "l", "i", "b")  # one frame for each, in the order of speech
MOUTH_PIXELS = 800  # side of the pictures from which the mouths are cut
MOUTHS = {"0,0,600": (240, 408), "38,0,600": (20, 408)}  # left upper corner of the mouth in each view
MOOD_TEXT = "I have a lot to tell you, so please sit down and listen while I explain what happened yesterday."
N_MOOD_FRAMES = 6
DRAWN = ("ada", "ben", "noor", "zuri")
LIT = (*DRAWN, "mara", "tomas")
DYED = {
    "ada": ("blond", "black", "auburn"),
    "ben": ("blond", "red", "grey"),
    "noor": ("dark-brown", "auburn", "blond"),
    "zuri": ("auburn", "light-brown", "red"),
}  # colours of their haircuts
HAIR_VIEWS = ("front", "three-quarter")
CAST_VIEWS, CAST_COLUMNS = ("front", "three-quarter", "profile", "close"), 9
CAST_TEXT, CAST_PHONES = "My father, thin as he was, saw you leave the room.", ("m", "f", "ɑ", "θ", "u", "i")
SMILE = {"mouthSmile": 0.9, "cheekSquint": 0.5, "eyeSquint": 0.2}
PHOTOGRAPHED = ("ada", "tomas", "noor")
PHOTO_POSES: Sequence[tuple[str, dict[str, float], tuple[int, int, int]]] = (
    ("a", {"jawOpen": 0.55}, (0, 0, 0)),
    ("i", {"jawOpen": 0.15, "mouthStretchLeft": 0.5, "mouthStretchRight": 0.5}, (0, 0, 0)),
    ("u", {"jawOpen": 0.1, "mouthPucker": 0.8, "mouthFunnel": 0.3}, (0, 0, 0)),
    ("blink", {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}, (0, 0, 0)),
    ("turned", {"eyeLookOutLeft": 0.3, "eyeLookInRight": 0.3}, (4, 14, 3)),
)  # shapes, and pitch, yaw and roll in degrees
SIDE = 320
WORD_PIXELS = 18
JPEG_QUALITY = 88


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


def frames_of_phones(
    session: Session, text: str, wanted: Sequence[str], picture: Picture
) -> Iterator[tuple[NDArray[np.uint8], str, str]]:
    """Frames at the middle of phones of a text, in the order of speech, each with its phone and word."""
    request = Request(text=text)
    renderer = session.renderer(picture)
    (piece,) = session.stream(request)
    phones, after = piece.clip.speech.phones, 0
    for phone in wanted:
        at = phones.phones.index(phone, after)
        after = at + 1
        middle = round((phones.edges[at] + phones.edges[at + 1]) / 2 * piece.clip.fps)
        word = next((word.text for word in piece.clip.speech.words if word.first <= at < word.last), SILENCE)
        yield renderer.frame(piece.clip, middle), phone, word


def clip_sheet() -> Image.Image:
    """Frames of one clip at the middle of twelve of its phones."""
    picture = Picture(size=f"{SIDE}x{SIDE}")
    return sheet(
        [
            labelled(pixels, f"{ipa_to_arpabet(phone)}  {word}")
            for pixels, phone, word in frames_of_phones(Session(), SENTENCE, SPOKEN, picture)
        ],
        4,
    )


def shapes_sheet() -> Image.Image:
    """Mouth shapes of ten phones within one sentence, from the front and from three quarters."""
    pictures = []
    for camera, (left, top) in MOUTHS.items():
        picture = Picture(size=f"{MOUTH_PIXELS}x{MOUTH_PIXELS}", camera=camera)
        pictures.append(
            [
                labelled(pixels[top : top + SIDE, left : left + SIDE], f"{ipa_to_arpabet(phone)}  {word}")
                for pixels, phone, word in frames_of_phones(Session(), SHAPES_TEXT, SHAPES, picture)
            ]
        )
    rows = [row[at : at + 5] for at in (0, 5) for row in pictures]
    return sheet([picture for row in rows for picture in row], 5)


def still(face: Face, label: str, camera: str = "front") -> Image.Image:
    """A face at rest."""
    weights = np.zeros(len(face.shape_names), np.float32)
    return labelled(draw(face, weights, picture=Picture(size=f"{SIDE}x{SIDE}", camera=camera)), label)


def faces_sheet() -> Image.Image:
    """The shipped faces and the identities of the head, at rest."""
    chosen: list[tuple[str, str | None]] = [*((name, None) for name in LIT), ("head", None)]
    chosen += [("head", name) for name in (entry.name for entry in identities())]
    return sheet([still(load_face(name, identity), identity or name) for name, identity in chosen], 4)


def cast_sheet() -> Image.Image:
    """Each face in film light at rest in four views, in six phones, smiling, and in each mood."""
    pictures = []
    for name in LIT:
        session = Session(face=name)
        face, shown = session.face.mesh, Picture(size=f"{SIDE}x{SIDE}")
        pictures += [still(face, camera, camera) for camera in CAST_VIEWS]
        pictures += [
            labelled(pixels, ipa_to_arpabet(phone))
            for pixels, phone, _ in frames_of_phones(session, CAST_TEXT, CAST_PHONES, shown)
        ]
        smiling = np.array([SMILE.get(one.removesuffix("Left").removesuffix("Right"), 0.0) for one in face.shape_names])
        pictures.append(labelled(draw(face, smiling, picture=shown), "smile"))
        renderer = session.renderer(shown)
        for style in load_palette("starter").derivations:
            clip = session.clip(MOOD_TEXT, style=style)
            pictures.append(labelled(renderer.frame(clip, len(clip.motion) // 2), style))
        pictures += [Image.new("RGB", (SIDE, SIDE))] * (-len(pictures) % CAST_COLUMNS)
    whole = sheet(pictures, CAST_COLUMNS)
    return whole.resize((whole.width // 2, whole.height // 2), Image.Resampling.LANCZOS)


def hair_sheet() -> Image.Image:
    """The haircuts on the default head, from the front and from three quarters."""
    pictures = [
        still(load_face("head", hair=entry.name), entry.name, camera)
        for entry in haircuts()
        if entry.face == "head"
        for camera in ("front", "three-quarter")
    ]
    return sheet(pictures, 6)


def drawn_hair_sheet() -> Image.Image:
    """The haircuts of each drawn character, and then each in another colour."""
    pictures = []
    for name in DRAWN:
        own = [entry.name for entry in haircuts() if entry.face == name]
        dyed = list(zip(own, DYED[name], strict=True))
        pictures += [still(load_face(name, hair=cut), cut, camera) for cut in own for camera in HAIR_VIEWS]
        pictures += [still(load_face(name, hair=cut, hair_color=colour), colour) for cut, colour in dyed]
    whole = sheet(pictures, 3 * len(HAIR_VIEWS) + 3)
    return whole.resize((whole.width // 2, whole.height // 2), Image.Resampling.LANCZOS)


def moods_sheet() -> Image.Image:
    """Frames of one sentence in each mood, evenly spaced."""
    session, pictures = Session(), []
    renderer = session.renderer(Picture(size=f"{SIDE}x{SIDE}"))
    for style in load_palette("starter").derivations:
        clip = session.clip(MOOD_TEXT, style=style)
        at = np.linspace(0, len(clip.motion) - 1, N_MOOD_FRAMES + 2).round().astype(int)[1:-1]
        pictures += [labelled(renderer.frame(clip, int(number)), style) for number in at]
    return sheet(pictures, N_MOOD_FRAMES)


def photo_sheet() -> Image.Image:
    """Pictures of shipped people, each as it is and as it speaks, blinks and turns."""
    cells = []
    with tempfile.TemporaryDirectory() as folder:
        for name in PHOTOGRAPHED:
            path = Path(folder) / f"{name}.png"
            Image.fromarray(draw(load_face(name), picture=Picture(size="640x640"))).save(path)
            face = face_from_photo(path, consent="drawn")
            renderer = mesh_renderer(face, Picture(size=f"{SIDE}x{SIDE}", camera="0,0,760"))
            cells.append(labelled(renderer.draw(np.zeros(len(face.shape_names), np.float32)), name))
            for label, weights, head in PHOTO_POSES:
                values = np.array([weights.get(shape, 0.0) for shape in face.shape_names], np.float32)
                pose = np.array([*np.radians(head), 0, 0, 0], np.float32)
                cells.append(labelled(renderer.draw(values, pose), label))
    return sheet(cells, 1 + len(PHOTO_POSES))


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
    sheets = {
        "cast": cast_sheet,
        "photo": photo_sheet,
        "drawn-hair": drawn_hair_sheet,
        "clip": clip_sheet,
        "faces": faces_sheet,
        "hair": hair_sheet,
        "moods": moods_sheet,
        "shapes": shapes_sheet,
    }
    for name, draw_sheet in sheets.items():
        draw_sheet().save(HERE / f"{name}.jpg", quality=JPEG_QUALITY)


if __name__ == "__main__":
    main()
