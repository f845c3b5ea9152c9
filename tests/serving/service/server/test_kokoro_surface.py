"""What clients of Kokoro-FastAPI send beyond OpenAI's interface, and words of other writing systems."""

import base64
import io
import json
import wave
from urllib.parse import quote

import av
import httpx
import numpy as np
import pytest

from tts2face.serving.service.downloads import MAX_CHARACTERS, Downloads
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.messages import Work

SPEECH = {"model": "kokoro", "voice": "af_bella", "input": "Hello there."}
ADJUSTED = "x-tts2face-adjusted"


def spoken(client: httpx.Client, text: str, **fields: object) -> httpx.Response:
    answer = client.post("/v1/audio/speech", json={**SPEECH, "input": text, **fields})
    assert answer.status_code == 200, answer.text
    return answer


def seconds_of(answer: httpx.Response) -> float:
    """Seconds of an answer of 16-bit samples at 24 kHz."""
    return len(answer.content) / 48_000


def words_of(client: httpx.Client, text: str) -> list[str]:
    asked = {**SPEECH, "input": text, "stream": False, "response_format": "pcm"}
    return [one["word"] for one in client.post("/dev/captioned_speech", json=asked).json()["timestamps"]]


@pytest.mark.parametrize(
    ("text", "word", "note"),
    [
        ("The word 你好 means hello.", "你好", "Chinese words are spoken in cmn"),
        ("Say Привет to them.", "Привет", "Cyrillic words are spoken in ru"),
        ("She is called Ἀχιλλεύς here.", "Ἀχιλλεύς", "Greek words are spoken in el"),
        ("The word ខ្មែរ is a name.", "kha", "Khmer words are spelled"),
    ],
)
def test_a_foreign_word_is_spoken_and_named(client: httpx.Client, text: str, word: str, note: str) -> None:
    assert word in words_of(client, text)
    assert note in spoken(client, text).headers[ADJUSTED]
    assert note in client.post("/v1/clips", json={"text": text, "format": "words"}).headers[ADJUSTED]
    assert note in client.post("/v1/synthesize", json={"input": text}).headers[ADJUSTED]


def test_phones_of_a_foreign_word_are_in_those_of_a_text(client: httpx.Client) -> None:
    given = [client.post("/dev/phonemize", json={"text": text}).json()["phonemes"] for text in ("A 你好.", "A.")]
    assert len(given[0].split()) > len(given[1].split())


@pytest.mark.parametrize("format", ["wav", "flac", "weba", "mp3"])
def test_an_answer_that_is_not_streamed_is_a_complete_file(client: httpx.Client, format: str) -> None:
    content = spoken(client, "Hello there.", stream=False, response_format=format).content
    with av.open(io.BytesIO(content), "r") as file:
        assert 0.5 < (file.duration or 0) / av.time_base < 3.0


def samples_of(content: bytes) -> bytes:
    """Samples of a WAV file, of as many frames as its header states."""
    with wave.open(io.BytesIO(content)) as file:
        samples = file.readframes(file.getnframes())
        assert len(samples) == 2 * file.getnframes()
    assert content.endswith(samples)
    return samples


def test_sound_within_json_is_a_complete_file(client: httpx.Client) -> None:
    answers = [
        client.post("/v1/audio/speech", json={**SPEECH, "response_format": "wav", "timestamps": ["word"]}).json(),
        client.post("/dev/captioned_speech", json={**SPEECH, "response_format": "wav", "stream": False}).json(),
    ]
    for answer in answers:
        assert samples_of(base64.b64decode(answer["audio"]))
        assert answer["audio_format"] == "audio/wav"


def test_a_download_link_gives_a_complete_file(client: httpx.Client) -> None:
    streamed = spoken(client, "Hello there.", response_format="pcm", return_download_link=True, download_format="wav")
    path = streamed.headers["x-download-path"]
    assert path.startswith("/download/")
    for address in (f"/v1{path}", path):
        file = client.get(address)
        assert (file.status_code, file.headers["content-type"]) == (200, "audio/wav")
        assert file.headers["content-disposition"] == f'attachment; filename="{path.rpartition("/")[2]}"'
        assert samples_of(file.content) == streamed.content
    captioned = client.post("/dev/captioned_speech", json={**SPEECH, "return_download_link": True})
    assert client.get(f"/v1{captioned.headers['x-download-path']}").headers["content-type"] == "audio/mpeg"


def test_no_link_is_given_unasked_or_followed_unknown(client: httpx.Client) -> None:
    assert "x-download-path" not in spoken(client, "Hello there.").headers
    for name in ("0123456789abcdef01234567.mp3", quote("../../etc/passwd", safe="")):
        assert client.get(f"/v1/download/{name}").status_code == 404


