"""Public functions besides `tts2face.session.Session`: drawing an existing clip into a file."""

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
    """Draw a clip on a face and write it to a file.

    Parameters
    ----------
    face
        `Session.face` of the session that made the clip, or of another one with the same face.
    out
        .mp4, .webm, .mov, .gif, or a folder of .png files. The file appears when it is complete; after an error no
        partial file remains.
    picture
        Drawing options; None for the defaults.
    on_progress
        Called with the number of frames drawn and the total number of frames.

    Raises
    ------
    InputError
        The clip's motion is not in the channels of this face, or the name of the file has no known suffix.
    BackendError
        The file cannot be written.
    """
    write_clips(Path(out), [clip], face.renderer(picture or Picture()), on_progress=on_progress)
