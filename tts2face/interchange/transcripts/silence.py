"""Labels of silence and noise, which are no words, in every format and at every door.

A label is no word if it stands in ``silence_labels.tsv``, wholly in brackets or between marks of fillers, numbers a
speaker (``SPEAKER_00``), or has neither letter nor digit. The table holds no English word: those stand in brackets
where they name a noise.
"""

import functools
import re
from dataclasses import dataclass
from importlib import resources

from lexicon.dictionary import word_set

# <eps>, {SL}, [noise], (laughs); several in a row; ++UM++, +noise+ (CMU Sphinx); *cough*; _noise_; &=laughs (CHAT)
_MARKED = re.compile(
    r"(?:<[^<>]*>|\{[^{}]*\}|\[[^\[\]]*\]|\(\([^()]*\)\)|\([^()]*\)|\+{1,2}\w+\+{1,2}|\*\w+\*|_\w+_|&=\S+|\s)+"
)
# <LAUGH-yeah> (Buckeye), [laughter-yeah] (Switchboard): a word, and how it is said
_SAID_LAUGHING = re.compile(r"[<\[](?:laughter|laugh|cry|yawn|ext|hes)-([^\W\d][\w'’_-]*)[>\]]", re.IGNORECASE)
# within an utterance; a space behind < is a comparison; between single ( ) people also write what is said
_INSERTED = re.compile(r"<[^<>\s][^<>]*>|\{[^{}]*\}|\[[^\[\]]*\]|\(\([^()]*\)\)|&=\S+")
# THE(2), A(2): further pronunciations (CMU Sphinx); f(2) is said
_VARIANT = re.compile(r"(?<![^\s(])([^\W\d_]{2,}(?:['’-][^\W\d_]+)*|[^\W\d_]['’][^\W\d_]+|[AaI])\(\d{1,2}\)(?![^\s)])")
_COMPOUND = re.compile(r"(?<=[^\W\d_])_(?=[^\W\d_])")  # GOING_TO: words that a recogniser takes for one
# labels of who speaks, in place of what is said (programs that divide speakers)
_SPEAKER = re.compile(r"(?:s|(?:spk|spkr|speaker|sprecher|locuteur|hablante)[ _-]?)\d{1,3}:?", re.IGNORECASE)
# labels that stand between the words of an utterance and are no words of a language
_BETWEEN_WORDS = word_set("spn nsn sp ssil lsil brth vocnoise xxx yyy # + h# !sil !enter !exit sent-start sent-end")


@dataclass(frozen=True, slots=True)
class SpokenLabel:
    """Words of a label, empty if it has none, and its pieces that nobody says."""

    spoken: str
    left_out: tuple[str, ...] = ()


@functools.cache
def silence_labels() -> frozenset[str]:
    """Labels of ``silence_labels.tsv``, in lower case."""
    table = resources.files(__package__).joinpath("silence_labels.tsv").read_text(encoding="utf-8")
    return frozenset(line.split("\t")[0].casefold() for line in table.splitlines()[1:])


def is_silence(label: str) -> bool:
    """Whether a label is silence, noise or a filler of a program, and no word."""
    plain = " ".join(label.split())
    if _SAID_LAUGHING.fullmatch(plain):
        return False
    return (
        plain.casefold() in silence_labels()
        or _MARKED.fullmatch(plain) is not None
        or _SPEAKER.fullmatch(plain) is not None
        or not any(letter.isalnum() for letter in plain)
    )


def spoken_label(label: str) -> SpokenLabel:
    """Words of a label, and its silences and noises."""
    plain = " ".join(label.split())
    if is_silence(plain):
        return SpokenLabel("", (plain,) if plain else ())
    said = _SAID_LAUGHING.sub(r"\1", plain)
    left_out = _INSERTED.findall(said)
    words: list[str] = []
    for word in _INSERTED.sub(" ", said).split():
        is_between = len(word) > 1 and word.casefold() in _BETWEEN_WORDS
        (left_out if is_between else words).append(word)
    return SpokenLabel(_COMPOUND.sub(" ", without_variants(" ".join(words))), tuple(left_out))


def spoken_part(label: str) -> str:
    """Words of a label without its silences and noises; empty if it has none."""
    return spoken_label(label).spoken


def without_variants(text: str) -> str:
    """A text without the numbers of pronunciations behind words: THE(2)."""
    return _VARIANT.sub(r"\1", text)
