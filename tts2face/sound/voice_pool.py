"""Loaded voices shared by requests, with the utterances that were measured before they are animated.

Choice and loading of a voice by name and language: those of tts2face, of other packages, and Piper's by path.
"""

import importlib.util
import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Mapping
from concurrent.futures import Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from lexicon.errors import BackendError, InputError
from lexicon.languages import language_code
from tts2face.plugins import VOICES, declared, load_plugin
from tts2face.sound.delivery import sound_with, speak_with
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.shipped_voices import ENGLISH_CODES, SHIPPED_VOICES, piper_voice, server_info, server_voice
from tts2face.sound.voice import (
    ExpectingVoice,
    NativeRun,
    PronunciationMap,
    SpeechInput,
    Voice,
    VoiceInfo,
    VoiceSetting,
    Wait,
)
from tts2face.sound.voice_urls import NAMES_VARIABLE, is_voice_url, named_urls
from tts2face.types import Speech, Waveform, YieldTurn, keep_on

if TYPE_CHECKING:
    from tts2face.sound.alignment import Align, Aligner

# voices of languages whose usual one is not that of every installation, the preferred one first
WHERE_INSTALLED = MappingProxyType({"en-gb": ("emma", "fable", "heart"), "ja": ("mei",)})
TYPICAL_HZ = MappingProxyType({"female": 200.0, "male": 115.0, "-": 165.0})  # F0 of people who read aloud
MAX_VOICES = 2  # unused voices in memory; about 100 MB each
MAX_UTTERANCES = 8  # of at most some ten seconds; one second of sound takes 100 kB


def _server_urls() -> Mapping[str, str]:
    """URLs by the names that the operator gives them; a name of another voice is refused."""
    urls = named_urls()
    taken = urls.keys() & {*SHIPPED_VOICES, "auto"}
    if taken:
        raise InputError(
            f"{NAMES_VARIABLE} names a server's voice as another voice, {min(taken)}; give it its own name"
        )
    return urls


def voice_names() -> tuple[str, ...]:
    """Names of all voices; those of tts2face first, which win over others of the same name."""
    own = {**SHIPPED_VOICES, **_server_urls()}
    return (*own, *(name for name in declared(VOICES) if name not in own))


def has_voice(name: str | None) -> bool:
    """Whether a name is one of `voice_names`; other packages are asked only where it is not shipped."""
    return name in SHIPPED_VOICES or name in _server_urls() or name in declared(VOICES)


def find_voice(name: str) -> VoiceInfo:
    """Description of a voice.

    Raises
    ------
    InputError
        There is none of this name.
    BackendError
        Its package cannot be loaded.
    """
    urls = _server_urls()
    if name in SHIPPED_VOICES:
        return SHIPPED_VOICES[name]
    if name in urls:
        return server_info(urls[name])
    if has_voice(name):
        info: VoiceInfo = load_plugin(VOICES, name)
        return info
    raise InputError(
        f"there is no voice {name!r}; give {', '.join(voice_names())}, or the path of a Piper voice (.onnx)"
    )


def require_installed(name: str) -> None:
    """Refuse a voice of `voice_names` whose package is missing, without loading it; errors as `find_voice`."""
    info = find_voice(name)
    if importlib.util.find_spec(info.package) is None:
        raise BackendError(
            f"the voice {name} is not installed: {info.package} is missing; `tts2face voices` lists all voices"
        )
    if not is_installed(name):
        raise BackendError(f"the voice {name} is not installed; run: tts2face voices add {name}")


def speaks(name: str, language: str) -> bool:
    """Whether a voice of `voice_names` speaks a language; errors as `find_voice`."""
    languages = find_voice(name).languages
    return not languages or language in languages


def default_voice(language: str) -> str:
    """Name of the voice that speaks a language code where none is chosen."""
    usual = "heart" if language in ENGLISH_CODES[:2] else "espeak"
    return next((name for name in WHERE_INSTALLED.get(language, ()) if is_installed(name)), usual)


def usual_pitch_hz(name: str | None, language: str) -> float:
    """Median F0 of a voice, None for the default one of a language; of a voice that has none, that of its sex."""
    chosen = name or default_voice(language)
    if not has_voice(chosen):
        return TYPICAL_HZ["-"]
    info = find_voice(chosen)
    return info.pitch_hz or TYPICAL_HZ.get(info.sex, TYPICAL_HZ["-"])


def is_installed(name: str) -> bool:
    """Whether the package of a voice of `voice_names` is there; errors as `find_voice`."""
    info = find_voice(name)
    return importlib.util.find_spec(info.package) is not None and (info.has_files is None or info.has_files())


