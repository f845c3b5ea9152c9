"""A voice of a server: its sound with our edges, what of its errors is said, and what is never sent."""

import json
import re
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lexicon.errors import BackendError, DataError, InputError, SilentTextError
from tests.sound.speech_server import Reply, SpeechServer, captioned_reply, speech_server, spoken, wave_reply
from tts2face.request import Request
from tts2face.serving.batch.cast import cast_from_tables
from tts2face.serving.batch.lines import read_lines
from tts2face.serving.service.clip_options import check_voice
from tts2face.serving.service.errors import RefusedError, as_refused
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.work.run import _for_clients
from tts2face.session.prepared import prepare
from tts2face.session.project_file import parse_project
from tts2face.session.speech_stream import SpeechModels, speak_sentences
from tts2face.sound.fitting import fitted_voices
from tts2face.sound.received_sound import decode_sound
from tts2face.sound.voice import SpokenWord, VoiceSetting
from tts2face.sound.voice_pool import VoicePool, find_voice, load_voice, voice_names
from tts2face.sound.voice_server import ServerVoice, SpeechClient, matched_times
from tts2face.sound.voice_urls import KEY_VARIABLE, NAMES_VARIABLE, SERVER_FAILS, parse_voice_url

TEXT = "Bob may move five big maps."
DOCUMENT = '<speak><voice name="{}">Hello.</voice></speak>'


def says(content: dict[str, Any]) -> Reply:
    return wave_reply(spoken(content["input"], content["speed"]))


def client_of(server: SpeechServer, waits: list[float] | None = None) -> SpeechClient:
    return SpeechClient(parse_voice_url(server.url), [].append if waits is None else waits.append)


def onsets(voice: Any) -> np.ndarray:
    return np.array([voice.phones.edges[word.first] for word in voice.words])


def test_the_sound_of_a_server_gets_edges_of_ours() -> None:
    with speech_server(speech=says) as server:
        found = load_voice(server.url, "en-us").speak(TEXT)
    truth = spoken(TEXT)
    assert [word.text for word in found.words] == TEXT[:-1].split()
    assert np.abs(onsets(found) - onsets(truth)).max() < 0.05
    assert min(word.confidence for word in found.words) > 0.2
    path, headers, content = server.asked[-1]
    assert (path, content["voice"], content["model"], content["response_format"]) == (
        "/v1/audio/speech", "af_heart", "tts-1", "wav",
    )  # fmt: skip
    assert "Authorization" not in headers


def test_rates_are_the_servers() -> None:
    with speech_server(speech=says) as server:
        voice = load_voice(server.url, "en-us")
        slow, fast = (voice.sound(TEXT, rate=rate) for rate in (0.8, 1.6))
    assert slow.duration / fast.duration == pytest.approx(1.8, abs=0.25)  # silence stays


def test_word_times_are_asked_for_once_where_there_are_none() -> None:
    with speech_server(speech=says) as server:
        client = client_of(server)
        client.sound("One.", 1.0)
        client.sound("Two.", 1.0)
    assert [path for path, *_ in server.asked] == ["/dev/captioned_speech", "/v1/audio/speech", "/v1/audio/speech"]


def test_word_times_decide_where_ours_are_far_off() -> None:
    words = [SpokenWord(word, ()) for word in TEXT[:-1].split()]
    for later_s, expected_s in ((0.06, 0.0), (0.4, 0.4)):  # those of Kokoro are some 60 ms off
        with speech_server(captioned=lambda content, s=later_s: captioned_reply(spoken(content["input"]), s)) as server:
            found = ServerVoice(server.url, VoiceSetting("en-us")).speak(words)
        assert np.median(onsets(found) - onsets(spoken(TEXT[:-1]))) == pytest.approx(expected_s, abs=0.04)
        assert not server.texts()


