"""Rules of a live face: speech, pushed sound, listening, gestures and interruption.

Without threads and clock: `tts2face.session.live.stream` runs it in a thread, the service's live stream in its turns.
"""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import Tts2faceError
from lexicon.growing_text import GrowingText
from lexicon.marked_text import GestureMark
from tts2face.gestures.listening import PartnerSound
from tts2face.session.live.blocks import Block, End, Item, Note
from tts2face.session.live.idle import IdlePlayer, idle_motion
from tts2face.session.live.lips import LiveLips
from tts2face.session.live.pushed_sound import PushedSound
from tts2face.session.live.speech import LiveSpeech
from tts2face.session.speech_stream import Piece

GESTURE_S = 0.4  # of silence with a gesture at a time, so that speech can begin soon
LISTEN_S = 0.2  # likewise of a listener's


@dataclass(slots=True, eq=False)
class _Text:
    """An utterance of text: sentences that wait, and the text that still grows."""

    number: int
    growing: GrowingText | None = None
    sentences: deque[str] = field(default_factory=deque)

    @property
    def is_ready(self) -> bool:
        return bool(self.sentences) or self.growing is None

    @property
    def is_done(self) -> bool:
        return not self.sentences and self.growing is None


class LiveFace:
    """One face, whose utterances are spoken one after another; each has a number of its own, above 0.

    Parameters
    ----------
    speech
        Clip without an end, to which all but shared idle motion is appended.
    lips
        Returns the lip motion of sound with a rate in Hz.
    """

    def __init__(self, speech: LiveSpeech, lips: Callable[[int], LiveLips]) -> None:
        self.speech = speech
        self.idle = IdlePlayer(idle_motion(speech))
        self._lips = lips
        self._utterances: deque[_Text | PushedSound] = deque()
        self._n_interruptions = 0
        self._partner: PartnerSound | None = None
        self._partner_rate: int | None = None
        self.is_listening = False

    @property
    def has_speech(self) -> bool:
        """Whether a sentence, or sound that is known far enough, waits."""
        return bool(self._utterances) and self._is_ready(self._utterances[0])

    @property
    def next_text(self) -> str:
        """The sentence that is spoken next; empty for sound."""
        first = self._utterances[0] if self._utterances else None
        return first.sentences[0] if isinstance(first, _Text) and first.sentences else ""

    @property
    def is_moved(self) -> bool:
        """Whether the face listens or makes a gesture, so that it is not idle."""
        return self.is_listening or self.speech.has_gestures

    def _is_ready(self, utterance: _Text | PushedSound) -> bool:
        if isinstance(utterance, _Text):
            return utterance.is_ready
        return utterance.is_ready(self.speech.fps)

    def say(self, number: int, text: str) -> None:
        """Speak a text after everything that waits."""
        self._utterances.append(_Text(number, sentences=deque([text])))

    def add_text(self, number: int, part: str) -> None:
        """Speak more of a text that is still being written, sentence by sentence."""
        found = self._find(number)
        if not isinstance(found, _Text):
            found = _Text(number, GrowingText(self.speech.language, self.speech.markup, self.speech.marks))
            self._utterances.append(found)
        if found.growing is not None:
            found.sentences += found.growing.add(part)

    def add_sound(self, number: int, samples: NDArray[np.floating], rate: int) -> None:
        """Speak more of a sound; errors as of `LiveLips`."""
        found = self._find(number)
        if not isinstance(found, PushedSound):
            found = PushedSound(self._lips(rate), rate, number)
            self._utterances.append(found)
        found.add(samples)

    def end(self, number: int) -> None:
        """End a growing text or a sound, also one of which nothing could be spoken."""
        found = self._find(number)
        if found is None:
            self._utterances.append(_Text(number))
        elif isinstance(found, PushedSound):
            found.end()
        elif found.growing is not None:
            found.sentences += found.growing.flush()
            found.growing = None

    def _find(self, number: int) -> "_Text | PushedSound | None":
        return next((waiting for waiting in self._utterances if waiting.number == number), None)

    def listen(self, rate: int | None) -> None:
        """Listen until the next speech, to sound of a partner with a rate in Hz; None where it is not heard."""
        self.is_listening, self._partner_rate = True, rate
        self._partner = None if rate is None else PartnerSound(rate)

    def hear(self, samples: NDArray[np.float32]) -> None:
        """Hear samples (m,) of the partner, at whose cues the face nods."""
        if self._partner is not None:
            self._partner.add(samples)

    def hear_at(self, rate: int | None, samples: NDArray[np.float32] | None) -> None:
        """Listen, and hear samples of a partner with a rate, whose sound goes on while the rate is the same."""
        if not self.is_listening or rate != self._partner_rate:
            self.listen(rate)
        if samples is not None:
            self.hear(samples)

    def gesture(self, mark: GestureMark) -> None:
        """Make a gesture with the next word that is not made yet, in silence at once."""
        self.speech.gesture(mark)

    def change_style(self, style: str) -> str:
        """From the next word or the next silence on, have another style, whose name is returned; errors as of it."""
        style = self.speech.change_style(style)
        self.idle = IdlePlayer(idle_motion(self.speech))
        return style

    def interrupt(self, number: int | None = None) -> int:
        """Forget an utterance, or all that waits with its gestures; what `speak` makes of it ends.

        Returns the number of utterances that had not begun.
        """
        n_waiting = len(self._utterances)
        self._utterances = deque(found for found in self._utterances if number not in (None, found.number))
        self._n_interruptions += 1
        self.rest()
        if number is None:
            self.speech.gestures.clear()
        return n_waiting

    def rest(self) -> None:
        """The sentence before has been heard: the next one begins without the pause behind it."""
        self.speech.rest()

    def speak(self) -> Iterator[Item]:
        """Make the next sentence, or the sound that is known; it ends early after `interrupt`.

        An error leaves out the sentence, or the rest of the sound; it is raised behind the end of its utterance.
        """
        self.is_listening = False
        first = self._utterances[0]
        if isinstance(first, PushedSound):
            yield from self._speak_sound(first)
            return
        text = first.sentences.popleft() if first.sentences else ""
        if first.is_done:
            self._utterances.popleft()
        n_interruptions, error = self._n_interruptions, None
        try:
            if text:
                yield from self._speak_text(text, first.number)
        except Tts2faceError as refused:
            error = refused
        if first.is_done and self._n_interruptions == n_interruptions:
            yield End(first.number)
        if error is not None:
            raise error

    def _speak_sound(self, pushed: PushedSound) -> Iterator[Item]:
        fps, error = self.speech.fps, None
        try:
            if pushed.n_ready(fps):
                yield pushed.make(self.speech)
        except Tts2faceError as refused:
            error = refused
        is_done = pushed.is_ended and (error is not None or not pushed.n_ready(fps))
        if is_done and self._utterances and self._utterances[0] is pushed:
            self._utterances.popleft()
        if is_done:
            yield End(pushed.number)
        if error is not None:
            raise error

    def _speak_text(self, text: str, number: int) -> Iterator[Item]:
        n_interruptions = self._n_interruptions
        for piece in self.speech.say(text):
            yield from self._notes(text)
            block, sound = self._block(piece), piece.clip.speech.waveform
            yield replace(block, source="speech", utterance=number, piece=piece, sound=sound)
            if self._n_interruptions != n_interruptions:
                return
        yield from self._notes(text)

    def _notes(self, text: str) -> Iterator[Note]:
        return (Note(text, note) for note in self.speech.new_notes())

    def silence(self) -> Iterator[Block]:
        """Make some silence in which the face listens, or makes gestures."""
        if self.is_listening:
            cues = None if self._partner is None else self._partner.new_cues()
            for piece in self.speech.listen(LISTEN_S, cues):
                yield replace(self._block(piece), source="listening")
        else:
            for piece in self.speech.idle(GESTURE_S):
                yield self._block(piece)

    def _block(self, piece: Piece) -> Block:
        return Block(piece.clip.motion, piece.clip.head, "gestures", shown=self.speech.shown(piece.begin))
