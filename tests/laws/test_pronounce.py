"""Any text is pronounced or refused with a reason, and syllables cover their word."""

import contextlib

from hypothesis import given, settings
from hypothesis import strategies as st

from lexicon.errors import BackendError, InputError
from lexicon.pronounce import pronounce

WORDS = st.text("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ'-.,!?$%0123456789 éñ", max_size=40)


@settings(deadline=None)
@given(st.one_of(WORDS, st.text(max_size=30)), st.sampled_from(["en-us", "en-gb", "de", "ru", "ja"]))
def test_syllables_cover_each_word(text: str, language: str) -> None:
    with contextlib.suppress(InputError, BackendError):  # the reader of Chinese characters is an extra
        for word in pronounce(text, language).words:
            ends = [0, *(last for _, last in word.syllables)]
            assert [first for first, _ in word.syllables] == ends[:-1]
            assert ends[-1] == len(word.phones) == len(word.stress)
            assert len(word.arpabet) in {0, len(word.phones)} or language == "en-gb"
