"""The voice that fits a person: of the sex, among those that are installed, and in another pitch where there is none.

One voice in another pitch, range and formants is no other person: `Fitting.sentence` says what was done.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from lexicon.languages import language_code
from lexicon.pronounce import has_dictionary
from tts2face.models.person import FEMALE, MALE, Person
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.shipped_voices import SHIPPED_VOICES
from tts2face.sound.voice import PronunciationMap, Voice, VoiceInfo
from tts2face.sound.voice_pool import VoicePool, default_voice, is_installed, speaks

AGES = (10.0, 18.0, 50.0, 75.0)  # years of the columns below; between them values change evenly
# F0, Hz: men 132, women 223, children 264 (Peterson and Barney 1952, means of table II). In old age it falls in women
# and rises in men (Stathopoulos, Huber and Sussman 2011), here by 2 and by 1.5 semitones.
F0_HZ = {FEMALE: (264.0, 223.0, 223.0, 199.0), MALE: (264.0, 132.0, 132.0, 144.0)}
# Formants over those of men: geometric means of F1 to F3 of ten vowels (Peterson and Barney 1952: women 1.16, children
# 1.35); they fall by some 3 % in old age (Linville and Rens 2001).
FORMANTS = {FEMALE: (1.35, 1.16, 1.16, 1.13), MALE: (1.35, 1.0, 1.0, 0.97)}
VOICE_BREAKS = 13.0  # years; a boy before it is nearer to a woman than to a man
RATES = (1.0, 1.0, 1.0, 0.92)  # old people speak some 10 % more slowly, others 20 (Smith, Wasowicz and Preston 1987)
FORMANT_SYNTHESIS = "espeak-ng"  # engine of the voices that are chosen where no other one speaks a language


@dataclass(frozen=True, slots=True)
class Fitting:
    """A voice with what is changed of it, and a sentence about that, which is empty for the voice of a language."""

    name: str
    prosody: Prosody = PLAIN_PROSODY
    sentence: str = ""

    @property
    def described(self) -> str:
        """The voice, and what is changed of it."""
        return self.name if self.prosody == PLAIN_PROSODY else f"{self.name}, {_described(self.prosody)}"


def fitted_voices(
    pool: VoicePool, person: Person | None, dictionary: PronunciationMap, *, keeps_utterances: bool = False
) -> Callable[[str | None, str], Voice]:
    """Function that returns the voice of a name and a language; without a name, the one that fits a person.

    Parameters
    ----------
    dictionary, keeps_utterances
        As for `VoicePool.voice`.
    """

    def load(name: str | None, language: str) -> Voice:
        fitting = fitting_voice(person, language_code(language)) if name is None else Fitting(name)
        return pool.voice(
            fitting.name, language, dictionary, prosody=fitting.prosody, keeps_utterances=keeps_utterances
        )

    return load


@cache
def fitting_voice(person: Person | None, language: str) -> Fitting:
    """Voice in which a person speaks a language where none is chosen.

    Parameters
    ----------
    person
        Whom the face shows; None where that is not known, for the voice of the language.
    language
        Code of `lexicon.languages`.
    """
    usual = default_voice(language)
    foreign = _foreign_accent(usual, language, person)
    if person is None:
        return Fitting(usual, sentence=foreign)
    voices = _usable(language, usual)
    sex = FEMALE if person.age < VOICE_BREAKS else person.sex
    name = min(voices, key=lambda name: (voices[name].sex != sex, voices[name].accent not in ("", language)))
    prosody = _difference(Person(voices[name].sex), person)
    if name == usual and prosody == PLAIN_PROSODY:
        return Fitting(name, sentence=foreign)
    fitting = Fitting(name, prosody)
    sentence = f"the face shows {person.noun} and speaks as {fitting.described}; --voice sets another"
    return replace(fitting, sentence=f"{sentence}; {foreign}" if foreign else sentence)


def _foreign_accent(name: str, language: str, person: Person | None) -> str:
    """Sentence about a voice whose accent is not that of the language; empty where it is."""
    if SHIPPED_VOICES[name].accent in {"", language} or not has_dictionary(language):
        return ""
    others = [other for other, info in SHIPPED_VOICES.items() if info.accent == language]
    if person is not None:
        others.sort(key=lambda other: SHIPPED_VOICES[other].sex != person.sex)
    hint = f"; `tts2face voices add {others[0]}` adds one that was" if others else ""
    return f"{name} was trained in {SHIPPED_VOICES[name].accent} and speaks the phones of {language}{hint}"


def _usable(language: str, usual: str) -> dict[str, VoiceInfo]:
    """Installed voices of a language, the preferred ones first; formant synthesis is for what no other voice speaks.

    Voices of other packages are chosen by name alone: to ask for their sex loads them.
    """
    spoken = {name: info for name, info in SHIPPED_VOICES.items() if speaks(name, language) and is_installed(name)} or {
        usual: SHIPPED_VOICES[usual]
    }
    is_synthetic = SHIPPED_VOICES[usual].engine == FORMANT_SYNTHESIS
    usual_accent = SHIPPED_VOICES[usual].accent
    natural = {
        name: info
        for name, info in spoken.items()
        # a voice of another accent speaks only where the usual voice has that accent, too
        if info.engine != FORMANT_SYNTHESIS
        and (info.accent in ("", language) or (not is_synthetic and usual_accent == language) or name == usual)
    }
    return natural or spoken


def _difference(voice: Person, person: Person) -> Prosody:
    """Prosody that changes the voice of one person into that of another, by the differences of people."""
    pitches, formants = (
        [float(np.interp(who.age, AGES, values[who.sex])) for who in (voice, person)] for values in (F0_HZ, FORMANTS)
    )
    rate = float(np.interp(person.age, AGES, RATES))
    pitch = round(12 * math.log2(pitches[1] / pitches[0]), 1)
    return Prosody(rate=round(rate, 3), pitch=pitch, formants=round(formants[1] / formants[0], 3))


def _described(prosody: Prosody) -> str:
    words = ["lowered" if prosody.pitch < 0 else "raised"] if prosody.pitch else []
    steps = [f"by {abs(prosody.pitch):g} semitones"] if prosody.pitch else []
    formants = [f"with formants times {prosody.formants:g}"] if prosody.formants != 1.0 else []
    rate = [f"slower ({prosody.rate:g})"] if prosody.rate != 1.0 else []
    return " ".join([*words, *steps, *formants]) + "".join(f" and {part}" for part in rate)
