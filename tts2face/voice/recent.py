"""A voice that keeps measured utterances until they are spoken, for callers that measure speech before animating it."""

from collections import OrderedDict
from collections.abc import Hashable

from tts2face.types import Speech
from tts2face.voice.engine import SpeechInput, Voice

MAX_UTTERANCES = 8  # of at most some ten seconds; one second of sound takes 100 kB


class MeasuredVoice:
    """A voice with the utterances that `measuring` has synthesised; equal arguments give equal bytes in any case."""

    def __init__(self, voice: Voice) -> None:
        self._voice = voice
        self._kept: OrderedDict[Hashable, Speech] = OrderedDict()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._voice.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence, or return and forget it if it was measured; arguments as for `Voice.speak`."""
        kept = self._kept.pop(_key(content, rate, seed), None)
        return self._voice.speak(content, rate=rate, seed=seed) if kept is None else kept

    def measuring(self) -> Voice:
        """The same voice, which keeps its last `MAX_UTTERANCES` utterances for `speak`."""
        return _Measuring(self._voice, self._kept)


class _Measuring:
    """A voice that keeps its last utterances."""

    def __init__(self, voice: Voice, kept: OrderedDict[Hashable, Speech]) -> None:
        self._voice, self._kept = voice, kept

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._voice.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence or return the kept one; arguments as for `Voice.speak`."""
        key = _key(content, rate, seed)
        if key not in self._kept:
            self._kept[key] = self._voice.speak(content, rate=rate, seed=seed)
        while len(self._kept) > MAX_UTTERANCES:
            self._kept.popitem(last=False)
        return self._kept[key]


def _key(content: SpeechInput, rate: float, seed: int) -> Hashable:
    return content if isinstance(content, str) else tuple(content), rate, seed
