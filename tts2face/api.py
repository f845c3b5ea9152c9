"""The public functions beside `tts2face.session.Session`: writing clips that exist already."""

from collections.abc import Callable
from pathlib import Path

from tts2face.render.encode import write_clips
from tts2face.render.picture import Picture
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.types import Clip


def write_clip(
    clip: Clip,
    face: AnimatedFace,
    out: str | Path,
    *,
    picture: Picture | None = None,
    on_progress: Callable[[int, int], None] | None = None,
) -> None:
    """Draw a clip on a face and write it into a file.

    Parameters
    ----------
    face
        `Session.face` of the session that made the clip, or of another one with the same face.
    out
        .mp4, .webm, .gif, or a folder of .png. It appears when all is done; after an error nothing is left.
    picture
        How the clip is drawn; the default options without it.
    on_progress
        Called with frames drawn, and frames in all.

    Raises
    ------
    InputError
        The clip's motion is not in the channels of this face, or the file cannot have this name.
    BackendError
        The file cannot be written.
    """
    write_clips(Path(out), [clip], face.renderer(picture or Picture()), on_progress=on_progress)
