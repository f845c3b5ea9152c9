"""Build a talker file from a folder of recordings."""

import math
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from corpus_tools.clone_talker import appearance_from_lips
from corpus_tools.recordings.observation import Observation
from corpus_tools.recordings.observe import QualityWarning, Refusal, check_any_kept, observe
from corpus_tools.recordings.provenance import PROVENANCE, PROVENANCE_FIELDS, read_provenance
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.plots import load_matplotlib
from corpus_tools.studies.recordings_page import recordings_page
from corpus_tools.training.adapt_talker import Base, carried_audio_maps
from corpus_tools.training.choose_adaptation import BASE_ONLY
from corpus_tools.training.learn_audio_maps import learn_audio_maps
from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pooling.base_speech import base_speech
from corpus_tools.training.pose_correction import correct_pose
from corpus_tools.training.score_map import add_score_map
from corpus_tools.training.short_talker import (
    NO_BASE,
    ShortTalker,
    learn_short_talker,
    needs_base,
    recording_advice,
    statements_of_both,
)
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import DataError, InputError
from tts2face.models.talker import NOT_STATED, Talker
from tts2face.models.talker_file import load_talker, write_talker
from tts2face.storage.files import write_atomically
from tts2face.types import Progress, StageCallback, ignore_progress, ignore_stage
from tts2face.video.blendshapes import BlendshapeReader
from tts2face.video.networks import find_bundle

READING_STAGE = "reading recordings"  # name of the first stage
NETWORK_STAGE = "learning phone network"
N_SHOWN = 40  # recordings that show how the mouth of the person lies beside that of a base
CONTENT_WITH_PICTURES = (
    "landmark shapes, head pose, phones, loudness, and with the stated consent pictures of the person's face; no sound"
)
CONTENT = "motion only: landmark shapes, head pose, phones and loudness; no image and no sound"


@dataclass(frozen=True, slots=True)
class BuiltTalker:
    """Result of a build: number and minutes of kept recordings, refusals, and warnings about kept ones.

    ``notes`` state what was chosen of transcripts and not read, what to expect of a talker with a base, and what to
    record next.
    """

    n_kept: int
    minutes: float
    refused: tuple[Refusal, ...]
    warnings: tuple[QualityWarning, ...] = ()
    notes: tuple[str, ...] = ()


def build_talker(  # noqa: PLR0913 - run options and the date change no motion
    recordings: Path,
    out: Path,
    *,
    name: str | None = None,
    provenance: Path | None = None,
    run_options: RunOptions | None = None,
    created: str | None = None,
    consent: Mapping[str, str] | None = None,
    report: Path | None = None,
    base: str = "grid_s1",
    is_strict: bool = False,
    stages: StageCallback = ignore_stage,
) -> BuiltTalker:
    """Observe recordings, learn a talker and write it; apart from `created` the bytes are reproducible.

    Parameters
    ----------
    name
        Name of the talker; that of the provenance, or of the folder, when None.
    provenance
        JSON file as `read_provenance` reads it; ``provenance.json`` in the folder when None.
    created
        Date for the metadata; today when None.
    consent
        Consent of the person shown, from `consent_record`; required for an appearance model.
    report
        HTML page about the recordings to write, also if none could be used.
    base
        Talker that completes recordings of less than `MIN_OWN_MINUTES`, and whose networks are evidence of rare phones
        for the networks of any talker; `NO_BASE` for none.
    is_strict
        Whether recordings with warnings are refused.
    stages
        Called with the name of each stage at its start.

    Raises
    ------
    InputError
        The folder is missing or holds no video, or no recording could be used.
    DataError
        The provenance cannot be read.
    BackendError
        A package or the landmark models are missing, or a file cannot be written.
    """
    if report is not None:
        load_matplotlib()  # reports a missing package before the recordings are read
    stated = read_provenance(provenance or recordings / PROVENANCE, must_exist=provenance is not None)
    observations = observe(recordings, is_strict=is_strict, run_options=run_options, on_progress=stages(READING_STAGE))
    talker_name = name or stated.get("name") or recordings.resolve().stem
    if report is not None:
        write_atomically(report, recordings_page(talker_name, observations).encode())
    check_any_kept(observations)
    metadata = {
        **dict.fromkeys(PROVENANCE_FIELDS, NOT_STATED),
        **stated,
        "name": talker_name,
        "command": _command_line(recordings, out, name, provenance, run_options),
        "created": created or datetime.now(UTC).date().isoformat(),
        "content": CONTENT if consent is None else CONTENT_WITH_PICTURES,
        **({} if consent is None else {"consent": dict(consent)}),
        "refused": [[refusal.name, refusal.reason] for refusal in observations.refused],
        **_reading_metadata(observations.kept),
    }
    steady = correct_pose(observations.kept)
    short = _learn_with_base(steady, base, metadata, stages)
    talker = short.talker if short else _learn_from_recordings(steady, base, metadata, stages)
    talker = replace(talker, audio_maps={**talker.audio_maps, **learn_audio_maps(steady, talker, stages=stages)})
    talker = add_score_map(talker, BlendshapeReader((run_options or RunOptions()).model))
    if consent is not None:
        on_frames = stages("learning appearance")
        talker = add_appearance(
            talker, observations.kept, run_options=run_options or RunOptions(), on_progress=on_frames
        )
    write_talker(out, talker)
    minutes = sum(len(item.landmarks) / item.fps for item in steady) / 60.0
    notes = (*short.notes, *recording_advice(steady)) if short else ()
    notes = (*observations.notes, *notes)
    return BuiltTalker(len(steady), minutes, observations.refused, observations.warnings, notes)


