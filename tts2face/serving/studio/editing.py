"""Edits of a project, as a page sends them: pure, without files, clock and pages.

An edit is a JSON object with a ``kind`` and the fields of `EDITS`, from which ``components/protocol.js`` is made.
A new kind of edit:

1. a function of the project, the fields and the sentences, which returns the changed project;
2. a row of `EDITS` with the types of its fields; if it adds or removes elements of a timeline, with their kind;
3. ``python -m tts2face.serving.studio.protocol``, and a component that emits ``EDITS.name({...})``.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from lexicon.errors import InputError
from lexicon.sequence import PhoneSequence
from lexicon.values.checks import check_type, is_number
from tts2face.gestures.elements import Gesture, StyleSpan, check_feature
from tts2face.gestures.kinds import KINDS, ElementKind
from tts2face.gestures.timeline import Timeline, expand_feature
from tts2face.lips.options import ExcludedToken
from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.session.corrections import SentenceEdges
from tts2face.session.named_models import Models
from tts2face.session.project import Project

MIN_PHONE_S = 0.01  # shortest phone that dragging an edge leaves: a frame of the alignment
NEAR_S = 0.05  # within which a gesture is the one at a time
Edit = Mapping[str, Any]
Sentences = Mapping[tuple[str, int], PhoneSequence]  # phones of each sentence by its text and occurrence
Change = Callable[[Project, Edit, Sentences], Project]
_SPAN = {"start": float, "end": float}
_USUAL = float | None  # of a field that may be missing, or null: its usual value
_TIME = {"time": float}
_LANE = {"feature": str, "on": bool}
_SENTENCE = {"text": str, "occurrence": int}
_OPTIONS = {"options": dict}
_GAZE, _LISTENS = KINDS["gaze"], KINDS["listens"]


def apply(project: Project, edit: Edit, sentences: Sentences | None = None) -> Project:
    """The project after an edit.

    Parameters
    ----------
    sentences
        Phones of the sentences as they are shown, which only dragged edges need.

    Raises
    ------
    InputError, DataError
        There is no such kind of edit, a field is missing or has the wrong type, or its value is refused.
    """
    kind = edit.get("kind")
    if not isinstance(kind, str) or kind not in EDITS:
        raise InputError(f"there is no edit {str(kind)[:40]!r}; choose one of {', '.join(EDITS)}")
    given = {name: _checked(kind, name, wanted, edit) for name, wanted in EDITS[kind].fields.items()}
    return EDITS[kind].change(project, given, sentences or {})


def _checked(kind: str, name: str, wanted: Any, edit: Edit) -> Any:
    """Value of a field; a missing or empty ``end`` is the end of the clip."""
    if wanted == _USUAL:
        return None if edit.get(name) is None else check_type(f"{name} of the edit {kind}", edit[name], float)
    if name == "end" and edit.get(name) is None:
        return math.inf
    if name not in edit:
        raise InputError(f"the edit {kind} needs {name}; send it")
    return check_type(f"{name} of the edit {kind}", edit[name], wanted)


def _paint(project: Project, given: Edit, _: Sentences) -> Project:
    spans = tuple(
        StyleSpan(feature, given["style"], max(0.0, given["start"]), given["end"])
        for feature in expand_feature(given["feature"])
    )
    return _timed(project, spans=KINDS["spans"].merged(project.timeline.spans, spans))


def _erase(project: Project, given: Edit, _: Sentences) -> Project:
    features = expand_feature(given["feature"])
    kept = [span for span in project.timeline.spans if span.feature not in features]
    for feature in features:
        own = [span for span in project.timeline.spans if span.feature == feature]
        for start, end in ((-1.0, given["start"]), (given["end"], math.inf)):
            kept += KINDS["spans"].restricted(own, start, end)
    return _timed(project, spans=tuple(kept))


def _curve(kind: ElementKind, project: Project, given: Edit, _: Sentences) -> Project:
    """Replace the curve of a lane, or remove it if there are no keys."""
    keys = given["keys"]
    if not all(
        isinstance(key, list | tuple) and len(key) == 2 and all(is_number(number) for number in key) for key in keys
    ):
        raise InputError("keys must be a list of [seconds, value]")
    kept = [curve for curve in getattr(project.timeline, kind.name) if kind.lane(curve) != given[kind.owner]]
    made = [kind.record(given[kind.owner], tuple(map(tuple, keys)))] if keys else []
    return _timed(project, **{kind.name: (*kept, *made)})


def _gesture(project: Project, given: Edit, _: Sentences) -> Project:
    """Add a gesture, which replaces one of its name beside it."""
    made = Gesture(**given)
    return _timed(project, gestures=(*_without_gesture(project, made.time, made.name), made))


def _remove_gesture(project: Project, given: Edit, _: Sentences) -> Project:
    kept = _without_gesture(project, given["time"], given["name"])
    if len(kept) == len(project.timeline.gestures):
        raise InputError(f"there is no {given['name'][:40]} at {given['time']:.2f} s; click on one")
    return _timed(project, gestures=kept)


def _without_gesture(project: Project, time: float, name: str) -> tuple[Gesture, ...]:
    """Gestures but the nearest one of a name within `NEAR_S`: a page knows times to the pixel."""
    gestures = project.timeline.gestures
    near = [gesture for gesture in gestures if gesture.name == name and abs(gesture.time - time) < NEAR_S]
    gone = min(near, key=lambda gesture: abs(gesture.time - time), default=None)
    return tuple(gesture for gesture in gestures if gesture is not gone)


def _place(kind: ElementKind, project: Project, given: Edit, _: Sentences) -> Project:
    """Add a span that replaces those of its lane under it."""
    element = kind.record(**dict(given) | {"start": max(0.0, given["start"])})
    return _timed(project, **{kind.name: kind.merged(getattr(project.timeline, kind.name), (element,))})


def _remove_span(kind: ElementKind, what: str, project: Project, given: Edit, _: Sentences) -> Project:
    spans = getattr(project.timeline, kind.name)
    kept = tuple(span for span in spans if not span.start <= given["time"] < span.end)
    if len(kept) == len(spans):
        raise InputError(f"there is no {what} at {given['time']:.2f} s; click on one")
    return _timed(project, **{kind.name: kept})


def _mute(project: Project, given: Edit, _: Sentences) -> Project:
    return replace(project, muted=_toggled(project.muted, given))


def _solo(project: Project, given: Edit, _: Sentences) -> Project:
    return replace(project, solo=_toggled(project.solo, given))


def _toggled(features: frozenset[str], given: Edit) -> frozenset[str]:
    feature = check_feature(given["feature"])
    return features | {feature} if given["on"] else features - {feature}


def _seed(project: Project, given: Edit, _: Sentences) -> Project:
    seeds = {**project.timeline.seeds, **dict.fromkeys(expand_feature(given["feature"]), given["seed"])}
    return _timed(project, seeds=seeds)


def _edge(project: Project, given: Edit, sentences: Sentences) -> Project:
    sentence, index = (given["text"], given["occurrence"]), given["index"]
    phones = sentences.get(sentence)
    if phones is None:
        raise InputError(
            f"there is no sentence {given['text'][:40]!r} in the clip; wait until it is made, and try again"
        )
    edges = phones.edges.tolist()
    if not 0 < index < len(edges) - 1:
        raise InputError(
            f"edge {index} of a sentence cannot move; choose one between two phones, 1 to {len(edges) - 2}"
        )
    low, high = edges[index - 1] + MIN_PHONE_S, edges[index + 1] - MIN_PHONE_S
    if low > high:
        raise InputError("the two phones are too short to move the edge between them; move a neighbouring edge first")
    edges[index] = min(max(given["time"], low), high)
    others = tuple(edge for edge in project.edges if (edge.text, edge.occurrence) != sentence)
    return replace(project, edges=(*others, SentenceEdges(*sentence, phones.phones, tuple(edges))))


def _reset_edges(project: Project, given: Edit, _: Sentences) -> Project:
    sentence = (given["text"], given["occurrence"])
    return replace(project, edges=tuple(edge for edge in project.edges if (edge.text, edge.occurrence) != sentence))


def _pronounce(project: Project, given: Edit, _: Sentences) -> Project:
    word, phones = given["word"].strip(), given["phones"].strip()
    others = {
        pronunciation: written
        for pronunciation, written in project.pronunciations.items()
        if pronunciation.lower() != word.lower()
    }
    return replace(project, pronunciations=others | ({word: phones} if phones else {}))


def _exclude(project: Project, given: Edit, _: Sentences) -> Project:
    token = ExcludedToken(given["utterance"], given["start"])
    others = tuple(kept for kept in project.excluded if kept != token)
    return replace(project, excluded=(*others, token) if given["on"] else others)


def _request(project: Project, given: Edit, _: Sentences) -> Project:
    return replace(project, request=_with_options(project.request, given["options"], Request))


def _models(project: Project, given: Edit, _: Sentences) -> Project:
    models = _with_options(project.models, given["options"], Models)
    excluded = project.excluded if models.talker == project.models.talker else ()  # they are the talker's
    return replace(project, models=models, excluded=excluded)


def _picture(project: Project, given: Edit, _: Sentences) -> Project:
    return replace(project, picture=_with_options(project.picture, given["options"], Picture))


def _with_options(options: Any, given: Edit, kind: type) -> Any:
    known = [field.name for field in option_fields(kind)]
    for name in given:
        if name not in known:
            raise InputError(f"there is no option {str(name)[:40]!r}; choose {', '.join(known)}")
    return replace(options, **given)


def _name(project: Project, given: Edit, _: Sentences) -> Project:
    return replace(project, name=given["name"].strip())


def _timed(project: Project, **changes: Any) -> Project:
    timeline: Timeline = replace(project.timeline, **changes)
    return replace(project, timeline=timeline)


@dataclass(frozen=True, slots=True)
class EditKind:
    """A kind of edits.

    Parameters
    ----------
    fields
        Names and types of its fields.
    change
        What it changes.
    adds, removes
        Kind of the elements of the timeline (`KINDS`) that it adds or removes; a curve is set as a whole.
    """

    fields: Mapping[str, Any]
    change: Change
    adds: str = ""
    removes: str = ""


EDITS: Mapping[str, EditKind] = {
    "paint": EditKind({"feature": str, "style": str, **_SPAN}, _paint, adds="spans"),
    "erase": EditKind({"feature": str, **_SPAN}, _erase, removes="spans"),
    **{
        edit: EditKind({KINDS[name].owner: str, "keys": list}, partial(_curve, KINDS[name]), adds=name)
        for edit, name in (("curve", "curves"), ("strength", "strengths"), ("channel", "edits"))
    },
    "gesture": EditKind(
        {"time": float, "name": str, "size": float, "seconds": _USUAL, "down_deg": _USUAL, "left_deg": _USUAL},
        _gesture,
        adds="gestures",
    ),
    "remove_gesture": EditKind({**_TIME, "name": str}, _remove_gesture, removes="gestures"),
    "gaze": EditKind({**_SPAN, "down_deg": float, "left_deg": float}, partial(_place, _GAZE), adds="gaze"),
    "remove_gaze": EditKind(_TIME, partial(_remove_span, _GAZE, "gaze target"), removes="gaze"),
    "listen": EditKind(_SPAN, partial(_place, _LISTENS), adds="listens"),
    "remove_listen": EditKind(_TIME, partial(_remove_span, _LISTENS, "listening span"), removes="listens"),
    "mute": EditKind(_LANE, _mute),
    "solo": EditKind(_LANE, _solo),
    "seed": EditKind({"feature": str, "seed": int}, _seed),
    "edge": EditKind({**_SENTENCE, "index": int, "time": float}, _edge),
    "reset_edges": EditKind(_SENTENCE, _reset_edges),
    "pronounce": EditKind({"word": str, "phones": str}, _pronounce),
    "exclude": EditKind({"utterance": str, "start": float, "on": bool}, _exclude),
    "request": EditKind(_OPTIONS, _request),
    "models": EditKind(_OPTIONS, _models),
    "picture": EditKind(_OPTIONS, _picture),
    "name": EditKind({"name": str}, _name),
}
