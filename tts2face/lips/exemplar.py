"""Lip synthesis from phones: selection and blending of recorded exemplars, with rest in silence.

Appearance parameters are blended from the same exemplars as the lip motion; recorded tokens that were tracked wrongly
can be excluded.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips import blending
from tts2face.lips.contacts import ChosenExemplars, LipGap, enforce_contacts, find_contacts, shown_contact
from tts2face.lips.options import ExcludedToken, SynthesisOptions
from tts2face.lips.rest import is_pause, rest_weights
from tts2face.lips.similarity import PhoneSimilarity, phone_similarity, token_samples
from tts2face.lips.targets import Targets, build_targets, target_phones
from tts2face.lips.token_search import (
    ContextIndex,
    TokenQuery,
    TokenRanking,
    best_tokens,
    context_index,
    context_weights,
    log_durations,
)
from tts2face.lips.tokens import Tokens, collect_tokens, phone_contexts
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker, require_appearance, speech_channels
from tts2face.numeric.arrays import interpolate_columns, smoothstep
from tts2face.processes.shared import shared
from tts2face.types import Trajectory, YieldTurn, keep_on

NETWORK_HZ = 50.0  # rate at which the networks are evaluated; their input changes in steps of 40 ms
# Distances of contexts (largest score less the best token's) between which the networks take over from the exemplars;
# learnt on held-out words and on held-out tracks of another speaker (docs/decisions/039-phone-networks.md).
NEAR_CONTEXT, FAR_CONTEXT = 0.2, 1.1
DEFAULT_OPTIONS = SynthesisOptions()
N_BLENDED_APPEARANCES = 3  # exemplars; more of them blur teeth and tongue (docs/decisions/032-own-face.md)
MAX_START_CHANGE_S = 0.001  # times of tokens are written with four decimals


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
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


@shared
def build_exemplar_model(talker: Talker) -> ExemplarModel:
    """Index a talker's tokens and compute the similarity of its phones."""
    model, n_speech = talker.model, talker.model.n_speech
    tokens = collect_tokens(talker)
    # a parameter that never moved would divide by 0
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
            start, end = (int(edges[at] * talker.fps) for at in (sounding[0], sounding[-1] + 1))
            parts.append(utterance.shape[start : end + 1, :n_speech])
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
    selection: TokenSelection, exemplars: ExemplarModel, *, fps: float, n_frames: int, yield_turn: YieldTurn = keep_on
) -> Trajectory:
    """Motion of the talker's speech parameters from selected tokens; the first and the last frame are at rest.

    Parameters
    ----------
    yield_turn
        Called between the steps.

    Notes
    -----
    Time and memory grow linearly with the number of phones. The motion is computed at `CLOCK_HZ` and interpolated at
    the frames, so that it does not depend on the frame rate. In silence farther than `REST_FROM_S` from speech the face
    is at rest; in pauses within speech the networks, if there are any, tell how the lips rest.
    """
    frame_times = np.arange(n_frames) / fps
    n_instants = int(np.ceil(max(selection.phones.end, frame_times[-1]) * blending.CLOCK_HZ)) + 2
    motion = _blend_motion(selection, exemplars, n_instants, yield_turn)
    pull = rest_weights(selection.phones, frame_times)
    if _used_network(selection, exemplars) is not None:
        pull[is_pause(selection.phones, frame_times)] = 0.0
    return Trajectory(exemplars.channels, read_at_frames(motion, frame_times, pull, exemplars.rest), fps)


def read_at_frames(
    motion: NDArray[np.float32], times: NDArray[np.float64], pull: NDArray[np.float64], rest: NDArray[np.float32]
) -> NDArray[np.float32]:
    """Resample motion (n, D) at `CLOCK_HZ` to T times (T, D), blended with the rest pose by weights `pull` (T,)."""
    at = times * blending.CLOCK_HZ
    low = at.astype(np.int64)
    part = (at - low)[:, None].astype(np.float32)
    values = (1 - part) * motion[low] + part * motion[low + 1]
    share = pull[:, None].astype(np.float32)
    return np.asarray((1 - share) * values + share * rest)


def _blend_motion(
    selection: TokenSelection, exemplars: ExemplarModel, n_instants: int, yield_turn: YieldTurn
) -> NDArray[np.float32]:
    """(n, D) motion at the instants of the clock."""
    targets = selection.targets
    found = selection.found
    options = selection.options
    weights = blending.exemplar_weights(found.scores, options.sharpness)
    pieces = blending.average_tokens(exemplars.tokens, found.tokens, weights, exemplars.spread, options)
    joined, is_covered = blending.join_averages(pieces, targets, n_instants, options)
    speech = joined * exemplars.spread
    yield_turn()
    about, network = exemplars.mean_speaking_pose, _used_network(selection, exemplars)
    if network is None:
        speech = about + options.amplitude * (speech - about)
    else:
        farness = interpolated_farness(targets, context_farness(selection), n_instants)[:, None]
        predicted = _network_motion(network, selection.phones, n_instants)
        speech = speech + (options.network + (1 - options.network) * farness) * (predicted - speech)
        clock = np.arange(n_instants) / blending.CLOCK_HZ
        pausing = np.where(is_pause(selection.phones, clock), rest_weights(selection.phones, clock), 0.0)[:, None]
        speech = (1 - pausing) * (about + options.amplitude * (speech - about)) + pausing * predicted
        is_covered |= pausing[:, 0] > 0
        yield_turn()
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


