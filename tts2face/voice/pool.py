"""Loaded voices, lent to one caller at a time, with the utterances that were measured before they are animated."""

import threading
from collections import OrderedDict
from collections.abc import Hashable, Iterator
from contextlib import contextmanager

from tts2face.types import Speech, Waveform
from tts2face.voice.engine import PronunciationMap, SpeechInput, Voice
from tts2face.voice.loading import load_voice

MAX_VOICES = 2  # unused voices in memory; about 100 MB each
MAX_UTTERANCES = 8  # of at most some ten seconds; one second of sound takes 100 kB


class RecentUtterances:
    """A voice that returns the last `MAX_UTTERANCES` utterances it was asked to keep without synthesising them again.

    Equal arguments give equal bytes in any case. While `keeps` is True, utterances are kept; otherwise one is released
    when it is returned.
    """

    def __init__(self, voice: Voice) -> None:
        self.keeps = False
        self._voice = voice
        self._kept: OrderedDict[Hashable, Speech] = OrderedDict()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return self._voice.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence, or return it if it is kept; arguments as for `Voice.speak`."""
        key = (content if isinstance(content, str) else tuple(content), rate, seed)
        speech = self._kept.pop(key, None) or self._voice.speak(content, rate=rate, seed=seed)
        if self.keeps:
            self._kept[key] = speech
            while len(self._kept) > MAX_UTTERANCES:
                self._kept.popitem(last=False)
        return speech

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound of a sentence; arguments as for `Voice.sound`."""
        return self._voice.sound(content, rate=rate, seed=seed)


class VoicePool:
    """Voices that stay loaded, the last `MAX_VOICES` that nobody uses. Safe from several threads."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._unused: list[tuple[Hashable, RecentUtterances]] = []  # the newest at the end

    @contextmanager
    def borrow(
        self, name: str | None, language: str, dictionary: PronunciationMap, *, keeps_utterances: bool = False
    ) -> Iterator[Voice]:
        """A voice for exclusive use within a ``with`` block; loading one takes half a second.

        Parameters
        ----------
        keeps_utterances
            Whether the last utterances are kept until they are spoken again.
        """
        key = (name, language, frozenset(dictionary.items()))
        with self._lock:
            found = next((at for at, (kept, _) in enumerate(self._unused) if kept == key), None)
            voice = None if found is None else self._unused.pop(found)[1]
        voice = voice or RecentUtterances(load_voice(name, language, dictionary))
        voice.keeps = keeps_utterances
        try:
            yield voice
        finally:
            with self._lock:
                self._unused.append((key, voice))
                del self._unused[:-MAX_VOICES]
