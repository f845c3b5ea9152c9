"""The pictures of the README and the docs: ``python docs/make_pictures.py [SHEET...] [--own-face me.talker]``.

``python docs/make_pictures.py --photos me.jpg you.png --out sheet.jpg`` makes that of photographs of others.
"""

import argparse
import csv
import json
import re
import runpy
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from importlib.resources import files
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from corpus_tools.dense.avatar import build_avatar
from corpus_tools.studies.gestures.analysis import StudyOptions
from corpus_tools.studies.gestures.write import write_gestures
from corpus_tools.studies.similarity.analysis import SimilarityOptions
from corpus_tools.studies.similarity.write import write_similarity
from lexicon.gesture_names import GESTURES
from lexicon.phones import ipa_to_arpabet
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face import export
from tts2face.face.expressions import add_expression_shapes
from tts2face.face.landmarks import landmark_positions
from tts2face.face.stand_in import VISEME_PREFIX, viseme_table
from tts2face.gestures.elements import Gesture
from tts2face.gestures.movements import TimedGesture
from tts2face.interchange.characters.families import FOLDER, general_family, program_families
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.landmark_table import landmark_table
from tts2face.interchange.characters.shapes import HEADER
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.palette_file import load_palette
from tts2face.models.talker_file import load_talker
from tts2face.numeric.arrays import Float32Array
from tts2face.photo.face_from_photo import face_from_photo
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, draw, mesh_renderer
from tts2face.request import Request
from tts2face.session.catalogue import haircuts, identities
from tts2face.session.session import Session
from tts2face.types import Clip, Speech, Trajectory, Waveform, resting_head

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
GESTURES_FACE, GESTURE_GAP_S, GESTURE_COLUMNS = "tomas", 4.5, 8
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
PHOTO_POSES: Sequence[tuple[str, dict[str, float], tuple[int, int, int]]] = (
    ("a", {"jawOpen": 0.55}, (0, 0, 0)),
    ("i", {"jawOpen": 0.15, "mouthStretchLeft": 0.5, "mouthStretchRight": 0.5}, (0, 0, 0)),
    ("u", {"jawOpen": 0.1, "mouthPucker": 0.8, "mouthFunnel": 0.3}, (0, 0, 0)),
    ("blink", {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}, (0, 0, 0)),
    ("turned", {"eyeLookOutLeft": 0.3, "eyeLookInRight": 0.3}, (4, 14, 3)),
)  # shapes, and pitch, yaw and roll in degrees
PHOTO_SIDE, PHOTO_CELL, PHOTO_WORD_PIXELS = 640, 128, 34  # px; words are reduced with the cells
PHOTO_KINDS: Sequence[tuple[str, str, str]] = (
    ("realistic head", "head", "studio"),
    ("drawn face", "ada", "studio"),
    ("grey picture", "tomas", "studio"),
    ("cut out, on teal", "zuri", "teal"),
    ("opaque, blurred", "ben", "blur"),
)  # kinds of pictures, the face that is photographed, and the background of the clip
AVATAR_OF = "noor"
BOOKS = ("#7a3b2e", "#c9b48a", "#3f5a6b", "#52683f", "#8f7a55", "#d8d2c4", "#6b4a63")
FAMILY_TEXT, FAMILY_PHONES = "Father may move five beads.", ("f", "ɑ", "m", "u", "i")
FAMILY_POSE = {"mouthSmileLeft": 0.9, "mouthSmileRight": 0.9, "eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0}
FAMILY_CELL, FAMILY_WORD_PIXELS = 128, 13  # px
FAMILIES_A_ROW = 2
FAMILY_CAMERA = "0,0,480"
STATUES = ("mara", "tomas")
STATUE_CAMERA = "16,2,520"
SIDE = 320
PHOTO_PICTURE = Picture(size=f"{SIDE}x{SIDE}", camera="0,0,760")
WORD_PIXELS = 18
JPEG_QUALITY = 88


def labelled(pixels: NDArray[np.uint8], text: str, size: int = WORD_PIXELS) -> Image.Image:
    """A picture with words in its corner."""
    picture = Image.fromarray(pixels)
    pen = ImageDraw.Draw(picture)
    pen.text((8, 6), text, fill="white", font=ImageFont.load_default(size))
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


def named_gestures_sheet() -> Image.Image:
    """Each named gesture at its peak, in silence; cells of half a side."""
    with tempfile.TemporaryDirectory() as folder:
        timeline = Path(folder) / "gestures.json"
        begins = {name: GESTURE_GAP_S * (number + 0.5) for number, name in enumerate(GESTURES)}
        elements = [{"time": begin, "name": name} for name, begin in begins.items()]
        timeline.write_text(json.dumps({"gestures": elements}), encoding="utf-8")
        session = Session(face=GESTURES_FACE)
        clip = session.clip(
            "", idle=GESTURE_GAP_S * len(begins) + 1.0, timeline=timeline, gaze="camera", gain="blink=0"
        )
    renderer = session.renderer(Picture(size=f"{SIDE}x{SIDE}"))
    cells = []
    for name, begin in begins.items():
        frame = renderer.frame(clip, round((begin + peak_s(name)) * clip.fps))
        cells.append(labelled(frame, name.replace("_", " "), 2 * WORD_PIXELS))
    whole = sheet(cells, GESTURE_COLUMNS)
    return whole.resize((whole.width // 2, whole.height // 2), Image.Resampling.LANCZOS)


def peak_s(name: str) -> float:
    """Second of a gesture at which its movements together are largest."""
    timed = TimedGesture.of(Gesture(0.0, name))
    times = np.arange(0.0, timed.duration, 0.02)
    moved = [np.abs(movement.values(times, keys)) for movement, keys in timed.movements]
    return float(times[np.sum([values / values.max() for values in moved], axis=0).argmax()])


def photo_sheet() -> Image.Image:
    """Pictures of shipped people by kind, each as it is and as it speaks, blinks and turns, and the head of one."""
    with tempfile.TemporaryDirectory() as folder:
        rows = [
            photo_row(write_still(kind, name, background, Path(folder)), kind, background)
            for kind, name, background in PHOTO_KINDS
        ]
        rows.append(avatar_row(write_still("picture", AVATAR_OF, "studio", Path(folder))))
    return photo_cells(rows)


def sheet_of_photos(photos: Sequence[Path]) -> Image.Image:
    """Pictures, each as it is and as it speaks, blinks and turns, and then as a head."""
    return photo_cells([row for photo in photos for row in (photo_row(photo, photo.stem, "studio"), avatar_row(photo))])


def photo_cells(rows: Sequence[list[Image.Image]]) -> Image.Image:
    """Rows of cells, small."""
    whole = sheet([cell for row in rows for cell in row], 1 + len(PHOTO_POSES))
    return whole.resize([side * PHOTO_CELL // SIDE for side in whole.size], Image.Resampling.LANCZOS)


def write_still(kind: str, name: str, background: str, folder: Path) -> Path:
    """Picture file of a shipped face: grey, cut out, or before shelves that a clip blurs, by its kind."""
    path = folder / f"{name}.png"
    size = f"{PHOTO_SIDE}x{PHOTO_SIDE}"
    shown = Picture(size=size, background="studio" if background == "studio" else "transparent")
    picture = Image.fromarray(draw(load_face(name), picture=shown))
    if background == "blur":
        behind = shelves(PHOTO_SIDE)
        behind.paste(picture, mask=picture.getchannel("A"))
        picture = behind
    (picture.convert("L") if "grey" in kind else picture).save(path)
    return path


def shelves(side: int) -> Image.Image:
    """Books in four rows."""
    rng, picture = np.random.default_rng(0), Image.new("RGB", (side, side), "#5d4532")
    pen, height = ImageDraw.Draw(picture), side // 4
    for bottom in range(height - 8, side, height):
        left = 0
        while left < side:
            wide, high = (int(rng.integers(*span)) for span in ((side // 40, side // 16), (height // 2, height - 16)))
            pen.rectangle((left, bottom - high, left + wide, bottom), BOOKS[int(rng.integers(len(BOOKS)))])
            left += wide + 2
    return picture


def photo_row(photo: Path, label: str, background: str) -> list[Image.Image]:
    """A picture as it is, then its face in each pose before a background."""
    face, shown = face_from_photo(photo, consent="nobody"), replace(PHOTO_PICTURE, background=background)
    return [photo_still(face, label), *posed(mesh_renderer(face, shown))]


def avatar_row(photo: Path) -> list[Image.Image]:
    """A picture as it is, then its head in each pose, turned twice as far."""
    with tempfile.TemporaryDirectory() as folder:
        build_avatar([photo], Path(folder) / "head.face", consent="nobody")
        head = load_face(str(Path(folder) / "head.face"))
    picture = photo_still(face_from_photo(photo, consent="nobody"), "picture and head")
    return [picture, *posed(mesh_renderer(head, PHOTO_PICTURE), 2)]


def photo_still(face: Face, label: str) -> Image.Image:
    """A face of a picture at rest, which is the picture."""
    weights = np.zeros(len(face.shape_names), np.float32)
    return labelled(draw(face, weights, picture=PHOTO_PICTURE), label, PHOTO_WORD_PIXELS)


def posed(renderer: MeshRenderer, turn: float = 1.0) -> Iterator[Image.Image]:
    """A face in each pose of photographs, its head turned by so many times the degrees."""
    for label, weights, head in PHOTO_POSES:
        values = np.array([weights.get(shape, 0.0) for shape in renderer.scene.face.shape_names], np.float32)
        pose = np.array([*(turn * np.radians(head)), 0, 0, 0], np.float32)
        yield labelled(renderer.draw(values, pose), label, PHOTO_WORD_PIXELS)


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


def families_sheet() -> Image.Image:
    """The shipped head under the names of each family, imported: five phones of a sentence, a smile with a blink."""
    names = [family.name for family in (*program_families(), general_family())]
    rows = [family_row(name) for name in names]
    n_rows, width = -(-len(rows) // FAMILIES_A_ROW), len(rows[0]) * FAMILY_CELL
    whole = Image.new("RGB", (FAMILIES_A_ROW * width, n_rows * FAMILY_CELL), "#39424e")
    for number, row in enumerate(rows):
        column, line = divmod(number, n_rows)
        for at, picture in enumerate(row):
            whole.paste(picture, (column * width + at * FAMILY_CELL, line * FAMILY_CELL))
    return whole


def family_row(name: str) -> list[Image.Image]:
    """Pictures of the head whose shapes have the first names of a family, written as .glb and imported."""
    head = load_face("head")
    own = family_shapes(head, name)
    limits = np.tile(np.array([0.0, 1.0], np.float32), (len(own), 1))
    named = replace(
        head, shape_names=tuple(own), shapes=np.stack(list(own.values())), limits=limits, scores=None, occlusion=None,
        eyes=tuple(replace(eye, turns={}) for eye in head.eyes),
    )  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        file, table = Path(folder) / "named.glb", Path(folder) / "landmarks.tsv"
        export(silent_clip(named), file, face=named)
        places = zip(head.landmarks.tolist(), landmark_positions(head).astype(np.float64) / 1000.0, strict=True)
        table.write_text(landmark_table(dict(places)), encoding="utf-8")
        face = import_face(file, landmarks=table).face
    picture = Picture(size=f"{FAMILY_CELL}x{FAMILY_CELL}", camera=FAMILY_CAMERA)
    spoken = frames_of_phones(Session(face=face), FAMILY_TEXT, FAMILY_PHONES, picture)
    cells = [pixels for pixels, *_ in spoken]
    posed = add_expression_shapes(face)
    cells.append(draw(posed, np.array([FAMILY_POSE.get(one, 0.0) for one in posed.shape_names]), picture=picture))
    words = (name.replace("_", " "), *map(ipa_to_arpabet, FAMILY_PHONES[1:]), "smile, blink")
    return [labelled(pixels, word, FAMILY_WORD_PIXELS) for pixels, word in zip(cells, words, strict=True)]


def statues_sheet() -> Image.Image:
    """Statues of shipped faces, imported with the shapes of the shipped head: at rest, and phones of a sentence."""
    write_statue = runpy.run_path(str(HERE.with_name("statue.py")))["write_statue"]  # scripts of docs are no package
    cells = []
    for name in STATUES:
        with tempfile.TemporaryDirectory() as folder:
            write_statue(load_face(name), Path(folder) / "statue.obj")
            face = import_face(Path(folder) / "statue.obj", shapes="transfer").face
        picture = Picture(size=f"{SIDE}x{SIDE}", camera=STATUE_CAMERA)
        cells.append(labelled(draw(face, np.zeros(len(face.shape_names)), picture=picture), f"statue of {name}"))
        spoken = frames_of_phones(Session(face=face), FAMILY_TEXT, FAMILY_PHONES, picture)
        cells += [
            labelled(pixels, ipa_to_arpabet(phone)) for (pixels, *_), phone in zip(spoken, FAMILY_PHONES, strict=True)
        ]
    return sheet(cells, 1 + len(FAMILY_PHONES))


def family_shapes(head: Face, family: str) -> Mapping[str, Float32Array]:
    """Displacements (N, 3) of the head by the first names of a family's table, whose sums are ARKit's shapes."""
    lines = files(FOLDER).joinpath(f"{family}.tsv").read_text("utf-8").splitlines()
    table = list(csv.DictReader((line for line in lines if not line.startswith("#")), delimiter="\t"))
    sums: dict[str, list[tuple[str, float]]] = {}
    for row in table:
        shape, first, gain = (row[column] for column in HEADER)
        sides = ("Left", "Right") if shape.endswith("*") else ("",)
        for number, side in enumerate(sides):
            named = [re.sub(r"\{([^/}]*)/([^}]*)\}", rf"\{at + 1}", first.split("|")[0]) for at in range(2)]
            added = [named[number]] if side else list(dict.fromkeys(named))
            sums.setdefault(shape.removesuffix("*") + side, []).extend((one, float(gain)) for one in added)
    own: dict[str, Float32Array] = {}
    for shape, sources in sums.items():
        moved = displaced(head, shape)
        for name, gain in sources:
            # a name of two directions has been moved by the shape of the other one
            if gain > 0 or name not in own:
                own[name] = own.get(name, np.zeros_like(moved)) + moved / np.float32(gain * len(sources))
    return {name: moved for name, moved in own.items() if moved.any()}


def displaced(head: Face, shape: str) -> Float32Array:
    """Displacement (N, 3) by a shape of the head, or by the sum that is a viseme."""
    weights = viseme_table().get(shape.removeprefix(VISEME_PREFIX), {shape: 1.0})
    moved = np.zeros(head.vertices.shape, np.float32)
    for name, weight in weights.items():
        if name in head.shape_names:
            moved += np.float32(weight) * head.shapes[head.shape_names.index(name)]
    return moved


def silent_clip(face: Face) -> Clip:
    """A clip of one frame of a face at rest."""
    motion = Trajectory(face.shape_names, np.zeros((1, len(face.shape_names)), np.float32), 30.0)
    waveform = Waveform(np.zeros(800, np.float32), 24000)
    return Clip(motion, resting_head(1, 30.0), Speech(waveform, PhoneSequence((SILENCE,), np.array([0.0, 1 / 30])), ()))


SHEETS = {
    "cast": cast_sheet,
    "photo": photo_sheet,
    "drawn-hair": drawn_hair_sheet,
    "clip": clip_sheet,
    "faces": faces_sheet,
    "families": families_sheet,
    "hair": hair_sheet,
    "moods": moods_sheet,
    "named_gestures": named_gestures_sheet,
    "shapes": shapes_sheet,
    "statues": statues_sheet,
}


def main() -> None:
    """Write the sheets."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sheets", nargs="*", metavar="SHEET", help=f"{', '.join(SHEETS)}; all and the plots if omitted")
    parser.add_argument("--own-face", type=Path, help="a talker with an appearance, for own_face.jpg")
    parser.add_argument("--photos", type=Path, nargs="+", help="pictures of people, for the sheet --out alone")
    parser.add_argument("--out", type=Path, default=Path("photos.jpg"), help="sheet of --photos")
    given = parser.parse_args()
    if unknown := set(given.sheets) - set(SHEETS):
        parser.error(f"there is no sheet {', '.join(sorted(unknown))}; choose {', '.join(SHEETS)}")
    if given.photos:
        sheet_of_photos(given.photos).save(given.out, quality=JPEG_QUALITY)
        return
    HERE.mkdir(exist_ok=True)
    if given.own_face is not None:
        own_face_sheet(given.own_face).save(HERE / "own_face.jpg", quality=85)
    if not given.sheets:
        write_similarity("grid_s1", HERE / "similarity.png", SimilarityOptions())
        write_gestures("starter", HERE / "gestures.png", StudyOptions())
    for name in given.sheets or SHEETS:
        SHEETS[name]().save(HERE / f"{name}.jpg", quality=JPEG_QUALITY, optimize=True)


if __name__ == "__main__":
    main()
