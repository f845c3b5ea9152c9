"""Voices of a server with OpenAI's route ``/v1/audio/speech``: their sound over HTTP, with phone edges of our own.

The text of each sentence leaves the process, and the machine if the server is another one.
"""

import base64
import binascii
import http.client
import json
import os
import time
import urllib.error
import urllib.request
from collections import OrderedDict
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any

import numpy as np

from lexicon.errors import BackendError, DataError, InputError, SilentTextError
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan, enforce_increasing
from lexicon.values.json_text import parse_json
from tts2face.sound.aligned_speech import aligned_speech, written_text
from tts2face.sound.alignment import Align, Aligner
from tts2face.sound.received_sound import decode_sound
from tts2face.sound.voice import PronunciationMap, SpeechInput, VoiceSetting, apply_volume, pronounce_content
from tts2face.sound.voice_urls import KEY_VARIABLE, ServerAddress, parse_voice_url
from tts2face.types import Speech, Waveform

SILENCE_S = 60.0  # without a byte from the server, which may make all of a sentence before the first one
LONGEST_S = 300.0  # of one answer: a slow machine needs minutes for a sentence of 400 characters
LARGEST_BYTES = 64 << 20  # of one answer: eleven minutes at 48 kHz
BLOCK_BYTES = 1 << 16
WAITS_S = (0.5, 2.0)  # before the second and the third try
TRY_AGAIN = frozenset({429, 500, 502, 503, 504})
MAX_SAID = 200  # characters of a server's own words in a message
RATES_OF_SERVERS = (0.25, 4.0)  # OpenAI's limits of ``speed``
AGREES_S = 0.15  # from the word times of a server, which are some 60 ms from the sound (as those of Kokoro)
N_AHEAD = 4  # answers that wait for their turn


class _NoRedirects(urllib.request.HTTPRedirectHandler):
    """Refuses redirects, by which a server would send a text and a key elsewhere."""

    def redirect_request(self, *_: Any) -> None:
        """None: the answer stays what it is."""


@dataclass(frozen=True, slots=True)
class _Answer:
    status: int
    kind: str
    body: bytes
    wait_s: float | None = None


