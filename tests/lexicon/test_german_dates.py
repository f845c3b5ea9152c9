"""Days of German dates as ordinals in their case."""

import pytest

from lexicon.normalize import spoken_form
from lexicon.pronounce import pronounce


@pytest.mark.parametrize(
    ("written", "spoken"),
    [
        ("Am 3. Mai 2024 in Berlin.", "Am dritten Mai 2024 in Berlin."),
        ("Heute ist der 31. Dezember.", "Heute ist der einunddreißigste Dezember."),
        ("3. Mai", "dritter Mai"),
        ("vom 21. März bis zum 7. April", "vom einundzwanzigsten März bis zum siebten April"),
        ("40. Mai", "40. Mai"),
        ("Es waren 3. Dann kam Mai.", "Es waren 3. Dann kam Mai."),
    ],
)
def test_days_of_dates(written: str, spoken: str) -> None:
    assert spoken_form(written, "de") == spoken


def test_a_date_is_pronounced_as_words() -> None:
    assert [word.text for word in pronounce("Am 3. Mai.", "de").words] == ["Am", "dritten", "Mai"]
    assert "3. Mai" in spoken_form("le 3. Mai", "fr-fr")
