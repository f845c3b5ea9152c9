"""How exactly words are found in recordings: clean, in noise, with echo, after codecs, joined, in other languages.

Run: ``python tests/bench/bench_alignment.py --shared ../shared``. Errors are those of the middles of phones (of the
edges of words for GRID), against edges set by hand (fadg0), GRID's own (automatic), and those that a voice states or
that are found in its clean sound. The last columns tell whether right texts are told from wrong ones.
"""

import argparse
import csv
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sentences import sentences

from corpus_tools.shipped.training.damage import babble, coded, speech_power, stationary_noise, with_echo
from corpus_tools.shipped.training.spoken_material import resampled
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.sound.alignment import LEAST_FIT, Aligner
from tts2face.sound.segments import RATE
from tts2face.sound.transcript import pronounce_transcript
from tts2face.sound.voice_pool import load_voice
from tts2face.sound.word_lattice import PronouncedWords
from tts2face.types import Waveform
from tts2face.video.media import read_sound

N_TEXTS, N_GRID, JOINED_S = 24, 20, 24.0
TILTS = (0.0, 0.5, 1.0)
ROOM = (0.5, 0.5)
LANGUAGES = {
    "de": "Der schöne Fluss fließt langsam über die alte Brücke, und niemand sieht ihm zu.",
    "fr-fr": "Bonjour, je voudrais un peu de vin rouge et deux morceaux de fromage.",
    "es": "El perro corre rápidamente por el parque mientras los niños juegan.",
    "it": "Questa mattina abbiamo visto una grande nave nel porto di Genova.",
    "nl": "Gisteren heb ik een mooi boek over de geschiedenis gelezen.",
    "pl": "W zeszłym tygodniu pojechaliśmy do Krakowa pociągiem.",
    "ru": "Сегодня утром мы долго гуляли по старому городу.",
    "cmn": "今天早上我们去北京看了很多朋友。",
    "ja": "きょうはとてもいいてんきですね。",
    "tr": "Bu sabah pazara gittik ve meyve aldık.",
    "pt-br": "Ontem à noite choveu muito na cidade onde eu moro.",
}


@dataclass(frozen=True)
class Case:
    """A sound, its words, and the true times of each word: middles of its phones, or its edges."""

    sound: Waveform
    words: PronouncedWords
    truth: tuple[NDArray[np.float64], ...]
    is_of_words: bool = False


def hand_edges(folder: Path) -> Iterator[Case]:
    """Sentences of a woman in an office."""
    for row in csv.DictReader((folder / "transcripts.tsv").open(), delimiter="\t"):
        rows = csv.DictReader((folder / f"{row['name']}.phones.tsv").open(), delimiter="\t")
        times = [
            (one["word"], (float(one["start"]) + float(one["end"])) / 2) for one in rows if one["phone"] != SILENCE
        ]
        middles = tuple(np.array([time for _, time in word]) for _, word in groupby(times, lambda one: one[0]))
        sound = read_sound(folder / f"{row['name']}.flac", RATE)
        yield Case(sound, pronounce_transcript(row["text"], "en-us"), middles)


def grid(folder: Path) -> Iterator[Case]:
    """Sentences of GRID's talker s1 that the classifier has not learnt."""
    for path in sorted((folder / "align").glob("*.align"))[1::39][:N_GRID]:
        cues = read_transcript(path).words
        words = pronounce_transcript(" ".join(cue.text for cue in cues), "en-us")
        edges = tuple(np.array([cue.start, cue.end]) for cue in cues)
        yield Case(read_sound(folder / "clips" / f"{path.stem}.mkv", RATE), words, edges, is_of_words=True)


def spoken(voice_name: str, texts: Sequence[str], language: str) -> Iterator[Case]:
    """Sentences of a voice."""
    voice = load_voice(voice_name, language)
    for text in texts:
        speech = voice.speak(text)
        sound = resampled(speech.waveform)
        phones = speech.phones
        said = [[one for one in phones.phones[word.first : word.last] if one != SILENCE] for word in speech.words]
        words = tuple((word.text, (tuple(one),)) for word, one in zip(speech.words, said, strict=True))
        middles = tuple(_middles(phones, word) for word in speech.words)
        yield Case(sound, words, middles)


def _middles(phones: PhoneSequence, word: WordSpan) -> NDArray[np.float64]:
    """Middles of the phones of a word."""
    inside = [at for at in range(word.first, word.last) if phones.phones[at] != SILENCE]
    return np.array([(phones.edges[at] + phones.edges[at + 1]) / 2 for at in inside])


def with_samples(case: Case, samples: NDArray[np.floating]) -> Case:
    """The case with other sound."""
    scaled = samples * min(1.0, 0.99 / np.abs(samples).max())
    return replace(case, sound=Waveform(scaled.astype(np.float32), RATE))


