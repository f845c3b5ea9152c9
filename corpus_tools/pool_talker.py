"""A talker whose networks are trained again on its recordings pooled with lip tracks of another speaker."""

from dataclasses import dataclass, replace
from pathlib import Path

from corpus_tools.training.phone_network import MIN_FRAMES, add_phone_network
from corpus_tools.training.pooling.lip_tracks import read_lip_tracks
from corpus_tools.training.pooling.speech import align_lip_tracks
from lexicon.errors import InputError
from tts2face.models.talker_file import load_talker, write_talker
from tts2face.types import StageCallback, ignore_stage

STAGES = ("aligning lip tracks", "learning phone networks")


@dataclass(frozen=True, slots=True)
class PooledTalker:
    """Numbers of pooled recordings and their minutes of speech."""

    n_tracks: int
    minutes: float


def pool_talker(
    talker: str,
    tracks: Path,
    out: Path,
    *,
    source: str,
    stages: StageCallback = ignore_stage,
) -> PooledTalker:
    """Write a talker with networks from its own recordings and the lip tracks of a folder.

    Only the networks of the talker change. Their outputs for the other speaker are not stored.

    Parameters
    ----------
    source
        What the tracks are and under which terms, for the metadata.

    Raises
    ------
    InputError
        The talker or the tracks do not exist, the talker is too short, or the source is empty.
    DataError
        A track is damaged, or its phones do not fit into it.
    """
    if not source.strip():
        raise InputError("the source of the tracks is empty; name the recordings and their licence")
    learnt = load_talker(talker)
    if sum(len(utterance.shape) for utterance in learnt.utterances) < MIN_FRAMES:
        raise InputError(f"{talker} has less than {MIN_FRAMES} frames; its own recordings are too few for networks")
    pooled = align_lip_tracks(read_lip_tracks(tracks), learnt, stages(STAGES[0]))
    trained = add_phone_network(learnt, pooled, on_progress=stages(STAGES[1]))
    write_talker(out, replace(trained, metadata={**learnt.metadata, "pooled": source}))
    return PooledTalker(len(pooled), sum(float(track.is_used.sum()) / track.fps for track in pooled) / 60)
