"""Loaded voices shared by requests, with the utterances that were measured before they are animated."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass

from tts2face.speech.forced_alignment import SpeechAligner
from tts2face.types import Speech, Waveform
from tts2face.voice.engine import NativeRun, PronunciationMap, SpeechInput, Voice
from tts2face.voice.loading import load_voice

MAX_VOICES = 2  # unused voices in memory; about 100 MB each
MAX_UTTERANCES = 8  # of at most some ten seconds; one second of sound takes 100 kB


class VoicePool:
    """Voices that stay loaded, the last `MAX_VOICES` that nobody uses. Safe from several threads.

    Each call of a voice has a loaded voice to itself, so that requests that take turns share one.

    Parameters
    ----------
    aligner
        Thread-safe aligner of all voices, during whose work other requests may use the same voice: they take turns, and
        only this wait, and runs of models, lie within a call. None: each voice has its own.
    run
        Runs the models of voices.
    """

    def __init__(self, aligner: SpeechAligner | None = None, run: NativeRun | None = None) -> None:
        self._aligner, self._native_run = aligner, run
        self._lock = threading.Lock()
        self._unused: list[tuple[Hashable, Voice]] = []  # the newest at the end
        self._kept: OrderedDict[Hashable, Speech] = OrderedDict()
        self._loading: dict[Hashable, Future[None]] = {}

    def voice(
        self, name: str | None, language: str, dictionary: PronunciationMap, *, keeps_utterances: bool = False
    ) -> Voice:
        """A voice for any number of threads; loading one takes half a second.

        Parameters
        ----------
        keeps_utterances
            Whether the last `MAX_UTTERANCES` utterances are kept until they are spoken again, with equal bytes.

        Raises
        ------
        InputError, BackendError
            As `load_voice`.
        """
        key = (name, language, frozenset(dictionary.items()))
        shared = _SharedVoice(
            self, key, lambda: load_voice(name, language, dictionary, self._aligner, self._native_run), keeps_utterances
        )
        with self.borrow(key, shared.load):  # an unknown voice is refused at once
            return shared

    def preload(self, name: str | None, language: str, dictionary: PronunciationMap) -> None:
        """Load a voice in a thread; `voice` waits for it. An error is raised by `voice`."""
        key = (name, language, frozenset(dictionary.items()))
        with self._lock:
            if key in self._loading or any(kept == key for kept, _ in self._unused):
                return
            thread = ThreadPoolExecutor(1, "voice")
            self._loading[key] = thread.submit(
                lambda: self._put_back(key, load_voice(name, language, dictionary, self._aligner, self._native_run))
            )
            thread.shutdown(wait=False)

    def give_way(self) -> None:
        """Let other requests take their turn, between two steps of a synthesis."""
        if self._native_run is not None:
            self._native_run(_nothing, _nothing)

    @contextmanager
    def borrow(self, key: Hashable, load: Callable[[], Voice]) -> Iterator[Voice]:
        """A loaded voice for exclusive use within a ``with`` block."""
        loading = self._loading.get(key)
        if loading is not None:
            wait([loading])
        with self._lock:
            self._loading.pop(key, None)
            found = next((at for at, (kept, _) in enumerate(self._unused) if kept == key), None)
            voice = None if found is None else self._unused.pop(found)[1]
        voice = voice or load()
        if self._aligner is not None:
            self._put_back(key, voice)
            yield voice
            return
        try:
            yield voice
        finally:
            self._put_back(key, voice)

    def _put_back(self, key: Hashable, voice: Voice) -> None:
        with self._lock:
            self._unused.append((key, voice))
            del self._unused[:-MAX_VOICES]

    def keep(self, key: Hashable, speech: Speech) -> None:
        """Keep an utterance."""
        with self._lock:
            self._kept[key] = speech
            while len(self._kept) > MAX_UTTERANCES:
                self._kept.popitem(last=False)

    def release(self, key: Hashable) -> Speech | None:
        """A kept utterance, which is then forgotten; None if there is none."""
        with self._lock:
            return self._kept.pop(key, None)


def _nothing() -> None:
    pass


@dataclass(frozen=True, slots=True, eq=False)
class _SharedVoice:
    """A voice of a pool."""

    pool: VoicePool
    key: Hashable
    load: Callable[[], Voice]
    keeps_utterances: bool

    @property
    def sample_rate(self) -> int:
        with self.pool.borrow(self.key, self.load) as voice:
            return voice.sample_rate

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        utterance = (self.key, content if isinstance(content, str) else tuple(content), rate, seed)
        speech = self.pool.release(utterance)
        if speech is None:
            with self.pool.borrow(self.key, self.load) as voice:
                speech = voice.speak(content, rate=rate, seed=seed)
        if self.keeps_utterances:
            self.pool.keep(utterance, speech)
        return speech

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        with self.pool.borrow(self.key, self.load) as voice:
            return voice.sound(content, rate=rate, seed=seed)
