"""Faces of those who must not be taken for the speaker beside them."""

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from lexicon.languages import language_code
from tts2face.request import Request
from tts2face.session.named_models import Models
from tts2face.sound.voice_pool import SHIPPED_VOICES, default_voice, find_voice, has_voice, is_installed, speaks

# Shipped faces of other speakers, by the sex of their voices.
_OTHER_FACES: Mapping[str, tuple[str, ...]] = MappingProxyType({"male": ("ben", "tomas"), "female": ("mara", "noor")})


def other_face(
    models: Models, request: Mapping[str, Any], number: int, *, keeps_face: bool = False
) -> tuple[Models, dict[str, Any]]:
    """Models and request of another speaker than the one that is shown with these; `number` counts such, from 1.

    An installed voice that speaks the language, of the other sex first, and a shipped face that goes with it.

    Parameters
    ----------
    keeps_face
        Whether only the voice is another one, for exports, which hold one face.
    """
    language = language_code(str(request.get("language", Request().language)))
    own = str(request.get("voice") or default_voice(language))
    usable = [name for name in SHIPPED_VOICES if name != own and speaks(name, language) and is_installed(name)]
    is_male = has_voice(own) and find_voice(own).sex == "male"
    wanted = "female" if is_male == (number % 2 == 1) else "male"
    voice = next((name for name in usable if find_voice(name).sex == wanted), usable[0] if usable else own)
    sex = find_voice(voice).sex if has_voice(voice) else wanted
    faces = [face for face in _OTHER_FACES[sex] if face != models.face]
    if not keeps_face:
        models = replace(models, face=faces[(number - 1) // 2 % len(faces)], identity=None, hair=None, hair_color=None)
    return models, {**request, "voice": voice}