def test_a_sentence_that_is_expected_is_asked_for_once() -> None:
    with speech_server(speech=says) as server:
        voice = ServerVoice(server.url, VoiceSetting("en-us"))
        voice.expect("Two.")
        voice.sound("One.")
        voice.sound("Two.")
    assert sorted(server.texts()) == ["One.", "Two."]


@pytest.mark.parametrize(
    ("status", "error", "said"),
    [
        (400, InputError, r"no voice af_heart.*check the voice 'af_heart'"),
        (401, BackendError, f"another key.*{KEY_VARIABLE}"),
        (404, InputError, "check the voice"),
        (500, BackendError, "fails"),
        (503, BackendError, "fails"),
        (302, BackendError, "redirects.*not followed"),
    ],
)
def test_errors_of_a_server_are_said(status: int, error: type[Exception], said: str) -> None:
    body = json.dumps({"error": {"message": "no voice af_heart\x00\n"}}).encode()
    with (
        speech_server(speech=lambda _: (status, {"Location": "http://127.0.0.1:1/"}, body)) as server,
        pytest.raises(error, match=said),
    ):
        client_of(server).sound(TEXT, 1.0)
    assert len(server.texts()) == (3 if status in (500, 503) else 1)


def test_clients_of_a_service_do_not_learn_where_a_voice_comes_from(caplog: pytest.LogCaptureFixture) -> None:
    body = b'{"error": {"message": "wrong key sk-1 for Bob"}}'
    with speech_server(speech=lambda _: (401, {}, body)) as server, pytest.raises(BackendError) as failed:
        client_of(server).sound(TEXT, 1.0)
    with caplog.at_level("WARNING"):
        refused = as_refused(failed.value)
    assert (refused.status, refused.code) == (503, "unavailable")
    assert "log says why" in refused.message
    assert not {str(server.port), "sk-1"} & set(re.findall(r"[\w-]+", refused.message))
    (record,) = caplog.records
    assert str(server.port) in record.fields["reason"]
    assert "(401)" in record.fields["reason"]
    assert "Bob" not in record.fields["reason"]


