"""Words that would take a synthesis process for itself."""

import re

from lexicon.errors import InputError

MAX_WORD_CHARACTERS = 200  # 300 digits are 70 s of speech, made in one step of 7 s, during which all others wait
_LONG_WORD = re.compile(rf"[!-~]{{{MAX_WORD_CHARACTERS + 1}}}|\d{{{MAX_WORD_CHARACTERS + 1}}}")


def check_words(text: str) -> None:
    """Refuse words and numbers of more than `MAX_WORD_CHARACTERS`; scripts without spaces are not concerned."""
    if (found := _LONG_WORD.search(text)) is not None:
        raise InputError(
            f"the text has a word of more than {MAX_WORD_CHARACTERS} characters, {found[0][:20]}...; put spaces into it"
        )
