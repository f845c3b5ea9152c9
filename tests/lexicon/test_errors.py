"""Messages of errors show the beginning of long values."""

from lexicon.errors import DataError, InputError


def test_of_a_word_without_end_a_message_shows_the_beginning() -> None:
    assert str(InputError(f"there is no {'x' * 5000}; choose y")) == f"there is no {'x' * 60}... choose y"
    assert len(str(DataError(f"{'x' * 900} is missing"))) == 911
