"""Phone recognition in recordings without a transcript.

The acoustic network is that of hama (Park 2026, Apache-2.0), included in its wheel. It returns phones without times;
`tts2face.speech.forced_alignment` computes their edges.
"""

from typing import Any

from lexicon.errors import BackendError, InputError
from lexicon.ipa import parse_ipa
from tts2face.types import Waveform

MAX_SOUND_S = 30.0  # longest sound in one call; memory grows with it
WORD_BOUNDARY = "|"  # separates words in the network's output

Phones = tuple[str, ...]


class PhoneRecogniser:
    """Recogniser of English phones.

    Raises
    ------
    BackendError
        The package hama is not installed or does not support this machine.
    """

    def __init__(self) -> None:
        try:
            from hama.asr import ASRModel

            self._network: Any = ASRModel()
        except (ImportError, OSError, RuntimeError) as missing:
            raise BackendError(
                "recordings without a transcript need the package hama (Linux or macOS): "
                "pip install 'tts2face[capture]', or give the words in a .txt file of the same name"
            ) from missing
        self._spellings: dict[str, Phones] = {}

    def words(self, sound: Waveform) -> tuple[Phones, ...]:
        """Phones of each word in a sound.

        Raises
        ------
        InputError
            The sound is longer than `MAX_SOUND_S`.
        """
        if sound.duration > MAX_SOUND_S + 1e-6:
            raise InputError(
                f"phones are recognised in sounds of at most {MAX_SOUND_S:.0f} s, not {sound.duration:.1f} s; divide it"
            )
        if not len(sound.samples):
            return ()
        recognised = self._network.transcribe_waveform(sound.samples, sound.rate).word_phoneme_text
        words = (
            tuple(phone for token in word.split() for phone in self._phones(token))
            for word in recognised.split(WORD_BOUNDARY)
        )
        return tuple(word for word in words if word)

    def _phones(self, token: str) -> Phones:
        """Phones of the phone table for a label of the network; none for labels that are not phones."""
        if token not in self._spellings:
            try:
                self._spellings[token] = tuple(segment.phone for segment in parse_ipa(token))
            except InputError:
                self._spellings[token] = ()
        return self._spellings[token]
