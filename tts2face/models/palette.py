"""Gesture palettes: recorded facial gestures of speakers as named styles.

After Ju and Lee 2008: a style holds one speaker's recorded gestures without the speech motion of the lips. All styles
are motion of one common face, so that styles of different speakers can be mixed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.codec import StoredModel
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.numeric.arrays import Float32Array
from tts2face.storage.schema import Contents, Tensor
from tts2face.types import HEAD_CHANNELS

MAX_MODES = 64  # of a region
GESTURE_FPS = 30.0  # Ju and Lee 2008, section 3; the frame rate of every style
EXPRESSIONS = ("sad", "happy", "afraid", "angry", "surprised")  # neutral, the sixth, is the face at rest
EYE_CHANNELS = ("left", "right")  # of the speaker
# Channels of the features that are the same in every palette; "brows" and "cheeks" have one channel per mode of the
# palette's regions. Units: weights of basis expressions; closure of the lids (0 to 1); radians (down, to the own left);
# radians and mm.
FIXED_CHANNELS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {"expression": EXPRESSIONS, "blink": EYE_CHANNELS, "gaze": ("pitch", "yaw"), "head": HEAD_CHANNELS}
)
GATHERED_DOWN = -0.6  # mm down of brows that come together by one (corrugator; Ekman and Friesen 1978, AU 4)
LEAST_GATHERING = 0.1  # share of that movement which the modes must have
REGION_FEATURES = ("brows", "cheeks")
MEASURED_STYLE = "measured"  # the recorded motion from which the default style is derived, unchanged
FEATURES = ("expression", "brows", "blink", "cheeks", "gaze", "head")


@dataclass(frozen=True, slots=True, eq=False)
class FaceRegion(StoredModel):
    """Independent motion D_j of a region of the face: ``displacement = sum_i d_i modes_i``.

    Parameters
    ----------
    landmarks : (L,)
        Indices of `tts2face.models.landmarks`.
    modes : (k, L, 3)
        Orthonormal as rows of (k, 3 L); values d are in mm.
    """

    landmarks: Annotated[NDArray[np.int32], Tensor("int32", ("landmarks of {own}",))]
    modes: Annotated[Float32Array, Tensor("float32", ("modes of {own}", "landmarks of {own}", 3), -1.01, 1.01)]

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse landmarks that there are not, and modes that are too many or not orthonormal."""
        landmarks, modes = f"{prefix}.landmarks", f"{prefix}.modes"
        contents.indices(landmarks, N_LANDMARKS, "landmarks of the face mesh")
        contents.distinct(landmarks)
        n_modes = len(contents.arrays[modes])
        contents.require(n_modes <= MAX_MODES, f"{modes} are {n_modes}; at most {MAX_MODES} are possible")
        contents.orthonormal(modes)


