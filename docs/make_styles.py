"""Make the clips and the contact sheet of the starter palette's styles in docs/pictures.

Run: python docs/make_styles.py
"""

from pathlib import Path

import av
import numpy as np
from PIL import Image, ImageDraw

from tts2face.models.face_loading import load_face
from tts2face.models.palette import load_palette
from tts2face.models.talker import load_talker
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.session import Session

PICTURES = Path(__file__).parent / "pictures"
# Ten seconds each; the second one with a pause, in which a face must go on living.
TEXTS = (
    "We were away a year ago, but Bob may move five big maps. I have a lot to tell you, so please sit down and listen "
    "while I explain what happened yesterday.",
    "Do you know what they told me this morning? [pause 0.8] They said that nobody would come before half past seven, "
    "and that we should [nod] wait for them outside.",
)
FACES = ("head", "cartoon")
SIDE, FPS = 192, 25.0
N_SHOWN, SHOWN = 10, 80  # frames of each clip on the sheet, pixels of each


def main() -> None:
    """Two clips for each style, and one sheet with frames of them all."""
    rows = []
    for style in load_palette("starter").derivations:
        for number, (text, face) in enumerate(zip(TEXTS, FACES, strict=True), start=1):
            ready = Session(load_talker("grid_s1"), load_face(face))
            out = PICTURES / f"style_{style}_{number}.mp4"
            request = Request(text=text, style=style, seed=number, fps=FPS)
            ready.write(request, out, picture=Picture(size=f"{SIDE}x{SIDE}"))
            rows.append((f"{style}, {face}", _frames(out)))
    _sheet(rows).save(PICTURES / "styles.jpg", quality=80)


def _frames(clip: Path) -> list[Image.Image]:
    with av.open(str(clip)) as container:
        frames = [frame.to_image() for frame in container.decode(video=0)]
    wanted = np.linspace(FPS / 2, len(frames) - FPS / 2, N_SHOWN).astype(int)
    box = (32, 16, 160, 144)
    return [frames[number].crop(box) for number in wanted]


def _sheet(rows: list[tuple[str, list[Image.Image]]]) -> Image.Image:
    sheet = Image.new("RGB", (N_SHOWN * SHOWN, len(rows) * SHOWN))
    pen = ImageDraw.Draw(sheet)
    for row, (name, frames) in enumerate(rows):
        for column, frame in enumerate(frames):
            sheet.paste(frame.resize((SHOWN, SHOWN)), (column * SHOWN, row * SHOWN))
        pen.text((3, row * SHOWN + 2), name, fill="white")
    return sheet


if __name__ == "__main__":
    main()
