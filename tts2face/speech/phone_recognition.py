"""Phones heard in a recording of which nobody says what was spoken.

The acoustic network is that of hama (Park 2026, Apache-2.0), which lies in its wheel. It hears which phones there are,
not where; `tts2face.speech.forced_alignment` finds their edges.
"""

from typing import Any

from lexicon.errors import BackendError, InputError
from lexicon.ipa import parse_ipa
from tts2face.types import Waveform

RECOGNISER_RATE = 16_000  # Hz, what the network was trained on
MAX_SOUND_S = 30.0  # of sound at a time; memory grows with it
WORD_BOUNDARY = "|"  # between words in the network's answer

Phones = tuple[str, ...]


class PhoneRecogniser:
    """Hears English phones.

    Raises
    ------
    BackendError
        The package hama is missing or has no engine for this machine.
    """

    def __init__(self) -> None:
        try:
            from hama.asr import ASRModel

            self._network: Any = ASRModel()
        except (ImportError, OSError, RuntimeError) as missing:
            raise BackendError(
                "recordings without a transcript need the package hama (Linux or macOS): "
                "pip install 'tts2face[capture]', or write what is said into a .txt beside the video"
            ) from missing
        self._spellings: dict[str, Phones] = {}

    def words(self, sound: Waveform) -> tuple[Phones, ...]:
        """Phones of each word heard in a sound of at most `MAX_SOUND_S`.

        Raises
        ------
        InputError
            The sound is longer.
        """
        if sound.duration > MAX_SOUND_S + 1e-6:
            raise InputError(f"a sound of {sound.duration:.1f} s is heard in parts of at most {MAX_SOUND_S:.0f} s")
        if not len(sound.samples):
            return ()
        heard = self._network.transcribe_waveform(sound.samples, sound.rate).word_phoneme_text
        words = (
            tuple(phone for token in word.split() for phone in self._phones(token))
            for word in heard.split(WORD_BOUNDARY)
        )
        return tuple(word for word in words if word)

    def _phones(self, token: str) -> Phones:
        """Phones of the table for one of the network's; none for signs that are no sound."""
        if token not in self._spellings:
            try:
                self._spellings[token] = tuple(segment.phone for segment in parse_ipa(token))
            except InputError:
                self._spellings[token] = ()
        return self._spellings[token]
