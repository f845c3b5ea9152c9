"""Reading and writing of ``.talker`` files (docs/file-formats.md)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import PHONES
from lexicon.sequence import SILENCE, PhoneSequence, WordSpan
from lexicon.values.checks import Check, Place, anything, list_of, number, record, row, text
from tts2face.models.appearance import APPEARANCE, STEPS_PER_PARAMETER, Appearance
from tts2face.models.audio_map_file import FPS_LIMITS, audio_map_arrays, audio_maps_of, check_audio_maps
from tts2face.models.codec import (
    StoredModel,
    check_model,
    half,
    has_part,
    header_checks,
    model_of,
    stored_arrays,
    stored_header,
)
from tts2face.models.phone_network import INVENTORY, NETWORK, PhoneNetwork
from tts2face.models.score_map import SCORES, check_score_map, score_map_of
from tts2face.models.talker import ShapeModel, Talker, Utterance, speech_channels
from tts2face.numeric.arrays import Float32Array
from tts2face.processes.shared import Shared, file_state
from tts2face.storage.schema import MAX_MM, Contents, Tensor, refuse
from tts2face.storage.shipped import find_file
from tts2face.storage.tensors import read_tensors, write_tensors
from tts2face.types import HEAD_CHANNELS

KIND = "talker"
# raised when readers of before would misread a file
FORMAT_VERSION = 1
STEPS_PER_SPREAD = 2000.0  # of shape parameters: finer than the tracker's noise
ROUNDING_S, BEYOND_S = 1e-6, 1.0  # largest excess of phones before and after the frames of their utterance
METADATA: Mapping[str, Check] = {
    "fps": number(*FPS_LIMITS),
    **header_checks(ShapeModel),
    "inventory": list_of(text),
    "head_channels": list_of(text, len(HEAD_CHANNELS)),
}
OPTIONAL_METADATA: Mapping[str, Check] = {
    "refused": list_of(row(text, text)),
    "phones_recognised": list_of(text),
    "consent": record({"name": anything, "statement": text, "date": text}),
    **header_checks(PhoneNetwork),
    "pooled": text,
}
OF_FORMAT = {*METADATA, "utterances", INVENTORY}  # metadata that are no statement about the talker

_TALKERS: Shared[Talker] = Shared()


@dataclass(frozen=True, slots=True, eq=False)
class StoredUtterances(StoredModel):
    """All utterances as a file holds them, one after the other: N frames and P phones of U utterances.

    Parameters
    ----------
    shape : (N, M)
        In steps of the spread of each parameter, of which there are `STEPS_PER_SPREAD`.
    head, intensity : (N, 6), (N,)
    n_frames, n_phones : (U,)
    phones : (P,)
        Numbers among the phones of the metadata.
    edges : (P + U,)
        Seconds.
    """

    shape: Annotated[NDArray[np.int16], Tensor("int16", ("frames", "modes"))]
    head: Annotated[Float32Array, half("frames", len(HEAD_CHANNELS), low=-MAX_MM, high=MAX_MM)]
    intensity: Annotated[Float32Array, half("frames", low=-1000.0, high=1000.0)]
    n_frames: Annotated[NDArray[np.int32], Tensor("int32", ("utterances",), 1)]
    n_phones: Annotated[NDArray[np.int32], Tensor("int32", ("utterances",), 1)]
    phones: Annotated[NDArray[np.int16], Tensor("int16", ("phones",))]
    edges: Annotated[NDArray[np.float64], Tensor("float64", ("edges",), -ROUNDING_S, 1e6)]

    @classmethod
    def of(cls, utterances: Sequence[Utterance], spread: Float32Array, inventory: Sequence[str]) -> "StoredUtterances":
        """Utterances of a talker with parameters of this spread (M,)."""
        numbers = {phone: number for number, phone in enumerate(inventory)}
        spoken = [numbers[phone] for utterance in utterances for phone in utterance.phones.phones]
        return cls(
            shape=_steps([utterance.shape for utterance in utterances], spread / STEPS_PER_SPREAD),
            head=np.concatenate([utterance.head for utterance in utterances]),
            intensity=np.concatenate([utterance.intensity for utterance in utterances]),
            n_frames=np.array([len(utterance.shape) for utterance in utterances], np.int32),
            n_phones=np.array([len(utterance.phones) for utterance in utterances], np.int32),
            phones=np.array(spoken, np.int16),
            edges=np.concatenate([utterance.phones.edges for utterance in utterances]),
        )

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse utterances whose frames, phones and words do not fit each other."""
        arrays, sizes = contents.arrays, contents.sizes
        inventory, utterances = contents.header["inventory"], contents.header["utterances"]
        n = sizes["utterances"]
        contents.require(len(utterances) == n, f"names {len(utterances)} utterances, but n_frames has {n}")
        contents.sums_to("n_frames", sizes["frames"], "frames")
        contents.sums_to("n_phones", sizes["phones"], "phones")
        n_edges, n_phones = sizes["edges"], sizes["phones"]
        contents.require(n_edges == n_phones + n, f"has {n_edges} edges of {n_phones} phones")
        contents.indices("phones", len(inventory), "phones of the inventory")
        is_speech = np.array([phone != SILENCE for phone in inventory], bool)
        contents.require(bool(is_speech[arrays["phones"]].any()), "holds no phone but silence")
        ends = np.cumsum(arrays["n_phones"] + 1)
        steps = np.diff(arrays["edges"])
        steps[ends[:-1] - 1] = 1.0  # from an utterance to the next
        falls = np.flatnonzero(steps <= 0)
        contents.require(not len(falls), f"edges do not increase at {falls[:1]}")
        late = np.flatnonzero(arrays["edges"][ends - 1] > arrays["n_frames"] / contents.header["fps"] + BEYOND_S)
        if len(late):
            contents.fail(f"phones of the utterance {utterances[late[0]][0]!r} end after its frames")
        reach = np.zeros(n, np.int64) + [max((word[2] for word in words), default=0) for _, words in utterances]
        beyond = np.flatnonzero(reach > arrays["n_phones"])
        if len(beyond):
            contents.fail(f"a word of the utterance {utterances[beyond[0]][0]!r} reaches beyond its phones")

    def utterances(
        self,
        named: Sequence[tuple[str, Any]],
        inventory: Sequence[str],
        spread: Float32Array,
        appearances: Float32Array | None,
    ) -> Iterator[Utterance]:
        """The utterances, with their names and words, and appearance parameters (N, A)."""
        frames = np.concatenate([[0], np.cumsum(self.n_frames)])
        phones = np.concatenate([[0], np.cumsum(self.n_phones)])
        shape = self.shape.astype(np.float32) * (spread / STEPS_PER_SPREAD)
        for i, (name, words) in enumerate(named):
            labels = [inventory[number] for number in self.phones[phones[i] : phones[i + 1]]]
            sequence = PhoneSequence(labels, self.edges[phones[i] + i : phones[i + 1] + i + 1])
            spans = tuple(WordSpan(text, first, last) for text, first, last in words)
            span = slice(frames[i], frames[i + 1])
            own = None if appearances is None else appearances[span]
            yield Utterance(name, sequence, spans, shape[span], self.head[span], self.intensity[span], own)


