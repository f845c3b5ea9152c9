"""Marks in speech: a voice with a known answer, and real ones."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lexicon.errors import InputError
from lexicon.marked_text import MAX_PAUSE_S, GestureMark
from lexicon.sentences import Sentence, index_by_letters, split_sentences
from lexicon.sequence import SILENCE
from lexicon.text_marks import parse_marks
from tests.tones import LEAD_S, LEVEL, PHONE_S, RATE_HZ, TRAIL_S, LetterVoice
from tts2face.gestures.elements import Gesture, StyleSpan
from tts2face.request import Request
from tts2face.session.joining import join_utterances, silent_speech, trim_silence
from tts2face.session.marked_styles import marked_styles
from tts2face.session.prepared import check_marks, prepare
from tts2face.session.speech import (
    MIN_UTTERANCE_GAP_S,
    MarkTime,
    SpokenSentence,
    resolve_recording_marks,
    speak_sentence,
    voice_in,
)
from tts2face.session.speech_stream import SpeechModels, spoken_pieces
from tts2face.sound.prosody import Prosody
from tts2face.sound.voice import SpeechInput
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech, Waveform

WORDS = st.lists(
    st.sampled_from(["one", "seven", "cat", "it's", "25", "$3.50", "Dr. Who", "well-known"]), min_size=1, max_size=8
)
BITS = st.one_of(st.text(max_size=8), st.sampled_from(["[nod]", "[pause 0.5]", ". ", "Ab", "\n\n"]))


def synthesise_sentences(text: str, voice: object | None = None, **options: object) -> list[SpokenSentence]:
    request = Request(text=text, lead=None, **options)
    return [
        speak_sentence(voice or LetterVoice(), part, request)
        for part in split_sentences(parse_marks(text), request.language)
    ]


def one(text: str, voice: object | None = None, **options: object) -> SpokenSentence:
    (only,) = synthesise_sentences(text, voice, **options)
    return only


def words(answer: SpokenSentence) -> dict[str, tuple[float, float]]:
    edges = answer.speech.phones.edges
    return {word.text: (float(edges[word.first]), float(edges[word.last])) for word in answer.speech.words}


def test_without_marks_the_speech_of_the_voice_is_unchanged() -> None:
    voice = LetterVoice()
    answer = one("hello there.", voice)
    plain = LetterVoice().speak("hello there.")
    assert answer.speech.waveform.samples.tobytes() == plain.waveform.samples.tobytes()
    assert answer.speech.phones.edges.tobytes() == plain.phones.edges.tobytes()
    assert (answer.timeline.spans, answer.timeline.gestures, answer.marks) == ((), (), ())
    assert voice.said == [("hello there.", 1.0)]


@pytest.mark.parametrize("pause", [0.02, 0.1, 0.4, 1.0, 3.0])
def test_a_pause_within_a_sentence_has_the_requested_duration(pause: float) -> None:
    voice = LetterVoice()
    answer = one(f"hello [pause {pause}] there.", voice)
    assert [text for text, _ in voice.said] == ["hello", "there."]
    assert words(answer)["there"][0] - words(answer)["hello"][1] == pytest.approx(pause, abs=2 / RATE_HZ)
    assert answer.speech.phones.end == pytest.approx(LEAD_S + 10 * PHONE_S + pause + TRAIL_S, abs=2 / RATE_HZ)
    assert answer.speech.phones.phones.count(SILENCE) == 3
    silent = answer.speech.waveform.samples[round((words(answer)["hello"][1] + 0.001) * RATE_HZ) :][
        : int((pause - 0.003) * RATE_HZ)
    ]
    assert np.abs(silent).max() == 0


def test_pauses_between_sentences_come_on_top() -> None:
    plain = synthesise_sentences("One. Two.")
    paused = synthesise_sentences("[pause 2]One. [pause 0.5]Two.[pause 1]")
    gained = [b.speech.phones.end - a.speech.phones.end for a, b in zip(plain, paused, strict=True)]
    assert gained == pytest.approx([2.5, 1.0])
    assert words(paused[0])["One"][0] == pytest.approx(2 + LEAD_S)


def test_punctuation_after_a_pause_belongs_to_the_preceding_words() -> None:
    voice = LetterVoice()
    answer = one("hello [pause 1].", voice)
    assert voice.said == [("hello.", 1.0)]
    assert answer.speech.phones.end == pytest.approx(LEAD_S + 5 * PHONE_S + TRAIL_S + 1)


def test_pauses_without_words_are_kept() -> None:
    assert [
        part.utterances[-1].pause for part in split_sentences(parse_marks("One. … [pause 1] Two. [pause 2] …"), "en-us")
    ] == [
        1.0,
        2.0,
    ]
    (only,) = split_sentences(parse_marks("… [pause 1] One."), "en-us")
    assert only.leading_pause == 1.0


def test_nods_and_names_come_with_the_onset_of_their_word() -> None:
    answer = one("one [nod]two three[nod 0.5] four[nod].")
    at = words(answer)
    assert answer.timeline.gestures == (Gesture(at["two"][0]), Gesture(at["four"][0], size=0.5), Gesture(at["four"][1]))
    named = one('<speak>one <mark name="x"/>two <break time="1s"/><mark name="y"/>three</speak>')
    at = words(named)
    assert named.marks == (MarkTime("x", at["two"][0]), MarkTime("y", pytest.approx(at["three"][0])))
    assert at["three"][0] == pytest.approx(LEAD_S + 6 * PHONE_S + 1, abs=2 / RATE_HZ)


def test_a_mark_within_a_word_counts_for_it() -> None:
    answer = one("one tw[nod]o three")
    assert answer.timeline.gestures == (Gesture(words(answer)["two"][0]),)


def test_words_of_numbers_are_counted_as_pronounced() -> None:
    answer = one("it is 25 [nod]times.")
    assert answer.timeline.gestures == (Gesture(words(answer)["times"][0]),)


def test_a_voice_that_counts_words_differently_is_followed_by_letters() -> None:
    answer = one("well-known men-at-arms [nod]fought well-fed", LetterVoice(splits=True))
    assert answer.timeline.gestures == (Gesture(words(answer)["fought"][0]),)


def test_styles_hold_over_their_words_and_the_inner_one_counts() -> None:
    answer = one("one [style:calm]two [style:head=cross]three[/style] four[/style] five")
    at = words(answer)
    spans = answer.timeline.spans
    assert [(span.style, span.start, span.end) for span in spans if span.feature == "head"] == [
        ("calm", at["two"][0], at["three"][0]),
        ("cross", at["three"][0], at["four"][0]),
        ("calm", at["four"][0], at["four"][1]),
    ]
    assert {span.style for span in spans if span.feature == "brows"} == {"calm"}


def test_a_style_around_all_sentences_holds_throughout() -> None:
    for answer in synthesise_sentences("[style:brows=calm]One. Two. Three.[/style]"):
        assert answer.timeline.spans == (StyleSpan("brows", "calm", 0.0, float("inf")),)


def test_the_styles_of_a_text_are_known_beforehand() -> None:
    assert marked_styles(parse_marks("[style:calm]a [style:head=cross]b[/style][/style] [style:calm]c[/style]")) == (
        "calm",
        "cross",
    )


def test_nods_at_one_place_are_one() -> None:
    assert one("one [nod 0.5][nod] [nod 0.3]two").timeline.gestures == (Gesture(LEAD_S + 3 * PHONE_S),)


def test_speed_and_loudness() -> None:
    voice = LetterVoice()
    answer = one(
        '<speak>one <prosody rate="50%">two</prosody> <prosody volume="soft">three</prosody> four</speak>', voice
    )
    assert voice.said == [("one", 1.0), ("two", 0.5), ("three four", 1.0)]
    at, samples = words(answer), answer.speech.waveform.samples
    assert at["two"][1] - at["two"][0] == pytest.approx(3 * PHONE_S / 0.5)
    level = {
        word: samples[round((start + 0.05) * RATE_HZ) : round((end - 0.05) * RATE_HZ)]
        for word, (start, end) in at.items()
    }
    np.testing.assert_allclose(level["three"], 0.6 * LEVEL, rtol=1e-5)
    for word in ("one", "two", "four"):
        np.testing.assert_allclose(level[word], LEVEL, rtol=1e-5)


class EvenVoice(LetterVoice):
    """Its constants have no pitch to change."""

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        return self.speak(content, rate=prosody.rate, seed=seed)

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        return self.deliver(content, prosody, seed).waveform


def test_emphasis_is_louder_with_a_nod() -> None:
    answer = one('<speak>one <emphasis level="strong">two</emphasis> four</speak>', EvenVoice())
    start, end = words(answer)["two"]
    loud = answer.speech.waveform.samples[round((start + 0.05) * RATE_HZ) : round((end - 0.05) * RATE_HZ)]
    np.testing.assert_allclose(loud, 10 ** (3 / 20) * LEVEL, rtol=1e-5)
    assert answer.timeline.gestures == (Gesture(start),)


def test_spans_use_their_own_voice_at_the_sample_rate_of_the_first() -> None:
    asked: list[tuple[str | None, str]] = []
    other = LetterVoice(rate=2 * RATE_HZ)

    def voices(name: str | None, language: str) -> LetterVoice:
        asked.append((name, language))
        return other

    text = '<speak>one <lang xml:lang="de">zwei drei</lang> <voice gender="male">four</voice> [x]</speak>'
    voice = LetterVoice()
    (sentence,) = split_sentences(parse_marks(text), "en-us")
    answer = speak_sentence(voice, sentence, Request(text=text), voices)
    assert asked == [(None, "de"), ("espeak", "en-us")]
    assert ([said_ for said_, _ in voice.said], [said_ for said_, _ in other.said]) == (
        ["one", "x"],
        ["zwei drei", "four"],
    )
    assert answer.speech.waveform.rate == RATE_HZ
    assert [word.text for word in answer.speech.words] == ["one", "zwei", "drei", "four", "x"]
    with pytest.raises(InputError, match="needs voices to speak them"):
        speak_sentence(voice, sentence, Request(text=text))


@pytest.mark.parametrize(
    ("name", "language", "chosen"),
    [
        (None, "de", None),
        ("heart", "de", None),
        ("heart", "en-gb", "heart"),
        ("heart", None, "heart"),
        ("espeak", "de", "espeak"),
        ("espeak-female", "de", "espeak-female"),
        ("my.onnx", "de", None),
        ("my.onnx", None, "my.onnx"),
    ],
)
def test_a_span_keeps_the_voice_that_speaks_its_language(
    name: str | None, language: str | None, chosen: str | None
) -> None:
    assert voice_in(name, language) == chosen


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_given_phones_reach_the_voice(name: str) -> None:
    sheep, cat = '<phoneme ph="ʃˈiːp">Bob</phoneme>', '<phoneme alphabet="x-arpabet" ph="K AE1 T">2</phoneme>'
    text = f"We saw {sheep}, and {cat}."
    answer = one(f"<speak>{text}</speak>", load_voice(name, "en-us"))
    phones = answer.speech.phones.phones
    found = {word.text.strip(".,"): "".join(phones[word.first : word.last]) for word in answer.speech.words}
    assert "ʃip" in found.values()
    assert "kæt" in found.values()
    assert (found["We"], found["saw"]) == ("wi", "sɔ")


@settings(deadline=None)  # the first example imports scipy's filters
@given(WORDS, st.data(), st.booleans())
def test_times_of_marks_increase_and_lie_in_the_sound(texts: list, data: st.DataObject, splits: bool) -> None:
    kinds = [data.draw(st.sampled_from(["", "[nod]", "[pause 0.3]", "[pause 1][nod 0.5]"])) for _ in texts]
    text = " ".join(kind + word for kind, word in zip(kinds, texts, strict=True))
    for answer in synthesise_sentences(f"[style:head=a]{text}[/style]", LetterVoice(splits)):
        nods = [nod.time for nod in answer.timeline.gestures]
        assert nods == sorted(nods)
        assert all(0 <= time < answer.speech.phones.end for time in nods)
        onsets = [answer.speech.phones.edges[word.first] for word in answer.speech.words]
        assert all(np.abs(np.array(onsets) - time).min() < 1e-3 for time in nods)


@given(WORDS, st.data())
def test_sentences_hold_the_same_words_with_pauses(texts: list, data: st.DataObject) -> None:
    text = " ".join(word + data.draw(st.sampled_from(["", "[pause 1]", " [nod] "])) for word in texts)
    parts = list(split_sentences(parse_marks(text), "en-us"))
    spoken = "".join("".join(part.source.split()) for sentence in parts for part in sentence.utterances)
    assert spoken == "".join("".join(texts).split())


@given(st.lists(BITS, max_size=12))
def test_any_text_is_cut_without_loss(bits: list) -> None:
    text = parse_marks("".join(bit if bit in {"[nod]", "[pause 0.5]"} else bit.replace("[", "") for bit in bits))
    parts = list(split_sentences(text, "de"))
    written = "".join(part.source for sentence in parts for part in sentence.utterances)
    assert [letter for letter in written if letter.isalnum()] == [letter for letter in text.text if letter.isalnum()]
    nods = {mark.at for mark in index_by_letters(text).marks if isinstance(mark, GestureMark)}
    assert sum(len(sentence.marks) for sentence in parts) == (len(nods) if parts else 0)
    for sentence in parts:
        bounds = [(part.first, part.last) for part in sentence.utterances]
        assert all(first < last for first, last in bounds)
        assert all(before[1] <= after[0] for before, after in pairwise(bounds))


def test_silences_are_removed_and_inserted_exactly() -> None:
    first, second = LetterVoice().speak("ab"), LetterVoice().speak("cd")
    short, cut = trim_silence(second, before=0.05, behind=0.1)
    assert cut == pytest.approx(0.15)
    assert short.phones.durations[[0, -1]] == pytest.approx([0.05, 0.1])
    both, begins = join_utterances([first, second], [1.0])
    assert begins == pytest.approx([0.0, LEAD_S + 0.2 + 1.0 - LEAD_S])
    assert silent_speech(0.5, RATE_HZ).phones.end == 0.5
    assert len(both.words) == 2


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_real_voices_pause_and_nod_at_the_marks(name: str) -> None:
    answer = one("We were away [pause 0.4] a year ago, [nod]but Bob may move.", load_voice(name, "en-us"))
    at = words(answer)
    assert at["a"][0] - at["away"][1] == pytest.approx(0.4, abs=0.002)
    assert [nod.time for nod in answer.timeline.gestures] == [at["but"][0]]
    samples, rate = answer.speech.waveform.samples, answer.speech.waveform.rate
    gap = samples[round((at["away"][1] + 0.19) * rate) : round((at["a"][0] - 0.19) * rate)]
    assert np.abs(gap).max() < 0.01


def test_words_of_a_language_without_spaces_are_found_by_letters() -> None:
    answer = one("こんにちは、[nod]せかい。", load_voice("espeak", "ja"), language="ja")
    (nod,) = answer.timeline.gestures
    assert 0.3 * answer.speech.phones.end < nod.time < 0.9 * answer.speech.phones.end


def test_in_a_recording_marks_come_with_their_words() -> None:
    text = parse_marks("one [style:head=calm]two[/style] [nod]three")
    speech = LetterVoice().speak(text.text)
    timeline, _ = resolve_recording_marks(text, speech.phones, speech.words, "en-us")
    assert timeline.gestures[0].time == pytest.approx(LEAD_S + 6 * PHONE_S)
    assert [(span.start, span.end) for span in timeline.spans] == [
        pytest.approx((LEAD_S + 3 * PHONE_S, LEAD_S + 6 * PHONE_S))
    ]


@pytest.mark.parametrize(
    ("text", "options", "reason"),
    [
        ("<speak><prosody rate='2'>a</prosody></speak>", {"rate": 1.5}, r"a speed of 2 in the text times 1\.5 of"),
        ("<speak><prosody volume='x-loud'>a</prosody></speak>", {"volume": 1.5}, "a loudness of 2 in the text"),
        ("<speak xml:lang='de'>a</speak>", {}, "the text names the language de, not en-us"),
        ("a [pause 1] b", {"audio": Path("a.wav")}, "have no effect on a recording"),
        ("<speak><emphasis>a</emphasis></speak>", {"audio": Path("a.wav")}, "have no effect on a recording"),
        ("<speak><lang xml:lang='de'>a</lang></speak>", {"audio": Path("a.wav")}, "have no effect on a recording"),
    ],
)
def test_marks_that_go_with_no_request_are_refused(text: str, options: dict, reason: str) -> None:
    request = Request(text=text, **options)
    with pytest.raises(InputError, match=reason):
        check_marks(parse_marks(text), request)


def test_pauses_that_meet_over_spaces_are_limited_too() -> None:
    found = parse_marks("a [pause 6] [pause 6] b")
    assert found.notes == ("silence at one place is 10 s, the limit, not 12",)
    assert next(split_sentences(found, "en-us")).utterances[0].pause == MAX_PAUSE_S


def test_a_megabyte_of_marks_is_cut_at_once() -> None:
    n = sum(1 for _ in split_sentences(parse_marks("Hello [nod] there [pause 1] my friend. " * 3000), "en-us"))
    assert n == 3000
    assert MIN_UTTERANCE_GAP_S < 0.06
    assert isinstance(next(split_sentences(parse_marks("a"), "en-us")), Sentence)


def test_silence_that_adds_up_over_punctuation_comes_in_parts() -> None:
    """It was one sentence with all of it: `a. . <break/> . <break/>` has as much silence as anybody writes."""
    text = f"[pause 8] . [pause 8] . [style:delighted]one. {'. [pause 9.5] ' * 20}. two.[/style]"
    fps = 29.97
    prepared = prepare(Request(text=text, fps=fps, lead=None))
    voice = LetterVoice()
    pieces = list(spoken_pieces(prepared, SpeechModels(lambda name, language: voice)))
    assert max(piece.speech.waveform.duration for piece in pieces) < 2 * MAX_PAUSE_S + 2.0
    assert [piece.text for piece in pieces if piece.text] == [". one.", ". two."]
    silence = sum(piece.speech.waveform.duration for piece in pieces) - 6 * PHONE_S - 2 * (LEAD_S + TRAIL_S)
    assert silence == pytest.approx(16.0 + 190.0, abs=len(pieces) / fps)
    begins = np.cumsum([0, *(len(piece.clip.motion) for piece in pieces)]) / float(prepared.fps)
    assert [piece.begin for piece in pieces] == pytest.approx([*begins[:-1]])
    for first, piece in zip(begins, pieces[:-1], strict=False):  # sound and picture stay together
        end = first + len(piece.clip.motion) / float(prepared.fps)
        n_samples = round(end * RATE_HZ) - round(first * RATE_HZ)
        assert len(piece.speech.waveform.samples) == pytest.approx(n_samples, abs=1)
    assert sum(piece.n_steps for piece in pieces) == sum(one.n_characters for one in prepared.sentences())
    styled = [piece for piece in pieces if piece.begin > 16.0]
    assert all(piece.timeline.spans for piece in styled)  # also in the silence between its sentences
