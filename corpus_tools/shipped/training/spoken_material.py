"""Speech from which what hears any voice is learnt: two voices of the project, and recorded sentences."""

import re
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.prompts.prompts import shipped_sentences
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence
from tts2face.interchange.transcripts.reader import read_transcript
from tts2face.sound.alignment import Aligner
from tts2face.sound.pauses import Span
from tts2face.sound.segments import RATE
from tts2face.sound.transcript import pronounce_transcript
from tts2face.sound.voice import pronounce_content
from tts2face.sound.voice_pool import load_voice
from tts2face.sound.word_lattice import PronouncedWords
from tts2face.types import Waveform
from tts2face.video.media import read_sound

STATING_VOICE, OTHER_VOICE = "heart", "joe"  # the first says where its phones are
N_TEXTS, N_OTHER = 420, 260  # of both voices
PLAIN, N_CAPTION_WORDS = re.compile(r"[A-Za-z ,.'?!;-]+"), 4  # of captions that are spoken
SPEECH_RATES = (0.8, 0.9, 1.0, 1.0, 1.15, 1.3)
RECORDED_STEP = 3  # every third recorded sentence


@dataclass(frozen=True, slots=True, eq=False)
class KnownSpeech:
    """Speech whose phones are known."""

    sound: Waveform
    phones: PhoneSequence


@dataclass(frozen=True, slots=True, eq=False)
class WordedSpeech:
    """Speech whose words are known, and their times or not."""

    sound: Waveform
    words: PronouncedWords
    times: Sequence[Span] | None = None

    def align(self, aligner: Aligner) -> PhoneSequence | None:
        """Its phones; None if it is spoken too quickly for its words."""
        with suppress(DataError):
            return aligner.align(self.sound, self.words, self.times).phones
        return None


def spoken_material(recordings: Path, rng: np.random.Generator) -> tuple[list[KnownSpeech], list[WordedSpeech]]:
    """Speech of the voice `STATING_VOICE`; that of another, and of recorded sentences.

    Parameters
    ----------
    recordings
        Folder with GRID's talker s1 (``grid_s1``), and with captions of free English (``address_tracks``), which the
        voices speak.
    """
    texts = [*caption_texts(recordings / "address_tracks"), *shipped_sentences()]
    rng.shuffle(texts)
    voice = load_voice(STATING_VOICE, "en-us")
    spoken = [voice.speak(text, rate=float(rng.choice(SPEECH_RATES))) for text in texts[:N_TEXTS]]
    known = [KnownSpeech(resampled(utterance.waveform), utterance.phones) for utterance in spoken]
    return known, [*_spoken_by_another(texts[N_TEXTS : N_TEXTS + N_OTHER], rng), *_recorded(recordings / "grid_s1")]


def caption_texts(folder: Path) -> list[str]:
    """Texts of captions (``*.cues.tsv``) that can be spoken alone."""
    pages = (path.read_text(encoding="utf-8") for path in sorted(folder.glob("*.cues.tsv")))
    texts = [line.split("\t")[2] for page in pages for line in page.splitlines()]
    return [text for text in dict.fromkeys(texts) if PLAIN.fullmatch(text) and len(text.split()) >= N_CAPTION_WORDS]


def resampled(sound: Waveform) -> Waveform:
    """The sound at `RATE`."""
    import soxr

    return Waveform(np.clip(soxr.resample(sound.samples, sound.rate, RATE), -1.0, 1.0), RATE)


def _spoken_by_another(texts: Sequence[str], rng: np.random.Generator) -> Iterator[WordedSpeech]:
    """Texts in the voice `OTHER_VOICE`."""
    voice = load_voice(OTHER_VOICE, "en-us")
    for text in texts:
        sound = resampled(voice.sound(text, rate=float(rng.choice(SPEECH_RATES))))
        words = [(word.text, [tuple(word.phones)]) for word in pronounce_content(text, "en-us", {})]
        yield WordedSpeech(sound, words)


def _recorded(folder: Path) -> Iterator[WordedSpeech]:
    """Recorded sentences with known times of their words."""
    for path in sorted((folder / "align").glob("*.align"))[::RECORDED_STEP]:
        cues = read_transcript(path).words
        words = pronounce_transcript(" ".join(cue.text for cue in cues), "en-us")
        if len(words) == len(cues):
            sound = read_sound(folder / "clips" / f"{path.stem}.mkv", RATE)
            yield WordedSpeech(sound, words, [(cue.start, cue.end) for cue in cues])
