"""Forced alignment."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from lexicon.dictionary import parse_dictionary
from lexicon.errors import DataError
from lexicon.sequence import enforce_increasing
from tests.rendered_takes import manifest_rows
from tests.sound.conftest import HEARD_TOGETHER
from tests.world import World
from tts2face.sound.alignment import Aligner, HeardSound
from tts2face.sound.pauses import speech_onset
from tts2face.sound.recogniser import RATE
from tts2face.sound.segments import STEP_S
from tts2face.sound.transcript import pronounce_transcript
from tts2face.sound.voice import Voice
from tts2face.sound.voice_pool import VoicePool, load_voice
from tts2face.types import Waveform
from tts2face.video.media import read_sound

pytestmark = HEARD_TOGETHER
WORDS = [("bob", [("b", "ɑ", "b")]), ("may", [("m", "eɪ")]), ("read", [("ɹ", "i", "d"), ("ɹ", "ɛ", "d")])]


@pytest.fixture(scope="module")
def heard(aligner: Aligner, heart: Voice) -> HeardSound:
    return aligner.hear(heart.speak("Bob may read.").waveform)


def test_phones_cover_the_sound_and_words_their_phones(aligner: Aligner, heard: HeardSound) -> None:
    found = aligner.align(heard, WORDS)
    assert found.phones.start == 0.0
    assert found.phones.end == heard.sound.duration
    spoken = ["".join(found.phones.phones[word.first : word.last]) for word in found.words]
    assert spoken == ["bɑb", "meɪ", "ɹid"]


@pytest.mark.parametrize("lead", [0.0, 0.0025, 0.005, 0.0075, 0.01, 0.015])
def test_the_first_phone_of_a_sound_without_silence_begins_with_it(aligner: Aligner, lead: float) -> None:
    """A silence of less than a step before it is no phone of its own."""
    text = "Are you there?"
    sound = load_voice("espeak", "en-us").sound(text)
    start = round((speech_onset(sound) - lead) * sound.rate)
    found = aligner.align(sound.part(start, len(sound.samples)), pronounce_transcript(text, "en-us"))
    assert found.phones.start == 0.0
    assert found.phones.end == pytest.approx(sound.duration - start / sound.rate)


def test_of_several_pronunciations_the_fitting_one_is_taken(aligner: Aligner, heard: HeardSound) -> None:
    swapped = [*WORDS[:2], ("read", [("ɹ", "ɛ", "d"), ("ɹ", "i", "d")])]
    found = aligner.align(heard, swapped)
    assert found.phones.phones[found.words[2].first : found.words[2].last] == ("ɹ", "i", "d")


def test_a_weak_form_is_found_where_it_is_said(aligner: Aligner, world: World, voices: VoicePool) -> None:
    said, session = [], world.session(voices=voices)
    for word in ('<phoneme ph="ən">and</phoneme>', "and"):
        speech = session.clip(f"<speak>Look at Bob {word} Mary.</speak>", gestures="none").speech
        found = aligner.align(speech.waveform, pronounce_transcript("Look at Bob and Mary.", "en-us"))
        said.append(found.phones.phones[found.words[3].first : found.words[3].last])
    assert said == [("ə", "n"), ("æ", "n", "d")]


def test_the_user_s_pronunciation_has_no_weak_form() -> None:
    own = parse_dictionary("and  B AA1", "own")
    assert pronounce_transcript("and at", "en-us", own) == (("and", (("b", "ɑ"),)), ("at", (("æ", "t"), ("ə", "t"))))


def test_silence_before_moves_every_edge_by_its_length(aligner: Aligner, heard: HeardSound) -> None:
    """20 ms: two frames of the model on either side."""
    sound = heard.sound
    later = Waveform(np.concatenate([np.zeros(round(0.3 * sound.rate)), sound.samples]), sound.rate)
    plain, moved = aligner.align(heard, WORDS), aligner.align(later, WORDS)
    first, last = plain.words[0].first, plain.words[-1].last
    shift = moved.words[0].first - first
    edges = moved.phones.edges[first + shift : last + shift + 1] - plain.phones.edges[first : last + 1]
    assert edges == pytest.approx(np.full(len(edges), 0.3), abs=0.02)


def test_level_does_not_matter(aligner: Aligner, heard: HeardSound) -> None:
    quiet = Waveform(heard.sound.samples * 0.1, heard.sound.rate)
    assert aligner.align(quiet, WORDS).phones.edges == pytest.approx(aligner.align(heard, WORDS).phones.edges, abs=0.02)


def test_no_words_are_refused(aligner: Aligner, heard: HeardSound) -> None:
    with pytest.raises(DataError, match="no word to align"):
        aligner.align(heard, [])


def test_sound_that_is_too_short_for_the_words_is_refused(aligner: Aligner) -> None:
    with pytest.raises(DataError, match="too short for 30 words"):
        aligner.align(Waveform(np.zeros(1600), 16000), [WORDS[0]] * 30)


def test_words_that_are_not_said_are_left_out_and_others_stay_where_they_are(
    aligner: Aligner, heard: HeardSound
) -> None:
    absent = ("elephants", [("ɛ", "l", "ə", "f", "ə", "n", "t", "s")])
    found = aligner.align(heard, [*WORDS[:2], absent, WORDS[2]], may_lack=True)
    plain = aligner.align(heard, WORDS)
    assert [word.text for word in found.words] == ["bob", "may", "read"]
    assert [mismatch.words for mismatch in found.mismatches] == [("elephants",)]
    assert found.phones.edges == pytest.approx(plain.phones.edges, abs=0.015)


def test_speech_that_is_not_written_is_stepped_over_and_told(aligner: Aligner, heart: Voice) -> None:
    parts = [heart.speak(text).waveform for text in ("Bob may", "Nobody saw the dog again.", "read.")]
    whole = Waveform(np.concatenate([part.samples for part in parts]), heart.sample_rate)
    found = aligner.align(whole, WORDS, may_lack=True)
    (mismatch,) = found.mismatches
    first, last = parts[0].duration, parts[0].duration + parts[1].duration
    assert mismatch.words == ()
    assert (mismatch.begin, mismatch.end) == pytest.approx((first, last), abs=0.4)
    assert found.phones.edges[found.words[1].last] < first
    assert found.phones.edges[found.words[2].first] > last
    assert "is not in the text" in mismatch.sentence


def test_confidence_tells_a_wrong_word_from_right_ones(aligner: Aligner, heard: HeardSound) -> None:
    wrong = ("jump", [("dʒ", "ʌ", "m", "p")])
    found = aligner.align(heard, [WORDS[0], wrong, WORDS[2]])
    assert [word.is_doubtful for word in found.words] == [False, True, False]


@pytest.mark.parametrize("kind", ["pink", "babble"])
def test_edges_hold_in_noise(aligner: Aligner, heart: Voice, kind: str) -> None:
    """At 10 dB, 168 edges of a voice of another make: 11 ms in the mean, where none counts more than 50 ms.

    Another processor's last bits may move an edge by 0.2 s, which is 0.3 ms of this mean; edges that were all 10 ms
    later would make it 15.5 ms and more.
    """
    speech = heart.speak("The third witness slowly carved a box of matches.")
    other = heart.speak("We were away a year ago, but Bob may move five big maps.").waveform.samples
    spans = [(word.text, [speech.phones.phones[word.first : word.last]]) for word in speech.words]
    found = [aligner.align(add_noise(speech.waveform, kind, other, seed), spans) for seed in range(4)]
    apart = np.concatenate([
        np.abs(one.phones.edges[mine.first : mine.last + 1] - speech.phones.edges[true.first : true.last + 1])
        for one in found
        for mine, true in zip(one.words, speech.words, strict=True)
    ])  # fmt: skip
    assert np.mean([word.confidence for one in found for word in one.words]) > 0.7
    assert np.minimum(apart, 0.05).mean() < 0.0135
    assert np.count_nonzero(apart > 0.1) <= 2


def add_noise(sound: Waveform, kind: str, other: np.ndarray, seed: int) -> Waveform:
    """Sound with pink noise, or six copies of another at the same time, at 10 dB of its loud samples."""
    rng, samples = np.random.default_rng(seed), sound.samples
    if kind == "pink":
        spectrum = np.fft.rfft(rng.normal(size=len(samples)))
        noise = np.fft.irfft(spectrum / np.sqrt(np.maximum(np.arange(len(spectrum)), 20)), len(samples))
    else:
        said = np.resize(other, len(samples))
        noise = np.sum([np.roll(said, int(rng.integers(len(said)))) for _ in range(6)], axis=0)
    loud = samples[np.abs(samples) > 0.02 * np.abs(samples).max()]
    noisy = samples + noise / noise.std() * np.sqrt(np.square(loud).mean() / 10)
    return Waveform((noisy * 0.9 / np.abs(noisy).max()).astype(np.float32), sound.rate)


def test_a_diphthong_that_ends_as_another_vowel_is_not_a_pause(aligner: Aligner, shared_recordings: Path) -> None:
    """Edges read from the spectrogram: "three now" without a pause, whose last vowel is heard as /oʊ/ to its end."""
    sound = read_sound(shared_recordings / "grid_talkers" / "swiz3n.mpg", RATE)
    found = aligner.align(sound, pronounce_transcript("set white in z three now", "en-us"))
    three, now = found.words[-2:]
    assert three.last == now.first
    assert found.phones.edges[now.last] == pytest.approx(2.66, abs=0.03)


def test_other_languages_are_aligned_by_the_nearest_phones(aligner: Aligner) -> None:
    """espeak-ng tells when it says each phone."""
    speech = load_voice("espeak", "de").speak("Der schöne Fluss fließt über die Brücke.")
    spans = [(word.text, [speech.phones.phones[word.first : word.last]]) for word in speech.words]
    found = aligner.align(speech.waveform, spans)
    apart = [
        np.abs(found.phones.edges[mine.first : mine.last + 1] - speech.phones.edges[other.first : other.last + 1])
        for mine, other in zip(found.words, speech.words, strict=True)
    ]
    assert np.concatenate(apart).mean() < 0.03


@pytest.mark.parametrize(
    ("edges", "moved"),
    [
        ([0.0, 0.1, 0.2], [0.0, 0.1, 0.2]),
        ([0.0, 0.1, 0.1, 0.2], [0.0, 0.1, 0.105, 0.2]),
        ([0.0, 0.2, 0.1, 0.3], [0.0, 0.2, 0.205, 0.3]),
        ([0.0, 0.3, 0.3, 0.3], [0.0, 0.29, 0.295, 0.3]),
        ([0.0, 0.0, 0.001], [0.0, 0.0005, 0.001]),
    ],
)
def test_edges_increase(edges: list[float], moved: list[float]) -> None:
    assert enforce_increasing(np.array(edges)) == pytest.approx(moved)


def test_recordings_agree_with_their_word_times(
    aligner: Aligner, hear_take: Callable[[Path], HeardSound], takes: Path
) -> None:
    """GRID's own word times: median within 20 ms (they are themselves automatic); a wrong transcript fits worse."""
    from lexicon.dictionary import cmudict_lookup

    rows = manifest_rows(takes)
    rows = (rows[::80] if len(rows) >= 80 else rows)[:10]  # what test_recognize.py hears as well
    errors: list[float] = []
    right: list[float] = []
    wrong: list[float] = []
    for row, other in zip(rows, rows[1:] + rows[:1], strict=True):
        heard = hear_take(takes / "clips" / f"{row['clip']}.mkv")
        transcripts = []
        for transcript in (row["transcript"], other["transcript"]):
            words = [word for word in transcript.split() if len(word) > 1]
            transcripts.append([(word, [tuple(s.phone for s in cmudict_lookup(word) or ())]) for word in words])
        found = aligner.align(heard, transcripts[0])
        right.append(float(np.mean([word.confidence for word in found.words])))
        wrong.append(float(np.mean([word.confidence for word in aligner.align(heard, transcripts[1]).words])))
        known = [line.split() for line in (takes / "align" / f"{row['clip']}.align").read_text().splitlines()]
        starts = {word: int(start) / 25000 for start, _, word in known}
        errors += [found.phones.edges[word.first] - starts[word.text] for word in found.words if word.text in starts]
    assert np.median(np.abs(errors)) < 0.02
    assert np.mean(np.array(right) > np.array(wrong)) >= 0.9


