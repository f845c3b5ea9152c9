"""Endings behind an apostrophe, whose vowels follow the last vowel before them: 20 TL'ye is yirmi liraya."""

_BACK, _FRONT = "aıou", "eiöü"
_NARROW = dict(zip("aıoueiöü", "ııuuiiüü", strict=True))  # narrow vowel behind each vowel


def with_tail(said: str, tail: str) -> str:
    """Words with an ending of Turkish, in the vowels that follow theirs (Lewis, Turkish Grammar, vowel harmony)."""
    last = next((letter for letter in reversed(said) if letter in _NARROW), "")
    if not tail or not last:
        return said + tail
    found = []
    for letter in tail:
        if letter in "ae":
            found.append("a" if last in _BACK else "e")
        elif letter in "ıiuü":
            found.append(_NARROW[last])
        else:
            found.append(letter)
        last = found[-1] if found[-1] in _NARROW else last
    return said + "".join(found)
