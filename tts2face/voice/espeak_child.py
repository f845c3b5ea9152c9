"""A process of its own that speaks one text with espeak-ng and ends.

The library is not thread safe and does not repeat itself within a process. Reads one JSON request from standard input;
writes one line of JSON (rate, events, number of bytes), then the samples as 16-bit little endian. Run as a file, with
nothing but the standard library and espeakng_loader.
"""

import ctypes
import json
import os
import sys
import threading
import time
from typing import Any

SYNCHRONOUS, PHONEME_EVENTS, IPA_EVENTS, DO_NOT_EXIT = 2, 0x0001, 0x0002, 0x8000  # speak_lib.h
WORD_EVENT, PHONEME_EVENT = 1, 7
CHARACTERS_UTF8, PHONEMES_IN_BRACKETS, POSITION_IN_CHARACTERS = 1, 0x100, 1
RATE_PARAMETER = 1
DEFAULT_BUFFER_MS = 200
WATCH_S = 0.2  # between looks at whether the parent lives


class _Name(ctypes.Union):
    _fields_ = (("number", ctypes.c_int), ("string", ctypes.c_char * 8))


class _Event(ctypes.Structure):
    _fields_ = (
        ("type", ctypes.c_int),
        ("identifier", ctypes.c_uint),
        ("text_position", ctypes.c_int),
        ("length", ctypes.c_int),
        ("audio_ms", ctypes.c_int),
        ("sample", ctypes.c_int),
        ("user_data", ctypes.c_void_p),
        ("name", _Name),
    )


_Callback = ctypes.CFUNCTYPE(
    ctypes.c_int, ctypes.POINTER(ctypes.c_short), ctypes.c_int, ctypes.POINTER(_Event)
)  # fmt: skip


class _Voice(ctypes.Structure):
    _fields_ = (
        ("name", ctypes.c_char_p),
        ("languages", ctypes.c_char_p),
        ("identifier", ctypes.c_char_p),
        ("gender", ctypes.c_ubyte),
        ("age", ctypes.c_ubyte),
        ("variant", ctypes.c_ubyte),
        ("unused", ctypes.c_ubyte),
        ("score", ctypes.c_int),
        ("spare", ctypes.c_void_p),
    )


def _start_library() -> tuple[Any, int]:
    """espeak-ng ready to speak, and its sample rate."""
    import espeakng_loader

    library = ctypes.CDLL(espeakng_loader.get_library_path())
    library.espeak_Synth.argtypes = [
        ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint, ctypes.c_int, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p,
        ctypes.c_void_p,
    ]  # fmt: skip
    data = espeakng_loader.get_data_path().encode()
    options = PHONEME_EVENTS | IPA_EVENTS | DO_NOT_EXIT
    return library, library.espeak_Initialize(SYNCHRONOUS, DEFAULT_BUFFER_MS, data, options)


def _decode_event(event: _Event) -> tuple[int, int, Any] | None:
    if event.type == PHONEME_EVENT:
        return PHONEME_EVENT, event.sample, bytes(event.name.string).split(b"\0")[0].decode("utf-8", "replace")
    if event.type == WORD_EVENT:
        return WORD_EVENT, event.sample, (event.text_position - 1, event.length)
    return None


def speak(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """Header and samples for a request: text, language, gender, words_per_minute; has_phonemes: [[...]] holds some."""
    library, rate = _start_library()
    chunks: list[bytes] = []
    events: list[tuple[int, int, Any]] = []

    def collect(samples: Any, count: int, found: Any) -> int:
        if count > 0:
            chunks.append(ctypes.string_at(samples, 2 * count))
        at = 0
        while found[at].type != 0:
            event = _decode_event(found[at])
            if event:
                events.append(event)
            at += 1
        return 0

    callback = _Callback(collect)
    library.espeak_SetSynthCallback(callback)
    voice = _Voice(languages=request["language"].encode(), gender=request["gender"])
    if rate <= 0 or library.espeak_SetVoiceByProperties(ctypes.byref(voice)) != 0:
        return {"error": f"espeak-ng does not speak {request['language']}"}, b""
    library.espeak_SetParameter(RATE_PARAMETER, request["words_per_minute"], 0)
    text = request["text"].encode() + b"\0"
    flags = CHARACTERS_UTF8 | (PHONEMES_IN_BRACKETS if request["has_phonemes"] else 0)
    if library.espeak_Synth(text, len(text), 0, POSITION_IN_CHARACTERS, 0, flags, None, None) != 0:
        return {"error": "espeak-ng cannot speak the text"}, b""
    library.espeak_Synchronize()
    return {"rate": rate, "events": events}, b"".join(chunks)


def _exit_without(parent: int) -> None:
    """End this process when its parent is dead: whoever adopts it has another number (POSIX)."""
    while os.getppid() == parent:
        time.sleep(WATCH_S)
    os._exit(1)


def main() -> None:
    """Answer one request."""
    request = json.load(sys.stdin)
    if os.name == "posix":
        threading.Thread(target=_exit_without, args=(request["parent"],), daemon=True).start()
    header, samples = speak(request)
    sys.stdout.buffer.write(json.dumps({**header, "n_bytes": len(samples)}).encode() + b"\n" + samples)


if __name__ == "__main__":
    main()
