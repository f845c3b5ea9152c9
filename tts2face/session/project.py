"""The project of one clip: its request and models, gestures over time, and corrections by hand.

Corrections that no longer belong to a changed text, voice or recording are removed; styles that a palette renames are
renamed.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from lexicon.dictionary import Dictionary, parse_dictionary
from lexicon.errors import InputError
from lexicon.ipa import IpaPhone
from lexicon.values.fields import check_fields
from tts2face.gestures.elements import Gains, StyleSpan, check_feature
from tts2face.gestures.timeline import Timeline, parse_style
from tts2face.lips.options import ExcludedToken
from tts2face.models.palette import FEATURES
from tts2face.models.person import seed_of
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.corrections import SentenceEdges
from tts2face.session.named_models import Models
from tts2face.session.prepared import PreparedRequest, prepare
from tts2face.source_options import is_auto

MAX_NAME = 200


@dataclass(frozen=True, slots=True)
class Project:
    """Everything from which a clip is made.

    Parameters
    ----------
    name
        Title for people.
    request
        Text or recording, voice, seed and methods. Its dictionary takes part; its timeline is `timeline`.
    models, picture
        Talker, face, hair and palette by name or path; drawing options.
    timeline
        Styles, expressions, gestures, gaze, strengths and corrections over time.
    pronunciations
        Written words with ARPABET names or IPA between slashes, as in a dictionary; they precede the request's.
    edges
        Corrected phone edges.
    excluded
        Recorded examples of the talker that are not used.
    muted, solo
        Features that do not move; features besides which no other one moves, if there are any.

    Raises
    ------
    InputError
        A feature is unknown, the name is no text or too long, or the request has a timeline file.
    DataError
        A pronunciation is invalid.
    """

    name: str = "untitled"
    request: Request = field(default_factory=lambda: Request(text=""))
    models: Models = field(default_factory=Models)
    picture: Picture = field(default_factory=Picture)
    timeline: Timeline = field(default_factory=Timeline)
    pronunciations: Mapping[str, str] = field(default_factory=dict)
    edges: tuple[SentenceEdges, ...] = ()
    excluded: tuple[ExcludedToken, ...] = ()
    muted: frozenset[str] = frozenset()
    solo: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        """Refuse other types, unknown features, a long name, a second timeline and wrong pronunciations."""
        check_fields(self)
        if not self.name.strip() or len(self.name) > MAX_NAME:
            raise InputError(f"a project needs a name of 1 to {MAX_NAME} characters, not {self.name[:40]!r}")
        for feature in (*self.muted, *self.solo):
            check_feature(feature)
        if self.request.timeline is not None:
            raise InputError("a project has its own timeline; remove the timeline file from its request")
        object.__setattr__(self, "pronunciations", MappingProxyType(dict(self.pronunciations)))
        self.dictionary()

    @property
    def seed(self) -> int:
        """Seed of its motion: that of the request, or of the face; raises as `Session`."""
        return seed_of(self.models.description()) if self.request.seed is None else self.request.seed

    @property
    def silent_features(self) -> frozenset[str]:
        """Features that do not move: the muted ones, and all others where some are solo."""
        others = frozenset(FEATURES) - self.solo if self.solo else frozenset()
        return self.muted | others

    def dictionary(self) -> Dictionary:
        """The project's own pronunciations.

        Raises
        ------
        DataError
            A pronunciation is invalid; the message names the word.
        """
        for word in self.pronunciations:
            # dictionaries have a word a line, and comments after #
            if len(word.split()) != 1 or "#" in word:
                raise InputError(f"a pronunciation is for one word, not for {word[:40]!r}; give each word its own")
        lines = (f"{word} {written}" for word, written in self.pronunciations.items())
        return parse_dictionary("\n".join(lines), f"pronunciations of {self.name}")

    def prepare(self) -> PreparedRequest:
        """The request with all that the project adds, for every method of a session; raises as `prepare`."""
        prepared = prepare(self.request, self.models.shown_person())
        if not self.request.has_gestures:
            return replace(prepared, dictionary=self._entries(prepared), edges=self.edges, excluded=self.excluded)
        silent = Timeline(gains=Gains(dict.fromkeys(self.silent_features, 0.0)))
        return replace(
            prepared,
            timeline=prepared.timeline.merge(self.timeline).merge(silent),
            dictionary=self._entries(prepared),
            edges=self.edges,
            excluded=self.excluded,
        )

    def _entries(self, prepared: PreparedRequest) -> Mapping[str, tuple[IpaPhone, ...]]:
        return {**prepared.dictionary, **self.dictionary().entries}


def without_edges(project: Project, sentences: Collection[tuple[str, int]]) -> Project:
    """The project without the corrected edges of some sentences, each a text and its occurrence."""
    return replace(
        project, edges=tuple(edges for edges in project.edges if (edges.text, edges.occurrence) not in set(sentences))
    )


def cut_timeline(project: Project, duration: float) -> Project:
    """The project with its timeline cut to `duration` seconds."""
    return replace(project, timeline=project.timeline.restrict(0.0, duration))


def used_styles(project: Project) -> frozenset[str]:
    """Names of the styles that a project's timeline and request name."""
    style = project.request.style
    asked = parse_style(style).values() if style and not is_auto(style) else ()
    return frozenset([*(span.style for span in project.timeline.spans), *asked])


def rename_style(project: Project, name: str, new: str) -> Project:
    """The project with another name for a style."""
    spans = tuple(replace(span, style=new) if span.style == name else span for span in project.timeline.spans)
    return _changed(project, spans, lambda style: new if style == name else style)


def drop_style(project: Project, name: str) -> Project:
    """The project without what is painted in a style: there it has its default style."""
    spans = tuple(span for span in project.timeline.spans if span.style != name)
    return _changed(project, spans, lambda style: None if style == name else style)


def _changed(project: Project, spans: tuple[StyleSpan, ...], change: Callable[[str], str | None]) -> Project:
    timeline = replace(project.timeline, spans=spans)
    if not project.request.style or is_auto(project.request.style):
        return replace(project, timeline=timeline)
    named = {feature: change(style) for feature, style in parse_style(project.request.style).items()}
    written = ",".join(f"{feature}={style}" for feature, style in named.items() if style is not None)
    return replace(project, timeline=timeline, request=replace(project.request, style=written or None))
