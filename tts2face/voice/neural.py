"""The neural English voice ``heart`` of hibari-tts, with phone edges by forced alignment of its sound."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError
from lexicon.pronounce import Word
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.speech.forced_alignment import Aligner, SpeechAligner, enforce_increasing
from tts2face.telemetry import disable_telemetry
from tts2face.types import Speech, Waveform, concatenate_speech
from tts2face.voice.content import pronounce_content, split_spoken_sentences
from tts2face.voice.engine import NativeRun, PronunciationMap, SpeechInput, apply_volume
from tts2face.voice.voice_alphabet import voice_phones, word_letters

LANGUAGE = "en-us"
CLAUSE_MARKS = frozenset({",", ";", ":"})
MAX_LETTERS = 400  # the model accepts at most this many letters in one call
DURATION_STEP_S = 0.025  # length of one step of the model's durations
BOUNDARY_DELAY_S = 0.045  # delay of the model's own boundaries against its sound (41-51 ms)
DURATION_TENSOR = "/Cast_32_output_0"  # internal tensor of the ONNX graph: steps of 25 ms for each letter
# A network that returns its input: Hibari's constructor loads one, with an arena, and loading the voice's takes 0.1 s.
IDENTITY_NETWORK = (
    b'\x08\x08B\x02\x10\x11:+\n\x10\n\x01x\x12\x01y"\x08Identity\x12\x01e'
    b"Z\t\n\x01x\x12\x04\n\x02\x08\x01b\t\n\x01y\x12\x04\n\x02\x08\x01"
)


@dataclass(frozen=True, slots=True)
class _Token:
    """A spoken word with its phones, and its letters in the voice's alphabet with the punctuation after it."""

    text: str
    phones: tuple[str, ...]
    letters: str
    places: tuple[int, ...]  # index of the letter of each phone


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
        self._own_words = own_words
        disable_telemetry()
        try:
            from hibari import Hibari
            from hibari.voices import voice_path
        except ImportError as missing:
            raise BackendError("the voice heart needs hibari-tts; run: pip install hibari-tts") from missing
        self._path = Path(voice_path("heart"))
        self._model: Any = Hibari(voice="heart", model=IDENTITY_NETWORK, threads=1)
        session = _session_without_arena(str(self._path))
        self._model.sess = session if run is None else _OwnRun(session, run)
        self._aligner: SpeechAligner = aligner or Aligner()
        pronounce_content("Hello.", LANGUAGE, {})  # reads the dictionary while other models are loaded

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

    def _spoken_parts(self, content: SpeechInput) -> list[list[_Token]]:
        """Tokens of each part that the model synthesises in one call."""
        words = pronounce_content(content, LANGUAGE, self._own_words)
        return [part for sentence in split_spoken_sentences(words) for part in _cut_tokens([*map(_token, sentence)])]

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
        found = self._aligner.align(sound, [(token.text, [token.phones]) for token in tokens])
        return found.phones, found.words

    def _predict_phones(
        self, tokens: Sequence[_Token], letters: str, rate: float, sound: Waveform
    ) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
        """Phone edges from the model's durations, corrected for its delay, for sound that cannot be aligned."""
        begins = np.concatenate([[0.0], np.cumsum(self._durations(letters, rate) * DURATION_STEP_S)])[1:]
        labels, starts, spans, at = [SILENCE], [0.0], [], 0
        for token in tokens:
            spans.append(WordSpan(token.text, len(labels), len(labels) + len(token.phones)))
            labels += token.phones
            starts += [float(begins[at + place]) - BOUNDARY_DELAY_S for place in token.places]
            at += len(token.letters) + 1
        labels.append(SILENCE)
        starts.append(min(float(begins[len(letters)]) - BOUNDARY_DELAY_S, sound.duration))
        edges = enforce_increasing(np.array([*starts, sound.duration]))
        return PhoneSequence(labels, edges), tuple(spans)

    def _durations(self, letters: str, rate: float) -> NDArray[np.float64]:
        """(L + 2,) durations in steps of `DURATION_STEP_S` of L letters and the padding at both ends."""
        disable_telemetry()
        import onnxruntime

        graph = add_graph_output(self._path.read_bytes(), DURATION_TENSOR)
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
    return " ".join(token.letters for token in tokens)


def _token(word: Word) -> _Token:
    letters, places = word_letters(word.phones, word.stress)
    return _Token(word.text, tuple(voice_phones(word.phones)), letters + word.mark, places)


def _cut_tokens(tokens: Sequence[_Token]) -> Iterator[list[_Token]]:
    """Divide tokens into parts of at most `MAX_LETTERS` letters, after a clause mark if the part has one."""
    part: list[_Token] = []
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
    graph_field, output_field, name_field = 7, 12, 1
    message = _length_delimited(name_field, tensor.encode())
    return model + _length_delimited(graph_field, _length_delimited(output_field, message))


def _length_delimited(field: int, content: bytes) -> bytes:
    return _encode_varint(field << 3 | 2) + _encode_varint(len(content)) + content


def _encode_varint(number: int) -> bytes:
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + _encode_varint(rest) if rest else bytes([low])
