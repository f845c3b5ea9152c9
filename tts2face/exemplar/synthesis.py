"""Lip synthesis from phones: selection and blending of recorded exemplars, with rest in silence."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.exemplar import blending
from tts2face.exemplar.contacts import ChosenExemplars, LipGap, enforce_contacts, find_contacts, shown_contact
from tts2face.exemplar.options import SynthesisOptions
from tts2face.exemplar.phone_substitution import Targets, build_targets, target_phones
from tts2face.exemplar.similarity import PhoneSimilarity, phone_similarity, token_samples
from tts2face.exemplar.token_search import (
    ContextIndex,
    TokenQuery,
    TokenRanking,
    best_tokens,
    context_index,
    context_weights,
    log_durations,
)
from tts2face.exemplar.tokens import Tokens, collect_tokens, phone_contexts
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker, speech_channels
from tts2face.numeric import interpolate_columns, smoothstep
from tts2face.types import GiveWay, Trajectory, keep_on

RELEASE_FROM_S = 0.08  # distance from speech at which the transition to rest begins
REST_FROM_S = 0.20  # distance from speech at which the face is at rest; recorded lips settle within 0.2 s
NETWORK_HZ = 50.0  # rate at which the networks are evaluated; their input changes in steps of 40 ms
# Distances of contexts (largest score less the best token's) between which the networks take over from the exemplars;
# learnt on held-out words and on held-out tracks of another speaker (docs/decisions/125-share-of-networks.md).
NEAR_CONTEXT, FAR_CONTEXT = 0.2, 1.1
MIN_EASE_S = 0.06  # transition from and to rest if a clip begins or ends within speech
DEFAULT_OPTIONS = SynthesisOptions()


@dataclass(frozen=True, slots=True, eq=False)
class ExemplarModel:
    """A talker indexed for synthesis: tokens, their index, phone similarity, and reference poses.

    ``spread``, ``rest`` and ``mean_speaking_pose`` (D,) are standard deviation, rest pose and mean pose in speech of
    the D speech parameters; ``channels`` are their names, ``names`` those of the utterances.
    """

    tokens: Tokens
    index: ContextIndex
    similarity: PhoneSimilarity
    spread: NDArray[np.float32]
    rest: NDArray[np.float32]
    mean_speaking_pose: NDArray[np.float32]
    lip_gap: LipGap
    channels: tuple[str, ...]
    names: tuple[str, ...]
    network: PhoneNetwork | None


def build_exemplar_model(talker: Talker) -> ExemplarModel:
    """Index a talker's tokens and compute the similarity of its phones."""
    model, n_speech = talker.model, talker.model.n_speech
    tokens = collect_tokens(talker)
    spread = np.maximum(model.spread[:n_speech], 1e-6).astype(np.float32)
    upper, lower = UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID
    similarity = phone_similarity(token_samples(tokens), tokens.phone, tokens.inventory, spread)
    return ExemplarModel(
        tokens,
        context_index(tokens, similarity.matrix),
        similarity,
        spread,
        model.rest[:n_speech].astype(np.float32),
        mean_speaking_pose(talker),
        LipGap.with_spread(
            np.ascontiguousarray(model.mean[upper] - model.mean[lower]),
            np.ascontiguousarray(model.basis[:n_speech, upper] - model.basis[:n_speech, lower]),
            spread,
        ),
        speech_channels(model),
        tuple(utterance.name for utterance in talker.utterances),
        talker.network,
    )


def mean_speaking_pose(talker: Talker) -> NDArray[np.float32]:
    """(D,) mean speech parameters of the frames between the first phone and the last of every utterance."""
    n_speech, parts = talker.model.n_speech, []
    for utterance in talker.utterances:
        sounding = [at for at, label in enumerate(utterance.phones.phones) if label != SILENCE]
        if sounding:
            edges = utterance.phones.edges
            begin, end = (int(edges[at] * talker.fps) for at in (sounding[0], sounding[-1] + 1))
            parts.append(utterance.shape[begin : end + 1, :n_speech])
    frames = np.concatenate(parts) if parts else np.zeros((1, n_speech))
    return np.asarray(frames.mean(axis=0, dtype=np.float64), np.float32)


