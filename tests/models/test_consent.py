"""Consent is one of three answers; files of before keep their words."""

from datetime import UTC, datetime, timedelta

import pytest

from lexicon.errors import InputError
from tts2face.models.consent import (
    AGREED,
    EARLIER,
    NOBODY,
    SELF,
    Consent,
    consent_record,
    parse_consent,
    stated_consent,
)

TODAY = datetime.now(UTC).date()


@pytest.mark.parametrize(
    ("written", "answer", "kept"),
    [
        ("me", SELF, "me"),
        (" Me. ", SELF, "me"),
        ("me, for the film of our team", SELF, "me: for the film of our team"),
        ("nobody", NOBODY, "nobody"),
        ("nobody: painted by Rembrandt", NOBODY, "nobody: painted by Rembrandt"),
        ("agreed: Ann Lee, 2026-11-29", AGREED, "agreed: Ann Lee, 2026-11-29"),
        ("AGREED: Lee, Ann, 2024-02-29, by letter", AGREED, "agreed: Lee, Ann, 2024-02-29, by letter"),
        ("agreed: 李安, 2026-01-02", AGREED, "agreed: 李安, 2026-01-02"),
        (f"agreed: Ann Lee, {TODAY + timedelta(days=1)}", AGREED, f"agreed: Ann Lee, {TODAY + timedelta(days=1)}"),
    ],
)  # fmt: skip
def test_three_answers_are_kept_with_their_words(written: str, answer: str, kept: str) -> None:
    consent = parse_consent(written)
    assert (consent.answer, str(consent)) == (answer, kept)
    assert parse_consent(kept) == consent
    assert stated_consent({"consent": consent_record("Ann", written)}) == consent


@pytest.mark.parametrize(
    "written",
    ["I agree to this.", "nobody was asked", "drawn", "yes", "me and Ann agree", "agreed with Ann Lee on 2026-11-29",
     "nobody's face", "somebody, agreed", "I, Ann Lee, agree, 2026-11-29"],
)  # fmt: skip
def test_free_words_are_refused_with_the_three_answers(written: str) -> None:
    with pytest.raises(InputError, match=r'not one of the three answers.*me \(.*"agreed: Ann Lee.*nobody \('):
        consent_record("Ann", written)


@pytest.mark.parametrize(
    ("written", "reason"),
    [
        ("agreed", "a name and a date"),
        ("agreed: Ann Lee", "a name and a date"),
        ("agreed: 2026-11-29", "a name and a date"),
        ("agreed: Ann Lee, 29.11.2026", "a name and a date"),
        ("agreed: ..., 2026-11-29", "a name and a date"),
        ("agreed: Ann Lee, 2026-02-30", "2026-02-30 is no day"),
        ("agreed: Ann Lee, 0000-01-01", "0000-01-01 is no day"),
        (f"agreed: Ann Lee, {TODAY + timedelta(days=2)}", "has not come yet"),
    ],
)
def test_an_agreement_has_a_name_and_a_day_that_has_come(written: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        parse_consent(written)


@pytest.mark.parametrize("written", [None, "", "  "])
def test_no_answer_is_asked_for(written: str | None) -> None:
    with pytest.raises(InputError, match="pictures of Ann's face; state the consent: me"):
        consent_record("Ann", written)


@pytest.mark.parametrize("statement", ["I agree that my face speaks this.", "drawn", "nobody was asked"])
def test_earlier_words_of_files_are_read_as_they_are(statement: str) -> None:
    found = stated_consent({"consent": {"name": "Ann", "statement": statement, "date": "2025-01-02"}})
    assert found == Consent(EARLIER, statement)
    assert str(found) == statement


@pytest.mark.parametrize(
    "metadata", [{}, {"consent": "me"}, {"consent": {"statement": 3}}, {"consent": {"statement": "yes"}}]
)
def test_metadata_may_state_none(metadata: dict[str, object]) -> None:
    assert stated_consent(metadata) is None
