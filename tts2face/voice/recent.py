"""A voice that keeps its last utterances, for callers that measure speech before they animate it."""

from collections import OrderedDict
from collections.abc import Hashable

from tts2face.types import Speech
from tts2face.voice.engine import SpeechInput, Voice

MAX_UTTERANCES = 8  # of at most some ten seconds; one second of sound takes 100 kB


class RecentUtterances:
    """A voice whose last `MAX_UTTERANCES` utterances are kept; equal arguments give equal bytes in any case."""

    def __init__(self, voice: Voice) -> None:
        self._voice = voice
        self._kept: OrderedDict[Hashable, Speech] = OrderedDict()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._voice.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence, or return it if it was one of the last ones; arguments as for `Voice.speak`."""
        key = (content if isinstance(content, str) else tuple(content), rate, seed)
        if key in self._kept:
            self._kept.move_to_end(key)
            return self._kept[key]
        speech = self._voice.speak(content, rate=rate, seed=seed)
        self._kept[key] = speech
        while len(self._kept) > MAX_UTTERANCES:
            self._kept.popitem(last=False)
        return speech