@dataclass(frozen=True, slots=True, eq=False)
class TokenSelection:
    """Result of the token search for a phone sequence, from which lip motion and appearance are blended.

    ``targets`` are the ``phones`` converted to the talker's inventory, ``found`` their best tokens by ``options``.
    """

    phones: PhoneSequence
    targets: Targets
    found: TokenRanking
    options: SynthesisOptions


def select_tokens(
    phones: PhoneSequence, exemplars: ExemplarModel, options: SynthesisOptions = DEFAULT_OPTIONS
) -> TokenSelection:
    """Search the recorded tokens for each phone.

    Raises
    ------
    InputError
        A phone is not in the phone table, the sequence does not begin at 0 s, or an option is out of range.
    """
    if phones.start != 0.0:
        raise InputError(f"phones to be animated begin at 0 s, not at {phones.start} s; shift them first")
    tokens = exemplars.tokens
    number = {label: at for at, label in enumerate(tokens.inventory)}
    targets = build_targets(phones, tokens.inventory)
    labels = np.array([number[label] for label in targets.labels], np.int32)
    around = phone_contexts(labels, np.zeros(len(labels), np.int32), number[SILENCE])
    wanted = TokenQuery(labels, around, log_durations(targets.spans))
    found = best_tokens(
        wanted,
        exemplars.index,
        context=options.context,
        k=options.k,
        duration=options.duration,
    )
    return TokenSelection(phones, targets, found, options)


def speech_trajectory(
    phones: PhoneSequence,
    exemplars: ExemplarModel,
    *,
    fps: float,
    n_frames: int,
    options: SynthesisOptions = DEFAULT_OPTIONS,
) -> Trajectory:
    """Motion of the talker's speech parameters for phones in time: `select_tokens`, then `blend_trajectory`."""
    return blend_trajectory(select_tokens(phones, exemplars, options), exemplars, fps=fps, n_frames=n_frames)


def blend_trajectory(
    selection: TokenSelection, exemplars: ExemplarModel, *, fps: float, n_frames: int, give_way: GiveWay = keep_on
) -> Trajectory:
    """Motion of the talker's speech parameters from selected tokens; the first and the last frame are at rest.

    Parameters
    ----------
    give_way
        Called between the steps.

    Notes
    -----
    Time and memory grow linearly with the number of phones. The motion is computed at `CLOCK_HZ` and interpolated at
    the frames, so that it does not depend on the frame rate. In silence farther than `REST_FROM_S` from speech the face
    is at rest.
    """
    frame_times = np.arange(n_frames) / fps
    n_instants = int(np.ceil(max(selection.phones.end, frame_times[-1]) * blending.CLOCK_HZ)) + 2
    motion = _blend_motion(selection, exemplars, n_instants, give_way)
    return Trajectory(exemplars.channels, read_at_frames(motion, selection.phones, frame_times, exemplars.rest), fps)


