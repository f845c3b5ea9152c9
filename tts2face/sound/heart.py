"""The neural English voice ``heart`` of hibari-tts: durations, F0 and spectra by its network, changed as is asked.

Phone edges are found in the sound as the network makes it, near the durations that it states.
"""

from bisect import bisect_left
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lexicon.british import LANGUAGE as BRITISH
from lexicon.errors import DataError, import_of_extra
from lexicon.pauses import PAUSES_S
from lexicon.pronounce import has_dictionary
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from lexicon.values.json_text import read_json
from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.telemetry import disable_telemetry
from tts2face.sound.heart_letters import (
    BRITISH_IN_AMERICAN,
    BRITISH_LETTERS,
    LETTERS_OF_PHONE,
    MARKS,
    LetteredPart,
    LetteredWord,
    lettered_parts,
)
from tts2face.sound.heart_network import DURATION_STEP_S, FRAME_S, HeartNetwork
from tts2face.sound.heart_spectrum import creak_to_harmonics, is_heard, match_energy, samples_of, spectrum
from tts2face.sound.hibari_voices import USUAL_VOICE, hibari_voice, read_model
from tts2face.sound.onnx_part import onnx_errors
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.psola import even_stretch, resynthesize
from tts2face.sound.spacing import Cut, pause_cuts, respaced, respaced_times, sound_levels
from tts2face.sound.transforms import import_hibari
from tts2face.sound.tune import EMPHASIS_LENGTH, SEMITONES, PlacedWord, Tune, shape_pitch
from tts2face.sound.voice import NativeRun, PronunciationMap, SpeechInput, pronounce_content
from tts2face.types import Speech, Waveform, concatenate_speech

if TYPE_CHECKING:
    from tts2face.models.phone_classifier import PhoneClassifier
    from tts2face.sound.segments import StatedPhone

SAMPLE_RATE = 24_000
BOUNDARY_DELAY_S = 0.061  # delay of the model's own boundaries against its sound (56 ms when fast, 71 when slow)
STATED_REACH_S = 0.15  # around a stated pause, in which the quiet part of the sound lies
# rates of the network; beyond them its sound is shortened or lengthened, and edges move with it (decision 251)
SLOWEST, FASTEST = 0.85, 1.0


@dataclass(frozen=True, slots=True, eq=False)
class SpokenPart:
    """A part of a sentence.

    Parameters
    ----------
    sound
        As it is heard.
    plain
        As the network makes it, of the same words at times that differ by a factor; in it edges are found.
    """

    sound: Waveform
    plain: Waveform
    words: tuple[LetteredWord, ...]
    stated: "Sequence[StatedPhone]"