def _steps(values: Sequence[Float32Array], step: Float32Array) -> NDArray[np.int16]:
    """Values (T, D) of utterances, one after the other, in whole steps (D,)."""
    steps: NDArray[np.int16] = np.clip(np.rint(np.concatenate(values) / step), -32768, 32767).astype(np.int16)
    return steps


def write_talker(path: Path, talker: Talker) -> None:
    """Write a ``.talker`` file."""
    utterances, model = talker.utterances, talker.model
    inventory = sorted({phone for utterance in utterances for phone in utterance.phones.phones})
    arrays = stored_arrays(model) | stored_arrays(StoredUtterances.of(utterances, model.spread, inventory))
    if talker.appearance is not None:
        parameters = [utterance.appearance_parameters for utterance in utterances]
        step = talker.appearance.spread / STEPS_PER_PARAMETER
        arrays["looks"] = _steps([values for values in parameters if values is not None], step)
        arrays |= stored_arrays(talker.appearance, APPEARANCE)
    if talker.network is not None:
        arrays |= stored_arrays(talker.network, NETWORK)
    arrays |= audio_map_arrays(talker.audio_maps)
    if talker.scores is not None:
        arrays |= stored_arrays(talker.scores, SCORES)
    header = {
        **talker.metadata,
        "fps": talker.fps,
        **stored_header(model),
        "inventory": inventory,
        **({} if talker.network is None else stored_header(talker.network)),
        "head_channels": HEAD_CHANNELS,
        "utterances": [
            [utterance.name, [[word.text, word.first, word.last] for word in utterance.words]]
            for utterance in utterances
        ],
    }
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header)


