"""Heads of photographs beside their pictures: python -m tests.bench.bench_avatar PICTURE_OR_VIDEO..."""

import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from PIL import Image

from corpus_tools.dense.avatar import build_avatar
from corpus_tools.recordings.folder import VIDEO_SUFFIXES
from tests.corpus_tools.build.likeness import SKIN, colours_apart, marks_apart, nearest, see_head, see_picture
from tests.photo.pictures import still
from tts2face.models.face_loading import load_face
from tts2face.photo.found_face import PhotoReader
from tts2face.video.media import read_frames
from tts2face.video.tracking import FaceTracker

STILLS, SIDE_PX = ("head", "mara", "tomas", "noor"), 512


def write_picture(source: str, folder: Path) -> Path:
    """A picture, the first frame of a video, or a still of a shipped face, as a PNG file."""
    path = folder / f"{Path(source).stem}.png"
    if source in STILLS:
        pixels = still(source, SIDE_PX)
    elif Path(source).suffix.lower() in VIDEO_SUFFIXES:
        pixels = next(iter(read_frames(Path(source)))).pixels
    else:
        pixels = np.asarray(Image.open(source).convert("RGB"))
    Image.fromarray(pixels).save(path)
    return path


def main() -> None:
    """Print the table; colours are CIEDE2000."""
    reader, tracker, looks, times = PhotoReader(), FaceTracker(), [], []
    with TemporaryDirectory() as folder:
        photos = [write_picture(source, Path(folder)) for source in (*sys.argv[1:], *STILLS)]
        shown = [reader.read(photo) for photo in photos]
        pictures = [see_picture(one.picture.pixels, one.found) for one in shown]
        heads = []
        for photo, one in zip(photos, shown, strict=True):
            began = time.process_time()
            looks.append(build_avatar([photo], photo.with_suffix(".face"), consent="nobody").look.summary())
            times.append(time.process_time() - began)
            heads.append(see_head(load_face(str(photo.with_suffix(".face"))), one, tracker)[1])
    closest = nearest(heads, pictures)
    print("| picture | landmarks, % of the width | skin | all colours | nearest | found | CPU s |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    figures = np.array([[100 * marks_apart(*both), colours_apart(*both, SKIN), colours_apart(*both)]
                        for both in zip(heads, pictures, strict=True)])  # fmt: skip
    for number, photo in enumerate(photos):
        marks, skin, every = figures[number]
        row = f"{marks:.2f} | {skin:.1f} | {every:.1f} | {photos[closest[number]].stem} | {looks[number]}"
        print(f"| {photo.stem} | {row} | {times[number]:.1f} |")
    marks, skin, every = np.median(figures, axis=0)
    n_own = sum(found == number for number, found in enumerate(closest))
    own = f"own: {n_own} of {len(photos)}"
    print(f"| median | {marks:.2f} | {skin:.1f} | {every:.1f} | {own} | | {np.median(times):.1f} |")


if __name__ == "__main__":
    main()