def load_voice(
    name: str | None,
    language: str,
    own_words: PronunciationMap | None = None,
    align: "Align | None" = None,
    run: NativeRun | None = None,
    wait: Wait = Future.result,
) -> Voice:
    """Load a voice by name, or the default voice of a language.

    Parameters
    ----------
    name
        One of `voice_names`, the path of a Piper voice (``.onnx``), the URL of a voice of a server
        (`tts2face.sound.voice_server.parse_voice_url`), or None for the default.
    language
        Code, tag or English name, see `lexicon.languages.language_code`.
    own_words, align, run, wait
        As for `VoiceSetting`.

    Raises
    ------
    InputError
        The voice does not exist or does not speak the language.
    DataError
        The file of a Piper voice or its settings is damaged.
    BackendError
        A package that the voice needs is not installed.
    """
    setting = VoiceSetting(language_code(language), own_words or {}, align, run, wait)
    chosen = name or default_voice(setting.language)
    if chosen.endswith(".onnx"):
        return piper_voice(Path(chosen), setting)
    if is_voice_url(chosen):
        return server_voice(setting, chosen)
    if not speaks(chosen, setting.language):
        spoken = "English" if find_voice(chosen).languages == ENGLISH_CODES else ", ".join(find_voice(chosen).languages)
        raise InputError(f"the voice {chosen} speaks {spoken}, not {setting.language}; choose --voice espeak")
    return find_voice(chosen).make(setting)


class VoicePool:
    """Voices that stay loaded, the last `MAX_VOICES` that nobody uses. Safe from several threads.

    Each call of a voice has a loaded voice to itself, so that requests that take turns share one.

    Parameters
    ----------
    run
        Runs the models of voices and their aligner, during which other requests have their turns and may use the same
        voice.
    yield_turn
        Lets other requests take their turn, between two steps of a synthesis.
    wait
        As for `VoiceSetting`.
    """

    def __init__(
        self, run: NativeRun | None = None, yield_turn: YieldTurn = keep_on, wait: Wait = Future.result
    ) -> None:
        self._native_run, self._wait = run, wait
        self.yield_turn = yield_turn
        self._lock = threading.Lock()
        self._unused: list[tuple[Hashable, Voice]] = []  # the newest at the end
        self._kept: OrderedDict[Hashable, Speech] = OrderedDict()
        self._loading: dict[Hashable, Future[None]] = {}

    def voice(
        self,
        name: str | None,
        language: str,
        dictionary: PronunciationMap,
        *,
        prosody: Prosody = PLAIN_PROSODY,
        keeps_utterances: bool = False,
    ) -> Voice:
        """A voice for any number of threads; loading one takes half a second.

        Parameters
        ----------
        prosody
            Of all that it speaks, with that of each sentence.
        keeps_utterances
            Whether the last `MAX_UTTERANCES` utterances are kept until they are spoken again, with equal bytes.

        Raises
        ------
        InputError, BackendError
            As `load_voice`.
        """
        key = (name, language, frozenset(dictionary.items()))
        shared = _SharedVoice(
            self, key, lambda: self._load(name, language, dictionary),
            prosody, keeps_utterances,
        )  # fmt: skip
        with self.borrow(key, shared.load):  # an unknown voice is refused at once
            return shared

    def preload(self, name: str | None, language: str, dictionary: PronunciationMap) -> None:
        """Load a voice in a thread; `voice` waits for it. An error is raised by `voice`."""
        key = (name, language, frozenset(dictionary.items()))
        with self._lock:
            if key in self._loading or any(kept == key for kept, _ in self._unused):
                return
            thread = ThreadPoolExecutor(1, "voice")
            self._loading[key] = thread.submit(lambda: self._put_back(key, self._load(name, language, dictionary)))
            # the thread ends with its only task
            thread.shutdown(wait=False)

    def _load(self, name: str | None, language: str, dictionary: PronunciationMap) -> Voice:
        return load_voice(name, language, dictionary, self._align, self._native_run, self._wait)

    @cached_property
    def _aligner(self) -> "Aligner":
        from tts2face.sound.alignment import Aligner  # voices that tell their edges need none

        return Aligner()

    @property
    def _align(self) -> "Align | None":
        """Aligner of all voices of the pool, which take turns."""
        run = self._native_run
        return run and (lambda *given: run(lambda: self._aligner.align(*given), _nothing))

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
        if self._native_run is not None:
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
    key: tuple[Hashable, ...]  # name, language, words of a user
    load: Callable[[], Voice]
    prosody: Prosody
    keeps_utterances: bool

    @property
    def sample_rate(self) -> int:
        with self.pool.borrow(self.key, self.load) as voice:
            return voice.sample_rate

    @property
    def language(self) -> str:
        """Code of the language for which it was loaded."""
        return str(self.key[1])

    def expect(self, content: SpeechInput) -> None:
        name = self.key[0]
        if is_voice_url(name) or name in _server_urls():  # others would be loaded for it
            with self.pool.borrow(self.key, self.load) as voice:
                if isinstance(voice, ExpectingVoice):
                    voice.expect(content)

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        return self.deliver(content, Prosody(rate), seed)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        return self.deliver_sound(content, Prosody(rate), seed)

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        prosody = self.prosody.combined(prosody)
        utterance = (self.key, content if isinstance(content, str) else tuple(content), prosody, seed)
        speech = self.pool.release(utterance)
        if speech is None:
            with self.pool.borrow(self.key, self.load) as voice:
                speech = speak_with(voice, content, prosody, seed, language=self.language)
        if self.keeps_utterances:
            self.pool.keep(utterance, speech)
        return speech

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        with self.pool.borrow(self.key, self.load) as voice:
            return sound_with(voice, content, self.prosody.combined(prosody), seed, language=self.language)