@dataclass(slots=True)
class SpeechClient:
    """Asks a server for the sound of sentences; safe from several threads.

    Proxies of the environment are used as by other programs (HTTPS_PROXY, NO_PROXY), but never for this machine.

    Parameters
    ----------
    sleep
        Waits some seconds between two tries.
    """

    address: ServerAddress
    sleep: Callable[[float], None] = time.sleep
    _states_words: bool = True
    _opener: Any = field(init=False)

    def __post_init__(self) -> None:
        """Refuse to send a key in the clear to another machine."""
        key, address = os.environ.get(KEY_VARIABLE, ""), self.address
        if key and address.base.startswith("http://") and not address.is_this_machine:
            raise InputError(
                f"{KEY_VARIABLE} would be sent unencrypted to {address.place}; give https://, or unset the variable"
            )
        proxies = urllib.request.ProxyHandler({} if address.is_this_machine else None)
        self._opener = urllib.request.build_opener(proxies, _NoRedirects)

    def sound(self, text: str, rate: float) -> tuple[Waveform, list[tuple[str, float, float]]]:
        """Sound of a text, and its words with their begins and ends in seconds where the server states them.

        Raises
        ------
        InputError
            The server refuses the request, for instance an unknown voice.
        BackendError
            It cannot be reached, does not answer in time, or fails.
        DataError
            It sends something else than sound.
        """
        content = {"model": self.address.model, "input": text, "voice": self.address.voice, "speed": rate}
        content["response_format"] = "wav"
        if self._states_words:
            captioned = self._captioned(content)
            if captioned is not None:
                return captioned
            self._states_words = False
        answer = self._ask(f"{self.address.base}/audio/speech", content)
        return self._wave(answer.body, answer.kind), []

    def _captioned(self, content: Mapping[str, Any]) -> tuple[Waveform, list[tuple[str, float, float]]] | None:
        """Sound and words by the route of Kokoro-FastAPI; None where a server has no such route."""
        root = self.address.base.removesuffix("/v1")
        more = {"stream": False, "return_timestamps": True}
        answer = self._try(f"{root}/dev/captioned_speech", {**content, **more}, n_tries=1)
        if answer is None or answer.status != 200 or "json" not in answer.kind:
            return None
        try:
            found = parse_json(answer.body.decode(), self.address.place)
            sound = self._wave(base64.b64decode(found["audio"], validate=True))
            stated = found.get("timestamps") or []
            words = [(str(word["word"]), float(word["start_time"]), float(word["end_time"])) for word in stated]
        except (ValueError, KeyError, TypeError, AttributeError, binascii.Error):
            return None
        return sound, words

    def _wave(self, body: bytes, kind: str = "") -> Waveform:
        try:
            return decode_sound(body, kind)
        except DataError as wrong:
            raise DataError(
                f"the voice server {self.address.place} sends no sound that can be read: {wrong}; check the URL"
            ) from wrong

    def _ask(self, url: str, content: Mapping[str, Any]) -> _Answer:
        answer = self._try(url, content, n_tries=1 + len(WAITS_S))
        assert answer is not None  # all tries of more than one raise
        if answer.status == 200:
            return answer
        said = f"{answer.status}{_words_of(answer)}"
        if 300 <= answer.status < 400:
            raise BackendError(
                f"the voice server {self.address.place} redirects to another place, which is not followed; give its URL"
            )
        if answer.status in (401, 403):
            raise BackendError(
                f"the voice server {self.address.place} wants another key ({said}); put it into {KEY_VARIABLE}"
            )
        if 400 <= answer.status < 500 and answer.status not in TRY_AGAIN:
            raise InputError(
                f"the voice server {self.address.place} refuses the request ({said}); check the voice "
                f"{self.address.voice!r}, the model {self.address.model!r} and the path of the URL"
            )
        raise BackendError(f"the voice server {self.address.place} fails ({said}); look into its log")

    def _try(self, url: str, content: Mapping[str, Any], n_tries: int) -> _Answer | None:
        """Answer to a request; None for one that had a single try and was not answered."""
        for number in range(n_tries):
            is_last = number + 1 == n_tries
            try:
                answer = self._send(url, content)
            except (OSError, http.client.HTTPException) as failed:
                if n_tries == 1:
                    return None
                if is_last:
                    reason = getattr(failed, "reason", failed)
                    raise BackendError(
                        f"the voice server {self.address.place} does not answer ({reason}); start it, or check the URL"
                    ) from failed
                self.sleep(WAITS_S[number])
                continue
            if answer.status not in TRY_AGAIN or is_last:
                return answer
            self.sleep(WAITS_S[number] if answer.wait_s is None else answer.wait_s)
        return None

    def _send(self, url: str, content: Mapping[str, Any]) -> _Answer:
        key = os.environ.get(KEY_VARIABLE, "")
        headers = {"Content-Type": "application/json", "Accept": "audio/wav, application/json"}
        headers |= {"Authorization": f"Bearer {key}"} if key else {}
        request = urllib.request.Request(url, json.dumps(content).encode(), headers)
        try:
            with self._opener.open(request, timeout=SILENCE_S) as response:
                return _Answer(response.status, response.headers.get("Content-Type", ""), self._read(response))
        except urllib.error.HTTPError as refused:
            with refused:
                wait = refused.headers.get("Retry-After", "")
                wait_s = min(float(wait), 10.0) if wait.isdigit() else None
                return _Answer(refused.code, refused.headers.get("Content-Type", ""), refused.read(4096), wait_s)

    def _read(self, response: Any) -> bytes:
        """Body of an answer, up to `LARGEST_BYTES` and `LONGEST_S`."""
        found, until = bytearray(), time.monotonic() + LONGEST_S
        while block := response.read1(BLOCK_BYTES):
            found += block
            if len(found) > LARGEST_BYTES:
                raise DataError(
                    f"the voice server {self.address.place} sends more than {LARGEST_BYTES >> 20} MB for a sentence; "
                    "check the URL"
                )
            if time.monotonic() > until:
                raise TimeoutError(f"an answer lasts longer than {LONGEST_S:.0f} s")
        # http.client ends quietly where a connection breaks
        if response.length:
            raise ConnectionError(f"the connection broke {response.length} bytes before the end of its answer")
        return bytes(found)


def _words_of(answer: _Answer) -> str:
    """Words of a server about an error: the message of OpenAI's form, or its first characters."""
    text = answer.body.decode("utf-8", "replace")
    try:
        found = parse_json(text, "answer")
        error = found.get("error", found.get("detail", ""))
        text = str(error.get("message", "") if isinstance(error, dict) else error)
    except (ValueError, AttributeError):
        pass
    text = "".join(letter if letter.isprintable() else " " for letter in text[:MAX_SAID]).strip()
    return f": {text}" if text else ""


