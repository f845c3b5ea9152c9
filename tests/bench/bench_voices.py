"""Measure every installed voice and write the tables and the picture of docs/voices.md.

Run: ``python tests/bench/bench_voices.py [-n 20] [NAME ...] [--write]``. A phone is an error where the product's
recogniser hears another one; it is trained on American speech, and its errors grow with the rate. Pauses and silence
are measured in clips, all else in the sound of the voice.
"""

import argparse
import time
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from bench_voice import SEARCH_S, STEP_S, high_energy, landmarks, sounding
from sentences import sentences
from speech_measures import (
    RISE_ST,
    longest_gap,
    phone_errors,
    pitch_track,
    rise_at,
    silence_at_ends,
    spoken_seconds,
)

from lexicon.sequence import SILENCE
from tts2face.session.session import Session
from tts2face.sound.delivery import speak_with
from tts2face.sound.loudness import integrated_loudness
from tts2face.sound.prosody import Prosody
from tts2face.sound.voice import Voice
from tts2face.sound.voice_pool import is_installed, load_voice, speaks, voice_names

PAGE = Path(__file__).resolve().parents[2] / "docs/voices.md"
PICTURE = PAGE.with_name("pictures") / "voices-f0.png"
LANGUAGE = "en-us"
RATES = (0.5, 0.7, 0.85, 1.1, 1.25, 1.5, 2.0)
YES_NO = (
    "Are they on the early train?", "Did Anna lose her umbrella?", "Is there any room at the table?",
    "Will you bring a warm jacket?", "Has nobody told him the news?", "Can a penguin fly?",
    "Do they open on Sunday?", "Should we water the roses now?", "Was it really that easy?",
    "You have never seen snow?",
)  # fmt: skip
STATEMENTS = (
    "They are on the early train.", "Anna lost her umbrella.", "There is room at the table.", "I will bring a jacket.",
    "Nobody has told him the news.", "A penguin cannot fly.", "They open on Sunday.", "We water the roses now.",
    "It was really that easy.", "You have never seen snow.",
)  # fmt: skip
WH = (
    "When does the early train leave?", "Where did Anna lose her umbrella?", "Why is there no room at the table?",
    "Who will bring a warm jacket?", "What did nobody tell him?", "How does a penguin swim?",
    "Which shops open on Sunday?", "Whose roses are these?", "How easy was it?", "What have you never seen?",
)  # fmt: skip
MARKS = {
    "comma": ", ", "dash": " – ", "semicolon": "; ", "ellipsis": "... ", "full stop": ". ", "paragraph": ".\n\n",
}  # fmt: skip
FIRST = ("We went to the old market", "She opened the green door", "My brother bought a boat", "He read the letter")
SECOND = ("nobody was there", "it began to rain", "the dog ran away", "everyone laughed")


def say(voice: Voice, text: str, rate: float = 1.0):
    """Speech of a sentence by itself."""
    return speak_with(voice, text, Prosody(rate), language=LANGUAGE)


def basics(voice: Voice, texts: Sequence[str]) -> dict[str, str]:
    """Figures of plain sentences."""
    errors = phones = 0
    tones, levels, edges, spent, seconds = [], [], [], 0.0, 0.0
    for text in texts:
        began = time.process_time()
        speech = say(voice, text)
        spent += time.process_time() - began
        sound = speech.waveform
        seconds += sound.duration
        wrong, n = phone_errors([phone for phone in speech.phones.phones if phone != SILENCE], sound)
        errors, phones = errors + wrong, phones + n
        tones.append(pitch_track(sound)[1])
        levels.append(integrated_loudness([sound]))
        edges += list(edge_errors(speech))
    flat = np.concatenate(tones)
    low, middle, high = np.quantile(flat, (0.1, 0.5, 0.9))
    return {
        "phone error": f"{errors / phones:.1%}",
        "F0": f"{2 ** (middle / 12):.0f} Hz",
        "10 to 90 %": f"{high - low:.1f} st",
        "level": f"{np.mean(levels):.1f} LUFS",
        "edges": f"{1000 * np.median(np.abs(edges)):.0f} ms",
        "real-time factor": f"{spent / seconds:.3f}",
    }


def edge_errors(speech) -> Iterator[float]:
    """Seconds between edges of sibilants and the steepest change of high energy near them."""
    phones = sounding(speech.phones)
    slope = np.gradient(high_energy(speech.waveform))
    for at, sign in landmarks(phones):
        first = max(0, round((phones.edges[at] - SEARCH_S) / STEP_S))
        near = sign * slope[first : round((phones.edges[at] + SEARCH_S) / STEP_S)]
        yield float(phones.edges[at]) - (first + int(np.argmax(near))) * STEP_S