def _used_network(selection: TokenSelection, exemplars: ExemplarModel) -> PhoneNetwork | None:
    """The networks of the talker, if the options use them."""
    return exemplars.network if selection.options.network > 0 else None


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


@dataclass(frozen=True, slots=True, eq=False)
class AppearanceExemplars:
    """A talker's recorded appearance parameters, indexed for synthesis.

    Parameters
    ----------
    tokens
        Phone tokens whose `frames` (F, A) are appearance parameters.
    spread : (A,)
        Standard deviation of each parameter.
    rest : (A,)
        Median over silent frames.
    channels
        A names.
    """

    tokens: Tokens
    spread: NDArray[np.float32]
    rest: NDArray[np.float32]
    channels: tuple[str, ...]


def build_appearance_exemplars(talker: Talker, exemplars: ExemplarModel) -> AppearanceExemplars:
    """Index the appearance parameters of a talker.

    Raises
    ------
    InputError
        The talker has no appearance model.
    """
    appearance = require_appearance(talker)
    frames = np.concatenate(
        [
            utterance.appearance_parameters
            for utterance in talker.utterances
            if utterance.appearance_parameters is not None
        ]
    )
    spread = np.maximum(appearance.spread, 1e-6).astype(np.float32)
    silent = np.concatenate(
        [_silent_frames(utterance.phones, len(utterance.shape), talker.fps) for utterance in talker.utterances]
    )
    still = frames[silent] if silent.any() else frames
    rest = np.median(still, axis=0).astype(np.float32)
    tokens = replace(exemplars.tokens, frames=frames.astype(np.float32))
    return AppearanceExemplars(tokens, spread, rest, appearance.channels)


def appearance_trajectory(
    selection: TokenSelection, appearance: AppearanceExemplars, *, fps: float, n_frames: int
) -> Trajectory:
    """(n_frames, A) appearance parameters from the tokens of the lip motion; arguments as `blend_trajectory`."""
    phones, targets = selection.phones, selection.targets
    options = replace(selection.options, k=min(selection.options.k, N_BLENDED_APPEARANCES), contacts=False)
    found = TokenRanking(selection.found.tokens[:, : options.k], selection.found.scores[:, : options.k])
    frame_times = np.arange(n_frames) / fps
    n_instants = int(np.ceil(max(phones.end, frame_times[-1]) * blending.CLOCK_HZ)) + 2
    weights = blending.exemplar_weights(found.scores, options.sharpness)
    pieces = blending.average_tokens(appearance.tokens, found.tokens, weights, appearance.spread, options)
    joined, is_covered = blending.join_averages(pieces, targets, n_instants, options)
    values = np.where(is_covered[:, None], joined * appearance.spread, appearance.rest)
    values = blending.gaussian_smooth(values, options.smoothing_s, blending.CLOCK_HZ)
    pull = rest_weights(phones, frame_times)
    return Trajectory(appearance.channels, read_at_frames(values, frame_times, pull, appearance.rest), fps)


def _silent_frames(phones: PhoneSequence, n_frames: int, fps: float) -> NDArray[np.bool_]:
    """(T,) frames within silence."""
    at = np.searchsorted(phones.edges, np.arange(n_frames) / fps, side="right") - 1
    labels = np.array([label == SILENCE for label in phones.phones])
    return np.asarray(labels[np.clip(at, 0, len(labels) - 1)])


def exclude_tokens(exemplars: ExemplarModel, excluded: Sequence[ExcludedToken]) -> ExemplarModel:
    """The exemplars without some tokens; their motion still serves the overlap of their neighbours.

    Raises
    ------
    InputError
        There is no such token, or a phone would have none left.
    """
    tokens = exemplars.tokens
    is_kept = np.ones(len(tokens), np.bool_)
    for token in excluded:
        if token.utterance not in exemplars.names:
            raise InputError(f"the talker has no recording {token.utterance!r} of which a phone could be excluded")
        is_here = tokens.utterance == exemplars.names.index(token.utterance)
        at = np.flatnonzero(is_here & (np.abs(tokens.spans[:, 1] - token.start) <= MAX_START_CHANGE_S))
        if not len(at):
            raise InputError(f"no phone of the recording {token.utterance} begins at {token.start:g} s; check the time")
        is_kept[at] = False
    for number in np.unique(tokens.phone[~is_kept]):
        if not is_kept[tokens.phone == number].any():
            label = tokens.inventory[number]
            raise InputError(f"all recorded examples of /{label}/ are excluded; keep at least one")
    return replace(exemplars, index=context_index(tokens, exemplars.similarity.matrix, is_kept))
