"""Lips as a user gets them: from the sound of test utterances, with their words and without, in place of given phones.

The sounds of a person lie in one folder, for each track ``NAME.npz`` a sound ``NAME.flac`` on its clock. Edges that
were set by hand (``NAME.phones.tsv`` with start, end and ipa) replace those of the track as the truth.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation
from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence
from lexicon.values.tables import parse_cell
from tts2face.models.talker import Talker
from tts2face.session.recording import map_audio_to_motion
from tts2face.sound.segments import RATE
from tts2face.sound.transcript import align_recording, pronounce_transcript, recognise_phones
from tts2face.video.media import read_sound

OWN_ALIGNMENT, SOUND_ALONE = "default, own alignment", "default, sound alone"
SOUND_SUFFIXES = (".flac", ".wav")
EDGES_SUFFIX = ".phones.tsv"
COLUMNS = ("start", "end", "ipa")


def find_sounds(folder: Path, utterances: Sequence[Observation]) -> Mapping[str, Path]:
    """Sound of each utterance by its name.

    Raises
    ------
    InputError
        An utterance has no sound in the folder.
    """
    found = {}
    for utterance in utterances:
        paths = [folder / f"{utterance.name}{suffix}" for suffix in SOUND_SUFFIXES]
        existing = [path for path in paths if path.is_file()]
        if not existing:
            raise InputError(f"{folder} holds no sound of {utterance.name} ({', '.join(SOUND_SUFFIXES)}); add it")
        found[utterance.name] = existing[0]
    return found


def with_hand_edges(utterances: Sequence[Observation], sounds: Mapping[str, Path]) -> tuple[Observation, ...]:
    """The utterances with edges that were set by hand, where there are some beside the sounds."""
    return tuple(
        _with_edges(utterance, sounds[utterance.name].with_name(f"{utterance.name}{EDGES_SUFFIX}"))
        for utterance in utterances
    )


def _with_edges(observation: Observation, path: Path) -> Observation:
    if not path.is_file():
        return observation
    head, *rows = [line.split("\t") for line in path.read_text(encoding="utf-8").splitlines() if line] or [[]]
    if missing := [name for name in COLUMNS if name not in head]:
        raise DataError(f"{path} has no column {missing[0]}; it needs {', '.join(COLUMNS)}")
    start, end, label = (head.index(name) for name in COLUMNS)
    edges = [parse_cell(rows[0][start], path, 2)] + [parse_cell(row[end], path, at) for at, row in enumerate(rows, 2)]
    return replace(observation, phones=PhoneSequence([row[label] for row in rows], edges))


def heard_phones(utterances: Sequence[Observation], sounds: Mapping[str, Path]) -> dict[str, list[PhoneSequence]]:
    """Phones of each utterance as the program finds them in its sound: of its words, and without them."""
    found: dict[str, list[PhoneSequence]] = {OWN_ALIGNMENT: [], SOUND_ALONE: []}
    for utterance in utterances:
        sound = read_sound(sounds[utterance.name], RATE)
        words = pronounce_transcript(" ".join(word.text for word in utterance.words), "en-us")
        found[OWN_ALIGNMENT].append(align_recording(sound, words)[0])
        found[SOUND_ALONE].append(recognise_phones(sound))
    return found


def mapped_motion(
    talker: Talker, name: str, utterances: Sequence[Observation], sounds: Mapping[str, Path]
) -> list[NDArray[np.float32]]:
    """Parameters (T, S) of each utterance by an audio map of the talker."""
    found = []
    for utterance in utterances:
        motion = map_audio_to_motion(sounds[utterance.name], talker.audio_maps[name], talker, utterance.fps)[1].values
        # the sound may end a little before the pictures: its last motion is held
        found.append(motion[np.minimum(np.arange(len(utterance.landmarks)), len(motion) - 1)])
    return found
