"""``tts2face live``: a face that speaks to targets as it is given text, a recording or a microphone."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from cli.flags import (
    Face,
    Hair,
    HairColor,
    Palette,
    Person,
    Talker,
    add_option_flags,
    options_from_flags,
    switch,
)
from cli.photo import Consent, Photo, Yes, check_photo, face_of_photo, refuse_beside, refuse_without
from cli.process import WhatRemains, write_message
from cli.progress import compilation_messages
from cli.speak import open_session
from lexicon.errors import InputError, Tts2faceError
from lexicon.spoken_mark import mark_words
from tts2face.picture.options import Picture
from tts2face.processes.collection import resume_collection
from tts2face.request import Request, option_fields
from tts2face.session.named_models import Models
from tts2face.targets.table import TARGETS, parse_targets

if TYPE_CHECKING:
    from tts2face.targets.feeds import Feed

USUAL_MICROPHONE = "default"

# Options of a request that a live face does not take.
NOT_LIVE = frozenset({
    "text", "audio", "audio_map", "idle", "listen", "partner", "timeline", "expression", "synthesis", "context",
    "exemplars", "pitch", "articulation", "plain_delivery",
})  # fmt: skip
KINDS = ", ".join(f"{kind.form} ({kind.shows})" for kind in TARGETS)


@add_option_flags(("Speech and motion", Request), ("Picture", Picture), without=NOT_LIVE)
def live(  # noqa: PLR0913 - one parameter a flag
    text: Annotated[
        str | None,
        Parameter(
            help="Text to speak; by default read from standard input as it is written.", allow_leading_hyphen=True
        ),
    ] = None,
    /,
    *,
    to: Annotated[
        list[str] | None, Parameter(help=f"Where the face is sent; several times if wanted: {KINDS}.", negative="")
    ] = None,
    file: Annotated[Path | None, Parameter(help="Recording or film whose sound it speaks.")] = None,
    microphone: Annotated[
        str | None, Parameter(help="Microphone whose sound it speaks: default, or the name of a device.")
    ] = None,
    stay: Annotated[bool, switch("Go on when all has been said, until Ctrl-C.")] = False,
    talker: Talker = "grid_s1",
    face: Face = None,
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    person: Person = None,
    photo: Photo = None,
    consent: Consent = None,
    yes: Yes = False,
    palette: Palette = "starter",
    quiet: Annotated[bool, switch("Print no states of targets and no summary.")] = False,
    **options: Any,
) -> None:
    """Send a face that speaks live to other programs (docs/live.md)."""
    from tts2face.targets.broadcast import Broadcast, Listener, LivePlan
    from tts2face.targets.feeds import with_notice

    addresses = parse_targets(to or ())
    if not addresses:
        raise InputError(f"there is no target; add --to with one of {', '.join(kind.form for kind in TARGETS)}")
    fps = options_from_flags(Request, options, text="").fps  # a wrong option is refused before anything is loaded
    names = {option.name for option in option_fields(Request)} - {"fps", "spoken_mark"}
    spoken = {name: value for name, value in options.items() if name in names}
    picture = options_from_flags(Picture, options)
    plan = LivePlan(addresses, picture, spoken, fps, stays=stay or microphone is not None)
    targets, feed = plan.make_targets(), _feed(text, file, microphone, stay=stay)
    if (words := options.get("spoken_mark")) is not None:
        feed = with_notice(mark_words(words, options.get("language", "en-us")), feed)
    if photo is None:
        refuse_without({"--consent": consent})
    else:
        refuse_beside({"--face": face, "--identity": identity, "--hair": hair, "--hair-color": hair_color})
        check_photo(photo, {}, {})
        face = face_of_photo(photo, consent, quiet=quiet)
    models = Models(talker, face or "", identity, palette, hair, hair_color, person)
    unspoken: list[Tts2faceError] = []

    def warn(error: Tts2faceError) -> None:
        unspoken.append(error)
        write_message(f"tts2face: {error}")

    broadcast = Broadcast(plan, targets, Listener(lambda state: _show(state.sentence, quiet), warn))
    with compilation_messages(quiet):
        session = open_session(models, draws=any(target.draws for target in targets))
    resume_collection()
    try:
        broadcast.run(session, feed)
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(WhatRemains("the connections to the targets have been closed"))
        raise
    seconds = broadcast.n_frames / fps
    _show(f"sent {seconds:.1f} s, {broadcast.n_frames} frames, of which {broadcast.n_late} had no new picture", quiet)
    if unspoken:
        raise InputError("not all has been spoken; the messages above say why")


def _feed(text: str | None, file: Path | None, microphone: str | None, *, stay: bool) -> "Feed | None":
    """Source of the speech: a text, a recording, a microphone, or standard input; None without any."""
    from tts2face.targets.feeds import growing_feed, microphone_feed, recording_feed, text_feed

    sources = {"a text": text, "--file": file, "--microphone": microphone}
    given = [name for name, source in sources.items() if source is not None]
    if len(given) > 1:
        raise InputError(f"{given[0]} cannot be combined with {given[1]}; remove one of them")
    if file is not None:
        return recording_feed(file)
    if microphone is not None:
        return microphone_feed("" if microphone == USUAL_MICROPHONE else microphone)
    # "-" is standard input, by custom
    if text is not None and text != "-":
        return text_feed(text)
    is_typed = text is None and sys.stdin.isatty()
    if is_typed and not stay:
        raise InputError("there is nothing to say; add a text, --file, --microphone, or --stay for a silent face")
    return None if is_typed else growing_feed(sys.stdin.fileno(), may_be_empty=stay)


def _show(sentence: str, quiet: bool) -> None:
    if not quiet:
        write_message(sentence)
