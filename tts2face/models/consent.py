"""Consent to show a person's face: one of three answers, with words behind it if one likes.

Words cannot prove consent: a file keeps who is shown, what was answered and when, and who answers is answerable for it.
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime, timedelta
from typing import Any

from lexicon.errors import InputError

SELF = "me"
AGREED = "agreed"
NOBODY = "nobody"
EARLIER = "earlier"  # of a statement in free words, as files hold that were made before there were answers
EARLIER_DRAWN, EARLIER_WORDS = "drawn", 3  # a face that is nobody's; the least number of words for all others
GRACE = timedelta(days=1)  # a date that is tomorrow in Greenwich is today elsewhere
EXAMPLE = "agreed: Ann Lee, 2026-11-29"
THREE_ANSWERS = (
    f'{SELF} (the pictures show you), "{EXAMPLE}" (the person agreed: name and date), or {NOBODY} (drawn or '
    "generated); words may follow after a comma"
)
PHOTO_TOOL = "tts2face face photo"  # "made_by" of a head that was made of pictures of a person
_WRITTEN = re.compile(rf"({SELF}|{AGREED}|{NOBODY})\s*(?:[,:;.]\s*(.*))?", re.IGNORECASE | re.DOTALL)
_DATE = re.compile(r"(?<![0-9-])[0-9]{4}-[0-9]{2}-[0-9]{2}(?![0-9-])")


@dataclass(frozen=True, slots=True)
class Consent:
    """An answer, `SELF`, `AGREED`, `NOBODY` or `EARLIER`, and the words behind it; of an earlier one all its words."""

    answer: str
    words: str = ""

    def __str__(self) -> str:
        """The statement as files keep it."""
        if self.answer == EARLIER:
            return self.words
        return f"{self.answer}: {self.words}" if self.words else self.answer


def parse_consent(statement: str) -> Consent:
    """Consent in one of three answers.

    Raises
    ------
    InputError
        It is none of them, or a person agreed without a name or on a day that does not exist or has not come.
    """
    found = _WRITTEN.fullmatch(statement.strip())
    if found is None:
        said = statement.strip()[:60]
        raise InputError(f"{said!r} is not one of the three answers; state the consent: {THREE_ANSWERS}")
    consent = Consent(found[1].lower(), (found[2] or "").strip())
    if consent.answer == AGREED:
        _check_agreement(consent.words)
    return consent


def _check_agreement(words: str) -> None:
    """Refuse an agreement without the name of a person and a date that has come."""
    day = _DATE.search(words)
    if day is None or not any(map(str.isalpha, words[: day.start()])):
        raise InputError(f"who agreed is stated with a name and a date, year first: {EXAMPLE}; not {words[:60]!r}")
    try:
        agreed_on = date.fromisoformat(day[0])
    except ValueError as error:
        raise InputError(f"{day[0]} is no day of a calendar; state the day on which the person agreed") from error
    if agreed_on > datetime.now(UTC).date() + GRACE:
        raise InputError(f"{day[0]} has not come yet; state the day on which the person agreed")


def consent_record(name: str, statement: str | None, *, date: str | None = None) -> Mapping[str, str]:
    """Consent record for the metadata of a file: name of whom it shows, statement, date of the statement.

    Raises
    ------
    InputError
        There is no statement; otherwise as `parse_consent`.
    """
    if statement is None or not statement.strip():
        raise InputError(f"the file will contain pictures of {name}'s face; state the consent: {THREE_ANSWERS}")
    stated = parse_consent(statement)
    return {"name": name, "statement": str(stated), "date": date or datetime.now(UTC).date().isoformat()}


def stated_consent(metadata: Mapping[str, Any]) -> Consent | None:
    """Consent that the metadata of a file state, also in the words of earlier files; None where they state none."""
    record = metadata.get("consent")
    statement = record.get("statement") if isinstance(record, Mapping) else None
    if not isinstance(statement, str):
        return None
    try:
        return parse_consent(statement)
    except InputError:
        words = statement.strip()
        has_words = words == EARLIER_DRAWN or len(words.split()) >= EARLIER_WORDS
        return Consent(EARLIER, words) if has_words else None
