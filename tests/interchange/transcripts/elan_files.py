"""Files of ELAN made for tests: tiers of aligned labels, and of labels that annotate those of another tier."""

from collections.abc import Sequence

Row = tuple[str, str, Sequence[str]]  # name, parent, labels; a parent's labels last a second each


def annotated(*rows: Row) -> str:
    """Text of a file whose tiers stand in the order of `rows`."""
    n_labels = max(len(labels) for _, _, labels in rows)
    slots = "".join(f'<TIME_SLOT TIME_SLOT_ID="s{at}" TIME_VALUE="{1000 * at}"/>' for at in range(n_labels + 1))
    tiers = "".join(_tier(*row) for row in rows)
    return (
        '<?xml version="1.0" encoding="UTF-8"?><ANNOTATION_DOCUMENT FORMAT="3.0" VERSION="3.0">'
        f'<HEADER TIME_UNITS="milliseconds"/><TIME_ORDER>{slots}</TIME_ORDER>{tiers}</ANNOTATION_DOCUMENT>'
    )


def _tier(name: str, parent: str, labels: Sequence[str]) -> str:
    content = "".join(_annotation(name, parent, at, label) for at, label in enumerate(labels))
    of = f' PARENT_REF="{parent}"' if parent else ""
    return f'<TIER LINGUISTIC_TYPE_REF="default-lt" TIER_ID="{name}"{of}>{content}</TIER>'


def _annotation(name: str, parent: str, at: int, label: str) -> str:
    own = f'ANNOTATION_ID="{name}{at}"'
    value = f"<ANNOTATION_VALUE>{label}</ANNOTATION_VALUE>"
    if parent:
        ref = f'<REF_ANNOTATION {own} ANNOTATION_REF="{parent}{at}">{value}</REF_ANNOTATION>'
        return f"<ANNOTATION>{ref}</ANNOTATION>"
    places = f'TIME_SLOT_REF1="s{at}" TIME_SLOT_REF2="s{at + 1}"'
    return f"<ANNOTATION><ALIGNABLE_ANNOTATION {own} {places}>{value}</ALIGNABLE_ANNOTATION></ANNOTATION>"
