"""Steps of lip motion: that of a text sentence by sentence, and that of a recording as a whole.

What a step keeps for the next request, and by which key, is its method ``key``.
"""

from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace

from lexicon.sequence import PhoneSequence
from tts2face.lips.exemplar import ExemplarModel, TokenSelection, select_tokens
from tts2face.lips.explanation import PhoneExplanation, explain_selection
from tts2face.models.talker import Talker
from tts2face.request import FromSound, Recorded
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.prepared import PreparedRequest
from tts2face.session.recording import TimedTranscript, mapped_motion, select_audio_map
from tts2face.session.speech_stream import Piece, SpeechModels
from tts2face.types import Trajectory, frame_count

Explain = Callable[[], tuple[PhoneExplanation, ...]]


@dataclass(frozen=True, slots=True, eq=False)
class SynthesisModels:
    """Models from which clips are synthesised: talker, the talker's exemplars, face, and what speaks."""

    talker: Talker
    exemplars: ExemplarModel
    face: AnimatedFace
    speech: SpeechModels


@dataclass(frozen=True, slots=True, eq=False)
class Lips:
    """Step: lip motion from recorded tokens of the talker, and its explanation."""

    prepared: PreparedRequest
    models: SynthesisModels

    def __call__(self, piece: Piece) -> Piece:
        """The piece of a text with lip motion."""
        selection, motion = self.motion(piece.speech.phones, len(piece.clip.motion))
        explain = self.explanation(selection, piece.begin)
        return replace(piece, clip=replace(piece.clip, motion=motion), explain=explain)

    def motion(self, phones: PhoneSequence, n_frames: int) -> tuple[TokenSelection, Trajectory]:
        """Selected tokens of phones, and their lip motion (n_frames, K)."""
        return self.models.speech.memory.recall(
            lambda: self.key(phones, n_frames),
            lambda: self._blend(phones, n_frames),
            lambda made: made[1].values.nbytes + made[0].found.tokens.nbytes * 3,
        )

    def key(self, phones: PhoneSequence, n_frames: int) -> Hashable:
        """All on which the motion depends."""
        prepared = self.prepared
        timed = (phones.phones, phones.edges.tobytes(), n_frames, float(prepared.fps))
        return ("lips", timed, prepared.options, prepared.excluded, prepared.request.has_gestures)

    def _blend(self, phones: PhoneSequence, n_frames: int) -> tuple[TokenSelection, Trajectory]:
        models, yield_turn = self.models, self.models.speech.yield_turn
        selection = select_tokens(phones, models.exemplars, self.prepared.options)
        yield_turn()
        fps = float(self.prepared.fps)
        return selection, models.face.motion_of_tokens(selection, fps=fps, n_frames=n_frames, yield_turn=yield_turn)

    def explanation(self, selection: TokenSelection, start: float) -> Explain:
        """Function that explains a selection in seconds of the whole clip; it is evaluated only when called."""

        def explain() -> tuple[PhoneExplanation, ...]:
            phones = explain_selection(selection, self.models.exemplars)
            return tuple(replace(phone, start=phone.start + start, end=phone.end + start) for phone in phones)

        return explain


class RecordedLips:
    """Step: lip motion of a recording, which is made as a whole with its first piece."""

    def __init__(self, lips: Lips, source: Recorded, heard: TimedTranscript) -> None:
        self._lips = lips
        self._source = source
        self._heard = heard
        self._whole: Trajectory | None = None

    def __call__(self, piece: Piece) -> Piece:
        """The piece with its part of the motion; the first one explains the phones of all."""
        if self._whole is None:
            self._whole, explain = self._make()
            piece = replace(piece, explain=explain)
        first = round(piece.begin * piece.clip.fps)
        return replace(piece, clip=replace(piece.clip, motion=self._whole.part(first, first + len(piece.clip.motion))))

    def _make(self) -> tuple[Trajectory, Explain]:
        models = self._lips.models
        fps = float(self._lips.prepared.fps)
        heard = self._heard
        if isinstance(self._source.lips, FromSound):
            audio_map = select_audio_map(self._source.lips.audio_map, models.talker)
            parameters = mapped_motion(self._source.audio, audio_map, models.talker, fps, heard)
            return models.face.motion_of_parameters(parameters), tuple
        selection, motion = self._lips.motion(heard.phones, frame_count(heard.duration, fps))
        explain = self._lips.explanation(selection, 0.0)
        return motion, lambda: tuple(map(heard.with_confidence, explain()))
