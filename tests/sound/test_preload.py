"""A voice that is loaded ahead is loaded once, and its errors are raised where it is used."""

import threading
from typing import Any

import pytest

from lexicon.errors import InputError
from tts2face.request import Request
from tts2face.session.prepared import prepare
from tts2face.sound import voice_pool
from tts2face.sound.voice_pool import VoicePool


class CountedLoading:
    """Stands in for `load_voice`: counts its calls and lasts until `done` is set."""

    def __init__(self) -> None:
        self.names: list[Any] = []
        self.done = threading.Event()

    def __call__(self, name: str | None, *_: object) -> object:
        self.names.append(name)
        assert self.done.wait(5)
        if name == "nobody":
            raise InputError("there is no voice 'nobody'")
        return object()


@pytest.fixture
def loading(monkeypatch: pytest.MonkeyPatch) -> CountedLoading:
    counted = CountedLoading()
    monkeypatch.setattr(voice_pool, "load_voice", counted)
    return counted


def test_a_request_waits_for_the_voice_that_is_being_loaded(loading: CountedLoading) -> None:
    voices = VoicePool()
    voices.preload(None, "en-us", {})
    voices.preload(None, "en-us", {})
    threading.Timer(0.2, loading.done.set).start()
    voices.voice(None, "en-us", {})
    voices.preload(None, "en-us", {})  # it is in memory
    assert loading.names == [None]
    voices.voice("other", "en-us", {})
    assert loading.names == [None, "other"]


def test_an_unknown_voice_is_refused_when_it_is_used(loading: CountedLoading) -> None:
    voices = VoicePool()
    loading.done.set()
    voices.preload("nobody", "en-us", {})
    with pytest.raises(InputError, match="no voice 'nobody'"):
        voices.voice("nobody", "en-us", {})


def test_only_text_loads_a_voice(loading: CountedLoading) -> None:
    loading.done.set()
    voices = VoicePool()
    prepare(Request(idle=1.0)).preload_voice(voices)
    assert loading.names == []
    prepare(Request(text="Hello.")).preload_voice(voices)
    voices.voice("heart", Request(text="Hello.").language, {})
    assert loading.names == ["heart"]
