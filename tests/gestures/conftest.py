"""The made palette with recordings that are long enough for statistics."""

from collections.abc import Callable
from dataclasses import replace

import pytest

from tests.made_models import made_style
from tests.world import World
from tts2face.models.palette import Derivation, FeatureChange, Palette
from tts2face.models.palette_file import load_palette

LENGTHS = (90,) * 20  # frames


@pytest.fixture(scope="session")
def palette(world: World) -> Palette:
    """Styles "calm" and "wild", and "double", which is calm with a head that moves twice as far, and happier."""
    changes = {
        "head": FeatureChange(gain=2.0),
        "expression": FeatureChange(offset={"happy": 0.5}),
        "brows": FeatureChange(tempo=2.0),
    }
    styles = {"calm": made_style(1, lengths=LENGTHS), "wild": made_style(2, 3.0, LENGTHS)}
    return replace(world.palette, styles=styles, derivations={"double": Derivation("calm", changes, "calm, larger")})


@pytest.fixture(scope="session")
def starter_of() -> Callable[..., Palette]:
    """The starter palette with some of its features, whose motion is the same without the others."""

    def only(*features: str) -> Palette:
        starter = load_palette("starter")
        kept = {
            name: replace(style, motion={one: style.motion[one] for one in features})
            for name, style in starter.styles.items()
        }
        return replace(starter, styles=kept)

    return only
