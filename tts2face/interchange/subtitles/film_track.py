"""Tracks of subtitles in films (Matroska, MP4, MOV, WebM), read by PyAV."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.interchange.subtitles.blocks import with_voice
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP, SUBRIP_MARKUP, SUBSTATION_MARKUP, WEBVTT_MARKUP, Markup
from tts2face.interchange.subtitles.substation import packet_cue
from tts2face.video.container import open_container

_TEXT = {
    "subrip": SUBRIP_MARKUP, "srt": SUBRIP_MARKUP, "text": SUBRIP_MARKUP, "webvtt": WEBVTT_MARKUP,
    "mov_text": PLAIN_MARKUP, "ass": SUBSTATION_MARKUP, "ssa": SUBSTATION_MARKUP,
}  # fmt: skip
_PICTURES = frozenset({"hdmv_pgs_subtitle", "dvd_subtitle", "dvb_subtitle", "xsub"})
# Codes of ISO 639-2, as films have them, by those of ISO 639-1.
_SHORT = {
    "eng": "en", "ger": "de", "deu": "de", "fre": "fr", "fra": "fr", "spa": "es", "ita": "it", "por": "pt",
    "dut": "nl", "nld": "nl", "swe": "sv", "dan": "da", "nor": "nb", "nob": "nb", "fin": "fi", "pol": "pl",
    "cze": "cs", "ces": "cs", "slo": "sk", "slk": "sk", "slv": "sl", "hun": "hu", "rum": "ro", "ron": "ro",
    "hrv": "hr", "srp": "sr", "bul": "bg", "rus": "ru", "ukr": "uk", "gre": "el", "ell": "el", "tur": "tr",
    "heb": "he", "ara": "ar", "per": "fa", "fas": "fa", "vie": "vi", "tha": "th", "jpn": "ja", "kor": "ko",
    "chi": "zh", "zho": "zh", "cmn": "zh", "yue": "zh", "est": "et", "lav": "lv", "lit": "lt", "ice": "is", "isl": "is",
    "cat": "ca", "hin": "hi", "ind": "id", "glg": "gl", "baq": "eu", "eus": "eu", "wel": "cy", "cym": "cy",
}  # fmt: skip
SECONDS = 1_000_000  # units of the times of a container


@dataclass(frozen=True, slots=True)
class Film:
    """Length of a film or recording and its frames a second, as it states them; None where it does not."""

    seconds: float | None = None
    fps: float | None = None


def film_facts(path: Path) -> Film:
    """Length and rate of a film or recording; none of a file that cannot be read as one."""
    try:
        with open_container(path) as container:
            video = next(iter(container.streams.video), None)
            rate = None if video is None else video.average_rate
            return Film(container.duration / SECONDS if container.duration else None, float(rate) if rate else None)
    except (InputError, DataError, ValueError):
        return Film()


def has_text_track(path: Path) -> bool:
    """Whether a file is a film with a track of subtitles of text."""
    try:
        with open_container(path) as container:
            return any(_codec(stream) in _TEXT for stream in container.streams.subtitles)
    except (InputError, DataError, ValueError):
        return False


def read_film(
    path: Path, language: str | None, track: str | None
) -> tuple[list[WrittenCue], list[SubtitleWarning], float | None]:
    """Cues of a track of subtitles, warnings with the track that is chosen, and the length of the film."""
    import av

    try:
        with av.open(str(path)) as container:
            stream, warnings = _choose(container.streams.subtitles, path, language, track)
            markup = _TEXT[_codec(stream)]
            starts = [
                float(other.start_time * other.time_base)
                for other in (*container.streams.video, *container.streams.audio)
                if other.start_time is not None and other.time_base is not None
            ]
            cues = _cues(container.demux(stream), _codec(stream), markup, min(starts, default=0.0))
            film_s = container.duration / SECONDS if container.duration else None
    except (OSError, ValueError) as broken:
        if isinstance(broken, (InputError, DataError)):
            raise
        raise DataError(f"{path} cannot be read as a film ({broken}); check the file") from broken
    return cues, warnings, film_s


def _codec(stream: Any) -> str:
    return str(stream.codec_context.name if stream.codec_context is not None else "")


def _shown(number: int, stream: Any) -> str:
    title = stream.metadata.get("title", "")
    return f"{number} ({stream.language or 'no language'}{', ' + title[:40] if title else ''}, {_codec(stream)})"


def _choose(
    streams: Sequence[Any], path: Path, language: str | None, track: str | None
) -> tuple[Any, list[SubtitleWarning]]:
    """The track of a number or language, else the one of the words' language, else the default or first one."""
    texts = [(number, stream) for number, stream in enumerate(streams, start=1) if _codec(stream) in _TEXT]
    if not streams:
        raise DataError(f"{path} is a film without a track of subtitles; give a file of subtitles")
    shown = ", ".join(_shown(number, stream) for number, stream in enumerate(streams, start=1))
    if not texts:
        pictures = all(_codec(stream) in _PICTURES for stream in streams)
        reason = "hold pictures, no text" if pictures else "are of a kind that is not read"
        raise DataError(f"the tracks of subtitles in {path} {reason}: {shown}; give a file of subtitles")
    if track is not None:
        for number, stream in texts:
            if track == str(number) or _is_language(stream, track):
                return stream, [] if len(streams) == 1 else [_choice(number, shown)]
        raise InputError(f"there is no track {track!r} of text in {path}, which has {shown}")
    wanted = [stream for stream in texts if language and _is_language(stream[1], language)]
    full = [stream for stream in wanted or texts if not _is_forced(stream[1])]
    number, stream = next(iter(full or wanted or texts))
    return stream, [] if len(streams) == 1 else [_choice(number, shown)]


def _choice(number: int, shown: str) -> SubtitleWarning:
    return SubtitleWarning(1, f"the film has the tracks {shown}; track {number} is read, --track names another one")


def _is_forced(stream: Any) -> bool:
    """Whether a track holds only what all viewers see, as translations of foreign words."""
    import av

    forced = getattr(av.stream.Disposition, "forced", None)
    return bool(forced is not None and stream.disposition & forced)


def _is_language(stream: Any, language: str) -> bool:
    """Whether a track, with a code of three letters, is of a language."""
    own, wanted = (stream.language or "").casefold(), language.casefold().partition("-")[0]
    return bool(own) and (own == wanted or _SHORT.get(own, own) == _SHORT.get(wanted, wanted))


def _cues(packets: Any, codec: str, markup: Markup, start_s: float) -> list[WrittenCue]:
    cues = []
    for number, packet in enumerate(packets, start=1):
        if packet.pts is None or not packet.size:
            continue
        start = float(packet.pts * packet.time_base) - start_s
        end = start + float(packet.duration * packet.time_base) if packet.duration else None
        content = bytes(packet)
        if codec == "mov_text":
            content = content[2 : 2 + int.from_bytes(content[:2], "big")]
        text = content.decode("utf-8", errors="replace").replace("\r\n", "\n").strip("\0\n")
        if markup is SUBSTATION_MARKUP:
            cue = packet_cue(text, start, end, number)
            cues += [] if cue is None else [cue]
        elif text.strip():
            cue = WrittenCue(start, end, text, number, markup=markup)
            cues.append(with_voice(cue) if codec == "webvtt" else cue)
    return cues
