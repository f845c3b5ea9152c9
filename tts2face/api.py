"""The one core call: a request, a talker and a face become a clip, whole, piece by piece, or as a file."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from lexicon.errors import InputError
from lexicon.g2p import check_language
from lexicon.mark_parser import marked
from lexicon.sentences import sentences
from lexicon.sequence import PhoneSequence
from lexicon.writing_systems import check_script
from tts2face.clock import exact_rate, on_frames
from tts2face.exemplar.appearance_trajectory import looks_trajectory
from tts2face.exemplar.explanation import ShownPhone, explained
from tts2face.exemplar.options import METHODS, SynthesisOptions
from tts2face.exemplar.synthesis import speech_trajectory
from tts2face.gesture.request_timeline import asked
from tts2face.gesture.timeline import Timeline
from tts2face.models.face import Face
from tts2face.models.talker import Talker
from tts2face.own_face.appearance_regression import own_face
from tts2face.prefetch import Ahead
from tts2face.render.encode import ClipWriter
from tts2face.render.output_path import checked_output
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.session import Cast, cast
from tts2face.synthesis.audio_input import Heard, clips_in, drive_of, driven, heard
from tts2face.synthesis.gesture_layer import Life, still
from tts2face.synthesis.marked_speech import Reached, Said, check_marks, marked_styles, reached_in, say, silent
from tts2face.types import Clip, Speech, Trajectory, frame_count, joined_clips

VOICES_KEPT = 2  # kinds of voice; each keeps some 100 MB
STAGES_KEPT = 2  # kinds of picture; each keeps some 30 MB
RECORDED_STEPS = 1000  # of progress through a recording
IDLE_STEPS = 1000  # through a silent clip
CLIPS_AHEAD = 2  # pieces that may wait to be drawn while the next is spoken


def synthesize(request: Request, talker: Talker, face: Face | None) -> Clip:
    """The whole clip of a request; with `face` None in the channels of the talker's own face.

    The same request, talker, face and version give the same bytes, in any process and with any number of threads.

    Raises
    ------
    InputError
        The text is empty or holds something that the voice cannot say; the language or voice does not exist.
    BackendError
        The voice is not installed.
    """
    return joined_clips([piece.clip for piece in stream(request, cast(talker, face))])


@dataclass(frozen=True, slots=True)
class Piece:
    """A part of a clip, and what is marked in it.

    Parameters
    ----------
    n_steps
        How much of the whole goes with it: characters of a text, or parts of a recording.
    timeline, marks
        What the text's marks ask for in this part, and its named marks; on the clock of the whole clip.
    """

    clip: Clip
    n_steps: int
    timeline: Timeline = field(default_factory=Timeline)
    marks: tuple[Reached, ...] = ()


def stream(request: Request, ready: Cast) -> Iterator[Piece]:
    """A request sentence by sentence; the clips put together are what `synthesize` gives.

    Each clip ends on a frame, so that a text or recording of any length stays in step in bounded memory. Those of a
    text begin and end at rest.
    """
    check(request)
    if request.audio is not None:
        yield from _recorded(request, request.audio, ready)
        return
    fps = exact_rate(request.fps)
    life = _life(request, ready)
    first_frame = 0
    source = _said(request, ready) if request.idle is None else silent(request.idle, fps, IDLE_STEPS)
    for said, n_steps in source:
        speech, begins = on_frames(said.speech, first_frame, fps), float(first_frame / fps)
        timeline = said.timeline.within(0.0, speech.waveform.duration).shifted(begins)
        clip = _alive(speech, _lips(speech, ready, request), timeline, life)
        first_frame += len(clip.motion)
        marks = tuple(replace(mark, seconds=mark.seconds + begins) for mark in said.marks)
        yield Piece(clip, n_steps, timeline, marks)
    if life is not None:
        life.finish()


def _said(request: Request, ready: Cast) -> Iterator[tuple[Said, int]]:
    """Sentences of a text, and the characters of each."""
    with ready.voice(request) as voice:
        for sentence in sentences(marked(request.text), request.language):
            yield say(voice, sentence, request), sentence.n_characters


def check(request: Request) -> None:
    """Refuse a request whose text holds nothing to say or cannot be read in its language; cheap at any length.

    Raises
    ------
    InputError
        There is no word in the text, the language does not exist or cannot read it, a mark in it is wrong, there is no
        such recording, or what is asked of the gestures cannot be read.
    DataError
        The timeline's file is wrong.
    """
    if request.audio is not None and not request.audio.is_file():
        raise InputError(f"there is no recording {request.audio}; check the path")
    asked(request)
    if not request.text.strip() and (request.audio is not None or request.idle is not None):
        return
    text = marked(request.text)
    check_language(request.language)
    check_script(text.text, request.language)
    check_marks(text, request)
    if next(sentences(text, request.language), None) is None:
        raise InputError(f"there is nothing to say in {request.text[:40]!r}; give at least one word")


def _steps(request: Request) -> int:
    if request.audio is not None:
        return RECORDED_STEPS
    return IDLE_STEPS if request.idle is not None else max(len(marked(request.text).text), 1)


def _options(request: Request) -> SynthesisOptions:
    options = METHODS[request.synthesis]
    if request.context is not None:
        options = replace(options, context=request.context)
    if request.exemplars is not None:
        options = replace(options, k=request.exemplars)
    return options


def _life(request: Request, ready: Cast) -> Life | None:
    living = ready.living(request)
    if living is None:
        return None
    for style in marked_styles(marked(request.text)):
        living.fields.palette.require(style)
    return Life(request, living, float(exact_rate(request.fps)))


def _alive(speech: Speech, lips: Trajectory, timeline: Timeline, life: Life | None) -> Clip:
    """A clip with its gestures; the head stands still where there are none."""
    if life is not None:
        return life.added(speech, lips, timeline)
    return still(speech, lips)


def _lips(speech: Speech, ready: Cast, request: Request) -> Trajectory:
    fps = float(exact_rate(request.fps))
    n_frames = frame_count(speech.waveform.duration, fps)
    lips = speech_trajectory(speech.phones, ready.visual_voice, fps=fps, n_frames=n_frames, options=_options(request))
    return _shown(lips, speech.phones, ready, request)


def _recorded(request: Request, audio: Path, ready: Cast) -> Iterator[Piece]:
    """A recording in pieces: with its words by exemplars, without them by a drive."""
    fps = float(exact_rate(request.fps))
    text = marked(request.text)
    said, motion = _followed(replace(request, text=text.text), audio, ready, fps)
    timeline, marks = reached_in(text, said.phones, said.words, request.language)
    life = _life(request, ready)
    before = 0
    for clip in clips_in(audio, said, motion, volume=request.volume):
        after = before + len(clip.motion)
        n_steps = RECORDED_STEPS * after // len(motion) - RECORDED_STEPS * before // len(motion)
        begin, end = before / fps, after / fps
        here = tuple(mark for mark in marks if begin <= mark.seconds < end)
        asked_here = timeline.within(begin, end)
        yield Piece(_alive(clip.speech, clip.motion, asked_here, life), n_steps, asked_here, here)
        before = after
    if life is not None:
        life.finish()


def _followed(request: Request, audio: Path, ready: Cast, fps: float) -> tuple[Heard, Trajectory]:
    if not request.text.strip():
        said, lips = driven(audio, drive_of(request, ready.talker), ready.talker, fps)
        if ready.retargeter is None:
            return said, own_face(ready.talker).motion(lips)
        return said, ready.retargeter.retarget(lips)
    said = heard(request, audio)
    n_frames = frame_count(said.duration, fps)
    lips = speech_trajectory(said.phones, ready.visual_voice, fps=fps, n_frames=n_frames, options=_options(request))
    return said, _shown(lips, said.phones, ready, request)


def _shown(lips: Trajectory, phones: PhoneSequence, ready: Cast, request: Request) -> Trajectory:
    if ready.retargeter is not None:
        return ready.retargeter.retarget(lips)
    if ready.looks is None:
        raise InputError("a cast without a face needs the talker's looks; make it with `cast`")
    looks = looks_trajectory(
        phones, ready.visual_voice, ready.looks, fps=lips.fps, n_frames=len(lips), options=_options(request)
    )
    return Trajectory(lips.channels + looks.channels, np.concatenate([lips.values, looks.values], axis=1), lips.fps)


def explain(clip: Clip, ready: Cast, request: Request, *, begins: float = 0.0) -> tuple[ShownPhone, ...]:
    """For each phone of a clip, which recorded tokens moved the lips; `begins` is the clip's second in the whole."""
    shown = explained(clip.speech.phones, ready.visual_voice, options=_options(request))
    return tuple(replace(phone, start=phone.start + begins, end=phone.end + begins) for phone in shown)


