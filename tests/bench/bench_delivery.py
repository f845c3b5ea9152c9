"""How a voice does what it is asked: rate, pitch, range, formants, questions, emphasis and pauses, in its sound.

Run: ``python tests/bench/bench_delivery.py --voice heart``. F0 is Praat's, phone errors are those of the product's
recogniser (similar vowels count as alike; the same sound heard twice differs by half a percent). Nobody listens.
"""

import argparse
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace

import numpy as np
from sentences import sentences
from speech_measures import RISE_ST, phone_errors, pitch_track, rise_at, spoken_seconds

from lexicon.pauses import PAUSES_S
from lexicon.tones import Tone
from tts2face.sound.delivery import speak_with
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.spacing import quiet_span, sound_levels
from tts2face.sound.voice import SpokenWord, Voice, pronounce_content
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech

LANGUAGE = "en-us"
PROSODIES = (
    Prosody(pitch=-4.0), Prosody(pitch=4.0), Prosody(range=0.6), Prosody(range=1.5), Prosody(formants=0.86),
    Prosody(formants=1.16), Prosody(pitch=-9.1, formants=0.86), Prosody(pitch=2.9, formants=1.16),
    Prosody(0.92, -2.0, formants=0.97),
)  # fmt: skip
QUESTIONS = {
    "yes or no": (
        "Have they arrived?", "Does the shop open early?", "Your sister paints?", "Is the soup still warm?",
        "Did you lock the door?", "Can she drive a van?", "Would you tell him about it?", "Was it a good film?",
        "May I borrow a pencil?", "Has the rain stopped?", "Are these seats free?", "You met them?",
        "Should we wait here?", "Do your parents know?", "Will there be any cake?", "Won't you sit down?",
    ),
    "statements": (
        "They have arrived.", "The shop opens early.", "Your sister paints.", "The soup is still warm.",
        "You locked the door.", "She can drive a van.", "It was a good film.", "The rain has stopped.",
    ),
    "question words": (
        "Where do they live?", "Why was it closed?", "Who told you that?", "When does the film start?",
        "What is in the box?", "How do you spell it?", "Which of them is yours?", "At what time is dinner?",
    ),
    "tags": (
        "You like music, don't you?", "It was late, wasn't it?", "They never called, did they?",
        "She works here, doesn't she?", "We should go, shouldn't we?", "He can't swim, can he?",
    ),
}  # fmt: skip
ALTERNATIVES = (
    "Would you like a lamp or a candle?", "Is it Monday or Tuesday?", "Shall we walk or take the bus?",
    "Did Paul or Ann win?", "Was it good or bad?", "Is the room too warm or too cold?",
)  # fmt: skip
PAUSED = (
    "He came home{} she had gone to the station", "The lamp is broken{} we need another one",
    "We waited for an hour{} nobody opened", "It was raining{} the match went on", "I know the answer{} it is no help",
    "She looked at the map{} then turned around",
)  # fmt: skip
EMPHASISED = 3  # index of the word


