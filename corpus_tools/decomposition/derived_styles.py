"""Derived styles without recordings: the table of changes of a measured style."""

import csv
from collections.abc import Iterator, Mapping
from pathlib import Path

from lexicon.errors import DataError
from tts2face.models.palette import (
    FIXED_CHANNELS,
    PLAIN,
    REGION_FEATURES,
    Delivery,
    Derivation,
    FeatureChange,
)

VOICE = "voice"  # in place of a feature, on the line of a style's delivery
DERIVED_STYLE_TABLE = Path(__file__).with_name("derived_styles.tsv")


def read_derived_styles(source: str, table: Path = DERIVED_STYLE_TABLE) -> dict[str, Derivation]:
    """Derivations from a measured style, by name.

    Raises
    ------
    DataError
        A line of the table names no feature or channel, or holds no number.
    """
    changes: dict[str, dict[str, FeatureChange]] = {}
    reasons: dict[str, list[str]] = {}
    deliveries: dict[str, Delivery] = {}
    lines = [line for line in table.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    for row in csv.DictReader(lines, delimiter="\t"):
        style, feature = row["style"], row["feature"]
        if feature == VOICE:
            deliveries[style] = _parse_delivery(row["offsets"] or "", table.name, style)
            continue
        if feature not in FIXED_CHANNELS and feature not in REGION_FEATURES:
            raise DataError(f"{table.name}: {style} changes {feature!r}, which is not a feature; correct the table")
        try:
            offset = _parse_offsets(row["offsets"] or "", feature)
            changes.setdefault(style, {})[feature] = FeatureChange(float(row["gain"]), offset, float(row["tempo"]))
        except ValueError as broken:
            raise DataError(f"{table.name}: {feature} of {style} cannot be read ({broken}); correct it") from broken
        reasons.setdefault(style, []).extend([row["why"]] if row["why"] else [])
    return {
        style: Derivation(
            source, changed, f"derived from {source}: {'; '.join(reasons[style])}", deliveries.get(style, PLAIN)
        )
        for style, changed in changes.items()
    }


def _settings(written: str) -> Iterator[tuple[str, str]]:
    """Names and values of a list ``name=value name=value``."""
    for part in written.split():
        name, _, value = part.partition("=")
        yield name, value


def _parse_delivery(written: str, table: str, style: str) -> Delivery:
    try:
        return Delivery(**{name: float(value) for name, value in _settings(written)})
    except (TypeError, ValueError) as broken:
        raise DataError(f"{table}: the voice of {style} cannot be read ({broken}); correct it") from broken


def _parse_offsets(written: str, feature: str) -> Mapping[str, float]:
    found = {}
    for channel, value in _settings(written):
        if channel not in FIXED_CHANNELS.get(feature, ()):
            raise ValueError(f"no channel {channel!r}")
        found[channel] = float(value)
    return found
