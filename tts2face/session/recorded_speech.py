"""First step of a recording: its phones and words are found, and its sound becomes pieces with the face at rest."""

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import replace
from itertools import islice

from lexicon.given_phones import TextWord
from lexicon.normalize import spoken_form, written_pieces
from lexicon.sequence import WordSpan
from tts2face.models.talker import Talker
from tts2face.request import FromSound, Recorded
from tts2face.session.corrections import RECORDING
from tts2face.session.prepared import HEARING_STEPS, RECORDING_STEPS, PreparedRequest
from tts2face.session.recording import (
    TimedTranscript,
    align_transcript,
    measure_recording,
    recognise_transcript,
    recording_clips,
    select_audio_map,
)
from tts2face.session.speech import resolve_recording_marks
from tts2face.session.speech_stream import Piece
from tts2face.sound.retuned import matched_words
from tts2face.storage.memory import ResultMemory
from tts2face.types import Progress, frame_count

TRANSCRIPT_BYTES = 10_000  # of a transcript besides its phones


def hear(
    prepared: PreparedRequest, source: Recorded, talker: Talker, memory: ResultMemory, on_heard: Progress
) -> TimedTranscript:
    """Phones and words of a recording with their times; a single silence if lips follow its sound.

    Parameters
    ----------
    on_heard
        Called while the phones are found.
    """
    if isinstance(source.lips, FromSound):
        return measure_recording(source.audio, select_audio_map(source.lips.audio_map, talker))
    language = prepared.request.language

    def key() -> Hashable:
        found = source.audio.stat()
        file = (str(source.audio.resolve()), found.st_mtime_ns, found.st_size)
        return ("transcript", file, prepared.text.text, language, frozenset(prepared.dictionary.items()))

    def find() -> TimedTranscript:
        if not source.text:
            return recognise_transcript(source.audio, on_heard)
        return align_transcript(prepared.text.text, language, source.audio, prepared.dictionary, on_heard)

    found = memory.recall(key, find, lambda made: TRANSCRIPT_BYTES + made.phones.edges.nbytes * 8)
    return replace(found, phones=prepared.corrected(found.phones, RECORDING, 0))


def recorded_pieces(prepared: PreparedRequest, source: Recorded, heard: TimedTranscript) -> Iterator[Piece]:
    """Pieces of a recording that is heard, with its sound and marks; the face is at rest and has no channels."""
    fps = float(prepared.fps)
    n_frames = frame_count(heard.duration, fps)
    if prepared.request.has_gestures:
        prepared.timeline.check_duration(n_frames / fps)
    timeline, marks = resolve_recording_marks(prepared.text, heard.phones, heard.words, prepared.request.language)
    before = 0
    script = _script(_written(prepared.text.text, prepared.request.language), heard.words)
    for clip in recording_clips(source.audio, heard, n_frames, prepared.fps, volume=source.volume):
        after = before + len(clip.motion)
        start, end = before / fps, after / fps
        n_steps = RECORDING_STEPS * after // n_frames - RECORDING_STEPS * before // n_frames
        yield Piece(
            clip,
            start,
            n_steps + (HEARING_STEPS if before == 0 else 0),
            timeline.restrict(start, end),
            tuple(mark for mark in marks if start <= mark.seconds < end),
            mismatches=tuple(mismatch for mismatch in heard.mismatches if start <= mismatch.begin < end),
            transcript=heard.phones if before == 0 else None,
            script=tuple(islice(script, len(clip.speech.words))),
            is_last=after == n_frames,
        )
        before = after


def _written(text: str, language: str) -> list[str]:
    """Words of a text with their punctuation, as `pronounce_transcript` has them."""
    if language.startswith("en"):
        return spoken_form(text, language).split()
    return [written + after for written, after in written_pieces(text, language)]


def _script(written: Sequence[str], words: Sequence[WordSpan]) -> Iterator[TextWord]:
    """The written word, with its punctuation, of each word of a recording."""
    places = matched_words(written, [word.text for word in words])
    for word, place in zip(words, places, strict=True):
        yield TextWord(word.text if place is None else written[place])
