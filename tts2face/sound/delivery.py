"""Delivery of a sentence by any voice: rate, pitch and formants by the voice, or in its sound (decision 259)."""

from typing import Protocol, runtime_checkable

from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.retuned import intention, is_retuned, retuned
from tts2face.sound.spacing import has_pauses, with_pauses
from tts2face.sound.voice import SpeechInput, Voice
from tts2face.types import Speech, Waveform


@runtime_checkable
class DeliveringVoice(Protocol):
    """A voice that changes its pitch and formants itself, and says tones of words and questions."""

    def deliver(self, content: SpeechInput, prosody: Prosody, seed: int) -> Speech:
        """Synthesise a sentence as `tts2face.sound.voice.Voice.speak` does, with a prosody."""

    def deliver_sound(self, content: SpeechInput, prosody: Prosody, seed: int) -> Waveform:
        """Sound of `deliver` alone."""


def speak_with(
    voice: Voice, content: SpeechInput, prosody: Prosody = PLAIN_PROSODY, seed: int = 0, *, language: str = ""
) -> Speech:
    """Speech of a voice with a prosody.

    Parameters
    ----------
    content
        Text, or words with their phones and tones.
    language
        Code of the content, by whose words questions are known; empty: the voice intones them by itself.

    Raises
    ------
    InputError
        As `Voice.speak`.
    """
    if isinstance(voice, DeliveringVoice):
        return voice.deliver(content, prosody, seed)
    intended = intention(content, language)
    speech = with_pauses(voice.speak(content, seed=seed), content, language)
    return retuned(speech, prosody, intended) if is_retuned(prosody, intended) else speech


def sound_with(
    voice: Voice, content: SpeechInput, prosody: Prosody = PLAIN_PROSODY, seed: int = 0, *, language: str = ""
) -> Waveform:
    """Sound of `speak_with` alone, which some voices compute sooner; arguments and errors as there."""
    if isinstance(voice, DeliveringVoice):
        return voice.deliver_sound(content, prosody, seed)
    # edges of words tell where these are
    if has_pauses(content) or is_retuned(prosody, intention(content, language)):
        return speak_with(voice, content, prosody, seed, language=language).waveform
    return voice.sound(content, seed=seed)