class Bench:
    """A voice and its measures."""

    def __init__(self, voice: Voice, texts: Sequence[str]) -> None:
        self.voice, self.texts = voice, texts
        self.usual = {text: self.speak(text) for text in texts}

    def speak(self, text: str, prosody: Prosody = PLAIN_PROSODY, tones: Sequence[Tone] = ()) -> Speech:
        """Speech of a text, perhaps with a tone for each of its written words."""
        if not tones:
            return speak_with(self.voice, text, prosody, language=LANGUAGE)
        words = [SpokenWord(word, (), tone=tone) for word, tone in zip(text.split(), tones, strict=True)]
        return speak_with(self.voice, words, prosody, language=LANGUAGE)

    def error(self, spoken: Iterable[tuple[str, Speech]]) -> float:
        """Share of phones that are heard otherwise, in percent."""
        wrong = n = 0
        for text, speech in spoken:
            said = [phone for word in pronounce_content(text, LANGUAGE, {}) for phone in word.phones]
            found = phone_errors(said, speech.waveform)
            wrong, n = wrong + found[0], n + found[1]
        return 100.0 * wrong / n

    def rates(self, rates: Sequence[float]) -> None:
        """Print real rates and phone errors."""
        print("| rate asked | real | least and most of it | phone error |\n| --- | --- | --- | --- |")
        lengths = np.array([spoken_seconds(self.usual[text].waveform) for text in self.texts])
        for rate in rates:
            spoken = {text: self.speak(text, Prosody(rate)) for text in self.texts}
            now = np.array([spoken_seconds(speech.waveform) for speech in spoken.values()])
            apart = lengths / now / rate
            real, error = lengths.sum() / now.sum(), self.error(spoken.items())
            print(f"| {rate:g} | {real:.3f} | {apart.min():.3f}, {apart.max():.3f} | {error:.1f} % |", flush=True)

    def prosodies(self) -> None:
        """Print what becomes of pitch, range and phones."""
        print("\n| asked: st, range, formants, rate | F0, st | range | phone error |\n| --- | --- | --- | --- |")
        for prosody in (PLAIN_PROSODY, *PROSODIES):
            spoken = {text: self.speak(text, prosody) for text in self.texts}
            pitches = [(pitch_of(self.usual[text]), pitch_of(speech)) for text, speech in spoken.items()]
            shift = np.median([now[0] - before[0] for before, now in pitches])
            wide = np.median([now[1] / before[1] for before, now in pitches])
            asked = f"{prosody.pitch:+g}, {prosody.range:g}, {prosody.formants:g}, {prosody.rate:g}"
            print(f"| {asked} | {shift:+.2f} | {wide:.2f} | {self.error(spoken.items()):.1f} % |", flush=True)

    def questions(self) -> None:
        """Print how F0 ends."""
        print("\n| sentences | rise of 3 st or more | median, st | phone error |\n| --- | --- | --- | --- |")
        for name, texts in QUESTIONS.items():
            spoken = {text: self.speak(text) for text in texts}
            rises = np.array([rise_at(speech, -1) for speech in spoken.values()])
            share = f"{(rises >= RISE_ST).sum()} of {len(texts)}"
            print(f"| {name} | {share} | {np.nanmedian(rises):+.1f} | {self.error(spoken.items()):.1f} % |", flush=True)
        either = [self.speak(text) for text in ALTERNATIVES]
        places = [[word.text for word in speech.words].index("or") - 1 for speech in either]
        rises = np.array([rise_at(speech, place) for speech, place in zip(either, places, strict=True)])
        falls = np.array([rise_at(speech, -1) for speech in either])
        print(
            f"| alternatives: the first | {(rises >= RISE_ST).sum()} of {len(either)} | {np.nanmedian(rises):+.1f} | |"
        )
        print(f"| the last | {(falls >= RISE_ST).sum()} of {len(either)} | {np.nanmedian(falls):+.1f} | |")

    def emphasis(self) -> None:
        """Print what becomes of an emphasised word; its level is the session's."""
        print("\n| emphasis | F0 peak, st | length | phone error of the sentence |\n| --- | --- | --- | --- |")
        for name, much in (("strong", 1.0), ("moderate", 0.6), ("reduced", -1.0)):
            spoken: dict[str, Speech] = {}
            peaks, lengths = [], []
            for text in self.texts:
                even = [Tone()] * len(text.split())
                tones = [replace(tone, emphasis=much * (at == EMPHASISED)) for at, tone in enumerate(even)]
                spoken[text] = self.speak(text, tones=tones)
                before, now = (word_measures(speech, EMPHASISED) for speech in (self.usual[text], spoken[text]))
                peaks.append(now[0] - before[0])
                lengths.append(now[1] / before[1])
            error = self.error(spoken.items())
            print(f"| {name} | {np.nanmedian(peaks):+.1f} | {np.median(lengths):.2f} | {error:.1f} % |", flush=True)

    def pauses(self) -> None:
        """Print how silent marks are."""
        print("\n| mark | table, s | median | least, most |\n| --- | --- | --- | --- |")
        for mark in (",", "—", ";", ":", "…"):
            found = []
            for text in PAUSED:
                before = text.split("{")[0]
                speech = self.speak(text.format(f" {mark}" if mark == "—" else mark) + ".")
                at = len(before.split()) - 1
                start, end = speech.phones.edges[[speech.words[at].last, speech.words[at + 1].first]].tolist()
                found.append(float(np.diff(quiet_span(sound_levels(speech.waveform), (start, end)))[0]))
            print(f"| {mark} | {PAUSES_S[mark]} | {np.median(found):.3f} | {min(found):.3f}, {max(found):.3f} |")


def pitch_of(speech: Speech) -> tuple[float, float]:
    """Median and range (10 to 90 %) of F0 in semitones."""
    _, tones = pitch_track(speech.waveform)
    return float(np.median(tones)), float(np.ptp(np.quantile(tones, [0.1, 0.9])))


def word_measures(speech: Speech, word: int) -> tuple[float, float]:
    """Peak of F0 in semitones (95th percentile) and seconds of a word."""
    times, tones = pitch_track(speech.waveform)
    start, end = speech.phones.edges[[speech.words[word].first, speech.words[word].last]]
    inside = tones[(times > start) & (times < end)]
    return (float(np.quantile(inside, 0.95)) if len(inside) else float("nan")), float(end - start)


def main() -> None:
    """Print the tables that docs/performance.md and decisions 251 and 252 sum up."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--voice", default="heart")
    parser.add_argument("-n", type=int, default=20, help="sentences")
    parser.add_argument("--only", choices=["rates", "prosodies", "questions", "emphasis", "pauses"])
    given = parser.parse_args()
    bench = Bench(load_voice(given.voice, LANGUAGE), sentences(given.n, 5))
    tables: dict[str, Callable[[], None]] = {
        "rates": lambda: bench.rates((0.5, 0.7, 0.85, 1.1, 1.25, 1.34, 1.5, 2.0)),
        "prosodies": bench.prosodies,
        "questions": bench.questions,
        "emphasis": bench.emphasis,
        "pauses": bench.pauses,
    }
    for name, table in tables.items():
        if given.only in (None, name):
            table()


if __name__ == "__main__":
    main()
