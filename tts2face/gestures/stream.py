"""Gestures for speech: one Markov random field for each feature, with its own style, time axis and random stream.

The fields of Ju and Lee 2008 as published (section 5.1), to compare with the default ones.
"""

from bisect import bisect_right
from collections.abc import Mapping
from copy import copy, deepcopy
from dataclasses import dataclass, field, replace
from itertools import pairwise
from types import MappingProxyType
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from tts2face.gestures.blinks import BlinkPresentation, blink_profiles, lids_without_blinks, open_at_end
from tts2face.gestures.field import (
    Field,
    FieldOptions,
    FieldState,
    build_field,
    initial_state,
    sample_field,
    transfer_state,
)
from tts2face.gestures.gaze import GazeProcess, HeadFollower
from tts2face.gestures.head_presentation import HeadPresentation, slow_scales
from tts2face.gestures.movements import channel_values, head_turn, pair_values, timed
from tts2face.gestures.phrase_motion import PhraseMotion
from tts2face.gestures.presentation import (
    CHANGING,
    Emphasis,
    FrameContext,
    PhrasePresentation,
    Presentation,
    brow_lifts,
    phrase_scales,
)
from tts2face.gestures.speech_features import FollowedSound, recorded_features
from tts2face.gestures.speech_plan import NO_PLAN, SpeechPlan
from tts2face.gestures.timeline import Timeline
from tts2face.models.gaze import load_gaze
from tts2face.models.palette import FEATURES, GESTURE_FPS, FeatureChange, Palette, Style
from tts2face.numeric.arrays import Float32Array, interpolate_cubic
from tts2face.types import Waveform

N_LOOKAHEAD_FRAMES = 2  # frames after a time that cubic interpolation needs
# Features whose fields compare the place in speech; the expression follows it as well without (decision 243).
FOLLOWING = frozenset({"brows", "cheeks", "head"})
NO_CHANGE = FeatureChange()
NEAR_ENOUGH = 1.6  # search error: with many features, motion is that of 1.1 in two thirds of the time
NO_SEEDS: Mapping[str, int] = MappingProxyType({})
# Tuned on three quarters of the recordings of GRID s1 (decisions 175, 243); all other features use the defaults.
OPTIONS: Mapping[str, FieldOptions] = MappingProxyType(
    {
        "expression": FieldOptions(alpha=(3.0, 1.0), sigma=0.05, stride=4, search_error=NEAR_ENOUGH),
        "brows": FieldOptions(search_error=NEAR_ENOUGH),
        "cheeks": FieldOptions(search_error=NEAR_ENOUGH),
        # decision 175 compares these with exponential decay
        "head": FieldOptions(
            alpha=(16.0, 16.0),
            speech_alpha=(20.0, 20.0, 20.0, 3.0),
            stride=3,
            continuity=0.07,
            settle_s=0.09,
            candidates=4,
            search_error=NEAR_ENOUGH,
        ),
        "blink": FieldOptions(
            alpha=(1.0, 0.1),
            sigma=0.3,
            stride=3,
            continuity=1.0,
            future=6,
            settle_s=0.015,
            candidates=2,
            memory=150,
        ),
    }
)
GestureValues = Mapping[str, Float32Array]  # (T, k) values of each feature
# A draw at every frame from the four nearest of all recorded frames, h = 10 preceding frames at 30 frames a second, no
# bonus for the following frame, no memory of earlier draws, and recorded values shown as they are. The paper names
# alpha and sigma but prints no values; both were chosen within the training recordings (decision 066). Its distance
# is the sum over the h frames, that of a field their mean: the draw is the same with sigma h times as large.
JU_2008 = FieldOptions(
    history=10,
    candidates=4,
    alpha=(1.0, 1.0),
    sigma=0.1,
    stride=1,
    continuity=1.0,
    future=0,
    settle_s=0.0,
    memory=0,
    apart=1,
    search_error=1.0,
)
FIELD_OPTIONS: Mapping[str, Mapping[str, FieldOptions]] = MappingProxyType(
    {"fields": OPTIONS, "ju2008": MappingProxyType(dict.fromkeys(FEATURES, JU_2008))}
)


