"""A talker given an appearance: learnt from the recordings that the talker was learnt from."""

from collections.abc import Sequence
from dataclasses import replace

from corpus_tools.aam.source_videos import build_appearance_recording
from corpus_tools.aam.train_appearance import TextureOptions, learn_appearance
from corpus_tools.recordings.corpus_video import CachedTracker
from corpus_tools.recordings.observation import Observation
from corpus_tools.run_options import Progress, RunOptions
from tts2face.models.talker import Talker
from tts2face.video.landmark_models import find_bundle


def add_appearance(
    talker: Talker,
    observations: Sequence[Observation],
    *,
    effort: RunOptions,
    options: TextureOptions | None = None,
    on_progress: Progress | None = None,
) -> Talker:
    """The talker with texture models, a plate, and the looks of every utterance.

    Parameters
    ----------
    observations
        Those that the talker was learnt from, in the order of its utterances.

    Raises
    ------
    InputError
        There are too few frames for the modes.
    BackendError
        A package or the landmark models are missing.
    """
    eyes = CachedTracker(effort.folder(), find_bundle(effort.model))
    recordings = [
        build_appearance_recording(observation, spoken.shape, eyes)
        for observation, spoken in zip(observations, talker.utterances, strict=True)
    ]
    learnt = learn_appearance(recordings, options, on_progress=on_progress)
    utterances = tuple(
        replace(spoken, looks=looks) for spoken, looks in zip(talker.utterances, learnt.looks, strict=True)
    )
    return replace(talker, utterances=utterances, appearance=learnt.appearance)
