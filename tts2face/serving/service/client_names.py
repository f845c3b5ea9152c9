"""Names of OpenAI and Kokoro for voices, models and speeds, and the nearest that the service has.

Whatever is replaced is named in the header `ADJUSTED` of the answer.
"""

import asyncio
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, TypeVar

from fastapi.responses import Response

from lexicon.errors import InputError
from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.languages import language_code
from lexicon.marked_text import RATE_LIMITS
from lexicon.text_language import guess_language
from tts2face.request import Request
from tts2face.serving.service.clip_options import OptionValues, check_voice, resolve_models
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.kokoro_text import with_marks
from tts2face.serving.service.library import CLIENT_MODELS
from tts2face.serving.service.state import ServiceState
from tts2face.session import catalogue
from tts2face.session.named_models import Models
from tts2face.session.prepared import reading_notes
from tts2face.sound.fitting import FORMANT_SYNTHESIS, fitting_voice
from tts2face.sound.voice_pool import find_voice
from tts2face.source_options import AUTO, AUTO_MARKUP

ADJUSTED = "X-Tts2face-Adjusted"
FEMALE, MALE = "female", "male"
READING_OPTIONS = {"text", "language", "markup", "style", "gestures", "text_marks"}  # that decide how a text is read
VOICE_NAMES = {"markup", "voice_pitch", "voice_range"}  # options of clips beside the fields of OpenAI
OPENAI_VOICES: Mapping[str, str] = MappingProxyType({
    "alloy": FEMALE, "ash": MALE, "ballad": MALE, "cedar": MALE, "coral": FEMALE, "echo": MALE, "fable": MALE,
    "marin": FEMALE, "nova": FEMALE, "onyx": MALE, "sage": FEMALE, "shimmer": FEMALE, "verse": MALE,
})  # fmt: skip
# Kokoro's voices are named by language, sex and a name: af_bella; several with weights: af_bella(2)+am_adam.
KOKORO_LANGUAGES: Mapping[str, str] = MappingProxyType({
    "a": "en-us", "b": "en-gb", "e": "es", "f": "fr-fr", "h": "hi", "i": "it", "j": "ja", "p": "pt-br", "z": "cmn",
})  # fmt: skip
KOKORO_EXAMPLES = ("af_bella", "af_heart", "am_adam", "bf_emma", "bm_george")  # of the names that lists show
_KOKORO = re.compile(rf"(?P<language>[{''.join(KOKORO_LANGUAGES)}])(?P<sex>[fm])(_[a-z0-9]{{1,30}})?")
_WEIGHTED = re.compile(r"(?P<name>[a-z0-9_]{1,40})(?:[(:](?P<weight>\d{0,6}(?:\.\d{1,6})?)\)?)?")
_UNSAFE = re.compile(r"[^A-Za-z0-9._+()/-]")
_MODEL = re.compile(rf"({'|'.join(CLIENT_MODELS)})(-\d{{4}}(-\d\d-\d\d)?)?")  # dated ones too: tts-1-hd-1106
Answer = TypeVar("Answer", bound=Response)
MAX_COMBINED = 20  # voices of a combination; further ones are left out
MAX_SHOWN = 60  # characters of a client's name in the header


@dataclass(slots=True)
class Adjustments:
    """The values that were replaced, and by which."""

    made: list[str] = field(default_factory=list)

    def note(self, what: str, given: object, used: object) -> None:
        """Note that something else is used than what was given; a client's characters cannot end the header."""
        if given != used:
            self.made.append(f"{what} {_UNSAFE.sub('_', str(given))[:MAX_SHOWN]} is {used}")

    def note_language(self, language: str) -> None:
        """Note the language that a text is taken for, unless it is the default one."""
        if language != DEFAULT_LANGUAGE:
            self.made.append(f"the language is {language}")

    async def note_words(self, state: ServiceState, options: OptionValues) -> None:
        """Note what of a text is not followed, words of other writing systems, and moods of the style auto."""
        fields = {name: value for name, value in options.request.items() if name in READING_OPTIONS}
        state.results.check_length(fields.get("text", ""))
        palette = options.models.get("palette", state.settings.palette)
        notes = await asyncio.to_thread(lambda: reading_notes(Request(**fields), palette))
        self.made += [_in_header(note) for note in notes]

    def note_fitted(self, models: Models, language: str) -> None:
        """Note the voice that fits the face, unless it is the usual one of the language."""
        fitting = fitting_voice(models.shown_person(), language_code(language))
        if fitting.sentence:
            self.note("voice", AUTO, fitting.described)

    def note_sounds(self, notes: Sequence[str]) -> None:
        """Note what is guessed of sounds that were sent; semicolons divide notes in the header."""
        self.made += [_in_header(note) for note in notes]

    def on(self, response: Answer) -> Answer:
        """An answer with the header that names them, if there are any."""
        if self.made:
            response.headers[ADJUSTED] = "; ".join(self.made)
        return response


def _in_header(note: str) -> str:
    """A note as the header can hold it: semicolons divide notes, and other letters than ASCII are left out."""
    return "".join(c if c.isascii() and c.isprintable() else "?" for c in note.replace(";", ","))


def is_client_model(name: str) -> bool:
    """Whether clients name the default talker so, perhaps with a date."""
    return _MODEL.fullmatch(name) is not None


