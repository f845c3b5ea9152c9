"""Changes of a palette: derived styles that are mixed of others, new names, removal."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from tts2face.models.palette import EXPRESSIONS, FEATURES, Delivery, Derivation, FeatureChange, Palette
from tts2face.models.palette_file import LEVEL_DB, PITCH, RANGE_FACTORS, RATE_FACTORS

# characters
MAX_NAME = 40
FORBIDDEN = frozenset(",=@;:#[]<>\"'/\\")  # have a meaning in marks, flags, timelines or paths
SHARE_LIMITS = (0.0, 1.0)  # of a style in a mix
EXPRESSION_LIMITS = (-1.0, 1.5)  # weights that are added
SIZE_LIMITS = (0.0, 3.0)  # factors of the motion of a feature
# factors of the tempo of recorded gestures
TEMPO_LIMITS = (0.5, 2.0)


@dataclass(frozen=True, slots=True)
class StyleMix:
    """A derived style as a mix of others and changes of them.

    Parameters
    ----------
    source
        Recorded style whose motion it has.
    shares
        Share of each derived style of the palette, 0 to 1. One style with share 1 gives that style; without shares the
        source is presented unchanged. Shares need not add up to 1: two moods may be shown in full.
    expressions
        Weights that are added to basis expressions.
    sizes
        Factors of the motion of features about its mean.
    tempo
        Factor of the speed of all features.

    Raises
    ------
    InputError
        An expression or a feature does not exist, or a value is out of range.
    """

    source: str
    shares: Mapping[str, float] = field(default_factory=dict)
    expressions: Mapping[str, float] = field(default_factory=dict)
    sizes: Mapping[str, float] = field(default_factory=dict)
    tempo: float = 1.0

    def __post_init__(self) -> None:
        """Check types, names and values."""
        check_fields(self)
        for name, share in self.shares.items():
            _check_value(f"the share of {name}", share, SHARE_LIMITS)
        for name, weight in self.expressions.items():
            _check_name("expression", name, EXPRESSIONS)
            _check_value(f"the weight of {name}", weight, EXPRESSION_LIMITS)
        for name, size in self.sizes.items():
            _check_name("feature", name, FEATURES)
            _check_value(f"the size of {name}", size, SIZE_LIMITS)
        _check_value("the tempo", self.tempo, TEMPO_LIMITS)


def mix_styles(palette: Palette, mix: StyleMix) -> Derivation:
    """The derived style of a mix.

    Offsets are sums of those of the mixed styles times their shares; gains and tempos are products of theirs to the
    power of their shares, so that each is changed by the same ratio whatever the others do. So is the delivery.

    Raises
    ------
    InputError
        The palette has no such recorded style, or a share names no derived one.
    """
    if mix.source not in palette.styles:
        raise InputError(
            f"there is no recorded style {mix.source[:40]!r} in the palette; it has {', '.join(palette.styles)}"
        )
    for name in mix.shares:
        if name not in palette.derivations:
            raise InputError(
                f"there is no derived style {name[:40]!r} in the palette; it has {', '.join(palette.derivations)}"
            )
    changes = {feature: _mixed_change(palette, mix, feature) for feature in FEATURES}
    kept = {name: change for name, change in changes.items() if change != FeatureChange()}
    return Derivation(mix.source, kept, _summary(mix), _mixed_delivery(palette, mix))


def _mixed_delivery(palette: Palette, mix: StyleMix) -> Delivery:
    rate = span = 1.0
    level = pitch = 0.0
    for name, share in mix.shares.items():
        delivery = palette.derivations[name].delivery
        rate, span = rate * delivery.rate**share, span * delivery.range**share
        level, pitch = level + share * delivery.level_db, pitch + share * delivery.pitch
    limits = RATE_FACTORS, (-LEVEL_DB, LEVEL_DB), (-PITCH, PITCH), RANGE_FACTORS
    mixed = np.array([rate, level, pitch, span])
    return Delivery(*np.clip(mixed, *np.transpose(limits)).tolist())


def _mixed_change(palette: Palette, mix: StyleMix, feature: str) -> FeatureChange:
    gain, tempo = mix.sizes.get(feature, 1.0), mix.tempo
    offset = dict(mix.expressions) if feature == "expression" else {}
    for name, share in mix.shares.items():
        change = palette.derivations[name].changes.get(feature, FeatureChange())
        gain *= change.gain**share if change.gain > 0 else 1.0 + share * (change.gain - 1.0)
        tempo *= change.tempo**share
        for channel, value in change.offset.items():
            offset[channel] = offset.get(channel, 0.0) + share * value
    return FeatureChange(gain, {name: value for name, value in offset.items() if value}, tempo)


def _summary(mix: StyleMix) -> str:
    parts = [f"{name} {share:.0%}" for name, share in mix.shares.items() if share]
    parts += [f"{name} {weight:+.2g}" for name, weight in mix.expressions.items() if weight]
    parts += [f"{name} x {size:.2g}" for name, size in mix.sizes.items() if size != 1.0]
    parts += [f"tempo x {mix.tempo:.2g}"] * (mix.tempo != 1.0)
    return f"derived from {mix.source}: {', '.join(parts) or 'presented, otherwise unchanged'}"


def add_derivation(palette: Palette, name: str, derived: Derivation) -> Palette:
    """The palette with one more derived style.

    Raises
    ------
    InputError
        The name is taken or cannot be used.
    """
    return replace(palette, derivations={**palette.derivations, check_new_style(palette, name): derived})


def rename_style(palette: Palette, name: str, new: str) -> Palette:
    """The palette in which a style has another name, also where others are derived from it; order and motion stay.

    Raises
    ------
    InputError
        There is no such style, or the new name is taken or cannot be used.
    """
    require_own(palette, name)
    names = {name: check_new_style(palette, new)}
    derivations = {
        names.get(old, old): replace(derived, source=names.get(derived.source, derived.source))
        for old, derived in palette.derivations.items()
    }
    styles = {names.get(old, old): style for old, style in palette.styles.items()}
    return replace(palette, styles=styles, derivations=derivations)


def remove_style(palette: Palette, name: str) -> Palette:
    """The palette without a style.

    Raises
    ------
    InputError
        There is no such style, other styles are derived from it, or it is the only recorded one.
    """
    require_own(palette, name)
    dependent = [other for other, derived in palette.derivations.items() if derived.source == name and other != name]
    # a derived style has no motion of its own
    if dependent and name in palette.styles:
        raise InputError(f"{', '.join(dependent)} is derived from {name}; delete what is derived from it first")
    styles = {other: style for other, style in palette.styles.items() if other != name}
    if not styles:
        raise InputError(f"{name} is the only recorded style of the palette; delete the palette")
    derivations = {other: derived for other, derived in palette.derivations.items() if other != name}
    return replace(palette, styles=styles, derivations=derivations)


def check_new_style(palette: Palette, name: str) -> str:
    """The name of a new style without spaces around it.

    Raises
    ------
    InputError
        It is empty or too long, has characters that mean something else, or is taken.
    """
    name = " ".join(name.split())
    if not 0 < len(name) <= MAX_NAME or not name.isprintable() or FORBIDDEN & set(name):
        raise InputError(
            f"a style cannot be called {name[:MAX_NAME]!r}; give 1 to {MAX_NAME} letters, digits, spaces or hyphens"
        )
    if name in palette.names:
        raise InputError(f"the palette has a style {name} already; choose another name")
    return name


def require_own(palette: Palette, name: str) -> str:
    """The name of a style that the palette holds itself, which `tts2face.models.palette.MEASURED_STYLE` is not."""
    if name not in palette.styles and name not in palette.derivations:
        raise InputError(f"there is no style {name[:40]!r} that can be changed; choose one of the palette")
    return name


def _check_name(what: str, name: str, known: tuple[str, ...]) -> None:
    if name not in known:
        raise InputError(f"there is no {what} {name[:40]!r}; choose {', '.join(known)}")


def _check_value(what: str, value: float, limits: tuple[float, float]) -> None:
    if not limits[0] <= value <= limits[1]:
        raise InputError(f"{what} must lie between {limits[0]:g} and {limits[1]:g}, not {value:g}")
