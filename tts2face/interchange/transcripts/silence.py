"""Labels of silence and noise, which are no words, in every format and at every door.

A label is no word if it stands in ``silence_labels.tsv``, wholly in brackets or between marks of fillers, or has
neither letter nor digit. The table holds no English word: those stand in brackets where they name a noise.
"""

import functools
import re
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
# labels that stand between the words of an utterance and are no words of a language
_BETWEEN_WORDS = word_set("spn nsn sp ssil lsil brth vocnoise xxx yyy # + h# !sil !enter !exit sent-start sent-end")


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
        or not any(letter.isalnum() for letter in plain)
    )


def spoken_part(label: str) -> str:
    """Words of a label without its silences and noises; empty if it has none."""
    if is_silence(label):
        return ""
    words = _INSERTED.sub(" ", _SAID_LAUGHING.sub(r"\1", label)).split()
    return " ".join(word for word in words if len(words) == 1 or word.casefold() not in _BETWEEN_WORDS)
