"""New projects: from a text, a recording, subtitles, a project file, or as an example."""

import asyncio
import shutil
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

from lexicon.errors import DataError, InputError
from lexicon.values.json_text import parse_json
from tts2face.gestures.elements import StyleSpan
from tts2face.gestures.timeline import Timeline
from tts2face.interchange.subtitles.decoding import read_text
from tts2face.interchange.subtitles.formats import SUFFIXES, is_subtitle_text
from tts2face.interchange.subtitles.options import SubtitleOptions
from tts2face.interchange.subtitles.reader import read_subtitles
from tts2face.interchange.transcripts.reader import PLAIN_SUFFIXES, READERS, find_reader_of_text
from tts2face.interchange.transcripts.written_words import BY_LINES, WrittenWords, read_written_words
from tts2face.request import Request
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.uploads import MAX_TEXT_BYTES, MAX_TRANSCRIPT_BYTES
from tts2face.serving.studio.requests import check_project
from tts2face.serving.studio.studio_host import StudioHost
from tts2face.serving.work.uploaded_file import SOUND, SUBTITLES, FileOrder
from tts2face.session.project import MAX_NAME, Project

SOUND_SUFFIXES = (
    ".wav", ".mp3", ".ogg", ".oga", ".opus", ".flac", ".aac", ".m4a", ".mp4", ".mov", ".webm", ".mkv", ".aiff",
    ".ts", ".mpg", ".mpeg", ".avi", ".m4v", ".ac3", ".wma", ".caf",
)  # fmt: skip
TEXT_SUFFIXES = (".txt", ".ssml", ".md")
RECORDING = "recording.wav"
SAMPLE_TEXT = "Hello! This face was learnt from a real talker. Paint a style on the timeline, and watch it change."
SAMPLE_TIMELINE = Timeline(
    spans=(StyleSpan("expression", "delighted", 0.0, 1.6), StyleSpan("head", "delighted", 0.0, 3.0))
)


async def import_text(studio: StudioHost, key: ApiKey, text: str, name: str = "") -> str:
    """Id of a new project that speaks a text, with marks or SSML."""
    if len(text) > studio.state.settings.text_characters:
        raise InputError(f"the text has more than {studio.state.settings.text_characters} characters; divide it")
    project = Project(name=_title(name or text), request=Request(text=text))
    return await studio.create(key, project)


async def import_sample(studio: StudioHost, key: ApiKey) -> str:
    """Id of a new project that shows what the studio does."""
    return await studio.create(
        key, Project(name="Example", request=Request(text=SAMPLE_TEXT), timeline=SAMPLE_TIMELINE)
    )


@dataclass(frozen=True, slots=True)
class Imported:
    """Id of a new project, and what was guessed of its file and is not spoken."""

    project: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class ImportChoices:
    """How a file is read: words of a recording if they are known; encoding and other choices of subtitles.

    ``tier`` names the tier of the words in a TextGrid or another file of tiers.
    """

    transcript: str = ""
    encoding: str | None = None
    subtitles: SubtitleOptions = field(default_factory=SubtitleOptions)
    tier: str | None = None


NO_CHOICES = ImportChoices()


async def import_file(
    studio: StudioHost, key: ApiKey, path: Path, name: str, choices: ImportChoices = NO_CHOICES
) -> Imported:
    """A new project from an uploaded file, whose ending says what it is.

    Parameters
    ----------
    path
        The file as it came.
    name
        Its name at the client.
    """
    suffix, title = Path(name).suffix.lower(), _title(Path(name).stem)
    if suffix == ".json" and not await asyncio.to_thread(_holds_words, path, name):
        return Imported(await _import_project(studio, key, path))
    is_text = suffix in READERS or suffix in TEXT_SUFFIXES
    is_by_lines = is_text and suffix not in PLAIN_SUFFIXES and await asyncio.to_thread(_holds_subtitles, path, name)
    if is_text and not is_by_lines:
        words = await asyncio.to_thread(_timed_words, path, name, choices.tier)
        if words is not None:
            return Imported(await import_text(studio, key, words.text, title), words.notes)
        return Imported(await import_text(studio, key, _read_text(path, name), title))
    if suffix in SUFFIXES or is_by_lines:
        suffix = suffix if suffix in SUFFIXES else ".srt"  # its lines show which subtitles
        async with _decoded(studio.state, key, (SUBTITLES, path, suffix), choices.encoding) as (checked, _):
            read = await asyncio.to_thread(read_subtitles, checked, choices.encoding, choices.subtitles)
        text = "\n".join(cue.text for cue in read.cues if cue.text)
        stated = (BY_LINES,) if is_by_lines else ()
        notes = (*stated, *(f"line {note.line}: {note.message}" for note in (*read.warnings, *read.notes)))
        return Imported(await import_text(studio, key, text, title), notes)
    if suffix in SOUND_SUFFIXES:
        async with _decoded(studio.state, key, (SOUND, path, ".wav")) as (checked, guessed):
            words = await asyncio.to_thread(_words_of_text, choices.transcript, choices.tier)
            text, notes = (choices.transcript, ()) if words is None else (words.text, words.notes)
            return Imported(await add_recording(studio, key, checked, title, text), (*guessed, *notes))
    kinds = (*TEXT_SUFFIXES, *READERS, *SUFFIXES, *SOUND_SUFFIXES)
    raise InputError(f"a file {name[-40:]!r} cannot be imported; give one that ends in {', '.join(kinds)}")