def read_talker(path: Path) -> Talker:
    """Read a ``.talker`` file.

    Raises
    ------
    InputError
        The file does not exist.
    DataError
        The file is damaged, of another kind or version, or invalid.
    """
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    contents = Contents(path, KIND, arrays, header)
    _check(contents)
    return _talker_of(contents)


def load_talker(name: str) -> Talker:
    """A shipped talker by name, or one from a ``.talker`` file; errors as `find_file` and `read_talker`.

    All who load the same file share one talker; a file that has changed is read again.
    """
    path = find_file(name, KIND)
    return _TALKERS.get(file_state(path), lambda: read_talker(path))


def _check(contents: Contents) -> None:
    _check_metadata(contents)
    check_model(ShapeModel, contents)
    check_model(StoredUtterances, contents)
    if has_part(contents, APPEARANCE):
        check_model(Appearance, contents, APPEARANCE)
        n_parameters = contents.sizes["face parameters"] + contents.sizes["mouth parameters"]
        contents.tensors({"looks": Tensor("int16", ("frames", n_parameters))})
    if has_part(contents, NETWORK):
        check_model(PhoneNetwork, contents, NETWORK)
    check_audio_maps(contents)
    check_score_map(contents, contents.header["n_speech"])
    contents.only_known()


def _talker_of(contents: Contents) -> Talker:
    arrays, header = contents.arrays, contents.header
    model, recordings = model_of(ShapeModel, contents), model_of(StoredUtterances, contents)
    appearance = model_of(Appearance, contents, APPEARANCE) if has_part(contents, APPEARANCE) else None
    appearances = None if appearance is None else arrays["looks"] * (appearance.spread / STEPS_PER_PARAMETER)
    fps = float(header["fps"])
    return Talker(
        fps=fps,
        model=model,
        utterances=tuple(recordings.utterances(header["utterances"], header["inventory"], model.spread, appearances)),
        metadata={key: value for key, value in header.items() if key not in OF_FORMAT},
        appearance=appearance,
        network=model_of(PhoneNetwork, contents, NETWORK) if has_part(contents, NETWORK) else None,
        audio_maps=audio_maps_of(contents),
        scores=score_map_of(contents, speech_channels(model)),
    )


def _check_metadata(contents: Contents) -> None:
    header = contents.header
    stated = {name: check for name, check in OPTIONAL_METADATA.items() if name in header}
    contents.metadata({**METADATA, **stated, "utterances": _utterance_rows})
    contents.require(
        header["head_channels"] == list(HEAD_CHANNELS), f"head_channels must be {', '.join(HEAD_CHANNELS)}"
    )
    for name in ("inventory", "network_inventory"):
        phones = header.get(name, [SILENCE])
        unknown = [phone for phone in phones if phone not in PHONES]
        contents.require(not unknown, f"{name} holds {unknown[:1]}, which is no phone of the phone table")
        contents.require(len(set(phones)) == len(phones), f"{name} holds a duplicate phone")


def _utterance_rows(value: Any, place: Place) -> None:
    """Check names and words of utterances; one loop, because talkers have tens of thousands of words."""
    if type(value) is not list:
        refuse(f"{place.name} is not a list", "talker")
    for at, utterance in enumerate(value):
        if (
            type(utterance) is not list
            or len(utterance) != 2
            or type(utterance[0]) is not str
            or type(utterance[1]) is not list
        ):
            refuse(f"{place.name}[{at}] is not a name with a list of words", "talker")
        for word in utterance[1]:
            fits = type(word) is list and len(word) == 3 and type(word[0]) is str
            if not fits or type(word[1]) is not int or type(word[2]) is not int or not 0 <= word[1] < word[2] < 2**31:
                refuse(f"{place.name}[{at}] holds a word that is not a text with its first and last phone", "talker")
