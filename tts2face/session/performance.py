"""Transfer of a performer's video or an ARKit capture to a face, with its original sound, and its writing to files."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from lexicon.errors import InputError
from lexicon.values.checks import check_limits
from lexicon.values.fields import check_fields
from tts2face.face.body import Body
from tts2face.face.combinations import with_combinations
from tts2face.interchange.exports.table import all_formats
from tts2face.numeric.arrays import interpolate_rows
from tts2face.picture.options import Picture
from tts2face.session.animated_face import AnimatedFace, FaceMotion
from tts2face.session.outputs import OutputFiles, WrittenClip
from tts2face.session.recording import clip_bounds
from tts2face.session.shared_models import SessionModels
from tts2face.storage.marks import Making
from tts2face.types import SOUND_RATE, Clip, Speech, StageCallback, Waveform, exact_rate, ignore_progress
from tts2face.video.blendshapes import BlendshapeReader
from tts2face.video.livelink import MAX_CAPTURE_FPS, MIN_CAPTURE_FPS, TABLE_SUFFIXES, read_livelink
from tts2face.video.media import read_media_info, read_sound
from tts2face.video.streaming import StreamingTracker
from tts2face.video.take import Take, read_take
from tts2face.video.weight_files import READERS, read_weight_file

CAPTURE_SUFFIXES = (*TABLE_SUFFIXES, *READERS)
CAPTURE_FPS = 30.0  # default frame rate of captures, whose own is higher than a video needs
# of a performer's lips and expressions
GAINS = (0.0, 4.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Performance:
    """A recorded performance and the options of its transfer to a face.

    Parameters
    ----------
    take
        A video of one person, a .csv, .tsv or .txt table of Live Link Face, or weights of shapes as .a2f.json or
        .curves.jsonl.
    gain
        Factor of the motion of lips and brows, 0 to 4.
    fps
        Frames per second; None for the take's own rate, limited to 30 for a capture.
    audio
        Sound file that belongs to a capture.
    take_fps
        Frames that the numbers or timecodes of a capture count to a second, where it does not show that itself.
    append_missing
        Whether lip motion that the talker's recordings lack is added to the talker's own face.
    model
        Path of the face landmark models; None for the installed ones.

    Raises
    ------
    InputError
        A value has another type, the gain is out of range, or `audio` is given for a video, which has its own sound.
    """

    take: Path
    gain: float = 1.0
    fps: float | None = None
    audio: Path | None = None
    take_fps: float | None = None
    append_missing: bool = False
    model: Path | None = None

    def __post_init__(self) -> None:
        """Reject values of other types, and options that exclude each other."""
        check_fields(self)
        check_limits("the gain", self.gain, GAINS)
        if self.audio is not None and not is_capture(self.take):
            raise InputError(f"{self.take} has its own sound; --audio belongs to a capture, as .csv or .a2f.json")
        if self.take_fps is not None:
            check_limits("the frame rate of the take", self.take_fps, (MIN_CAPTURE_FPS, MAX_CAPTURE_FPS))
            if self.take.suffix.lower() not in TABLE_SUFFIXES:
                raise InputError(f"{self.take} has its own frame rate; --take-fps belongs to a Live Link Face table")


@dataclass(frozen=True, slots=True, eq=False)
class PerformedTake:
    """A take transferred to a face: the face, its motion, and the sound, which is empty if the take has none.

    `notes` say what is missing in a capture, and what is guessed about it.
    """

    face: AnimatedFace
    motion: FaceMotion
    sound: Waveform
    notes: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """Duration of the motion."""
        return self.motion.face.duration


def perform(
    performance: Performance, face: AnimatedFace, *, on_progress: Callable[[int, int], None] | None = None
) -> PerformedTake:
    """Transfer a recorded performance to a face.

    Parameters
    ----------
    on_progress
        Called with the number of frames tracked and their total, for a video.

    Raises
    ------
    InputError
        The take does not exist, or the face cannot show such a take.
    DataError
        The take cannot be read, is too short, or shows no face or several.
    BackendError
        LiteRT, OpenCV or the landmark models are missing.
    """
    take = performance.take
    _check_kind(take)
    sound = sound_of_take(take) if performance.audio is None else read_sound(performance.audio, SOUND_RATE)
    if is_capture(take):
        is_table = take.suffix.lower() in TABLE_SUFFIXES
        capture = read_livelink(take, performance.take_fps) if is_table else read_weight_file(take)
        motion = FaceMotion(face.motion_of_capture(capture, gain=performance.gain), capture.head)
        fps = performance.fps or min(motion.face.fps, CAPTURE_FPS)
        return PerformedTake(face, resample_take(motion, fps), sound, capture.notes)
    tracker, reader = StreamingTracker(performance.model), BlendshapeReader(performance.model)
    tracked = read_take(take, tracker, reader, on_progress=on_progress or ignore_progress)
    if performance.append_missing:
        face = face.with_motion_of(tracked)
    motion = retarget_take(tracked, face, gain=performance.gain)
    return PerformedTake(face, motion if performance.fps is None else resample_take(motion, performance.fps), sound)


def _check_kind(take: Path) -> None:
    """Refuse exports that hold no weights of shapes, before they are taken for a damaged video."""
    if is_capture(take):
        return
    for info in all_formats():
        if not info.is_sound and take.name.lower().endswith(info.suffixes):
            raise InputError(
                f"{take} has the suffix of the export {info.name}, which mimic does not read; give a video, a .csv of "
                "Live Link Face, .a2f.json or .curves.jsonl"
            )


def is_capture(take: Path) -> bool:
    """Whether the suffix of a path is that of a table or of weights of shapes; other files are read as videos."""
    return take.suffix.lower() in CAPTURE_SUFFIXES


def retarget_take(take: Take, face: AnimatedFace, *, gain: float = 1.0) -> FaceMotion:
    """Motion of a face from a tracked video."""
    return FaceMotion(face.motion_of_take(take, gain=gain), take.head)


def sound_of_take(take: Path) -> Waveform:
    """Sound of a video at `SOUND_RATE`; empty if the file has no sound."""
    if not is_capture(take) and read_media_info(take).rate:
        return read_sound(take, SOUND_RATE)
    return Waveform(np.zeros(0, np.float32), SOUND_RATE)


def resample_take(motion: FaceMotion, fps: float) -> FaceMotion:
    """Resample motion to another frame rate by linear interpolation."""
    old = motion.face.fps
    if exact_rate(fps) == exact_rate(old):
        return motion
    # 1e-6: an instant that is a frame of both rates counts in spite of rounding
    n_frames = max(1, int(np.floor((len(motion.face) - 1) / old * fps + 1e-6)) + 1)
    at = np.minimum(np.arange(n_frames) / fps * old, len(motion.face) - 1)

    return FaceMotion(
        *(replace(motion, values=interpolate_rows(motion.values, at), fps=fps) for motion in (motion.face, motion.head))
    )


def take_clips(motion: FaceMotion, sound: Waveform) -> Iterator[Clip]:
    """Divide motion and sound into clips of at most `MAX_CLIP_FRAMES` frames; short sound is padded with silence."""
    body = Body(motion.face.channels, 0)
    for first, last, start, end in clip_bounds(len(motion.face), exact_rate(motion.face.fps), sound.rate):
        speech = replace(Speech.without_phones(sound.part(start, end).padded(end - start)), is_recorded=True)
        face, head = motion.face.part(first, last), motion.head.part(first, last)
        yield Clip(with_combinations(body.move(face, head, speech.phones)), head, speech)


def write_take(
    performance: Performance,
    models: SessionModels,
    to: tuple[OutputFiles, Picture],
    stages: StageCallback,
) -> WrittenClip:
    """Transfer a performance to the face of a session and write it; as `Session.write_performance`."""
    outputs, picture = to
    face = models.speech_face
    outputs.check_face(face)  # before the video is tracked, as are the drawing options
    renderer = None if outputs.out is None else models.renderer(picture, has_gestures=False)
    take = perform(performance, face, on_progress=stages("tracking"))
    if renderer is not None and take.face is not face:  # motion was appended to the face
        renderer = take.face.renderer(picture)
    n_frames = len(take.motion.face)
    draw = stages("writing" if renderer is None else "drawing")
    making = Making(signer=models.signer)
    with outputs.open(take.face, renderer, lambda done, _: draw(done, n_frames), making) as files:
        for clip in take_clips(take.motion, take.sound):
            files.add(clip)
    is_silent = not len(take.sound.samples)
    return WrittenClip(
        outputs.path, take.seconds, n_frames, is_silent=is_silent, exports=files.exports.paths, notes=take.notes
    )
