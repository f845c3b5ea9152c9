"""Who speaks a line: its models and request by cast and table, and how speakers without a role differ."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

from lexicon.errors import InputError
from lexicon.languages import language_code
from tts2face.interchange.subtitles.cues import Cue
from tts2face.models.person import seed_of
from tts2face.request import DRAWN_FACE, Request
from tts2face.serving.batch.cast import MODEL_NAMES, REQUEST_NAMES, SILENT, Cast, Role
from tts2face.serving.batch.lines import NO_SETTINGS, Lines, LineSettings
from tts2face.session.named_models import Models
from tts2face.sound.fitting import Fitting, fitting_voice
from tts2face.sound.shipped_voices import SHIPPED_VOICES
from tts2face.sound.voice_pool import find_voice, has_voice, is_installed, speaks
from tts2face.source_options import AUTO

UNNAMED = "(no name)"
# Shipped faces of other speakers, by the sex of their voices.
_OTHER_FACES: Mapping[str, tuple[str, ...]] = MappingProxyType({"male": ("ben", "tomas"), "female": ("mara", "noor")})


@dataclass(frozen=True, slots=True)
class Casting:
    """Models and fields of the request of a line, and the number of its role, from 1; None without a role.

    `usual_rate` is the speaking rate of its role, or of the command, without that of the table of lines.
    """

    models: Models
    request: Mapping[str, Any]
    role: int | None
    other: int = 0  # counts the speakers of one cue who have no role, from the second one
    usual_rate: float = 1.0

    @property
    def seed(self) -> int:
        """Seed of the motion: the given one, or that of the face."""
        given = self.request.get("seed")
        return seed_of(self.models.description()) if given is None else int(given)


@dataclass(slots=True)
class Speakers:
    """Castings of the lines of one subtitle file.

    Parameters
    ----------
    request
        Fields of the command's request that differ from their defaults.
    names
        Name of the file with its ending, for the patterns of roles, and without, for the table.
    keeps_face
        Whether all have one face, as exports need it.
    on_unknown
        Called with a cue whose language is not known.
    """

    cast: Cast
    lines: Lines
    request: Mapping[str, Any]
    models: Models
    names: tuple[str, str]
    keeps_face: bool
    on_unknown: Callable[[Cue], None]
    used: set[int] = field(default_factory=set)
    _others: dict[tuple[int, int], int] = field(default_factory=dict)
    _castings: dict[tuple[int, int], Casting] = field(default_factory=dict)

    def tell_apart(self, group: Sequence[tuple[Cue, int]]) -> None:
        """Note the lines of one instant, with their parts: several speakers without a role do not look alike."""
        strangers: list[str] = []
        for number, (cue, part) in enumerate(group):
            # nobody says a sign, and a word without a length comes before the next one of the same person
            is_alone = (cue.has_estimated_end and not part) or (cue.kind and not self.is_spoken(cue, part))
            if is_alone or self.cast.role_of(cue, self.names[0]) is not None:
                continue
            who = cue.speaker or f"{number}"  # nobody without a name speaks twice at once
            if who not in strangers:
                strangers.append(who)
            self._others[(cue.number, part)] = strangers.index(who)

    def settings(self, cue: Cue, part: int) -> LineSettings:
        """Settings of a line in the table."""
        return self.lines.of(self.names[1], cue.number, part) if self.lines.settings else NO_SETTINGS

    def is_spoken(self, cue: Cue, part: int) -> bool:
        """Whether a line is spoken, by the table or its role; else all are but those that nobody says."""
        chosen = self.settings(cue, part).is_spoken
        if chosen is not None:
            return chosen
        role = self.cast.role_of(cue, self.names[0])
        if cue.kind and (role is None or SILENT not in role.settings):
            return False
        return not self.cast.is_silent(cue, self.names[0])

    def casting(self, cue: Cue, part: int) -> Casting:
        """Models and request of a line, without its words."""
        key = (cue.number, part)
        if key not in self._castings:
            self._castings[key] = self._made(cue, part)
        return self._castings[key]

    def _made(self, cue: Cue, part: int) -> Casting:
        role = self.cast.role_of(cue, self.names[0])
        self.used.add(id(role))
        request = dict(self.request)
        if cue.language and "language" not in request:
            request["language"] = self._language(cue)
        chosen = self.cast.settings(cue, self.names[0])
        request |= {name: value for name, value in chosen.items() if name in REQUEST_NAMES}
        request = {name: value for name, value in request.items() if value is not None}
        models, other = self._models(role), self._others.get((cue.number, part), 0)
        if other:
            models, request = other_face(models, request, other, keeps_face=self.keeps_face)
        line, usual = self.settings(cue, part), float(request.get("rate", 1.0))
        request |= {name: value for name, value in (("rate", line.rate), ("voice", line.voice)) if value is not None}
        return Casting(models, request, None if role is None else self.cast.roles.index(role) + 1, other, usual)

    def _language(self, cue: Cue) -> str | None:
        try:
            return language_code(str(cue.language))
        except InputError:
            self.on_unknown(cue)
            return None

    def _models(self, role: Role | None) -> Models:
        models = self.models
        for settings in (self.cast.default, role.settings if role else {}):
            chosen = {name: settings[name] for name in MODEL_NAMES if name in settings}
            # a haircut of one face does not fit another
            if chosen.get("face", models.face) != models.face:
                chosen = dict.fromkeys(("identity", "hair", "hair_color", "person")) | chosen  # they belong to a face
            elif models.face == DRAWN_FACE:
                chosen = {"face": ""} | chosen  # the one that the other settings belong to
            models = replace(models, **chosen)
        return models


def shown_name(speaker: str, casting: Casting | None) -> str:
    """Name of a speaker in a plan; of people without a name in one cue, with their number."""
    if speaker:
        return speaker
    return f"{UNNAMED} {casting.other + 1}" if casting is not None and casting.other else UNNAMED


def spoken_voice(models: Models, request: Mapping[str, Any]) -> Fitting:
    """Voice of a speaker: the chosen one, or the one that fits the face."""
    voice = request.get("voice")
    if voice not in (None, AUTO):
        return Fitting(str(voice))
    return fitting_voice(models.shown_person(), language_code(str(request.get("language", Request().language))))


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
    own = spoken_voice(models, request).name
    usable = [name for name in SHIPPED_VOICES if name != own and speaks(name, language) and is_installed(name)]
    is_male = has_voice(own) and find_voice(own).sex == "male"
    wanted = "female" if is_male == (number % 2 == 1) else "male"
    voice = next((name for name in usable if find_voice(name).sex == wanted), usable[0] if usable else own)
    sex = find_voice(voice).sex if has_voice(voice) else wanted
    faces = [face for face in _OTHER_FACES[sex] if face != models.face]
    if not keeps_face:
        models = replace(
            models, face=faces[(number - 1) // 2 % len(faces)], identity=None, hair=None, hair_color=None, person=None
        )
    return models, {**request, "voice": voice}
