"""Labels of phones in figures and tables."""

from lexicon.errors import InputError
from lexicon.phones import look_up_phone

LABELS = ("both", "ipa", "arpabet")


def check_labels(labels: str) -> None:
    """Check a kind of label; `InputError` where it is none of `LABELS`."""
    if labels not in LABELS:
        raise InputError(f"phones are labelled in {', '.join(LABELS[1:])} or {LABELS[0]}, not {labels!r}")


def label(phone: str, labels: str) -> str:
    """A phone in IPA, in ARPABET, or in both: ``tʃ CH``; IPA where ARPABET has no name."""
    name = look_up_phone(phone).arpabet
    if not name or labels == "ipa":
        return phone
    return name if labels == "arpabet" else f"{phone} {name}"