def test_links_belong_to_a_key_and_are_bounded() -> None:
    downloads = Downloads()
    small = downloads.add("small", Work(request={"text": "Hello."}, format="mp3"), "mp3")
    long = Work(request={"text": "a" * (MAX_CHARACTERS // 10)}, format="mp3")
    names = [downloads.add("large", long, "flac") for _ in range(12)]
    with pytest.raises(RefusedError, match="there is no file"):
        downloads.find("large", small)
    with pytest.raises(RefusedError, match="speak the text again"):
        downloads.find("large", names[0])
    assert downloads.find("small", small).format == "mp3"
    last = downloads.find("large", names[-1])
    assert (last.format, last.is_complete) == ("flac", True)


@pytest.mark.parametrize("given", ["af_bella+am_adam(3)", ["af_bella", "am_adam(3)"]])
def test_a_combination_is_a_name_that_speaks(client: httpx.Client, given: object) -> None:
    answer = client.post("/v1/audio/voices/combine", json=given)
    assert answer.status_code == 200, answer.text
    assert answer.json() == {"voice": "af_bella+am_adam(3)", "speaks": answer.json()["speaks"], "language": "en-us"}
    assert "filename=" in answer.headers["content-disposition"]
    adjusted = spoken(client, "Hello.", voice=answer.json()["voice"]).headers[ADJUSTED]
    assert adjusted.endswith(f"is {answer.json()['speaks']}")


@pytest.mark.parametrize("given", ["", [], "+", "heart+joe", ["af_bella", "nobody"], "af_bella+a\r\nb: c"])
def test_what_cannot_be_combined_is_refused(client: httpx.Client, given: object) -> None:
    answer = client.post("/v1/audio/voices/combine", json=given)
    assert answer.status_code == 400
    assert "voice" in answer.json()["error"]["message"]


def test_phones_are_spoken(client: httpx.Client) -> None:
    answer = client.post("/dev/generate_from_phonemes", json={"phonemes": "həlˈO wˈɜɹld.", "voice": "af_bella"})
    assert (answer.status_code, answer.headers["content-type"]) == (200, "audio/wav")
    samples = np.frombuffer(samples_of(answer.content), "<i2")
    assert 0.5 < len(samples) / 24_000 < 3.0
    assert np.abs(samples).max() > 3000


def test_phones_of_a_text_are_spoken_again(client: httpx.Client) -> None:
    phones = client.post("/dev/phonemize", json={"text": "Hello, butter!", "language": "a"}).json()["phonemes"]
    answer = client.post("/dev/generate_from_phonemes", json={"phonemes": phones, "voice": "af_bella"})
    assert answer.status_code == 200, answer.text


@pytest.mark.parametrize("phones", ["?!", "b§d", "[nod]"])
def test_what_is_no_phone_is_refused(client: httpx.Client, phones: str) -> None:
    answer = client.post("/dev/generate_from_phonemes", json={"phonemes": phones, "voice": "af_bella"})
    assert answer.status_code == 400


def test_a_pause_is_silent(client: httpx.Client) -> None:
    without = spoken(client, "Hello, there.", response_format="pcm")
    paused = spoken(client, "Hello, [pause:1.5s] there.", response_format="pcm")
    assert 1.0 < seconds_of(paused) - seconds_of(without) < 1.8


def test_given_phones_are_spoken_where_kokoro_is_expected(client: httpx.Client) -> None:
    lines = [
        client.post("/v1/audio/speech", json={**SPEECH, "input": text, "response_format": "wav",
                                              "timestamps": ["phone"]}).json()["phones"]
        for text in ("[Misaki](/mɪsˈɑki/) is here.", "Misaki is here.", "[Misaki](https://example.org) is here.")
    ]  # fmt: skip
    names = [[one["phone"] for one in phones if one["phone"] != "sil"] for phones in lines]
    assert names[0][:6] == ["m", "ɪ", "s", "ɑ", "k", "i"]
    assert names[2] == names[1]  # the label of a link


def test_elsewhere_brackets_are_the_label_of_a_link(client: httpx.Client) -> None:
    clip = {"text": "[Misaki](/mɪsˈɑki/) is here.", "format": "words"}
    words = [json.loads(line) for line in client.post("/v1/clips", json=clip).text.splitlines()]
    assert [word["word"] for word in words] == ["Misaki", "is", "here"]


@pytest.mark.parametrize("path", ["/v1/audio/speech", "/dev/phonemize", "/dev/generate_from_phonemes"])
def test_a_text_that_is_too_long_is_refused_before_its_marks_are_read(client: httpx.Client, path: str) -> None:
    long = "[a](/a/) " * 50_000
    answer = client.post(path, json={**SPEECH, "input": long, "text": long, "phonemes": long})
    assert (answer.status_code, answer.json()["error"]["code"]) == (413, "too_long")


def test_a_voice_of_the_service_speaks_another_writing_system(client: httpx.Client) -> None:
    answer = spoken(client, "Привет, мир", voice="heart")
    assert "Cyrillic words are spoken in ru" in answer.headers[ADJUSTED]
