"""The project of one clip: what is said, who says it, gestures over time, and corrections by hand."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType

from lexicon.dictionary import Dictionary, parse_dictionary
from lexicon.errors import InputError
from lexicon.ipa import Segment
from lexicon.json_values import check_type
from tts2face.exemplar.options import ExcludedToken
from tts2face.gesture.elements import Gains, check_feature
from tts2face.gesture.timeline import Timeline
from tts2face.models.palette import FEATURES
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.session_cache import Models
from tts2face.synthesis.phone_edges import SentenceEdges
from tts2face.synthesis.prepared_request import PreparedRequest, prepare

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
        Styles, expressions, nods, gaze, strengths and corrections over time.
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
        """Refuse unknown features, a long name, a second timeline and wrong pronunciations."""
        check_type("the name", self.name, str)
        if not self.name.strip() or len(self.name) > MAX_NAME:
            raise InputError(f"a project needs a name of 1 to {MAX_NAME} characters, not {self.name[:40]!r}")
        for feature in (*self.muted, *self.solo):
            check_feature(feature)
        if self.request.timeline is not None:
            raise InputError("a project has its own timeline; remove the timeline file from its request")
        object.__setattr__(self, "pronunciations", MappingProxyType(dict(self.pronunciations)))
        self.dictionary()

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
            if len(word.split()) != 1 or "#" in word:
                raise InputError(f"a pronunciation is for one word, not for {word[:40]!r}; give each word its own")
        lines = (f"{word} {written}" for word, written in self.pronunciations.items())
        return parse_dictionary("\n".join(lines), f"pronunciations of {self.name}")

    def prepare(self) -> PreparedRequest:
        """The request with all that the project adds, for every method of a session; raises as `prepare`."""
        prepared = prepare(self.request)
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

    def _entries(self, prepared: PreparedRequest) -> Mapping[str, tuple[Segment, ...]]:
        return {**prepared.dictionary, **self.dictionary().entries}
