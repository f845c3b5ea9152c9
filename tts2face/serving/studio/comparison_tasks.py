"""Tasks that compare: recorded motion on the face of a project, and measures of two motions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from tts2face.lips.motion_measures import DTW_BAND_S
from tts2face.models.talker import Talker
from tts2face.request import Recorded
from tts2face.serving.service.messages import Event, Inputs, Task, Work
from tts2face.serving.studio.tasks import digest_of, read_project
from tts2face.session.animated_face import AnimatedFace, FaceMotion
from tts2face.session.comparison import MotionPart, compare_motion, map_channels
from tts2face.session.project import Project
from tts2face.types import HEAD_CHANNELS, Chunk, Trajectory
from tts2face.video.livelink import read_livelink

if TYPE_CHECKING:
    from tts2face.session.session import Session


SILENT_RATE = 24_000  # Hz, of recorded motion, which has no sound of its own


def recordings(session: "Session", work: Work, _: Inputs) -> Iterator[Event]:
    """Names of the talker's recordings with their words."""
    spoken = [
        [utterance.name, " ".join(word.text for word in utterance.words)] for utterance in session.talker.utterances
    ]
    yield Event({"type": "recordings", "recordings": spoken})


def recorded_motion(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """Recorded motion on the face of a project, in events as those of a preview (`projects.tasks`), without sound.

    ``recording`` of the request names a recording of the talker, or ``take`` a Live Link file; its second ``offset`` is
    the beginning of the project's sound.
    """
    project = read_project(work)
    if not isinstance(project.request.source, Recorded):
        raise InputError(
            "a recording is compared with a project that is made from it; import its sound with its words first"
        )
    motion, notes = _recorded(session, work.request, project)
    values, head = motion.face.values.astype("<f4"), motion.head.values.astype("<f4")
    parts = [values.tobytes(), head.tobytes(), b""]
    digest = digest_of(parts)
    yield Event({"type": "begin", "fps": float(project.request.fps)})
    yield Event({
        "type": "piece", "number": 0, "text": "", "occurrence": 0, "begin": 0.0,
        "seconds": motion.face.duration, "rate": SILENT_RATE, "n_frames": len(values), "n_samples": 0,
        "digest": digest, "phones": [], "edges": [0.0], "words": [], "notes": notes,
        "channels": list(motion.face.channels),
    })  # fmt: skip
    if digest not in work.request.get("have", ()):
        yield Chunk(b"".join(parts))
    yield Event({"type": "end", "dropped": [], "cut_to": None})


def _recorded(session: "Session", options: Mapping[str, Any], project: Project) -> tuple[FaceMotion, list[str]]:
    """Recorded motion from the offset on, at the project's frame rate, and notes on a take."""
    face, notes = session.animated_face(has_gestures=project.request.has_gestures), list[str]()
    if options.get("recording"):
        found = _utterance_motion(session.talker, str(options["recording"]), face)
    else:
        capture = read_livelink(Path(options["take"]))
        found, notes = FaceMotion(face.motion_of_capture(capture), capture.head), list(capture.notes)
    offset, fps = float(options.get("offset", 0.0)), float(project.request.fps)
    # 1e-6: an instant that is a frame of both rates counts in spite of rounding
    n_frames = int(np.floor(((len(found.face) - 1) / found.face.fps - offset) * fps + 1e-6)) + 1
    if n_frames < 1:
        raise InputError(f"the recording ends before its second {offset:g}; give a smaller offset")
    times = offset + np.arange(n_frames) / fps
    face_motion, head = (
        replace(trajectory, values=trajectory.at(times), fps=fps) for trajectory in (found.face, found.head)
    )
    return FaceMotion(face_motion, head), notes


def _utterance_motion(talker: Talker, name: str, face: AnimatedFace) -> FaceMotion:
    found = next((utterance for utterance in talker.utterances if utterance.name == name), None)
    if found is None:
        raise InputError(f"the talker has no recording {name[:40]!r}; choose one from the list")
    head = Trajectory(HEAD_CHANNELS, found.head, talker.fps)
    return FaceMotion(face.motion_of_parameters(talker.speech_trajectory(found)), head)


def measure(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """Measures of a project's motion against another one.

    The request has of the other: ``motion``, the path of an .npz file with ``motion`` (T, K) and ``head`` (T, 6);
    ``channels``, ``fps``; and ``sentences`` as in a preview, empty for recorded motion, which has the same times.
    """
    project, options = read_project(work), work.request
    face = session.animated_face(has_gestures=project.request.has_gestures)
    names = (*face.channels, *HEAD_CHANNELS)
    with np.load(options["motion"], allow_pickle=False) as stored:
        other = Trajectory(tuple(options["channels"]), stored["motion"], float(options["fps"]))
        values = np.concatenate([map_channels(other, face.channels), stored["head"]], axis=1)
    reference = Trajectory(names, values, other.fps)
    made: list[_Made] = []
    for piece in session.stream(project.prepare()):
        clip = piece.clip
        motion = np.concatenate([map_channels(clip.motion, face.channels), clip.head.values], axis=1)
        made.append(_Made(piece.text, piece.begin, clip.speech.waveform.duration, motion, clip.speech.phones))
        yield Chunk(b"")
    fps = float(project.request.fps)
    found = compare_motion(
        _parts(made, reference, options["sentences"], fps), face, names, fps, n_face=len(face.channels)
    )
    yield Event({"type": "measures", **asdict(found)})


@dataclass(frozen=True, slots=True, eq=False)
class _Made:
    """A piece of the project: its text, start and duration in seconds, motion (T, K) and phones."""

    text: str
    start: float
    seconds: float
    motion: NDArray[np.float32]
    phones: PhoneSequence


def _parts(made: Sequence[_Made], reference: Trajectory, sentences: Sequence[Any], fps: float) -> list[MotionPart]:
    """Parts with the same times if the sentences allow it, else those of equal sentences."""
    if not sentences or _is_same_time(made, sentences):
        found = [_part_of_same_time(piece, reference, fps) for piece in made]
    else:
        found = _parts_of_equal_sentences(made, reference, list(sentences), fps)
    found = [part for part in found if len(part.motion) and len(part.reference)]
    if not found:
        raise InputError("the project and what it is compared with have no sentence in common; compare the same text")
    return found


def _is_same_time(made: Sequence[_Made], sentences: Sequence[Any]) -> bool:
    """Whether all sentences have the same times; the one of a recording spans all its pieces."""
    end = made[-1].start + made[-1].seconds
    if len(sentences) == 1 and not sentences[0][0]:
        return abs(float(sentences[0][3]) - end) <= DTW_BAND_S
    return len(made) == len(sentences) and all(
        piece.text == text and max(abs(piece.start - start), abs(piece.start + piece.seconds - end)) <= DTW_BAND_S
        for piece, (text, _, start, end) in zip(made, sentences, strict=True)
    )


def _part_of_same_time(piece: _Made, reference: Trajectory, fps: float) -> MotionPart:
    times = piece.start + np.arange(len(piece.motion)) / fps
    n = int((times < reference.duration).sum())
    return MotionPart(reference.at(times[:n]), piece.motion[:n], piece.phones)


def _parts_of_equal_sentences(
    made: Sequence[_Made], reference: Trajectory, sentences: list[Any], fps: float
) -> list[MotionPart]:
    """Each sentence with the first one of the reference that has its text and is not taken."""
    found = []
    for piece in made:
        same = next((theirs for theirs in sentences if theirs[0] == piece.text and piece.text), None)
        if same is not None:
            sentences.remove(same)
            times = np.arange(same[2], same[3], 1 / fps)
            found.append(MotionPart(reference.at(times), piece.motion, piece.phones, is_same_time=False))
    return found


TASKS: Mapping[str, Task] = MappingProxyType({
    "recordings": recordings, "recorded": recorded_motion, "measure": measure,
})  # fmt: skip