class NeuralVoice:
    """A voice of hibari-tts: English, 24 kHz. Not thread-safe.

    Parameters
    ----------
    name
        Of its list.
    run
        Runs the model; None: within the call.
    language
        Of the text. A British voice reads it as British; an American one reads British words in its own letters, as
        far as these go.
    """

    def __init__(
        self, own_words: PronunciationMap, run: NativeRun | None = None, *, name: str = USUAL_VOICE, language: str = ""
    ) -> None:
        self._own_words = own_words
        disable_telemetry()
        with import_of_extra("the voice heart needs hibari-tts; run: pip install hibari-tts"):
            import_hibari()
            from hibari.tts import ASSETS
        self._numbers = read_json(Path(ASSETS, "vocab.json"))
        voice = hibari_voice(name)
        self._language = BRITISH if language == BRITISH and has_dictionary(BRITISH) else voice.language
        americanised = BRITISH_IN_AMERICAN if self._language == BRITISH else LETTERS_OF_PHONE
        self._alphabet = BRITISH_LETTERS if voice.is_british else americanised
        model = read_model(name)
        try:
            self._network = HeartNetwork(model, run)
        except onnx_errors() as other:
            raise DataError(
                f"the network of the voice {name} has another form than this version reads; update tts2face, or run: "
                f"tts2face voices remove {name}"
            ) from other
        pronounce_content("Hello.", self._language, {})  # reads the dictionary while other models are loaded

    @cached_property
    def _classifier(self) -> "PhoneClassifier":
        from tts2face.models.phone_classifier import load_phone_classifier  # sound alone has no edges

        return load_phone_classifier("heart")

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz."""
        return SAMPLE_RATE

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`."""
        return self.deliver(content, Prosody(rate), seed)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones, which takes most of the time."""
        return self.deliver_sound(content, Prosody(rate), seed)

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        """Synthesise a sentence with a prosody; see `tts2face.sound.delivery.DeliveringVoice`."""
        return concatenate_speech([self._with_edges(part) for part in self.parts(content, prosody, seed)])

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        """Sound of `deliver`."""
        return Waveform(
            np.concatenate([part.sound.samples for part in self.parts(content, prosody, seed)]), SAMPLE_RATE
        )

    def parts(self, content: SpeechInput, prosody: Prosody = PLAIN_PROSODY, seed: int = 0) -> Iterator[SpokenPart]:
        """Parts that the model synthesises in one call."""
        for part in lettered_parts(pronounce_content(content, self._language, self._own_words), self._alphabet):
            yield self._spoken(part, prosody, seed)

    def _spoken(self, part: LetteredPart, prosody: Prosody, seed: int) -> SpokenPart:
        numbers = [0, *(self._numbers[letter] for letter in part.letters), 0]
        hidden, durations = self._network.read(numbers)
        rate = min(max(prosody.rate, SLOWEST), FASTEST)
        steps = letter_steps(part, durations, rate)
        frames = self._network.frames(numbers, hidden, steps)
        plain = spectrum(frames, frames.f0, seed)
        unchanged = _limited(samples_of(plain))
        # a sound that gets other formants gets its pitch with them, which is nearer (decision 252)
        in_sound = prosody.pitch if prosody.formants != 1.0 else 0.0
        tune = Tune(replace(prosody, pitch=prosody.pitch - in_sound), _placed(part, steps), part.movements)
        sound = unchanged
        if not tune.is_plain:
            shaped = shape_pitch(frames.f0, frame_times(len(frames.f0)), tune, is_heard(plain))
            frames = creak_to_harmonics(frames, shaped.f0, shaped.moved) if shaped.moved else frames
            changed = spectrum(frames, shaped.f0, seed)
            sound = _limited(samples_of(match_energy(changed, plain, shaped.moved)))
        stated = stated_phones(part.words, steps)
        cuts = _pause_cuts(part, steps, unchanged, rate)
        if cuts:
            unchanged, sound = respaced(unchanged, cuts), respaced(sound, cuts)
            starts = respaced_times(np.array([phone.start for phone in stated]), cuts)
            stated = [replace(phone, start=float(start)) for phone, start in zip(stated, starts, strict=True)]
        stretch = even_stretch(prosody.rate / rate)
        shift = 2.0 ** (in_sound / SEMITONES)
        shifted = (lambda _, hertz: hertz * shift) if in_sound else None
        sound = resynthesize(sound, stretch, shifted, prosody.formants)
        return SpokenPart(sound, unchanged, part.words, stated)

    def _with_edges(self, part: SpokenPart) -> Speech:
        from tts2face.sound.segments import find_edges

        stated, sound = part.stated, part.sound
        edges = find_edges(part.plain, stated, self._classifier) * (sound.duration / part.plain.duration)
        spoken = [at for at, phone in enumerate(stated) if not phone.may_be_skipped or edges[at + 1] > edges[at]]
        spans, first = [], 1  # stated phones of a word
        for word in part.words:
            start = bisect_left(spoken, first)
            spans.append(WordSpan(word.text, start, start + len(word.phones)))
            first += len(word.phones) + 1
        labels = [stated[at].label for at in spoken]
        return Speech(sound, PhoneSequence(labels, [*edges[spoken], sound.duration]), tuple(spans))


def _limited(samples: NDArray[np.float32]) -> Waveform:
    """Sound whose peaks are limited if they exceed full scale."""
    if np.abs(samples).max(initial=0.0) > 1.0:
        from tts2face.sound.level import limit_peaks

        samples = np.clip(limit_peaks(samples, SAMPLE_RATE), -1.0, 1.0)
    return Waveform(samples, SAMPLE_RATE)


def frame_times(n_frames: int) -> FloatArray:
    """Seconds (T,) of the middles of frames."""
    return np.asarray((np.arange(n_frames) + 0.5) * FRAME_S, np.float64)


def letter_steps(part: LetteredPart, durations: FloatArray, rate: float) -> NDArray[np.int64]:
    """Whole steps (L + 2,) of the letters of a part and of the padding at both ends.

    At rate 1 each duration is rounded, as in the training of the network. Otherwise the remainder is carried on to the
    next letter, so that their sum is that at rate 1 over the rate.
    """
    steps = np.maximum(np.rint(durations), 1).astype(np.int64)
    factors = np.ones(len(steps))
    for word, start in zip(part.words, part.starts, strict=True):
        factors[start + 1 : start + 1 + word.n_spoken] = EMPHASIS_LENGTH**word.tone.emphasis
    if rate == 1.0 and (factors == 1.0).all():
        return steps
    # pauses get their length later
    spoken = np.flatnonzero([letter not in MARKS for letter in part.letters]) + 1
    total = max(round(float((steps[spoken] * factors[spoken]).sum()) / rate), len(spoken))
    steps[spoken] = carried_steps((durations if rate != 1.0 else steps)[spoken] * factors[spoken], total)
    return steps


def carried_steps(durations: FloatArray, total: int) -> NDArray[np.int64]:
    """Whole steps (L,), at least 1 each, in proportion to durations (L,), whose sum is `total`."""
    low, high = 0.05, 20.0
    ends = np.zeros(len(durations))
    for _ in range(40):
        scale = (low * high) ** 0.5
        ends = np.floor(np.cumsum(np.maximum(durations * scale, 1.0)) + 0.5)
        if ends[-1] == total:
            break
        low, high = (low, scale) if ends[-1] > total else (scale, high)
    return np.diff(ends, prepend=0.0).astype(np.int64)


def _pause_cuts(part: LetteredPart, steps: NDArray[np.int64], sound: Waveform, rate: float) -> list[Cut]:
    """Changes that make the pauses at marks within a part as long as the table has them."""
    marks = [(word.letters[word.n_spoken :], start) for word, start in zip(part.words[:-1], part.starts, strict=False)]
    if not any(mark for mark, _ in marks):
        return []
    levels, ends = sound_levels(sound), _letter_ends(steps)
    silences = [
        (PAUSES_S[mark] / rate, ends[start + word.n_spoken], ends[start + len(word.letters) + 1])
        for word, (mark, start) in zip(part.words, marks, strict=False)
        if mark
    ]
    return [
        cut
        for wanted, start, end in silences
        for cut in pause_cuts(levels, (float(start), float(end)), wanted, STATED_REACH_S)
    ]


def _letter_ends(steps: NDArray[np.int64]) -> FloatArray:
    """Ends (L + 2,) of the letters in the sound, in seconds."""
    return np.asarray(np.cumsum(steps) * DURATION_STEP_S - BOUNDARY_DELAY_S, np.float64)


def _placed(part: LetteredPart, steps: NDArray[np.int64]) -> tuple[PlacedWord, ...]:
    """Words at their times in the sound."""
    ends = _letter_ends(steps)
    found = []
    for word, start in zip(part.words, part.starts, strict=True):
        vowel = start + word.stressed_vowel
        times = ends[[start, start + word.n_spoken, vowel, vowel + 1]]
        first, last, vowel_start, vowel_end = np.maximum(times, 0.0).tolist()
        found.append(PlacedWord(first, last, (vowel_start, vowel_end), word.tone))
    return tuple(found)


def stated_phones(words: Sequence[LetteredWord], steps: NDArray[np.integer]) -> "list[StatedPhone]":
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
    for word in words:
        if at:
            found.append(StatedPhone(SILENCE, starts[at - 1], may_be_skipped=True, is_marked=is_marked))
        ends = [*word.places[1:], word.n_spoken]
        found += [
            StatedPhone(phone, starts[at + place], starts[at + end] - starts[at + place])
            for phone, place, end in zip(word.phones, word.places, ends, strict=True)
        ]
        at, is_marked = at + len(word.letters) + 1, word.letters[-1] in MARKS
    return [*found, StatedPhone(SILENCE, starts[at - 1])]