def _learn_with_base(
    observations: Sequence[Observation], base: str, metadata: Mapping[str, Any], stages: StageCallback
) -> ShortTalker | None:
    """The talker with a base, or None if there is none or enough material without it."""
    if base == NO_BASE or not needs_base(observations):
        return None
    return learn_short_talker(observations, base, metadata=metadata, on_progress=stages("adapting the base"))


def _learn_from_recordings(
    observations: Sequence[Observation], base: str, metadata: Mapping[str, Any], stages: StageCallback
) -> Talker:
    """The talker of the recordings.

    If there is a base, its networks are also trained on phrases by those of the base, and it has the base's audio maps,
    which hold for other voices than its own.
    """
    learnt = learn_talker(observations, metadata=metadata)
    if base == NO_BASE:
        return add_phone_network(learnt, on_progress=stages(NETWORK_STAGE))
    known = load_talker(base)
    phrases = base_speech(known, on_progress=stages("synthesising phrases with the base"))
    trained = add_phone_network(learnt, phrases, on_progress=stages(NETWORK_STAGE))
    stated = {name: known.metadata[name] for name in ("name", "pooled") if name in known.metadata}
    both = statements_of_both(metadata, known.metadata)
    known_metadata = {**metadata, **both, "network_base": {**stated, "phrases": len(phrases)}}
    shown = observations[:: math.ceil(len(observations) / N_SHOWN)]
    maps = carried_audio_maps(Base.of(known), shown, trained.model, BASE_ONLY) if known.audio_maps else {}
    return replace(trained, metadata=known_metadata, audio_maps=maps)


def add_appearance(
    talker: Talker,
    observations: Sequence[Observation],
    *,
    run_options: RunOptions,
    on_progress: Progress = ignore_progress,
) -> Talker:
    """The talker with texture models, a plate, and the appearance parameters of every utterance.

    Parameters
    ----------
    observations
        Training observations of the talker, in the order of its first utterances; the appearance of further ones,
        which are those of a base, is predicted from the lips.
    """
    from corpus_tools.appearance.train import learn_appearance
    from corpus_tools.appearance.videos import build_appearance_recording

    tracker = CachedTracker(run_options.folder(), find_bundle(run_options.model))
    own, carried = talker.utterances[: len(observations)], talker.utterances[len(observations) :]
    recordings = [
        build_appearance_recording(observation, utterance.shape, tracker)
        for observation, utterance in zip(observations, own, strict=True)
    ]
    learnt = learn_appearance(recordings, on_progress=on_progress)
    utterances = tuple(
        replace(utterance, appearance_parameters=parameters)
        for utterance, parameters in zip(own, learnt.parameters, strict=True)
    )
    talker = replace(talker, utterances=utterances, appearance=learnt.appearance)
    if not carried:
        return talker
    predict = appearance_from_lips(talker)
    predicted = (replace(item, appearance_parameters=predict(item.shape, talker.fps)) for item in carried)
    return replace(talker, utterances=(*utterances, *predicted))


def add_audio_maps(
    recordings: Path,
    talker: Talker,
    out: Path,
    *,
    run_options: RunOptions | None = None,
    stages: StageCallback = ignore_stage,
) -> Talker:
    """Learn the audio maps of a talker from its recordings, and write the talker with them.

    Raises
    ------
    InputError
        The folder is missing or holds no video, or too little sound to learn from.
    DataError
        A recording holds no sound, or its frame rate is not the talker's.
    """
    kept = correct_pose(check_any_kept(observe(recordings, run_options=run_options, on_progress=stages(READING_STAGE))))
    if any(recording.fps != talker.fps for recording in kept):
        raise DataError(f"the recordings do not have the talker's {talker.fps:g} frames per second; convert them")
    audio_maps = learn_audio_maps(kept, talker, stages=stages)
    if not audio_maps:
        raise InputError(f"{recordings} contains too little speech for audio maps; give 20 utterances or more")
    talker = replace(talker, audio_maps={**talker.audio_maps, **audio_maps})
    write_talker(out, talker)
    return talker


def _reading_metadata(kept: Sequence[Observation]) -> dict[str, Any]:
    """Metadata about the recognition of phones and the correction of delays."""
    recognised = [observation.name for observation in kept if observation.is_recognised]
    lags = {observation.video.name: observation.quality.lag for observation in kept if observation.quality.lag}
    return {
        **({"phones_recognised": recognised} if recognised else {}),
        **({"sound_late_s": lags} if lags else {}),
    }


def _command_line(
    recordings: Path, out: Path, name: str | None, provenance: Path | None, run_options: RunOptions | None
) -> str:
    words = ["tts2face", "corpus", "build", recordings.name]
    words += ["--name", name] if name else []
    words += ["--provenance", provenance.name] if provenance else []
    words += ["--tier", run_options.tier] if run_options and run_options.tier else []
    return shlex.join([*words, "--out", out.name])