def noisy(cases: Sequence[Case], decibels: float, kind: str) -> list[Case]:
    """The cases in noise."""
    rng, made = np.random.default_rng(7), []
    for at, case in enumerate(cases):
        samples = case.sound.samples.astype(np.float64)
        if kind == "babble":
            noise = babble(len(samples), [one.sound.samples for one in cases if one is not case], rng)
        else:
            noise = stationary_noise(len(samples), RATE, TILTS[at % len(TILTS)], rng)
        made.append(with_samples(case, samples + noise * np.sqrt(speech_power(samples) / 10 ** (decibels / 10))))
    return made


def joined(cases: Sequence[Case]) -> list[Case]:
    """Cases joined to longer ones."""
    found: list[Case] = []
    for case in cases:
        if found and found[-1].sound.duration < JOINED_S:
            last = found.pop()
            samples = np.concatenate([last.sound.samples, case.sound.samples])
            truth = (*last.truth, *(times + last.sound.duration for times in case.truth))
            case = Case(Waveform(samples, RATE), last.words + case.words, truth, case.is_of_words)  # noqa: PLW2901
        found.append(case)
    return found


def report(name: str, cases: Sequence[Case], aligner: Aligner) -> str:
    """Row of a table."""
    apart: list[float] = []
    skipped, right, wrong, began = 0, [], [], time.process_time()
    for case in cases:
        found = aligner.align(case.sound, case.words)
        right.append(found.fit.share)
        for word, truth in zip(found.words, case.truth, strict=True):
            edges = found.phones.edges[[word.first, word.last]]
            times = edges if case.is_of_words else _middles(found.phones, word)
            if len(times) == len(truth):
                apart += (1000 * np.abs(times - truth)).tolist()
            else:  # another pronunciation than that of the reference
                skipped += 1
    seconds = (time.process_time() - began) / sum(case.sound.duration for case in cases)
    for at, case in enumerate(cases):
        wrong.append(aligner.align(case.sound, cases[at - 1].words).fit.share)
    refused = [float(np.mean(np.array(fits) < LEAST_FIT)) for fits in (right, wrong)]
    errors = np.array(apart)
    return (
        f"| {name} | {errors.mean():.0f} | {np.median(errors):.0f} | {np.mean(errors > 100):.1%} | {skipped} | "
        f"{refused[0]:.0%} / {refused[1]:.0%} | {seconds:.3f} |"
    )


def main() -> None:
    """Print the table that docs/accuracy.md keeps."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--shared", type=Path, default=Path("../shared"))
    shared = parser.parse_args().shared / "recordings"
    aligner = Aligner()
    aligner.load()
    print("| sound | mean ms | median | beyond 100 ms | words left out | refused right / wrong | CPU s a second |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    hand = list(hand_edges(shared / "fadg0_sound"))
    print(report("a woman in an office, edges by hand", hand, aligner), flush=True)
    print(report("the same joined", joined(hand), aligner), flush=True)
    print(report("GRID s1, edges of words", list(grid(shared / "grid_s1")), aligner), flush=True)
    for voice in ("heart", "joe"):
        clean = list(spoken(voice, sentences(N_TEXTS), "en-us"))
        print(report(f"voice {voice}", clean, aligner), flush=True)
        for decibels in (20, 10, 5, 0):
            print(report(f"{voice}, noise at {decibels} dB", noisy(clean, decibels, "noise"), aligner), flush=True)
        print(report(f"{voice}, babble at 10 dB", noisy(clean, 10, "babble"), aligner), flush=True)
        rng = np.random.default_rng(3)
        pure = [one.sound.samples.astype(np.float64) for one in clean]
        echoing = [with_samples(one, with_echo(x, RATE, ROOM, rng)) for one, x in zip(clean, pure, strict=True)]
        print(report(f"{voice}, echo", echoing, aligner), flush=True)
        mp3 = [
            with_samples(one, coded(x, RATE, "libmp3lame", "mp3", 64_000)) for one, x in zip(clean, pure, strict=True)
        ]
        print(report(f"{voice}, MP3 at 64 kb/s", mp3, aligner), flush=True)
        print(report(f"{voice}, joined", joined(clean), aligner), flush=True)
    foreign = [case for language, text in LANGUAGES.items() for case in spoken("espeak", [text], language)]
    for case, language in zip(foreign, LANGUAGES, strict=True):
        print(report(f"espeak-ng, {language}", [case], aligner), flush=True)
    print(report("espeak-ng, all languages, noise at 10 dB", noisy(foreign, 10, "noise"), aligner), flush=True)


if __name__ == "__main__":
    main()