def test_a_failed_job_does_not_name_the_server_either(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    message = "the voice server http://10.0.0.7:8880 refuses the request (400: no 'Bob'); check the voice"
    with caplog.at_level("WARNING"):
        assert _for_clients(message, tmp_path) == SERVER_FAILS
    (record,) = caplog.records
    assert "10.0.0.7" in record.fields["reason"]
    assert "Bob" not in record.fields["reason"]
    assert _for_clients(f"{tmp_path}/inputs/a.srt is no file", tmp_path) == "inputs/a.srt is no file"


def test_a_busy_server_is_asked_again_when_it_wishes() -> None:
    busy, waits = iter([(429, {"Retry-After": "3"}, b""), (503, {}, b"")]), list[float]()
    with speech_server(speech=lambda content: next(busy, None) or says(content)) as server:
        client_of(server, waits).sound(TEXT, 1.0)
    assert waits == [3.0, 2.0]


def test_a_server_that_is_not_there_is_said() -> None:
    with speech_server() as server:
        pass
    with pytest.raises(BackendError, match=r"127\.0\.0\.1:\d+/v1 does not answer .*start it"):
        client_of(server).sound(TEXT, 1.0)


def test_an_answer_that_breaks_off_is_asked_for_again() -> None:
    def half(content: dict[str, Any]) -> Reply:
        _, headers, body = says(content)
        return 200, {**headers, "Content-Length": str(len(body))}, body[: len(body) // 2]

    broken = iter([True])
    with speech_server(speech=lambda content: half(content) if next(broken, False) else says(content)) as server:
        sound, _ = client_of(server).sound(TEXT, 1.0)
    assert sound.duration == spoken(TEXT).waveform.duration
    with speech_server(speech=half) as server, pytest.raises(BackendError, match=r"broke .* bytes before the end"):
        client_of(server).sound(TEXT, 1.0)


@pytest.mark.parametrize(
    ("kind", "order", "rate"),
    [
        ("audio/pcm", "<i2", 24_000),
        ("audio/L16;rate=16000;channels=1", ">i2", 16_000),
        ("audio/l16; codec=pcm; rate=22050", "<i2", 22_050),
    ],
)
def test_samples_without_a_header_are_read_by_their_media_type(kind: str, order: str, rate: int) -> None:
    samples = 0.5 * np.sin(np.arange(8000) / 15)
    body = np.round(samples * 32768).astype(order).tobytes() + b"\0"
    found = decode_sound(body, kind)
    assert found.rate == rate
    np.testing.assert_allclose(found.samples, samples, atol=1e-4)
    with pytest.raises(DataError, match="its rate is 7 Hz"):
        decode_sound(body, "audio/pcm;rate=7")


def test_silence_is_no_speech() -> None:
    with pytest.raises(DataError, match="it is silent"):
        decode_sound(bytes(4000), "audio/pcm")


@pytest.mark.parametrize("body", [b"", b"<html>no</html>", b"RIFF\x04\0\0\0WAVE"])
def test_what_is_no_sound_is_refused(body: bytes) -> None:
    with (
        speech_server(speech=lambda _: (200, {"Content-Type": "audio/wav"}, body)) as server,
        pytest.raises(DataError, match="no sound"),
    ):
        client_of(server).sound(TEXT, 1.0)


def test_an_answer_without_an_end_is_cut_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tts2face.sound.voice_server.LARGEST_BYTES", 10_000)
    with speech_server(speech=says) as server, pytest.raises(DataError, match="more than"):
        client_of(server).sound(TEXT, 1.0)


def test_wave_files_of_streams_do_not_know_their_length() -> None:
    whole = wave_reply(spoken(TEXT))[2]
    at = whole.index(b"data") + 4
    stream = whole[:4] + b"\xff" * 4 + whole[8:at] + b"\xff" * 4 + whole[at + 4 :]
    assert len(decode_sound(stream).samples) == len(decode_sound(whole).samples)


def test_a_key_is_sent_to_this_machine_and_over_https_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(KEY_VARIABLE, "secret")
    with speech_server(speech=says) as server:
        client_of(server).sound(TEXT, 1.0)
    assert server.asked[-1][1]["Authorization"] == "Bearer secret"
    SpeechClient(parse_voice_url("https://api.example.org/v1#alloy"))
    with pytest.raises(InputError, match="unencrypted"):
        SpeechClient(parse_voice_url("http://10.0.0.8:8880/v1#af_heart"))


def test_a_proxy_is_not_asked_for_this_machine(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:1")
    monkeypatch.delenv("no_proxy", raising=False)
    with speech_server(speech=says) as server:
        client_of(server).sound(TEXT, 1.0)
    with pytest.raises(BackendError, match="does not answer"):
        SpeechClient(parse_voice_url("http://192.0.2.1/v1#a"), [].append).sound(TEXT, 1.0)


@pytest.mark.parametrize(
    ("url", "model", "voice", "base"),
    [
        ("http://127.0.0.1:8880/v1#af_heart", "tts-1", "af_heart", "http://127.0.0.1:8880/v1"),
        ("https://api.openai.com/v1/#gpt-4o-mini-tts/alloy", "gpt-4o-mini-tts", "alloy", "https://api.openai.com/v1"),
        ("http://[::1]:9/v1#a%20b", "tts-1", "a b", "http://[::1]:9/v1"),
        ("http://localhost/v1#org/model/af_bella(2)+af_sky", "org/model", "af_bella(2)+af_sky", "http://localhost/v1"),
    ],
)
def test_urls_name_server_model_and_voice(url: str, model: str, voice: str, base: str) -> None:
    address = parse_voice_url(url)
    assert (address.model, address.voice, address.base) == (model, voice, base)


@pytest.mark.parametrize(
    "url", ["http://", "http:///v1#a", "http://host/v1", "http://host:x/v1#a", "http://host/v1?voice=a#b", "http://[#a"]
)
def test_other_urls_are_refused(url: str) -> None:
    with pytest.raises(InputError, match="http://host:port/v1#voice"):
        load_voice(url, "en-us")


def test_a_password_in_a_url_is_refused() -> None:
    with pytest.raises(InputError, match=KEY_VARIABLE):
        load_voice("http://user:secret@host/v1#a", "en-us")


def test_a_text_without_words_is_not_sent() -> None:
    with speech_server(speech=says) as server, pytest.raises(SilentTextError):
        ServerVoice(server.url, VoiceSetting("en-us")).sound("...")
    assert not server.asked


def test_times_count_where_all_words_have_one() -> None:
    stated = [("Hello", 0.1, 0.3), (",", 0.3, 0.4), ("there.", 0.4, 0.7)]
    assert matched_times(["hello", "there"], stated) == [(0.1, 0.3), (0.4, 0.7)]
    assert matched_times(["hello", "you"], stated) == []
    assert matched_times(["hello", "there"], [*stated[:2], ("there", 0.2, 0.1)]) == []


def test_an_operator_names_voices_of_servers(monkeypatch: pytest.MonkeyPatch) -> None:
    with speech_server(speech=says) as server:
        monkeypatch.setenv(NAMES_VARIABLE, f"kokoro={server.url} other=https://example.org/v1#a")
        assert {"kokoro", "other"} <= set(voice_names())
        assert "to which texts are sent" in find_voice("kokoro").summary
        check_voice("kokoro")
        load_voice("kokoro", "en-us").sound("Hello.")
    assert server.texts() == ["Hello."]
    monkeypatch.setenv(NAMES_VARIABLE, "heart=https://example.org/v1#a")
    with pytest.raises(InputError, match="as another voice, heart"):
        load_voice("heart", "en-us")
    monkeypatch.setenv(NAMES_VARIABLE, "kokoro=ftp://example.org")
    with pytest.raises(InputError, match="named voices must be such as"):
        voice_names()
    with pytest.raises(InputError, match="named voices must be such as"):
        ServiceSettings(voices=("Kokoro",))


def test_clients_documents_and_files_cannot_name_a_url(tmp_path: Path) -> None:
    url = "http://127.0.0.1:1/v1#a"
    with pytest.raises(RefusedError, match="there is no voice"):
        check_voice(url)
    with suppress(InputError):  # refused, or spoken by another voice
        assert not any(run.voice for run in prepare(Request(text=DOCUMENT.format(url))).text.runs)
    with pytest.raises(DataError, match="command line alone"):
        cast_from_tables({"default": {"voice": url}}, "the cast")
    with pytest.raises(DataError, match="command line alone"):
        parse_project({"format": "tts2face project", "version": 2, "request": {"voice": url}}, "scene.json", tmp_path)
    (tmp_path / "lines.csv").write_text(f"file,cue,voice\na,1,{url}\n", encoding="utf-8")
    with pytest.raises(DataError, match="command line alone"):
        read_lines(tmp_path / "lines.csv", ["a"])


def test_the_next_sentence_is_asked_for_while_one_is_worked_on() -> None:
    with speech_server(speech=says) as server:
        prepared = prepare(Request(text="One. Two. Three.", voice=server.url, rate=1.2))
        models = SpeechModels(fitted_voices(VoicePool(), None, {}))
        sentences = speak_sentences(prepared, models, has_phones=False)
        next(sentences)
        until = time.monotonic() + 5
        while len(server.texts()) < 2 and time.monotonic() < until:
            time.sleep(0.01)
        assert sorted(server.texts()) == ["One.", "Two."]
        list(sentences)
    assert sorted(server.texts()) == ["One.", "Three.", "Two."]