@dataclass(slots=True, eq=False)
class GestureFields:
    """Fields of a palette, built at their first use; for any number of clips.

    ``has_presentation`` is False for motion as published, where derived styles blink and move as their sources.
    """

    palette: Palette
    options: Mapping[str, FieldOptions] = field(default_factory=lambda: OPTIONS)
    with_pitch: bool = False
    has_presentation: bool = True
    _made: dict[tuple[str, str, bool], Field] = field(default_factory=dict)
    _profiles: dict[str, tuple[NDArray[np.float64], ...]] = field(default_factory=dict)
    _head_scales: dict[tuple[str, str], NDArray[np.float64]] = field(default_factory=dict)
    _scales: dict[tuple[str, str], tuple[NDArray[np.float64], NDArray[np.float64]]] = field(default_factory=dict)
    _middles: dict[tuple[str, str], Float32Array] = field(default_factory=dict)
    _speech: dict[str, Float32Array] = field(default_factory=dict)

    def of(self, source: str, feature: str, *, has_blinks: bool = True) -> Field:
        """Field of a feature of a recorded style; without ``has_blinks``, of its lids between blinks."""
        key = (source, feature, has_blinks)
        if key not in self._made:
            style = self.palette.styles[source]
            prosody = np.stack([style.intensity, style.pitch], axis=1)[:, : 2 if self.with_pitch else 1]
            options = self.options.get(feature, FieldOptions())
            if self.follows_speech(feature):
                alpha = options.alpha[: prosody.shape[1]] + options.speech_alpha
                prosody, options = (
                    np.concatenate([prosody, self._speech_of(source)], axis=1),
                    replace(options, alpha=alpha),
                )
            motion = style.motion[feature] if has_blinks else lids_without_blinks(style)
            self._made[key] = build_field(motion, prosody, style.lengths, options)
        return self._made[key]

    def follows_speech(self, feature: str) -> bool:
        """Whether `recorded_features` are compared, too: not those of lids and eyes, and not as published."""
        return self.has_presentation and feature in FOLLOWING

    def _speech_of(self, source: str) -> Float32Array:
        if source not in self._speech:
            self._speech[source] = recorded_features(self.palette.styles[source])
        return self._speech[source]

    def middle(self, source: str, feature: str) -> Float32Array:
        """`style_median` of a feature of a recorded style."""
        key = (source, feature)
        if key not in self._middles:
            self._middles[key] = style_median(self.palette.styles[source], feature)
        return self._middles[key]

    def presents(self, style: str) -> bool:
        """Whether a style is shown retimed and scaled for viewers: a derived one, unless motion is as published."""
        return self.has_presentation and style in self.palette.derivations

    def presentation(self, source: str, feature: str, seed: int) -> Presentation | None:
        """Presentation of a feature of a recorded style for one clip; None for features that are not changed."""
        if not self.has_presentation:
            return None
        style = self.palette.styles[source]
        motion = PhraseMotion([seed, crc32(b"phrases")])
        if feature == "blink":
            if source not in self._profiles:
                self._profiles[source] = blink_profiles(style)
            return BlinkPresentation(self._profiles[source], [seed, crc32(b"presented blink")])
        if feature != "head" and feature not in CHANGING:
            return None
        key, middle = (source, feature), self.middle(source, feature)
        if feature == "head":
            if key not in self._head_scales:
                self._head_scales[key] = slow_scales(style)
            return HeadPresentation(middle, self._head_scales[key], motion)
        if key not in self._scales:
            self._scales[key] = phrase_scales(style, feature)
        lifts = brow_lifts(self.palette.regions["brows"], self.palette.neutral) if feature == "brows" else None
        return PhrasePresentation(middle, self._scales[key], None if lifts is None else (motion, lifts))

    def gaze_process(self, feature: str, seed: int) -> GazeProcess | None:
        """Gaze of derived styles for one clip; None for other features, and for motion as published."""
        if feature != "gaze" or not self.has_presentation:
            return None
        # With this name the default seed draws a typical person (on the face .66 of speech, .92 of listening), who
        # looks at the viewer for two seconds first.
        return GazeProcess.of_person(load_gaze(), [seed, crc32(b"partner")])

    def source(self, style: str, feature: str) -> str:
        """Recorded style from which a style's feature is sampled; another one if that style lacks the feature."""
        styles, name = self.palette.styles, self.palette.source(style)
        if feature in styles[name].motion:
            return name
        return next(other for other, recorded in styles.items() if feature in recorded.motion)

    def change(self, style: str, feature: str) -> FeatureChange:
        """Change of a feature by which a derived style differs from its source."""
        derived = self.palette.derivations.get(style)
        return NO_CHANGE if derived is None else derived.changes.get(feature, NO_CHANGE)

    def apply_change(
        self, style: str, feature: str, values: Float32Array, emphasis: NDArray[np.float64] | None = None
    ) -> Float32Array:
        """Apply the gain of a style, and its offset times `emphasis` (T,), to values (T, k) of its source."""
        change = self.change(style, feature)
        middle = self.middle(self.source(style, feature), feature)
        offset = np.array([change.offset.get(channel, 0.0) for channel in self.palette.channels(feature)], np.float32)
        offsets = offset if emphasis is None else emphasis[:, None] * offset
        return np.asarray(middle + np.float32(change.gain) * (values - middle) + offsets, np.float32)

    def apply_timeline(
        self, feature: str, values: Float32Array, times: NDArray[np.float64], timeline: Timeline
    ) -> Float32Array:
        """Apply what a timeline adds to a feature, and its strength, to values (T, k)."""
        values = np.asarray(values * timeline.strength(feature, times).astype(np.float32)[:, None], np.float32)
        if feature == "expression":
            values = values + timeline.expression_weights(times).astype(np.float32)
        elif feature == "gaze":
            values = timeline.apply_gaze(times, values).astype(np.float32)
        elif timeline.gestures:
            values = self._with_gestures(feature, values, times, timeline)
        return values

    def _with_gestures(
        self, feature: str, values: Float32Array, times: NDArray[np.float64], timeline: Timeline
    ) -> Float32Array:
        """Values (T, k) of lids, head and brows with the gestures of a timeline; others as they are."""
        moving, added = timed(timeline.gestures, times), np.zeros(values.shape)
        if feature == "head":
            added[:, :3] = head_turn(moving, times)
        elif feature == "blink":
            # of the way to shut lids, wherever they are: a lid that is shut already shuts no further
            added += pair_values(moving, "lid", times).clip(0.0, 1.0) * (1.0 - values)
        elif feature == "brows":
            lift = self.palette.brow_lift
            added += np.outer(channel_values(moving, "brows_up", times), lift / (lift @ lift))
            added += np.outer(channel_values(moving, "brows_together", times), self.palette.brow_gathering)
        else:
            return values
        return np.asarray(values + added, np.float32)

    @property
    def features(self) -> tuple[str, ...]:
        """Features of which any style of the palette has recordings."""
        return tuple(name for name in FEATURES if any(name in style.motion for style in self.palette.styles.values()))