@pytest.mark.parametrize(("seconds", "level"), [(1.0, 0.0), (8.0, 0.0), (20.0, 0.0), (8.0, 10 ** (-81 / 20))])
def test_edges_are_those_of_the_recording_without_silence_around_it(
    aligner: Aligner, heart: Voice, seconds: float, level: float
) -> None:
    """Of a stem, which is muted where nobody speaks: zeros, or the noise of a converter, around a room."""
    words = pronounce_transcript("Many silver spoons can often be found here.", "en-us")
    spoken = heart.speak("Many silver spoons can often be found here.").waveform.resampled(RATE).samples
    random = np.random.default_rng(0)
    room = random.normal(0.0, 0.0012, len(spoken) + round(0.6 * RATE)).astype(np.float32)
    room[round(0.3 * RATE) : round(0.3 * RATE) + len(spoken)] += spoken
    quiet = random.normal(0.0, 1.0, round(seconds * RATE)).astype(np.float32) * np.float32(level)
    plain = aligner.align(Waveform(room, RATE), words, may_lack=True)
    muted = aligner.align(Waveform(np.concatenate([quiet, room, quiet]), RATE), words, may_lack=True)
    ends = [[found.phones.edges[[word.first, word.last]] for word in found.words] for found in (plain, muted)]
    assert np.array(ends[1]) - seconds == pytest.approx(np.array(ends[0]), abs=2.1 * STEP_S)
    assert min(word.confidence for word in muted.words) > 0.95