def limited_rate(speed: float, adjustments: Adjustments) -> float:
    """A speed of 0.25 to 4 within the limits of the speaking rate."""
    rate = min(max(speed, RATE_LIMITS[0]), RATE_LIMITS[1])
    adjustments.note("speed", f"{speed:g}", f"{rate:g}")
    return rate


@dataclass(frozen=True, slots=True)
class _Kind:
    """Language and sex that the name of a voice promises."""

    language: str
    sex: str


def voice_kind(name: str) -> _Kind | None:
    """Language and sex of a voice of OpenAI or Kokoro, of several the one of most weight; None: it is none of theirs.

    Examples
    --------
    >>> voice_kind("bf_emma"), voice_kind("af_bella(1)+am_adam(2)").sex, voice_kind("heart")
    (_Kind(language='en-gb', sex='female'), 'male', None)
    """
    heaviest: tuple[float, _Kind] | None = None
    # Kokoro's clients combine voices: af_bella(2)+af_sky; none are mixed (decision 206)
    for part in (_WEIGHTED.fullmatch(named.strip()) for named in re.split(r"[+-]", name[:400])):
        kind = None if part is None else _single_kind(part["name"])
        if part is None or kind is None:
            return None
        weight = float(part["weight"] or 1)
        if heaviest is None or weight > heaviest[0]:
            heaviest = weight, kind
    return heaviest[1] if heaviest else None


def _single_kind(name: str) -> _Kind | None:
    if name in OPENAI_VOICES:
        return _Kind("en-gb" if name == "fable" else DEFAULT_LANGUAGE, OPENAI_VOICES[name])
    found = _KOKORO.fullmatch(name)
    return found and _Kind(KOKORO_LANGUAGES[found["language"]], FEMALE if found["sex"] == "f" else MALE)


def combined_name(voices: str | list[str]) -> str:
    """Name of a combination of voices of OpenAI and Kokoro, which stands for the one of most weight."""
    parts = voices.split("+") if isinstance(voices, str) else voices
    names = [name for part in parts[:MAX_COMBINED] if (name := "".join(part.split()))]
    if not names:
        raise InputError("there is no voice to combine; give names as af_bella+af_sky, or a list of them")
    for name in names:
        if voice_kind(name) is None:
            raise InputError(f"voice {name[:40]!r} cannot be combined; give voices as af_bella and bm_george")
    return "+".join(names)


def nearest_voice(kind: _Kind, language: str) -> str:
    """The installed voice that speaks a language, of the sex and accent if there is one; neural ones come first."""
    spoken = [voice for voice in catalogue.voices() if voice.is_installed and language in voice.languages]

    def distance(voice: catalogue.VoiceEntry) -> tuple[bool, bool, bool]:
        accent = find_voice(voice.name).accent
        return voice.sex != kind.sex, voice.engine == FORMANT_SYNTHESIS, accent not in ("", language)

    return min(spoken, key=distance).name if spoken else "espeak"


def choose_voice(name: str, language: str | None, text: str, adjustments: Adjustments) -> tuple[str, str]:
    """Voice and language of a text.

    Parameters
    ----------
    name
        A voice of the service, of OpenAI, or of Kokoro.
    language
        As the client gives it, also Kokoro's letter; None: that of the text, else of the voice.

    Raises
    ------
    RefusedError
        There is no such voice.
    InputError
        There is no such language.
    """
    kind = voice_kind(name)
    if kind is None:
        check_voice(name)
        spoken = next((voice.languages for voice in catalogue.voices() if voice.name == name), None)
        if language is None:
            guessed = guess_language(text)
            # the voice that fits a face speaks any language
            spoken = spoken or (guessed,)
            language = next((code for code in (guessed, DEFAULT_LANGUAGE) if code in spoken), spoken[0])
            adjustments.note_language(language)
        return name, KOKORO_LANGUAGES.get(language, language)
    if language is None:
        language = guess_language(text, kind.language)
        adjustments.note_language(language)
    language = KOKORO_LANGUAGES.get(language, language)
    voice = nearest_voice(kind, language_code(language))
    adjustments.note("voice", name, voice)
    return voice, language


async def choose_talker(state: ServiceState, key: ApiKey, model: str, adjustments: Adjustments) -> str | None:
    """A talker of this name; None, the default one, for any other name of a model."""
    if is_client_model(model):
        return None
    try:
        await resolve_models(state.library, key, {"talker": model})
    except RefusedError:
        adjustments.note("model", model, state.settings.talker)
        return None
    return model


async def spoken_fields(state: ServiceState, key: ApiKey, asked: Any, adjustments: Adjustments) -> dict[str, Any]:
    """Options of a clip for a request with OpenAI's fields (input, model, voice, speed, language) and `VOICE_NAMES`."""
    voice = asked.voice if isinstance(asked.voice, str) else str(asked.voice.get("id", ""))
    language = asked.language or asked.lang_code
    state.results.check_length(asked.input)
    more: dict[str, Any] = asked.model_dump(include=VOICE_NAMES, exclude_none=True)
    markup = more.get("markup", AUTO_MARKUP)
    text = with_marks(asked.input) if markup == AUTO_MARKUP else asked.input
    name, code = await asyncio.to_thread(choose_voice, voice, language, text, adjustments)
    talker = await choose_talker(state, key, asked.model, adjustments)
    given = {"text": text, "rate": limited_rate(asked.speed, adjustments), "voice": name, "language": code}
    return given | more | ({} if talker is None else {"talker": talker})
