"""The neural English voice ``heart`` of hibari-tts, with phone edges by forced alignment of its sound."""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError, InputError
from lexicon.ipa import Segment
from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.speech.forced_alignment import Aligner, SpeechAligner, enforce_increasing
from tts2face.telemetry import disable_telemetry
from tts2face.types import Speech, Waveform, concatenate_speech
from tts2face.voice.engine import NativeRun, PronunciationMap, SpeechInput, SpokenWord, apply_volume

MAX_LETTERS = 400  # the model accepts at most this many letters in one call
DURATION_STEP_S = 0.025  # length of one step of the model's durations
BOUNDARY_DELAY_S = 0.045  # delay of the model's own boundaries against its sound (41-51 ms)
DURATION_TENSOR = "/Cast_32_output_0"  # internal tensor of the ONNX graph: steps of 25 ms for each letter
NO_LETTER = re.compile(r"[^\w'’-]+")  # characters that hibari does not accept in bracketed words
WORD_CHARACTER = re.compile(r"[^\W_]")  # a letter or a digit, which must have a pronunciation
# Letters of the misaki alphabet, in which the voice was trained, to phones of the table.
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
RHOTIC_VOWELS = MappingProxyType({"ə": "ɚ", "ɝ": "ɝ", "ɚ": "ɚ"})  # vowels that merge with a following ɹ
VOWELS = frozenset(phone for letter, phone in PHONE_OF_LETTER.items() if letter in "AIOQWYəɐᵊᵻɪiɛæaɑɒɔʊuʌɜɚeo")
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})


@dataclass(frozen=True, slots=True)
class _Token:
    """A written word or punctuation, its letters in the voice's alphabet, and whether a space follows."""

    text: str
    letters: str
    has_space: bool


