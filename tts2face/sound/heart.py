"""The neural English voice ``heart`` of hibari-tts, with phone edges from its own durations and its sound.

The alphabet of the neural voice: letters of misaki, in which Kokoro and its students are trained, for phones.
"""

from bisect import bisect_left
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import import_of_extra
from lexicon.pauses import PAUSES_S
from lexicon.phones import PHONES, nearest_phones
from lexicon.pronounce import Word
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.numeric.telemetry import disable_telemetry
from tts2face.sound.transforms import import_hibari
from tts2face.sound.voice import (
    NativeRun,
    PronunciationMap,
    SpeechInput,
    apply_volume,
    pronounce_content,
    split_spoken_sentences,
)
from tts2face.storage.array_cache import computed_once
from tts2face.types import Speech, Waveform, concatenate_speech

if TYPE_CHECKING:
    from tts2face.models.phone_classifier import PhoneClassifier
    from tts2face.sound.segments import StatedPhone

# Letters to phones of the table.
PHONE_OF_LETTER = MappingProxyType({
    "A": "eɪ", "I": "aɪ", "O": "oʊ", "Q": "oʊ", "W": "aʊ", "Y": "ɔɪ", "ʤ": "dʒ", "ʧ": "tʃ", "ə": "ə", "ɐ": "ə",
    "ᵊ": "ə", "ᵻ": "ɪ", "ɪ": "ɪ", "i": "i", "ɛ": "ɛ", "æ": "æ", "a": "æ", "ɑ": "ɑ", "ɒ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ",
    "u": "u", "ʌ": "ʌ", "ɜ": "ɝ", "ɚ": "ɚ", "e": "ɛ", "o": "ɔ", "ɹ": "ɹ", "r": "ɹ", "ð": "ð", "θ": "θ", "ʃ": "ʃ",
    "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "T": "t", "ɾ": "t", "ʔ": "t", "h": "h", "x": "k", "b": "b", "d": "d",
    "f": "f", "k": "k", "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
LETTERS_OF_PHONE = MappingProxyType({
    "eɪ": "A", "aɪ": "I", "oʊ": "O", "aʊ": "W", "ɔɪ": "Y", "dʒ": "ʤ", "tʃ": "ʧ", "ə": "ə", "ɪ": "ɪ", "i": "i",
    "ɛ": "ɛ", "æ": "æ", "ɑ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ", "u": "u", "ʌ": "ʌ", "ɝ": "ɜɹ", "ɚ": "əɹ", "ɹ": "ɹ", "ð": "ð",
    "θ": "θ", "ʃ": "ʃ", "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "h": "h", "b": "b", "d": "d", "f": "f", "k": "k",
    "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})
_SYLLABIC, _SHORT_SCHWA = "ᵊ", "ɐ"
_FLAP, _SHORT_I = "T", "ᵻ"
_ENDINGS = MappingProxyType(
    dict.fromkeys(("t", "d"), (("d",),)) | dict.fromkeys(("s", "z", "ʃ", "ʒ", "tʃ", "dʒ"), (("z",),))
)  # -ed after a stop of the tongue, -es after a sibilant
_BEFORE_FLAP = frozenset(phone for phone in LETTERS_OF_PHONE if PHONES[phone].is_vowel) | {"ɹ"}
_ARTICLES = frozenset({("ə",), ("ə", "n"), ("ə", "m")})  # a, an, am
LANGUAGE = "en-us"
CLAUSE_MARKS = frozenset({",", ";", ":"})
MARKS = "".join(PAUSES_S)  # punctuation among the letters
MAX_LETTERS = 400  # the model accepts at most this many letters in one call
DURATION_STEP_S = 0.025  # length of one step of the model's durations
BOUNDARY_DELAY_S = 0.061  # delay of the model's own boundaries against its sound (56 ms when fast, 71 when slow)
CACHE_KIND, CACHE_VERSION = "voices", 1  # raised when the graph of the same model changes
DURATION_TENSOR = "/Cast_32_output_0"  # internal tensor of the ONNX graph: steps of 25 ms for each letter
# A network that returns its input: Hibari's constructor loads one, with an arena, and loading the voice's takes 0.1 s.
IDENTITY_NETWORK = (
    b'\x08\x08B\x02\x10\x11:+\n\x10\n\x01x\x12\x01y"\x08Identity\x12\x01e'
    b"Z\t\n\x01x\x12\x04\n\x02\x08\x01b\t\n\x01y\x12\x04\n\x02\x08\x01"
)


def voice_phones(phones: Sequence[str]) -> list[str]:
    """Phones of the voice's alphabet; a phone that the alphabet lacks is replaced by the nearest one."""
    return [own for phone in phones for own in nearest_phones(phone, LETTERS_OF_PHONE.keys())]


def word_letters(phones: Sequence[str], stress: Sequence[int]) -> tuple[str, tuple[int, ...]]:
    """Letters of a word, and the place of the first letter of each of its `voice_phones`.

    The alphabet distinguishes variants of one phone: /t/ between vowels is a flap unless a stressed vowel or a syllabic
    /n/ follows, /ə/ before a final /l/ is short, and so is the vowel of the endings -ed and -es.

    Parameters
    ----------
    phones, stress : N
        Phones of the table and their stress: 1 primary, 2 secondary, 0 none.
    """
    pairs = [
        (own, digit if at == 0 else 0)
        for phone, digit in zip(phones, stress, strict=True)
        for at, own in enumerate(nearest_phones(phone, LETTERS_OF_PHONE.keys()))
    ]
    letters, places = "", []
    for at, (_, digit) in enumerate(pairs):
        letters += STRESS_MARKS.get(digit, "")
        places.append(len(letters))
        letters += _variant(pairs, at)
    is_article = tuple(phone for phone, _ in pairs) in _ARTICLES and pairs[0][1] == 0
    return (_SHORT_SCHWA + letters[1:] if is_article else letters), tuple(places)


def _variant(pairs: Sequence[tuple[str, int]], at: int) -> str:
    """Letters of the phone at an index."""
    phone, digit = pairs[at]
    after = [following for following, _ in pairs[at + 1 : at + 3]]
    if phone == "t" and 0 < at < len(pairs) - 1 and pairs[at - 1][0] in _BEFORE_FLAP:
        is_unstressed = PHONES[after[0]].is_vowel and pairs[at + 1][1] == 0
        return _FLAP if is_unstressed and after != ["ə", "n"] else "t"
    if phone == "ə" and at > 0 and not digit and after[:1] == ["l"]:
        return LETTERS_OF_PHONE[phone] if len(after) == 2 and PHONES[after[1]].is_vowel else _SYLLABIC
    if phone in {"ə", "ɪ"} and not digit and at > 0 and tuple(after) in _ENDINGS.get(pairs[at - 1][0], ()):
        return _SHORT_I
    return LETTERS_OF_PHONE[phone]


@dataclass(frozen=True, slots=True)
class LetteredWord:
    """A spoken word with its phones, and its letters in the voice's alphabet with the punctuation after it."""

    text: str
    phones: tuple[str, ...]
    letters: str
    places: tuple[int, ...]  # index of the letter of each phone


class NeuralVoice:
    """The voice ``heart``: American English, 24 kHz. Not thread-safe.

    Parameters
    ----------
    run
        Runs the model; None: within the call.
    """

    def __init__(self, own_words: PronunciationMap, run: NativeRun | None = None) -> None:
        self._own_words = own_words
        disable_telemetry()
        with import_of_extra("the voice heart needs hibari-tts; run: pip install hibari-tts"):
            hibari = import_hibari()
            from hibari.voices import voice_path
        # with other numbers of threads ONNX Runtime's convolutions give other bits
        self._model: Any = hibari.Hibari(voice="heart", model=IDENTITY_NETWORK, threads=1)
        self._network = _Network(open_network(Path(voice_path("heart")).read_bytes()), run)
        self._model.sess = self._network
        pronounce_content("Hello.", LANGUAGE, {})  # reads the dictionary while other models are loaded

    @cached_property
    def _classifier(self) -> "PhoneClassifier":
        from tts2face.models.phone_classifier import load_phone_classifier  # sound alone has no edges

        return load_phone_classifier("heart")

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return int(self._model.sample_rate)

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`."""
        return concatenate_speech([self._with_edges(*part) for part in self.parts(content, rate=rate, seed=seed)])

    def parts(
        self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0
    ) -> "Iterator[tuple[Waveform, Sequence[LetteredWord], Sequence[StatedPhone]]]":
        """Sound, words and stated phones of each part that the model synthesises in one call."""
        for words in self._spoken_parts(content):
            sound = self._sound_of(words, rate, seed)
            yield sound, words, stated_phones(words, self._network.steps)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones, which takes most of the time."""
        sounds = [self._sound_of(part, rate, seed).samples for part in self._spoken_parts(content)]
        return Waveform(np.concatenate(sounds), self.sample_rate)

    def _spoken_parts(self, content: SpeechInput) -> list[list[LetteredWord]]:
        """Tokens of each part that the model synthesises in one call."""
        words = pronounce_content(content, LANGUAGE, self._own_words)
        return [part for sentence in split_spoken_sentences(words) for part in _cut_tokens([*map(_token, sentence)])]

    def _with_edges(self, sound: Waveform, words: Sequence[LetteredWord], stated: "Sequence[StatedPhone]") -> Speech:
        from tts2face.sound.segments import find_edges

        edges = find_edges(sound, stated, self._classifier)
        spoken = [at for at, phone in enumerate(stated) if not phone.may_be_skipped or edges[at + 1] > edges[at]]
        spans, first = [], 1  # stated phones of a word
        for word in words:
            start = bisect_left(spoken, first)
            spans.append(WordSpan(word.text, start, start + len(word.phones)))
            first += len(word.phones) + 1
        labels = [stated[at].label for at in spoken]
        return Speech(sound, PhoneSequence(labels, [*edges[spoken], sound.duration]), tuple(spans))

    def _sound_of(self, tokens: Sequence[LetteredWord], rate: float, seed: int) -> Waveform:
        samples = self._model.from_phonemes(_joined_letters(tokens), speed=rate, seed=seed)
        return Waveform(apply_volume(samples), self.sample_rate)


def stated_phones(tokens: Sequence[LetteredWord], steps: NDArray[np.integer]) -> "list[StatedPhone]":
    """Phones as the model states them, with a silence before each word, which may lack, and one at the end.

    Parameters
    ----------
    steps : (L + 2,)
        Durations of the L letters and of the padding at both ends, in steps of `DURATION_STEP_S`.
    """
    from tts2face.sound.segments import StatedPhone

    starts = np.cumsum(steps)[:-1] * DURATION_STEP_S - BOUNDARY_DELAY_S
    found = [StatedPhone(SILENCE, 0.0)]
    at = 0
    is_marked = False
    for token in tokens:
        if at:
            found.append(StatedPhone(SILENCE, starts[at - 1], may_be_skipped=True, is_marked=is_marked))
        ends = [*token.places[1:], len(token.letters.rstrip(MARKS))]
        found += [
            StatedPhone(phone, starts[at + place], starts[at + end] - starts[at + place])
            for phone, place, end in zip(token.phones, token.places, ends, strict=True)
        ]
        at, is_marked = at + len(token.letters) + 1, token.letters[-1] in MARKS
    return [*found, StatedPhone(SILENCE, starts[at - 1])]


class _Network:
    """The model's ONNX session, whose runs can be ended; it keeps the durations of the last one, ``steps``."""

    def __init__(self, session: Any, run: NativeRun | None) -> None:
        self._session, self._run = session, run or _run_within
        self.steps: NDArray[np.integer] = np.zeros(0, np.int64)

    def run(self, _: None, inputs: Any) -> Any:
        """Outputs of the model but the durations."""
        import onnxruntime

        options = onnxruntime.RunOptions()
        options.log_severity_level = 4  # fatal errors; an end is none

        def end() -> None:
            options.terminate = True

        *outputs, steps = self._run(lambda: self._session.run(None, inputs, options), end)
        self.steps = np.ravel(steps)
        return outputs

    def __getattr__(self, name: str) -> Any:
        """Other attributes of the session."""
        return getattr(self._session, name)


def _run_within(run: Callable[[], Any], _: Callable[[], None]) -> Any:
    return run()


def open_network(model: bytes) -> Any:
    """ONNX session of the voice, which frees its memory after each sentence; an arena would retain up to 100 MB.

    Optimising the graph takes most of the time of a session. It is kept as far as it is the same on every machine; what
    depends on the processor is done each time.
    """
    import onnxruntime

    levels = onnxruntime.GraphOptimizationLevel
    kept = computed_once(
        CACHE_KIND, CACHE_VERSION, [np.frombuffer(model, np.uint8), DURATION_TENSOR, onnxruntime.__version__],
        lambda: {"graph": _optimised(model)}, lambda found: "graph" in found and found["graph"].dtype == np.uint8,
    )  # fmt: skip
    session = _session(kept["graph"].tobytes(), levels.ORT_ENABLE_ALL)
    session._model_bytes = None  # kept for a start on another provider: the size of the model, for as long as it lasts
    return session


def _optimised(model: bytes) -> NDArray[np.uint8]:
    """Bytes (N,) of the model with the durations among its outputs, optimised for any machine."""
    import onnxruntime

    # the layouts of ORT_ENABLE_ALL are those of one processor (decision 160)
    level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_EXTENDED
    with TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder, "graph.onnx")
        _session(add_graph_output(model, DURATION_TENSOR), level, path)
        return np.frombuffer(path.read_bytes(), np.uint8)


def _session(model: bytes, level: Any, written: Path | None = None) -> Any:
    """Session that optimises up to a level, and writes its graph to a path if there is one."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # one thread: convolutions give other bits at other numbers of threads
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3  # errors
    # an arena keeps up to 100 MB after a sentence (decision 073)
    options.enable_cpu_mem_arena = options.enable_mem_pattern = False
    options.graph_optimization_level = level
    if written is not None:
        options.optimized_model_filepath = str(written)
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])


def _joined_letters(tokens: Sequence[LetteredWord]) -> str:
    return " ".join(token.letters for token in tokens)


def _token(word: Word) -> LetteredWord:
    letters, places = word_letters(word.phones, word.stress)
    return LetteredWord(word.text, tuple(voice_phones(word.phones)), letters + word.mark, places)


def _cut_tokens(tokens: Sequence[LetteredWord]) -> Iterator[list[LetteredWord]]:
    """Divide tokens into parts of at most `MAX_LETTERS` letters, after a clause mark if the part has one."""
    part: list[LetteredWord] = []
    length = 0
    for token in tokens:
        if part and length + len(token.letters) + 1 > MAX_LETTERS:
            marks = [at for at, earlier in enumerate(part) if earlier.letters[-1:] in CLAUSE_MARKS]
            keep = marks[-1] + 1 if marks else len(part)
            yield part[:keep]
            part = part[keep:]
            length = sum(len(earlier.letters) + 1 for earlier in part)
        part.append(token)
        length += len(token.letters) + 1
    if part:
        yield part


def add_graph_output(model: bytes, tensor: str) -> bytes:
    """Add an output tensor to a serialised ONNX model.

    Protocol buffers merge appended messages, so that the output is appended as a ``GraphProto`` (ONNX IR).
    """
    graph_field = 7
    output_field = 12
    name_field = 1
    message = _length_delimited(name_field, tensor.encode())
    return model + _length_delimited(graph_field, _length_delimited(output_field, message))


def _length_delimited(field: int, content: bytes) -> bytes:
    return _encode_varint(field << 3 | 2) + _encode_varint(len(content)) + content


def _encode_varint(number: int) -> bytes:
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + _encode_varint(rest) if rest else bytes([low])