def rates(voice: Voice, texts: Sequence[str]) -> dict[str, str]:
    """Real rate at each rate that is asked, and the phone error there."""
    usual = [spoken_seconds(say(voice, text).waveform) for text in texts]
    found = {}
    for rate in RATES:
        real, errors, phones = [], 0, 0
        for text, seconds in zip(texts, usual, strict=True):
            speech = say(voice, text, rate)
            real.append(seconds / spoken_seconds(speech.waveform))
            wrong, n = phone_errors([phone for phone in speech.phones.phones if phone != SILENCE], speech.waveform)
            errors, phones = errors + wrong, phones + n
        found[f"{rate:g}"] = f"{np.median(real):.2f}, {errors / phones:.0%}"
    return found


def questions(voice: Voice) -> dict[str, str]:
    """Sentences of each kind whose end rises."""
    kinds = {"yes or no": YES_NO, "statements": STATEMENTS, "wh": WH}
    return {
        kind: f"{sum(rise_at(say(voice, text)) >= RISE_ST for text in texts)} of {len(texts)}"
        for kind, texts in kinds.items()
    }


def pauses(session: Session, name: str) -> dict[str, str]:
    """Median silence at each mark, and at the ends of a clip, in seconds."""
    found, ends = {}, []
    for kind, mark in MARKS.items():
        gaps = []
        for first, second in zip(FIRST, SECOND, strict=True):
            behind = second[0].upper() + second[1:] if mark[0] == "." and mark != "... " else second
            clip = session.clip(f"{first}{mark}{behind}.", voice=name, language=LANGUAGE, gestures="none")
            gaps.append(longest_gap(clip.speech.waveform))
            ends.append(silence_at_ends(clip.speech.waveform))
        found[kind] = f"{np.median(gaps):.2f}"
    begin, end = np.median(ends, axis=0)
    return {**found, "begin": f"{begin:.2f}", "end": f"{end:.2f}"}


def table(rows: dict[str, dict[str, str]]) -> str:
    """Of Markdown."""
    columns = list(next(iter(rows.values())))
    lines = [["voice", *columns], ["---"] * (len(columns) + 1)]
    lines += [[f"`{name}`", *row.values()] for name, row in rows.items()]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines)


def draw(voices: dict[str, Voice]) -> None:
    """F0 of a statement and of the question with the same words by each voice."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, axes = pyplot.subplots(len(voices), 1, figsize=(7, 1.9 * len(voices)), sharex=True, layout="constrained")
    for axis, (name, voice) in zip(np.atleast_1d(axes), voices.items(), strict=True):
        for text, colour in (("You have never seen snow.", "#3465a4"), ("You have never seen snow?", "#c4442a")):
            seconds, tones = pitch_track(say(voice, text).waveform)
            axis.plot(seconds, 2 ** (tones / 12), ".", markersize=3, color=colour, label=text)
        axis.set_yscale("log")
        axis.set_yticks([75, 100, 150, 200, 300, 450], ["75", "100", "150", "200", "300", "450"], minor=False)
        axis.minorticks_off()
        axis.set_ylabel(f"{name}\nHz")
    np.atleast_1d(axes)[0].legend(frameon=False)
    np.atleast_1d(axes)[-1].set_xlabel("s")
    figure.savefig(PICTURE, dpi=110)


def main() -> None:
    """Print the tables, or write them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*")
    parser.add_argument("-n", type=int, default=20, help="sentences")
    parser.add_argument("--write", action="store_true", help="into docs/voices.md, with the picture")
    options = parser.parse_args()
    installed = [name for name in voice_names() if is_installed(name) and speaks(name, LANGUAGE)]
    voices = {name: load_voice(name, LANGUAGE) for name in options.names or installed}
    texts, session = sentences(options.n, seed=54), Session()
    measured = {
        "basics": table({name: basics(voice, texts) for name, voice in voices.items()}),
        "rates": table({name: rates(voice, texts) for name, voice in voices.items()}),
        "questions": table({name: questions(voice) for name, voice in voices.items()}),
        "pauses": table({name: pauses(session, name) for name in voices}),
    }
    for name, rows in measured.items():
        print(f"\n{name}\n{rows}", flush=True)
    if options.write:
        page = PAGE.read_text(encoding="utf-8")
        for name, rows in measured.items():
            before, _, rest = page.partition(f"<!-- {name} -->\n")
            page = f"{before}<!-- {name} -->\n\n{rows}\n\n{rest[rest.index('<!-- end -->') :]}"
        PAGE.write_text(page, encoding="utf-8")
        draw(voices)


if __name__ == "__main__":
    main()
