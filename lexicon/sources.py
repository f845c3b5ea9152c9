"""Written forms of spoken words: which part of a text (1 234 567, 3,50 €) each word is a part of."""

from bisect import bisect_right
from collections.abc import Sequence
from itertools import accumulate

from lexicon.written_forms import WrittenForm

_MARKS = ' \n\t.,;:!?—…«»“”„"()[]¿¡'


def sources_of(words: Sequence[str], forms: Sequence[WrittenForm]) -> list[tuple[int, str]] | None:
    """Number and text of the written form of each spoken word, equal for words of one form; None if they differ.

    Parameters
    ----------
    words
        Spoken words, in order.
    forms
        The text as written, with its spoken form; those that are spoken as they are written are no forms.
    """
    ends = [*accumulate(_n_letters(form.spoken) for form in forms)]
    if not ends or ends[-1] != sum(map(_n_letters, words)):
        return None
    groups = _groups(forms)
    found: list[tuple[int, str]] = []
    at = 0
    for number, word in enumerate(words):
        n = _n_letters(word)
        first = bisect_right(ends, at)
        last = bisect_right(ends, at + max(n, 1) - 1)
        inside = range(first, min(last + 1, len(forms)))
        own = next((k for k in inside if not _is_plain(forms[k])), None)
        if own is None:
            found.append((-number - 1, word))
        else:
            found.append((groups[own], _joined(forms, groups, groups[own], inside)))
        at += n
    return found


def written_groups(words: Sequence[str], forms: Sequence[WrittenForm]) -> list[tuple[str, range]]:
    """Words of a text as they are written, each with the range of its spoken words; parameters as of `sources_of`.

    Words whose written form is not known are as they are spoken.
    """
    found: list[tuple[str, range]] = []
    before = None
    for at, (number, source) in enumerate(sources_of(words, forms) or enumerate(words)):
        if found and number == before:
            found[-1] = (found[-1][0], range(found[-1][1].start, at + 1))
        else:
            found.append((source, range(at, at + 1)))
        before = number
    return found


def _n_letters(text: str) -> int:
    return sum(map(str.isalnum, text))


def _is_plain(form: WrittenForm) -> bool:
    return form.source == form.spoken


def _groups(forms: Sequence[WrittenForm]) -> list[int]:
    """Number of the first form of each run of forms without white space or words between them (10-15 km)."""
    numbers: list[int] = []
    for at, form in enumerate(forms):
        is_continued = (
            at > 0
            and not _is_plain(form)
            and not _is_plain(forms[at - 1])
            and (not form.source[:1].isspace() and not forms[at - 1].source[-1:].isspace())
        )
        numbers.append(numbers[-1] if is_continued else at)
    return numbers


def _joined(forms: Sequence[WrittenForm], groups: Sequence[int], group: int, inside: range) -> str:
    """Written text of a group, with the letters before and behind it that are part of the word (l'1, 20-fach)."""
    own = [at for at, number in enumerate(groups[group:], start=group) if number == group and not _is_plain(forms[at])]
    text = "".join(forms[at].source for at in own)
    if inside.start < own[0]:
        text = (forms[own[0] - 1].source.split() or [""])[-1] + text
    if inside.stop - 1 > own[-1]:
        text += (forms[own[-1] + 1].source.split() or [""])[0]
    return text.strip(_MARKS) or text.strip()
