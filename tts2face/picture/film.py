"""Files of clips, written while they are drawn: .mp4, .webm, .mov, .gif, or a folder of .png pictures."""

import contextlib
import os
from collections.abc import Iterable
from pathlib import Path
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.picture.clip_frames import ClipFrames
from tts2face.picture.encoder_thread import EncoderThread, Sink
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.gif import GifWriter
from tts2face.picture.movie import MKV_MOVIE, MOV_MOVIE, MP4_MOVIE, WEBM_MOVIE, MovieWriter
from tts2face.picture.png_folder import PngFolderWriter, is_png_folder
from tts2face.storage.files import translate_disk_errors, write_atomically
from tts2face.storage.marks import UNKNOWN, Making, Mark, sound_mark
from tts2face.storage.output_paths import MOVIE_SUFFIXES, check_name
from tts2face.storage.signing import SIDECAR_SUFFIX
from tts2face.storage.temporary import Temporary
from tts2face.types import Clip, Progress, exact_rate, ignore_progress

FILE_SUFFIXES = MP4, WEBM, MOV, GIF = MOVIE_SUFFIXES
FOLDER = ""
OPAQUE = frozenset({MP4, MOV})  # H.264 as players know it has no coverage
MKV = ".mkv"  # parts of a .webm file
_MOVIES = {MP4: MP4_MOVIE, WEBM: WEBM_MOVIE, MOV: MOV_MOVIE, MKV: MKV_MOVIE}
N_SWATCHES = 6  # frames of the first clip from which the palette of a GIF is computed


