"""Child process that synthesises one text with espeak-ng.

A process serves one request because the library is not thread-safe and its output depends on earlier calls. The script
reads a JSON request from standard input and writes one line of JSON (rate, events, number of bytes), then the samples
as 16-bit little endian. It runs as a file and imports only the standard library and espeakng_loader.
"""

import ctypes
import json
import os
import sys
import threading
import time
from typing import Any

# speak_lib.h
SYNCHRONOUS = 2
PHONEME_EVENTS = 0x0001
IPA_EVENTS = 0x0002
# without it the library ends the process where its data are missing
DO_NOT_EXIT = 0x8000
WORD_EVENT, PHONEME_EVENT = 1, 7
CHARACTERS_UTF8 = 1
PHONEMES_IN_BRACKETS = 0x100
POSITION_IN_CHARACTERS = 1
RATE_PARAMETER = 1
RANDOM_SEED = 1
DEFAULT_BUFFER_MS = 200
POLL_INTERVAL_S = 0.2  # between checks whether the parent is running


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
    """Load and initialise espeak-ng; returns the library and its sample rate in Hz."""
    import espeakng_loader

    library = ctypes.CDLL(espeakng_loader.get_library_path())
    # ctypes passes a number without a type as a C int, which is shorter than size_t
    library.espeak_Synth.argtypes = [
        ctypes.c_char_p, ctypes.c_size_t, ctypes.c_uint, ctypes.c_int, ctypes.c_uint, ctypes.c_uint, ctypes.c_void_p,
        ctypes.c_void_p,
    ]  # fmt: skip
    data = espeakng_loader.get_data_path().encode()
    options = PHONEME_EVENTS | IPA_EVENTS | DO_NOT_EXIT
    return library, library.espeak_Initialize(SYNCHRONOUS, DEFAULT_BUFFER_MS, data, options)


def _decode_event(event: _Event) -> tuple[int, int, Any] | None:
    if event.type == PHONEME_EVENT:
        name = bytes(event.name.string).split(b"\0")[0]  # espeak-ng cuts it after 8 bytes, also within a character
        return PHONEME_EVENT, event.sample, name.decode("utf-8", "ignore")
    if event.type == WORD_EVENT:
        # espeak-ng counts characters from 1
        return WORD_EVENT, event.sample, (event.text_position - 1, event.length)
    return None


def speak(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    """Synthesise a request; returns the header and the samples.

    Parameters
    ----------
    request
        ``text``, ``language``, ``gender``, ``words_per_minute``, and ``has_phonemes``: whether the text contains
        mnemonics in [[...]].
    """
    library, rate = _start_library()
    chunks: list[bytes] = []
    events: list[tuple[int, int, Any]] = []

    def collect(samples: Any, count: int, found: Any) -> int:
        if count > 0:
            chunks.append(ctypes.string_at(samples, 2 * count))
        at = 0
        # the list ends with an event of type 0 (espeakEVENT_LIST_TERMINATED)
        while found[at].type != 0:
            event = _decode_event(found[at])
            if event:
                events.append(event)
            at += 1
        return 0

    # ctypes frees a callback to which no name refers
    callback = _Callback(collect)
    library.espeak_SetSynthCallback(callback)
    voice = _Voice(languages=request["language"].encode(), gender=request["gender"])
    if rate <= 0 or library.espeak_SetVoiceByProperties(ctypes.byref(voice)) != 0:
        return {"error": f"espeak-ng does not speak {request['language']}"}, b""
    # the breath of female voices is random, by the second in which the library starts; equal texts give equal bytes
    library.espeak_ng_SetRandSeed(ctypes.c_long(RANDOM_SEED))
    library.espeak_SetParameter(RATE_PARAMETER, request["words_per_minute"], 0)
    # espeak_Synth reads up to a zero byte
    text = request["text"].encode() + b"\0"
    flags = CHARACTERS_UTF8 | (PHONEMES_IN_BRACKETS if request["has_phonemes"] else 0)
    if library.espeak_Synth(text, len(text), 0, POSITION_IN_CHARACTERS, 0, flags, None, None) != 0:
        return {"error": "espeak-ng cannot speak the text"}, b""
    library.espeak_Synchronize()
    return {"rate": rate, "events": events}, b"".join(chunks)


def _exit_without(parent: int) -> None:
    """Exit when the parent has ended: an orphan gets another parent process id (POSIX)."""
    while os.getppid() == parent:
        time.sleep(POLL_INTERVAL_S)
    # `sys.exit` would end this thread alone
    os._exit(1)


def main() -> None:
    """Read a request from standard input and write the result to standard output."""
    request = json.load(sys.stdin)
    if os.name == "posix":
        threading.Thread(target=_exit_without, args=(request["parent"],), daemon=True).start()
    header, samples = speak(request)
    sys.stdout.buffer.write(json.dumps({**header, "n_bytes": len(samples)}).encode() + b"\n" + samples)


if __name__ == "__main__":
    main()
