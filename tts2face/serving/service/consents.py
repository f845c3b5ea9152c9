"""Consents that clients send, checked before a file is received or made."""

from lexicon.errors import InputError
from tts2face.models.consent import parse_consent
from tts2face.serving.service.errors import RefusedError


def check_consent(consent: str | None) -> str | None:
    """A consent that a client sent, in one of the three answers, or None where it is blank."""
    if consent is None or not consent.strip():
        return None
    try:
        return str(parse_consent(consent))
    except InputError as wrong:
        raise RefusedError(422, "consent", str(wrong)) from wrong