def _holds_subtitles(path: Path, name: str) -> bool:
    """Whether the lines of an uploaded text are those of subtitles."""
    _check_size(path, name)
    try:
        return Path(name).suffix.lower() not in READERS and is_subtitle_text(read_text(path))
    except DataError:
        return False  # said where it is read


def _holds_words(path: Path, name: str) -> bool:
    """Whether an uploaded JSON is that of a recogniser of speech, and no project."""
    _check_size(path, name)
    try:
        return find_reader_of_text(read_text(path)) is not None
    except DataError:
        return False  # said where it is read


def _timed_words(path: Path, name: str, tier: str | None) -> WrittenWords | None:
    """Words of an uploaded file of another program; None for plain text."""
    _check_size(path, name)
    suffix = Path(name).suffix.lower()
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        named = Path(folder, f"transcript{suffix}")
        shutil.copyfile(path, named)
        try:
            return read_written_words(named, tier)
        except (DataError, InputError) as wrong:
            # the place on the server is nobody's business
            raise InputError(str(wrong).replace(str(named), name[-40:])) from wrong


def _words_of_text(text: str, tier: str | None) -> WrittenWords | None:
    """Words of a text that is a table of labels, a TextGrid or subtitles; None for plain text."""
    if find_reader_of_text(text) is None and not is_subtitle_text(text):
        return None
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        path = Path(folder, "transcript.txt")
        path.write_text(text, encoding="utf-8", newline="")
        return _timed_words(path, path.name, tier)


async def _import_project(studio: StudioHost, key: ApiKey, path: Path) -> str:
    content = parse_json(_read_text(path, "the project"), "the project")
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as empty:
        project = await check_project(studio.state, key, Path(empty), content)
    return await studio.create(key, project)


async def add_recording(studio: StudioHost, key: ApiKey, sound: Path, title: str, transcript: str) -> str:
    """Id of a new project with a checked sound and its words, if they are known."""
    number = await studio.create(key, Project(name=title))
    asset = await asyncio.to_thread(studio.store.add_asset, number, RECORDING, sound)
    workspace = await studio.open(key, number)
    request = Request(audio=asset, text=transcript)
    workspace.history = workspace.history.amend(replace(workspace.project, request=request))
    await workspace.save()
    return number


@asynccontextmanager
async def _decoded(
    state: ServiceState, key: ApiKey, given: tuple[str, Path, str], encoding: str | None = None
) -> AsyncIterator[tuple[Path, tuple[str, ...]]]:
    """A file of a kind after its check in a process with limits, with a suffix; notes on what is guessed of it."""
    settings, (kind, path, suffix) = state.settings, given
    limit = settings.sound_s if kind == SOUND else settings.job_cues
    with tempfile.TemporaryDirectory(prefix="tts2face-upload-") as folder:
        target = Path(folder, f"checked{suffix}")
        order = FileOrder(kind, path, target, limit, encoding)
        try:
            notes = await state.decoders.decode(key.name, order, "the file", settings.decode_s)
        except RefusedError as refused:
            raise InputError(refused.message) from refused
        yield target, notes


def _check_size(path: Path, name: str) -> None:
    limit = MAX_TRANSCRIPT_BYTES if Path(name).suffix.lower() in READERS else MAX_TEXT_BYTES
    if path.stat().st_size > limit:
        raise InputError(f"{name[-40:]} has more than {limit} bytes; divide it")


def _read_text(path: Path, name: str) -> str:
    _check_size(path, name)
    try:
        return path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError as wrong:
        raise InputError(f"{name[-40:]} is no text in UTF-8; save it as UTF-8") from wrong


def _title(text: str) -> str:
    words = " ".join(text.split())[: min(60, MAX_NAME)].strip()
    return words or "untitled"