class ServerVoice:
    """A voice of a server, whose sound is aligned with the phones of its text; its loading asks the server nothing.

    Parameters
    ----------
    url
        As `parse_voice_url`.
    """

    def __init__(self, url: str, setting: VoiceSetting) -> None:
        self._client = SpeechClient(parse_voice_url(url))
        self._language = setting.language
        self._own_words: PronunciationMap = setting.own_words
        self._align: Align = setting.align or Aligner().align
        self._wait = setting.wait
        self._rate_hz: int | None = None
        self._threads = ThreadPoolExecutor(N_AHEAD, "voice-server")
        self._asked: OrderedDict[str, Future[Any]] = OrderedDict()

    @property
    def sample_rate(self) -> int:
        """Sample rate in Hz, that of the first sound; a word is spoken to know it."""
        if self._rate_hz is None:
            self._sound_of("Yes.", 1.0)
        assert self._rate_hz is not None
        return self._rate_hz

    def expect(self, content: SpeechInput) -> None:
        """Ask for the sound of a sentence that will be spoken soon."""
        text = written_text(content)
        if text and text not in self._asked:
            self._asked[text] = self._ask(text, 1.0)
            while len(self._asked) > N_AHEAD:
                self._asked.popitem(last=False)[1].cancel()

    def _ask(self, text: str, rate: float) -> Future[Any]:
        return self._threads.submit(self._client.sound, text, _speed(rate))

    def speak(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Speech:
        """Synthesise a sentence; see `tts2face.sound.voice.Voice`. What a server sends does not depend on `seed`."""
        words = [
            (word.text, [tuple(word.phones)]) for word in pronounce_content(content, self._language, self._own_words)
        ]
        sound, stated = self._sound_of(written_text(content), rate)
        times = matched_times([word for word, _ in words], stated)
        speech = aligned_speech(sound, words, self._align)
        phones, spans = speech.phones, speech.words
        starts = phones.edges[[word.first for word in spans]]
        if times and times[-1][1] <= sound.duration and np.abs(starts - [start for start, _ in times]).max() > AGREES_S:
            phones, spans = _moved(phones, spans, times)
        return Speech(sound, phones, spans)

    def sound(self, content: SpeechInput, *, rate: float = 1.0, seed: int = 0) -> Waveform:
        """Sound without the alignment of its phones."""
        return self._sound_of(written_text(content), rate)[0]

    def _sound_of(self, text: str, rate: float) -> tuple[Waveform, list[tuple[str, float, float]]]:
        if not any(letter.isalnum() for letter in text):
            raise SilentTextError("there is nothing to say in the text; give at least one word")
        asked = self._asked.pop(text, None) if rate == 1.0 else None
        asked = asked or self._ask(text, rate)
        sound, stated = self._wait(asked)
        self._rate_hz = self._rate_hz or sound.rate
        if sound.rate != self._rate_hz:
            sound = sound.resampled(self._rate_hz)
        return Waveform(apply_volume(sound.samples), sound.rate), stated


def _speed(rate: float) -> float:
    return float(np.clip(round(rate, 4), *RATES_OF_SERVERS))


def matched_times(words: Sequence[str], stated: Sequence[tuple[str, float, float]]) -> list[tuple[float, float]]:
    """Begins and ends of words in seconds, of those that a server states; empty unless it states all in their order."""
    named = [(_letters(word), start, end) for word, start, end in stated if _letters(word)]
    if [name for name, _, _ in named] != [_letters(word) for word in words]:
        return []
    bounds = [bound for _, start, end in named for bound in (start, end)]
    is_rising = all(0.0 <= first <= last for first, last in pairwise(bounds))
    return [(start, end) for _, start, end in named] if is_rising and np.isfinite(bounds).all() else []


def _moved(
    phones: PhoneSequence, words: Sequence[WordSpan], times: Sequence[tuple[float, float]]
) -> tuple[PhoneSequence, tuple[WordSpan, ...]]:
    """Phones of words at other times of the words, within which their edges keep their shares."""
    labels, edges = list[str](), [0.0]
    spans = []
    for word, (start, end) in zip(words, times, strict=True):
        if start > edges[-1]:
            labels.append(SILENCE)
            edges.append(start)
        own = phones.edges[word.first : word.last + 1]
        spans.append(replace(word, first=len(labels), last=len(labels) + word.last - word.first))
        labels += phones.phones[word.first : word.last]
        edges += [start + (end - start) * float(edge - own[0]) / float(own[-1] - own[0]) for edge in own[1:]]
    if phones.end > edges[-1]:
        labels.append(SILENCE)
        edges.append(phones.end)
    edges[-1] = phones.end
    return PhoneSequence(labels, enforce_increasing(np.array(edges))), tuple(spans)


def _letters(word: str) -> str:
    return "".join(letter for letter in word.lower() if letter.isalnum())
