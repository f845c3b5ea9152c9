"""Written forms of spoken words: which part of a text (1 234 567, 3,50 €) each word is a part of."""

import unicodedata
from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import accumulate

from lexicon.written_forms import WrittenForm

_MARKS = ' \n\t.,;:!?—…«»“”„"()[]¿¡。、，．！？：；「」『』（）؟،؛।'


def sources_of(words: Sequence[str], forms: Sequence[WrittenForm]) -> list[tuple[int, str]] | None:
    """Number and text of the written form of each spoken word, equal for words of one form; None if they differ.

    A word that lies in a form and beside it is with both (l'1, 3.5ドルです); of a form whose letters are spoken as they
    are written each word is for itself.

    Parameters
    ----------
    words
        Spoken words, in order.
    forms
        The text as written, with its spoken form.
    """
    text, spans = _spans_of_letters(forms)
    if not spans or len(spans) != sum(map(_n_letters, words)):
        return None
    found: list[list[int]] = []  # beginning and end in the text, of each written word
    numbers: list[int] = []
    at = 0
    for word in words:
        n = _n_letters(word)
        letters = spans[at : at + n] or [(found[-1][1] if found else 0,) * 2]
        first, last = letters[0][0], letters[-1][1]
        if found and first < found[-1][1]:
            found[-1][1] = max(found[-1][1], last)
        else:
            found.append([first, last])
        numbers.append(len(found) - 1)
        at += n
    return [(number, _without_signs(text, *found[number]) or word) for number, word in zip(numbers, words, strict=True)]


def written_groups(words: Sequence[str], forms: Sequence[WrittenForm]) -> list[tuple[str, range]]:
    """Words of a text as they are written, each with the range of its spoken words; parameters as of `sources_of`.

    Words whose written form is not known are as they are spoken.
    """
    return _grouped(sources_of(words, forms) or list(enumerate(words)))


def english_groups(words: Sequence[str], tokens: Sequence[WrittenForm], text: str) -> list[tuple[str, range]]:
    """As `written_groups`, of the tokens of an English text; those of a range without a space are one (6-8pm)."""
    found = english_sources(words, tokens)
    if found is None:
        return _grouped(list(enumerate(words)))
    within = _words_around(tokens, text)
    return _grouped([within[at] or (at, source) for at, source in found])


def _words_around(tokens: Sequence[WrittenForm], text: str) -> list[tuple[int, str] | None]:
    """Number and text of the word between spaces of which each token is a part; None if it is all of it.

    Tokens that are spoken as they are written (well, known) are words of their own.
    """
    written = text.split()
    ends = list(accumulate(len(_folded(word)) for word in written))
    reached = [0, *accumulate(len(_folded(token.source)) for token in tokens)]
    if not ends or reached[-1] != ends[-1]:
        return [None] * len(tokens)
    places = [bisect_right(ends, at) if at < ends[-1] else len(ends) - 1 for at in reached[:-1]]
    members: dict[int, list[int]] = {}
    for at, place in enumerate(places):
        is_inside = reached[at + 1] <= ends[place] and (reached[at + 1] > reached[at] or reached[at] not in ends)
        if is_inside:
            members.setdefault(place, []).append(at)
    joined: list[tuple[int, str] | None] = [None] * len(tokens)
    for place, own in members.items():
        if len(own) > 1 and any(_letters(tokens[at].source) != _letters(tokens[at].spoken) for at in own):
            for at in own:
                joined[at] = (own[0], written[place].strip(_MARKS))
    return joined


def english_sources(words: Sequence[str], tokens: Iterable[WrittenForm]) -> list[tuple[int, str]] | None:
    """Number and text of the token of each spoken word; None if the tokens are not spoken in these words."""
    pieces = [
        (number, token.source.strip(" .,;:!?—…") or piece, piece)
        for number, token in enumerate(tokens)
        for piece in token.spoken.split()
        if any(map(str.isalnum, piece))
    ]
    spoken = [_letters(piece).casefold() for *_, piece in pieces]
    if spoken != [_letters(word).casefold() for word in words]:
        return None
    return [(number, source) for number, source, _ in pieces]


def _grouped(sources: Sequence[tuple[int, str]]) -> list[tuple[str, range]]:
    found: list[tuple[str, range]] = []
    before = None
    for at, (number, source) in enumerate(sources):
        if found and number == before:
            found[-1] = (found[-1][0], range(found[-1][1].start, at + 1))
        else:
            found.append((source, range(at, at + 1)))
        before = number
    return found


def with_written_sources(forms: Iterable[WrittenForm], text: str) -> Iterator[WrittenForm]:
    """Forms with sources as they are written (cm², ½, H₂O), where characters of the text were replaced (cm^2).

    The letters of the sources are those of the text in order, in compatible characters (NFKC); where they differ, that
    form and those behind it stay as they are.
    """
    letters = [(letter, at) for at, sign in enumerate(text) for letter in _folded(sign)] if not text.isascii() else []
    first = 0
    for form in forms:
        own = _folded(form.source)
        found = letters[first : first + len(own)]
        if not own or "".join(letter for letter, _ in found) != own:
            letters = letters if not own else []
            yield form
            continue
        first += len(own)
        start, end = found[0][1], found[-1][1] + 1
        while start and not form.source[0].isalnum() and _is_sign(text[start - 1]):
            start -= 1
        while end < len(text) and not form.source[-1].isalnum() and _is_sign(text[end]):
            end += 1
        written = text[start:end]
        yield form if form.source.isascii() and written.isascii() else replace(form, source=written)


def _folded(text: str) -> str:
    return _letters(unicodedata.normalize("NFKC", text)).casefold()


def _is_sign(character: str) -> bool:
    return not character.isalnum() and not character.isspace()


def _n_letters(text: str) -> int:
    return sum(map(str.isalnum, text))


def _letters(text: str) -> str:
    return "".join(filter(str.isalnum, text))


def _without_signs(text: str, first: int, last: int) -> str:
    while last < len(text) and unicodedata.category(text[last])[0] == "M":  # signs of vowels
        last += 1
    written = text[first:last]
    return written.strip(_MARKS) or written.strip()


def _spans_of_letters(forms: Sequence[WrittenForm]) -> tuple[str, list[tuple[int, int]]]:
    """The written text, and for each spoken letter the range of it that it is a part of."""
    text = "".join(form.source for form in forms)
    starts = [0, *accumulate(len(form.source) for form in forms)]
    is_plain = [_letters(form.source) == _letters(form.spoken) for form in forms]
    groups = _groups(forms, is_plain)
    ends = {groups[at]: starts[at + 1] for at in range(len(forms))}
    spans: list[tuple[int, int]] = []
    for at, form in enumerate(forms):
        if is_plain[at]:
            places = (starts[at] + k for k, letter in enumerate(form.source) if letter.isalnum())
            spans += [(place, place + 1) for place in places]
        else:
            spans += [(starts[groups[at]], ends[groups[at]])] * _n_letters(form.spoken)
    return text, spans


def _groups(forms: Sequence[WrittenForm], is_plain: Sequence[bool]) -> list[int]:
    """Number of the first form of each run of forms without white space or words between them (10-15 km)."""
    numbers: list[int] = []
    for at, form in enumerate(forms):
        is_continued = (
            at > 0
            and not is_plain[at]
            and not is_plain[at - 1]
            and not form.source[:1].isspace()
            and not forms[at - 1].source[-1:].isspace()
        )
        numbers.append(numbers[-1] if is_continued else at)
    return numbers
