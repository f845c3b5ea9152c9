"""Consent of the person whose face a file carries: asked for, kept with name and date."""

from collections.abc import Mapping
from datetime import UTC, datetime

from lexicon.errors import InputError

MIN_STATEMENT_WORDS = 3  # shorter is a slip of the keyboard, not a statement


def consent_record(name: str, statement: str | None, *, date: str | None = None) -> Mapping[str, str]:
    """The consent as a file's metadata keep it: name, statement, date.

    Raises
    ------
    InputError
        There is no statement, or none that says anything.
    """
    if statement is None or len(statement.split()) < MIN_STATEMENT_WORDS:
        raise InputError(
            f"the file will carry pictures of {name}'s face; state the consent: "
            '--consent "I, NAME, agree that my face is used for ..."'
        )
    return {"name": name, "statement": statement.strip(), "date": date or datetime.now(UTC).date().isoformat()}