class GestureStream:
    """Gestures of one clip, generated piece by piece; the result is independent of the division into pieces.

    The random stream of each feature is seeded by the seed (or the feature's own one of `seeds`) and the feature's
    name, so that a change of one feature does not affect the others.
    """

    def __init__(
        self, fields: GestureFields, *, style: str, seed: int, fps: float, seeds: Mapping[str, int] = NO_SEEDS
    ) -> None:
        fields.palette.require(style)
        self._fields, self._fps = fields, fps
        self._tracks = {name: _FeatureTrack(fields, name, style, seeds.get(name, seed)) for name in fields.features}
        self._n_frames = 0
        self._style = style
        self._follower = HeadFollower()

    def copy(self) -> "GestureStream":
        """A stream that continues as this one, independently of it."""
        new = copy(self)
        new._follower = self._follower.copy()
        new._tracks = {name: track.copy() for name, track in self._tracks.items()}
        return new

    def next(self, sound: Waveform, n_frames: int, timeline: Timeline, plan: SpeechPlan = NO_PLAN) -> GestureValues:
        """Values (n_frames, k) of each feature for the next frames.

        Parameters
        ----------
        sound
            Sound of these frames.
        timeline
            Styles, expressions, gestures and gains, in seconds of the whole clip; all of them are applied.
        plan
            What is said in these frames, in seconds of them.
        """
        start = self._n_frames / self._fps
        times = (self._n_frames + np.arange(n_frames)) / self._fps
        self._n_frames += n_frames
        values, prosody = {}, FollowedSound(sound, start, plan, with_pitch=self._fields.with_pitch)
        said = plan.shift(start)
        for name, track in self._tracks.items():
            track.extend(prosody, float(times[-1]), timeline, said)
            values[name] = self._fields.apply_timeline(name, track.at(times, timeline), times, timeline)
        if plan.is_last and "blink" in values and self._fields.has_presentation:
            values["blink"] = open_at_end(values["blink"], times, float(times[-1]))
        if "gaze" in values and "head" in values:
            turned = self._follower.next(values["gaze"], self._fps) * timeline.strength("head", times)[:, None]
            shares = timeline.style_shares("head", times, default=self._style)
            presented = sum(share for style, share in shares.items() if self._fields.presents(style))
            values["head"][:, :2] += (np.reshape(presented, (-1, 1)) * turned).astype(np.float32)
        return values