def read_at_frames(
    motion: NDArray[np.float32], phones: PhoneSequence, times: NDArray[np.float64], rest: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Resample motion (n, D) at `CLOCK_HZ` to T times (T, D), blended with the rest pose in silence."""
    at = times * blending.CLOCK_HZ
    low = at.astype(np.int64)
    part = (at - low)[:, None].astype(np.float32)
    values = (1 - part) * motion[low] + part * motion[low + 1]
    pull = rest_weights(phones, times)[:, None].astype(np.float32)
    drawn: NDArray[np.float32] = (1 - pull) * values + pull * rest
    return drawn


def _blend_motion(
    selection: TokenSelection, exemplars: ExemplarModel, n_instants: int, give_way: GiveWay
) -> NDArray[np.float32]:
    """(n, D) motion at the instants of the clock."""
    targets, found, options = selection.targets, selection.found, selection.options
    weights = blending.exemplar_weights(found.scores, options.sharpness)
    pieces = blending.average_tokens(exemplars.tokens, found.tokens, weights, exemplars.spread, options)
    joined, is_covered = blending.join_averages(pieces, targets, n_instants, options)
    speech = joined * exemplars.spread
    give_way()
    if exemplars.network is not None and options.network > 0:
        farness = interpolated_farness(targets, context_farness(selection), n_instants)[:, None]
        predicted = _network_motion(exemplars.network, selection.phones, n_instants)
        speech = speech + (options.network + (1 - options.network) * farness) * (predicted - speech)
        give_way()
    speech = exemplars.mean_speaking_pose + options.amplitude * (speech - exemplars.mean_speaking_pose)
    motion = np.where(is_covered[:, None], speech, exemplars.rest).astype(np.float32)
    motion = blending.gaussian_smooth(motion, options.smoothing_s, blending.CLOCK_HZ)
    if not options.contacts:
        return motion
    requested = [selection.phones.phones[at] for at in targets.source]
    rules = [shown_contact(*pair) for pair in zip(requested, targets.labels, strict=True)]
    touching = np.array([rule is not None for rule in rules])
    chosen = ChosenExemplars(exemplars.tokens, found.tokens[touching], weights[touching])
    kept = [rule for rule in rules if rule is not None]
    contacts = find_contacts(chosen, exemplars.lip_gap, targets.spans[touching, 1:3], kept)
    return enforce_contacts(motion, contacts, exemplars.lip_gap, blending.CLOCK_HZ)


def _network_motion(network: PhoneNetwork, phones: PhoneSequence, n_instants: int) -> NDArray[np.float32]:
    """(n, D) motion of the networks at the instants of the clock, interpolated between samples at `NETWORK_HZ`."""
    shown = target_phones(build_targets(phones, network.inventory))
    times = np.arange(int(np.ceil(n_instants * NETWORK_HZ / blending.CLOCK_HZ)) + 1) / NETWORK_HZ
    sampled = network.parameters(shown, times)
    return interpolate_columns(sampled, times, np.arange(n_instants) / blending.CLOCK_HZ).astype(np.float32)


def context_farness(selection: TokenSelection) -> NDArray[np.float64]:
    """(N,) how far the nearest recorded context of N targets is: 0 near, 1 far or the phone itself was not recorded.

    Where contexts are near, the networks have the share `options.network` of the motion; where they are far, all of it.
    """
    targets, requested = selection.targets, selection.phones.phones
    distance = 2.0 * context_weights(selection.options.context).sum() - selection.found.scores[:, 0]
    is_replaced = np.array(
        [label != requested[source] for label, source in zip(targets.labels, targets.source, strict=True)]
    )
    return np.asarray(np.where(is_replaced, 1.0, smoothstep(distance, NEAR_CONTEXT, FAR_CONTEXT)))


def interpolated_farness(targets: Targets, farness: NDArray[np.float64], n_instants: int) -> NDArray[np.float32]:
    """(n,) farness (N,) of targets at the instants of the clock, linear between the middles of the targets."""
    middles = targets.spans[:, 1:3].mean(axis=1)
    return np.interp(np.arange(n_instants) / blending.CLOCK_HZ, middles, farness).astype(np.float32)


def rest_weights(phones: PhoneSequence, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """(T,) weights of the rest pose at T times in seconds: 0 in speech, 1 in silence and at both ends."""
    sounding = np.array([label != SILENCE for label in phones.phones])
    if not sounding.any():
        return np.ones(len(times))
    starts, ends = phones.edges[:-1][sounding], phones.edges[1:][sounding]
    next_start = np.searchsorted(starts, times, side="right")
    ahead = np.append(starts, np.inf)[next_start] - times
    behind = times - np.concatenate([[-np.inf], ends])[next_start]
    distance = np.minimum(ahead, np.maximum(behind, 0.0))
    pull = smoothstep(distance, RELEASE_FROM_S, REST_FROM_S)
    last = times[-1]
    onset = np.clip(starts[0], MIN_EASE_S, REST_FROM_S)
    offset = np.clip(last - ends[-1], MIN_EASE_S, REST_FROM_S)
    if onset < REST_FROM_S:
        pull = np.maximum(pull, 1.0 - smoothstep(times, 0.0, onset))
    if offset < REST_FROM_S:
        pull = np.maximum(pull, 1.0 - smoothstep(last - times, 0.0, offset))
    return pull