class NeuralVoice:
    """The voice ``heart``: American English, 24 kHz. Not thread-safe.

    Parameters
    ----------
    aligner
        Aligns its sound with its phones; None for an aligner of its own.
    run
        Runs the model; None: within the call.
    """

    def __init__(
        self, own_words: PronunciationMap, aligner: SpeechAligner | None = None, run: NativeRun | None = None
    ) -> None:
        self._own_words = {word: segments_to_letters(segments) for word, segments in own_words.items()}
        disable_telemetry()
        try:
            from hibari import Hibari
        except ImportError as missing:
            raise BackendError("the voice heart needs hibari-tts; run: pip install hibari-tts") from missing
        self._model: Any = Hibari(voice="heart", threads=1)
        session = _session_without_arena(self._model.model_path)
        self._model.sess = session if run is None else _OwnRun(session, run)
        self._aligner: SpeechAligner = aligner or Aligner()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return int(self._model.sample_rate)

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.voice.engine.Voice`."""
        return concatenate_speech([self._speak_tokens(part, rate, seed) for part in self._spoken_parts(content)])

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones, which takes most of the time."""
        sounds = [self._sound_of(part, rate, seed).samples for part in self._spoken_parts(content)]
        return Waveform(np.concatenate(sounds), self.sample_rate)

    def _spoken_parts(self, content: SpeechInput) -> "list[list[_Token]]":
        """Tokens of each part.

        Raises
        ------
        InputError
            No part has a word.
        """
        parts = list(self._parts(content))
        if not any(letters_to_phones(token.letters)[0] for part in parts for token in part):
            raise InputError("there is nothing to say in the text; give at least one word")
        return parts

    def _parts(self, content: SpeechInput) -> Iterator[list[_Token]]:
        """Yield the tokens of each part that the model synthesises in one call."""
        if isinstance(content, str):
            split = self._model.split_sentences(content)
            sentences = [self._tokens(self._insert_own_words(sentence)) for sentence in split]
        elif all(word.segments for word in content):
            sentences = [[_token_from_word(word) for word in content]]
        else:
            sentences = [self._tokens(" ".join(self._bracketed_word(word) for word in content))]
        for sentence in sentences:
            for part in _cut_tokens(sentence):
                if any(token.letters.strip() for token in part):
                    yield part

    def _tokens(self, sentence: str) -> list[_Token]:
        from hibari.g2p.normalize import normalize

        g2p = self._model.g2p
        phonemized = g2p.phonemize_tokens(g2p.tokenize(normalize(sentence)))
        tokens = [
            _Token(token.text, self._known_phones(token.phonemes), bool(token.whitespace)) for token in phonemized
        ]
        unpronounced = [
            token.text
            for token in tokens
            if WORD_CHARACTER.search(token.text) and not letters_to_phones(token.letters)[0]
        ]
        if unpronounced:
            raise InputError(
                f"the voice heart cannot say {unpronounced[0]!r}; write it in English words, or choose another voice"
            )
        return tokens

    def _insert_own_words(self, sentence: str) -> str:
        """Replace a user's words by ``[word](/letters/)``, hibari's notation for given pronunciations."""

        def add_brackets(match: "re.Match[str]") -> str:
            letters = self._own_words.get(match[0].lower())
            return match[0] if letters is None else f"[{match[0]}](/{letters}/)"

        plain = re.sub(r"[\[\]]", " ", sentence)
        return re.sub(r"[^\W_]+(?:['’-][^\W_]+)*", add_brackets, plain) if self._own_words else plain

    def _bracketed_word(self, word: SpokenWord) -> str:
        """A word in hibari's notation, with its phones if it has any."""
        if not word.segments:
            return self._insert_own_words(word.text) + word.after
        label = NO_LETTER.sub("", word.text) or "word"
        return f"[{label}](/{segments_to_letters(word.segments)}/){word.after}"

    def _known_phones(self, letters: str | None) -> str:
        """The letters that belong to the model's vocabulary."""
        return "".join(letter for letter in letters or "" if letter in self._model.vocab)

    def _speak_tokens(self, tokens: Sequence[_Token], rate: float, seed: int) -> Speech:
        sound = self._sound_of(tokens, rate, seed)
        try:
            phones, spans = self._align(tokens, sound)
        except DataError:
            phones, spans = self._predict_phones(tokens, _joined_letters(tokens), rate, sound)
        return Speech(sound, phones, spans)

    def _sound_of(self, tokens: Sequence[_Token], rate: float, seed: int) -> Waveform:
        samples = self._model.from_phonemes(_joined_letters(tokens), speed=rate, seed=seed)
        return Waveform(apply_volume(samples), self.sample_rate)

    def _align(self, tokens: Sequence[_Token], sound: Waveform) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
        words = [(str(owner), [phones]) for owner, phones, _ in _spoken_words(tokens)]
        found = self._aligner.align(sound, words)
        return found.phones, _token_spans(found.words, tokens)

    def _predict_phones(
        self, tokens: Sequence[_Token], letters: str, rate: float, sound: Waveform
    ) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
        """Phone edges from the model's durations, corrected for its delay, for sound that cannot be aligned."""
        begins = np.concatenate([[0.0], np.cumsum(self._durations(letters, rate) * DURATION_STEP_S)])[1:]
        labels, starts, spans = [SILENCE], [0.0], []
        for owner, phones, places in _spoken_words(tokens):
            spans.append(WordSpan(str(owner), len(labels), len(labels) + len(phones)))
            labels += phones
            starts += [float(begins[place]) - BOUNDARY_DELAY_S for place in places]
        labels.append(SILENCE)
        starts.append(min(float(begins[len(letters)]) - BOUNDARY_DELAY_S, sound.duration))
        edges = enforce_increasing(np.array([*starts, sound.duration]))
        return PhoneSequence(labels, edges), _token_spans(spans, tokens)

    def _durations(self, letters: str, rate: float) -> NDArray[np.float64]:
        """(L + 2,) durations in steps of `DURATION_STEP_S` of L letters and the padding at both ends."""
        disable_telemetry()
        import onnxruntime

        graph = add_graph_output(Path(self._model.model_path).read_bytes(), DURATION_TENSOR)
        session = onnxruntime.InferenceSession(graph, providers=["CPUExecutionProvider"])
        inputs = {
            "ids": np.array([self._model.ids(letters)], np.int64),
            "speed": np.array([rate], np.float32),
        }
        steps: NDArray[np.float64] = np.asarray(session.run([DURATION_TENSOR], inputs)[0], np.float64).ravel()
        return steps


@dataclass(frozen=True, slots=True)
class _OwnRun:
    """An ONNX session whose runs can be ended."""

    session: Any
    native_run: NativeRun

    def run(self, names: Any, inputs: Any) -> Any:
        """Outputs of the model."""
        import onnxruntime

        options = onnxruntime.RunOptions()
        options.log_severity_level = 4  # fatal errors; an end is none

        def end() -> None:
            options.terminate = True

        return self.native_run(lambda: self.session.run(names, inputs, options), end)

    def __getattr__(self, name: str) -> Any:
        """Other attributes of the session."""
        return getattr(self.session, name)


def _session_without_arena(path: str) -> Any:
    """ONNX session that frees its memory after each sentence; an arena would retain up to 100 MB."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3  # errors
    options.enable_cpu_mem_arena = options.enable_mem_pattern = False
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def _joined_letters(tokens: Sequence[_Token]) -> str:
    return "".join(token.letters + " " * token.has_space for token in tokens).strip()


def _token_from_word(word: SpokenWord) -> _Token:
    return _Token(word.text, segments_to_letters(word.segments) + word.after, True)


def _cut_tokens(tokens: Sequence[_Token]) -> Iterator[list[_Token]]:
    """Divide tokens into parts of at most `MAX_LETTERS` letters, after a clause mark if the part has one."""
    part: list[_Token] = []
    length = 0
    for token in tokens:
        if part and length + len(token.letters) + 1 > MAX_LETTERS:
            marks = [at for at, earlier in enumerate(part) if earlier.letters[-1:] in {",", ";", ":", "—"}]
            keep = marks[-1] + 1 if marks else len(part)
            yield part[:keep]
            part = part[keep:]
            length = sum(len(earlier.letters) + 1 for earlier in part)
        part.append(token)
        length += len(token.letters) + 1
    if part:
        yield part


def _spoken_words(tokens: Sequence[_Token]) -> Iterator[tuple[int, tuple[str, ...], tuple[int, ...]]]:
    """Yield for each spoken word the index of its token, its phones, and their positions in the joined letters.

    A token such as a number consists of several spoken words.
    """
    at = 0
    for number, token in enumerate(tokens):
        for word in re.finditer(r"\S+", token.letters):
            phones, places = letters_to_phones(word[0])
            if phones:
                yield number, phones, tuple(at + word.start() + place for place in places)
        at += len(token.letters) + token.has_space


def _token_spans(spans: Sequence[WordSpan], tokens: Sequence[_Token]) -> tuple[WordSpan, ...]:
    """Merge the spans of each token, labelled by token index, into one span labelled by the token's text."""
    joined: dict[str, WordSpan] = {}
    for span in spans:
        first = joined[span.text].first if span.text in joined else span.first
        joined[span.text] = WordSpan(span.text, first, span.last)
    return tuple(WordSpan(tokens[int(span.text)].text, span.first, span.last) for span in joined.values())


def add_graph_output(model: bytes, tensor: str) -> bytes:
    """Add an output tensor to a serialised ONNX model.

    Protocol buffers merge appended messages, so that the output is appended as a ``GraphProto`` (ONNX IR).
    """
    graph_field, output_field, name_field = 7, 12, 1
    message = _length_delimited(name_field, tensor.encode())
    return model + _length_delimited(graph_field, _length_delimited(output_field, message))


def _length_delimited(field: int, content: bytes) -> bytes:
    return _encode_varint(field << 3 | 2) + _encode_varint(len(content)) + content


def _encode_varint(number: int) -> bytes:
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + _encode_varint(rest) if rest else bytes([low])


def letters_to_phones(letters: str) -> tuple[tuple[str, ...], tuple[int, ...]]:
    """Phones of a word's letters, and the position of each phone's first letter.

    əɹ is one phone (ɚ) unless a vowel follows; ɜɹ is always one (ɝ). Stress marks and length signs are skipped.
    """
    candidates = [(PHONE_OF_LETTER[letter], at) for at, letter in enumerate(letters) if letter in PHONE_OF_LETTER]
    phones: list[str] = []
    places: list[int] = []
    for number, (phone, at) in enumerate(candidates):
        follows = candidates[number + 1][0] if number + 1 < len(candidates) else ""
        is_rhotic = phone == "ɹ" and phones and phones[-1] in RHOTIC_VOWELS
        if is_rhotic and (phones[-1] != "ə" or follows not in VOWELS):
            phones[-1] = RHOTIC_VOWELS[phones[-1]]
            continue
        phones.append(phone)
        places.append(at)
    return tuple(phones), tuple(places)


def segments_to_letters(segments: Sequence[Segment]) -> str:
    """Letters of phones in the voice's alphabet; a phone that the alphabet lacks is replaced by the nearest one.

    Raises
    ------
    InputError
        `segments` is empty.
    """
    if not segments:
        raise InputError("a spoken word needs at least one phone")
    letters = ""
    for segment in segments:
        for phone in nearest_phones(segment.phone, LETTERS_OF_PHONE.keys()):
            letters += STRESS_MARKS.get(segment.stress, "") + LETTERS_OF_PHONE[phone]
    return letters