@dataclass(frozen=True, slots=True)
class Written:
    """What a file holds: seconds of sound, frames, and when the text's named marks are reached."""

    path: Path
    seconds: float
    n_frames: int
    marks: tuple[Reached, ...] = ()


def write_clip(
    request: Request,
    picture: Picture,
    ready: Cast,
    out: Path,
    *,
    on_progress: Callable[[int, int], None] | None = None,
    on_clip: Callable[[Clip], None] | None = None,
) -> Written:
    """Speak, animate, draw and encode a request into a file; the next sentence is spoken while one is drawn.

    Parameters
    ----------
    out
        .mp4, .webm, .gif, or a folder of .png. It appears when all is done; after an error nothing is left.
    on_progress
        Called with steps drawn, and steps in all: characters of a text, or parts of a recording.
    on_clip
        Called with each piece before it is drawn.

    Raises
    ------
    InputError, BackendError
        As `synthesize`; or the file cannot be written.
    """
    checked_output(out)
    of = _steps(request)
    ready.living(request)  # before two threads want it
    marks: list[Reached] = []
    before, seconds, n_frames = 0, 0.0, 0
    piece_length, given_before = 0, 0

    def tell(done: int, given: int) -> None:
        if on_progress:
            share = (done - given_before) / max(given - given_before, 1)
            on_progress(min(of, int(before + piece_length * share)), of)

    with (
        Ahead(stream(request, ready), CLIPS_AHEAD) as spoken,
        ClipWriter(out, ready.stage(picture, request), on_progress=tell) as writer,
    ):
        for piece in spoken:
            if on_clip:
                on_clip(piece.clip)
            piece_length, given_before = piece.n_steps, n_frames
            writer.add(piece.clip)
            before += piece_length
            marks += piece.marks
            seconds += piece.clip.speech.waveform.duration
            n_frames += len(piece.clip.motion)
    if on_progress:
        on_progress(of, of)
    return Written(out, seconds, n_frames, tuple(marks))