class _FeatureTrack:
    """One feature of a clip: frames of its fields at times that follow the style's tempo."""

    def __init__(self, fields: GestureFields, feature: str, style: str, seed: int) -> None:
        self._fields = fields
        self._feature = feature
        self._style = style
        self._generator = np.random.default_rng([seed, crc32(feature.encode())])
        self._source, self._first_chance = self._source_of(style), self._generator.random()
        self._state: FieldState | None = None  # before the first frame of a field
        self._times: list[float] = []
        self._values = np.zeros((0, len(fields.palette.channels(feature))), np.float32)
        self._presentation = fields.presentation(self._source[0], feature, seed)
        self._gaze = fields.gaze_process(feature, seed)
        self._emphasis = Emphasis() if feature == "expression" else None
        self._emphases = np.zeros(0)

    def copy(self) -> "_FeatureTrack":
        """A track that continues as this one, independently of it."""
        new = copy(self)
        new._generator, new._times = deepcopy(self._generator), self._times.copy()  # all else is replaced, not changed
        new._presentation = None if self._presentation is None else self._presentation.copy()
        new._emphasis = None if self._emphasis is None else self._emphasis.copy()
        new._gaze = None if self._gaze is None else self._gaze.copy()
        return new

    def extend(self, sound: FollowedSound, end: float, timeline: Timeline, plan: SpeechPlan) -> None:
        """Generate frames up to `N_LOOKAHEAD_FRAMES` after `end` seconds."""
        first, style_of = len(self._times), timeline.style_finder(self._feature, default=self._style)
        while len(self._times) <= N_LOOKAHEAD_FRAMES or self._times[-1 - N_LOOKAHEAD_FRAMES] <= end:
            tempo = self._fields.change(style_of(self._times[-1]), self._feature).tempo if self._times else 1.0
            self._times.append(self._times[-1] + 1.0 / (GESTURE_FPS * tempo) if self._times else 0.0)
        new = np.array(self._times[first:])
        if not len(new):
            return
        styles = [style_of(second) for second in self._times[first:]]
        sources = [self._source_of(style) for style in styles]
        prosody = sound.at(new, with_speech=self._fields.follows_speech(self._feature))
        chances = self._generator.random(len(new))
        borders = [0, *(i for i in range(1, len(new)) if sources[i] != sources[i - 1]), len(new)]
        parts = [self._sample(sources[low], prosody[low:high], chances[low:high]) for low, high in pairwise(borders)]
        values, is_presented = np.concatenate(parts), np.array([self._fields.presents(style) for style in styles])
        last = end if plan.is_last else np.inf
        frames = FrameContext(new, prosody[:, 0], plan, is_presented, timeline.is_listening(new), last)
        if self._presentation is not None:
            values = self._presentation.apply(values, frames)
        if self._gaze is not None:
            self._gaze.extend(frames)
        if self._emphasis is not None:
            self._emphases = np.concatenate([self._emphases, self._emphasis.next(frames)])
        self._values = np.concatenate([self._values, values])

    def _source_of(self, style: str) -> tuple[str, bool]:
        """Recorded style of which the field is sampled, and whether with its blinks, or its gaze."""
        is_whole = self._feature not in {"blink", "gaze"} or not self._fields.presents(style)
        return self._fields.source(style, self._feature), is_whole

    def _field(self, source: tuple[str, bool]) -> Field:
        name, has_blinks = source
        return self._fields.of(name, self._feature, has_blinks=has_blinks)

    def _sample(self, source: tuple[str, bool], prosody: Float32Array, chances: NDArray[np.float64]) -> Float32Array:
        # the gaze of conversation replaces what a field would draw
        if self._gaze is not None and not source[1]:
            return np.zeros((len(chances), self._values.shape[1]), np.float32)
        field = self._field(source)
        if self._state is None:
            self._state = initial_state(field, self._first_chance)
        elif source != self._source:
            self._state = transfer_state(self._state, self._field(self._source), field)
        self._source = source
        values, self._state = sample_field(field, self._state, prosody, chances)
        return values

    def at(self, times: NDArray[np.float64], timeline: Timeline) -> Float32Array:
        """(T, k) values at T times with the changes of the styles; frames before the last time are discarded."""
        clock = np.array(self._times)
        values = interpolate_cubic(self._values, np.interp(times, clock, np.arange(len(clock))))
        emphasis = np.interp(times, clock, self._emphases) if len(self._emphases) else None
        shares = timeline.style_shares(self._feature, times, default=self._style)
        presented = values if self._gaze is None else self._gaze.at(times)
        changed = np.zeros_like(values)
        for style, share in shares.items():
            of_style = presented if self._fields.presents(style) else values
            changed += share.astype(np.float32)[:, None] * self._fields.apply_change(
                style, self._feature, of_style, emphasis
            )
        passed = max(0, bisect_right(self._times, times[-1]) - 1 - N_LOOKAHEAD_FRAMES)
        self._times, self._values = self._times[passed:], self._values[passed:]
        self._emphases = self._emphases[passed:]
        return changed


def style_median(style: Style, feature: str) -> Float32Array:
    """(k,) median of the recordings of a style's feature."""
    return np.asarray(np.median(style.motion[feature], axis=0), np.float32)
