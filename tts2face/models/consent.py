"""Consent of the person whose face a file shows."""

from collections.abc import Mapping
from datetime import UTC, datetime
from typing import Any

from lexicon.errors import InputError

MIN_STATEMENT_WORDS = 3  # shorter statements are treated as typing errors
DRAWN = "drawn"  # the statement for a face that is not that of a real person
PHOTO_TOOL = "tts2face face photo"  # "made_by" of a head that was made of pictures of a person


def consent_record(name: str, statement: str | None, *, date: str | None = None) -> Mapping[str, str]:
    """Consent record for the metadata of a file: name, statement, date.

    Raises
    ------
    InputError
        The statement is missing or too short.
    """
    said = "" if statement is None else statement.strip()
    # drawn people need nobody's consent
    if said != DRAWN and len(said.split()) < MIN_STATEMENT_WORDS:
        raise InputError(
            f"the file will contain pictures of {name}'s face; state the consent: "
            '--consent "I, NAME, agree that my face is used for ...", or --consent drawn if it is nobody\'s'
        )
    return {"name": name, "statement": said, "date": date or datetime.now(UTC).date().isoformat()}


def states_consent(metadata: Mapping[str, Any]) -> bool:
    """Whether the metadata of a file hold a statement of the person shown, as `consent_record` demands it."""
    record = metadata.get("consent")
    statement = record.get("statement") if isinstance(record, Mapping) else None
    try:
        consent_record("the person", statement if isinstance(statement, str) else None)
    except InputError:
        return False
    return True