@dataclass(frozen=True, slots=True, eq=False)
class Style:
    """Recorded gestures of one speaker in one mood: concatenated recordings at `GESTURE_FPS`.

    Parameters
    ----------
    lengths : (R,)
        Frames of each recording.
    intensity : (T,)
        Sound level in dB relative to the mean level of the speech; silence is far below 0.
    pitch : (T,)
        Semitones relative to the median of the recording; 0 on unvoiced frames.
    motion
        (T, k) values of each recorded feature of `FEATURES`.
    metadata
        At least sources, licence, attribution and command.
    steps
        (k,) steps of each feature's values in the file from which the style was read, so that it is written unchanged;
        empty for new motion.
    """

    lengths: NDArray[np.int32]
    intensity: Float32Array
    pitch: Float32Array
    motion: Mapping[str, Float32Array]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    steps: Mapping[str, Float32Array] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that all parts have the same number of frames, then make the arrays read-only."""
        n_frames = int(self.lengths.sum())
        if n_frames == 0 or not len(self.intensity) == len(self.pitch) == n_frames:
            raise DataError("a style's recordings, intensity and pitch differ in length; build the palette again")
        for name, values in self.motion.items():
            if name not in FEATURES or len(values) != n_frames:
                raise DataError(f"a style's {name} does not fit its {n_frames} frames; build the palette again")
        for array in (self.lengths, self.intensity, self.pitch, *self.motion.values(), *self.steps.values()):
            array.setflags(write=False)

    @property
    def seconds(self) -> float:
        """Duration of all recordings in seconds."""
        return float(self.lengths.sum()) / GESTURE_FPS


@dataclass(frozen=True, slots=True)
class FeatureChange:
    """Change of a feature of a recorded style.

    ``gain`` multiplies the motion about its mean, ``offset`` is added to channels by name, ``tempo`` multiplies the
    playback speed.
    """

    gain: float = 1.0
    offset: Mapping[str, float] = field(default_factory=dict)
    tempo: float = 1.0


@dataclass(frozen=True, slots=True)
class Delivery:
    """How a voice speaks under a style.

    Parameters
    ----------
    rate
        Factor of the speaking rate.
    level_db
        Gain of the sound.
    pitch
        Semitones added to F0.
    range
        Factor of the distances of F0 from its median.
    """

    rate: float = 1.0
    level_db: float = 0.0
    pitch: float = 0.0
    range: float = 1.0

    @property
    def volume(self) -> float:
        """The gain as a factor."""
        return math.pow(10.0, self.level_db / 20.0)


PLAIN = Delivery()


@dataclass(frozen=True, slots=True)
class Derivation:
    """Derived style: the recorded style ``source`` with changes by feature, and its delivery."""

    source: str
    changes: Mapping[str, FeatureChange]
    summary: str
    delivery: Delivery = PLAIN


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Palette:
    """Recorded and derived gesture styles by name.

    Parameters
    ----------
    neutral : (478, 3)
        Landmarks at rest of the face that all styles move, mm; axes as in `tts2face.models.landmarks`.
    regions
        Region of each of `REGION_FEATURES`.
    styles, derivations
        Recorded styles, and those derived from them.
    """

    neutral: Float32Array
    regions: Mapping[str, FaceRegion]
    styles: Mapping[str, Style]
    derivations: Mapping[str, Derivation]
    metadata: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Check that there are styles, that their channels agree, and that the source of each derived style exists."""
        if not self.styles:
            raise DataError("the palette holds no style; build it with `tts2face corpus gestures`")
        for name, style in self.styles.items():
            for feature, values in style.motion.items():
                if values.shape[1] != len(self.channels(feature)):
                    raise DataError(f"{feature} of the style {name} has {values.shape[1]} channels; build it again")
        for name, derived in self.derivations.items():
            if derived.source not in self.styles:
                raise DataError(f"the style {name} is derived from {derived.source}, which is missing; build it again")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all styles, the derived ones first, `MEASURED_STYLE` last."""
        return tuple(dict.fromkeys([*self.derivations, *self.styles, MEASURED_STYLE]))

    def source(self, name: str) -> str:
        """Recorded style that a style is or is derived from; for `MEASURED_STYLE` that of the first derived style.

        Raises
        ------
        InputError
            The palette has no style of this name.
        """
        if name in self.styles:
            return name
        if name in self.derivations:
            return self.derivations[name].source
        self.require(name)
        first = next(iter(self.derivations.values()), None)
        return next(iter(self.styles)) if first is None else first.source

    @property
    def deliveries(self) -> Mapping[str, Delivery]:
        """Deliveries of the styles by name; recorded styles have none."""
        return {name: derived.delivery for name, derived in self.derivations.items()}

    def channels(self, feature: str) -> tuple[str, ...]:
        """Names of a feature's channels."""
        if feature in REGION_FEATURES:
            return tuple(f"{feature}{i}" for i in range(len(self.regions[feature].modes)))
        return FIXED_CHANNELS[feature]

    @property
    def brow_lift(self) -> NDArray[np.float64]:
        """(k,) mean height in mm of the brows' landmarks for one unit of each of their modes."""
        return np.asarray(self.regions["brows"].modes[:, :, 1].mean(axis=1), np.float64)

    @property
    def brow_gathering(self) -> NDArray[np.float64]:
        """(k,) values of the modes of the brows that move their inner ends by a mm to the middle, and down."""
        region = self.regions["brows"]
        modes, sides = region.modes.astype(np.float64), np.sign(self.neutral[region.landmarks, 0].astype(np.float64))
        away = np.abs(self.neutral[region.landmarks, 0].astype(np.float64))
        share = np.interp(away / max(float(away.max()), 1e-6), (0.25, 0.65), (1.0, 0.0))  # inner ends in full
        wanted = share[:, None] * np.stack([-sides, np.full(len(away), GATHERED_DOWN), np.zeros(len(away))], axis=1)
        values = np.einsum("kla,la->k", modes, wanted)
        inward = -(sides * np.einsum("k,kl->l", values, modes[:, :, 0]))[share == 1.0]
        reached = float(inward.mean()) if len(inward) else 0.0
        # a palette whose brows never came together has no such movement
        return np.asarray(values / reached if reached > LEAST_GATHERING else 0.0 * values, np.float64)

    def require(self, name: str) -> str:
        """Return the name of an existing style.

        Raises
        ------
        InputError
            The palette has no style of this name.
        """
        if name not in self.names:
            raise InputError(f"there is no style {name!r} in the palette; it has {', '.join(self.names)}")
        return name