class ClipWriter:
    """Writer of consecutive clips to one file; drawing and encoding run in parallel.

    The file appears under its name when it is complete; after an error or an interruption no file remains. Clips follow
    each other as in `ClipFrames`.

    Parameters
    ----------
    path
        Output, by suffix: .mp4, .webm, .mov, .gif; a folder of .png pictures with a trailing slash or without a suffix.
    renderer
        Renderer of the clips' frames.
    kind
        Kind of the file, for a path with another suffix; None: that of its suffix.
    on_progress
        Called with the number of frames written and the number of frames added so far.
    making
        What the request adds to the mark of the file.

    Raises
    ------
    InputError
        The suffix is unknown or has no transparency, the folder does not exist, clips differ in fps or sound rate, or
        no clip was added.
    BackendError
        The disk is full or cannot be written.

    Examples
    --------
    >>> with ClipWriter("talk.mp4", renderer) as writer:  # doctest: +SKIP
    ...     for clip in clips:
    ...         writer.add(clip)
    """

    def __init__(
        self,
        path: Path | str,
        renderer: FrameRenderer,
        *,
        kind: str | None = None,
        on_progress: Progress | None = None,
        making: Making = UNKNOWN,
    ) -> None:
        self._making, self._mark = making, renderer.mark
        self.path, self._kind = check_output(path), kind or output_kind(path)
        if self._kind in OPAQUE and renderer.picture.is_transparent:
            raise InputError(f"{self.path} cannot be transparent; give .webm, .gif or a folder, or another background")
        self._renderer = renderer
        self._on_progress = on_progress or ignore_progress
        self._frames = ClipFrames(renderer)
        self._encoder: EncoderThread | None = None
        self._temporary: Temporary | None = None

    def __enter__(self) -> "ClipWriter":
        """Create the temporary file or folder."""
        self._temporary = make_temporary(self.path, self._kind)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Complete the file, or remove it after an error."""
        try:
            if kind is None:
                self._complete()
        finally:
            self._clear()

    def add(self, clip: Clip) -> None:
        """Draw and encode one more clip.

        Raises
        ------
        InputError
            Its fps or sound rate differs from those of the first clip, or its channels are not those of the face.
        BackendError
            The disk is full or cannot be written.
        """
        with translate_disk_errors(self.path):
            for pixels, samples in self._frames.add(clip):
                encoder = self._encoder or self._open_encoder(clip)
                encoder.put(pixels, samples)
                if pixels is not None:
                    self._on_progress(self._frames.n_frames, self._frames.n_added)

    def add_sound(self, samples: NDArray[np.float32]) -> None:
        """Append sound (n,) that lasts longer than the pictures of the clips before it; errors as `add`."""
        if self._encoder is not None:
            with translate_disk_errors(self.path):
                self._encoder.put(None, samples)

    def _open_encoder(self, clip: Clip) -> EncoderThread:
        self._encoder = EncoderThread(self._open_sink(clip))
        return self._encoder

    def _open_sink(self, clip: Clip) -> Sink:
        if self._temporary is None:
            raise InputError("ClipWriter writes only within a with statement; open it as `with ClipWriter(...)`")
        fps = exact_rate(clip.fps)
        rate = clip.speech.waveform.rate
        picture, is_recorded = self._renderer.picture, clip.speech.is_recorded
        mark = self._mark = self._renderer.mark.of(self._making, is_recorded=is_recorded)
        if self._kind == FOLDER:
            sound = sound_mark(self._making, is_recorded=is_recorded)
            return PngFolderWriter(self._temporary.path, rate, mark, sound)
        if self._kind == GIF:
            frames = np.linspace(0, len(clip.motion) - 1, N_SWATCHES).astype(int)
            pictures = [self._renderer.frame(clip, int(i)) for i in frames]
            return GifWriter(self._temporary.path, pictures, fps, mark)
        shape = (picture.height, picture.width, picture.channels)
        return MovieWriter(self._temporary.path, _MOVIES[self._kind], shape, (fps, rate), mark)

    def _complete(self) -> None:
        if self._encoder is None or self._temporary is None:
            raise InputError(f"there is no clip to write to {self.path}")
        with translate_disk_errors(self.path):
            self._encoder.finish()
        self._encoder = None
        move_signed(self._temporary, self.path, self._mark)
        self._temporary = None

    def _clear(self) -> None:
        if self._encoder is not None:
            with contextlib.suppress(OSError):  # the file is removed in any case
                self._encoder.abandon()
            self._encoder = None
        if self._temporary is not None:
            self._temporary.remove()
            self._temporary = None


def write_clips(
    path: Path | str, clips: Iterable[Clip], renderer: FrameRenderer, *, on_progress: Progress | None = None
) -> None:
    """Write consecutive clips to one file; parameters and errors as `ClipWriter`."""
    with ClipWriter(path, renderer, on_progress=on_progress) as writer:
        for clip in clips:
            writer.add(clip)


def output_kind(path: Path | str) -> str:
    """Kind of an output path: one of `FILE_SUFFIXES`, or `FOLDER`."""
    suffix = Path(path).suffix.lower()
    # a folder may have a point in its name
    if str(path).endswith(("/", os.sep)) or suffix == "" or (suffix not in FILE_SUFFIXES and Path(path).is_dir()):
        return FOLDER
    if suffix not in FILE_SUFFIXES:
        raise InputError(
            f"{path} has the unknown suffix {suffix}; give one of {', '.join(FILE_SUFFIXES)}, "
            "a folder without a suffix for .png pictures, or a suffix that `tts2face formats` lists"
        )
    return suffix


def check_output(path: Path | str) -> Path:
    """Checked path of an output.

    Raises
    ------
    InputError
        The suffix is unknown, the parent folder does not exist, the name is only a suffix or too long, or the path is
        a folder of other files.
    BackendError
        The parent folder cannot be written.
    """
    output = Path(path)
    check_name(output)
    kind = output_kind(path)
    # a finished folder replaces the old one whole: nothing else may lie there
    if kind == FOLDER and output.exists() and not (output.is_dir() and is_png_folder(output)):
        raise InputError(f"{output} contains files other than the pictures of a clip; choose another folder")
    if kind != FOLDER and output.is_dir():
        raise InputError(f"{output} is a folder; choose another name")
    return output


def make_temporary(path: Path, kind: str) -> Temporary:
    """New, empty, hidden file or folder in the same folder as a path.

    Raises
    ------
    BackendError
        The folder cannot be written.
    """
    with translate_disk_errors(path):
        return Temporary(path, is_folder=kind == FOLDER)


def move_signed(temporary: Temporary, path: Path, mark: Mark | None) -> None:
    """Rename a complete temporary file to `path`, with the manifest beside it of a signed format that holds none.

    Raises
    ------
    BackendError
        The folder cannot be written, or the file cannot be signed.
    """
    signer = None if mark is None or path.suffix.lower() != WEBM else mark.signer
    if signer is None or mark is None:
        return move_into_place(temporary, path)
    manifest = signer.sidecar(temporary.path, "webm", mark)
    move_into_place(temporary, path)
    with translate_disk_errors(path):
        write_atomically(path.with_suffix(SIDECAR_SUFFIX), manifest)
    return None


def move_into_place(temporary: Temporary, path: Path) -> None:
    """Rename a temporary file or folder to `path`, replacing what exists there."""
    with translate_disk_errors(path):
        temporary.replace(path)
