"""Schema of ``.talker`` files (docs/file-formats.md), checked when a file is read."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import PHONES
from lexicon.sequence import SILENCE
from lexicon.values.checks import Check, Place, anything, list_of, number, record, row, text, whole
from tts2face.models.audio_map import ACTIVATIONS, AUDIO_MAP_PREFIX, FEATURE_SIZES, MAX_CONTEXT, MIDDLE, layer_names
from tts2face.models.landmarks import FACE_OVAL, N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.models.networks import N_PHONES_SEEN, N_PLACE, check_score_map
from tts2face.storage.schema import MAX_MM, Contents, Tensor, millimetres, refuse
from tts2face.types import HEAD_CHANNELS

FPS_LIMITS = (1.0, 1000.0)
MAX_WEIGHT = 1e6  # of a network or an audio map
MAX_PX = 1e5
MAX_TEXTURE_SIDE_PX = 4096  # pixels per side
ROUNDING_S, BEYOND_S = 1e-6, 1.0  # largest excess of phones before and after the frames of their utterance

METADATA: Mapping[str, Check] = {
    "fps": number(*FPS_LIMITS),
    "n_speech": whole(1, 10_000),
    "inventory": list_of(text),
    "head_channels": list_of(text, len(HEAD_CHANNELS)),
}
OPTIONAL_METADATA: Mapping[str, Check] = {
    "refused": list_of(row(text, text)),
    "phones_recognised": list_of(text),
    "consent": record({"name": anything, "statement": text, "date": text}),
    "network_inventory": list_of(text),
    "pooled": text,
}
TENSORS: Mapping[str, Tensor] = {
    "mean": millimetres(N_LANDMARKS, 3),
    "basis": Tensor("float32", ("modes", N_LANDMARKS, 3), -1.01, 1.01),
    "spread": Tensor("float32", ("modes",), 0.0, MAX_MM),
    "rest": millimetres("modes"),
    "shape": Tensor("int16", ("frames", "modes")),
    "head": Tensor("float16", ("frames", len(HEAD_CHANNELS)), -MAX_MM, MAX_MM),
    "intensity": Tensor("float16", ("frames",), -1000.0, 1000.0),
    "n_frames": Tensor("int32", ("utterances",), 1),
    "n_phones": Tensor("int32", ("utterances",), 1),
    "phones": Tensor("int16", ("phones",)),
    "edges": Tensor("float64", ("edges",), -ROUNDING_S, 1e6),
}


def check_talker(path: Path, arrays: Mapping[str, NDArray[Any]], header: Mapping[str, Any]) -> None:
    """Check the arrays and metadata of a talker file.

    Raises
    ------
    DataError
        A part is missing, has the wrong type or shape, is out of range or not finite, or contradicts another part.
    """
    contents = Contents(path, "talker", arrays, header)
    _check_metadata(contents)
    contents.tensors(TENSORS)
    contents.orthonormal("basis")
    n_modes = contents.sizes["modes"]
    contents.require(header["n_speech"] <= n_modes, f"n_speech is {header['n_speech']}, but there are {n_modes} modes")
    _check_utterances(contents)
    if any(name.startswith("appearance.") for name in arrays):
        _check_appearance(contents)
    if any(name.startswith("network.") for name in arrays):
        _check_network(contents)
    for name in sorted({name.split(".")[1] for name in arrays if name.startswith(AUDIO_MAP_PREFIX)}):
        _check_audio_map(contents, f"{AUDIO_MAP_PREFIX}{name}")
    check_score_map(contents, header["n_speech"])
    contents.only_known()


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


def _check_utterances(contents: Contents) -> None:
    arrays, sizes = contents.arrays, contents.sizes
    inventory, utterances = contents.header["inventory"], contents.header["utterances"]
    n = sizes["utterances"]
    contents.require(len(utterances) == n, f"names {len(utterances)} utterances, but n_frames has {n}")
    contents.sums_to("n_frames", sizes["frames"], "frames")
    contents.sums_to("n_phones", sizes["phones"], "phones")
    contents.require(sizes["edges"] == sizes["phones"] + n, f"has {sizes['edges']} edges of {sizes['phones']} phones")
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


def _check_appearance(contents: Contents) -> None:
    contents.tensors(
        {
            "appearance.mouth_points": Tensor("int32", ("points of mouth",)),
            "appearance.moved_by_speech": Tensor("float16", ("pixels of face",), 0.0, 1.0),
        }
    )
    contents.sizes["points of face"] = N_MESH_LANDMARKS
    for name in ("face", "mouth"):
        _check_texture(contents, name)
    n_points = N_MESH_LANDMARKS + len(FACE_OVAL)
    contents.indices("appearance.mouth_points", N_MESH_LANDMARKS, "points of the face")
    n_face = contents.sizes["face parameters"]
    contents.tensors(
        {
            "appearance.plate.video": Tensor("uint8", ("bytes",)),
            "appearance.plate.points": Tensor("float32", ("plate", n_points, 2), -MAX_PX, MAX_PX),
            "appearance.plate.axes": Tensor("float32", ("plate", 2, 3), -MAX_PX, MAX_PX),
            "appearance.plate.shape": millimetres("plate", "modes", most=1e6),
            "appearance.plate.looks": Tensor("float32", ("plate", "face parameters"), -MAX_WEIGHT, MAX_WEIGHT),
            "looks": Tensor("int16", ("frames", n_face + contents.sizes["mouth parameters"])),
        }
    )


def _check_texture(contents: Contents, name: str) -> None:
    prefix, points, pixels, parameters = (
        f"appearance.{name}",
        f"points of {name}",
        f"pixels of {name}",
        f"{name} parameters",
    )
    contents.tensors(
        {
            f"{prefix}.size": Tensor("int32", (2,), 1, MAX_TEXTURE_SIDE_PX),
            f"{prefix}.reference": Tensor("float32", (points, 2), -MAX_PX, MAX_PX),
            f"{prefix}.triangles": Tensor("int32", (f"triangles of {name}", 3)),
            f"{prefix}.pixels": Tensor("int32", (pixels,)),
            f"{prefix}.mean": Tensor("float16", (pixels, 3), -1e4, 1e4),
            f"{prefix}.basis": Tensor("float16", (parameters, pixels, 3), -1.01, 1.01),
            f"{prefix}.spread": Tensor("float32", (parameters,), 0.0, MAX_WEIGHT),
        }
    )
    width, height = (int(side) for side in contents.arrays[f"{prefix}.size"])
    contents.indices(f"{prefix}.triangles", contents.sizes[points], "points")
    contents.indices(f"{prefix}.pixels", width * height, "pixels")
    contents.distinct(f"{prefix}.pixels")


def _check_network(contents: Contents) -> None:
    contents.require("network_inventory" in contents.header, "has a network, but its metadata lack network_inventory")
    inventory = contents.header["network_inventory"]
    contents.require(bool(set(inventory) - {SILENCE}), "network_inventory holds no phone but silence")
    n_layers = sum(name.startswith("network.weights") for name in contents.arrays)
    contents.require(n_layers >= 2, f"has a network of {n_layers} layers; it needs two or more")
    widths: list[int | str] = [N_PHONES_SEEN * len(inventory) + N_PLACE]
    widths += [f"units of layer {at}" for at in range(1, n_layers)] + [contents.header["n_speech"]]
    for at in range(n_layers):
        shape = ("networks", widths[at], widths[at + 1])
        contents.tensors(
            {
                f"network.weights{at}": Tensor("float16", shape),
                f"network.biases{at}": Tensor("float32", (shape[0], shape[2]), -MAX_WEIGHT, MAX_WEIGHT),
            }
        )


def _check_audio_map(contents: Contents, prefix: str) -> None:
    contents.tensors(
        {
            f"{prefix}.feature": Tensor("uint8", (f"{prefix} text",), 43, 122),
            f"{prefix}.context": Tensor("int32", (3,), 0, MAX_CONTEXT),
            f"{prefix}.loudness": Tensor("float32", (1,), -1000.0, 1000.0, may_be_nan=True),
        }
    )
    feature = contents.arrays[f"{prefix}.feature"].tobytes().decode("ascii")
    kinds = feature.split("+")
    if any(kind not in FEATURE_SIZES for kind in kinds):
        contents.fail(f"{prefix}.feature is {feature!r}, not a sum of {', '.join(FEATURE_SIZES)}")
    before, after, activation = (int(number_) for number_ in contents.arrays[f"{prefix}.context"])
    known = range(len(ACTIVATIONS))
    contents.require(activation in known, f"{prefix}.context ends with {activation}, not one of {[*known]}")
    layers = layer_names(3 if f"{prefix}.{MIDDLE[0]}" in contents.arrays else 2)
    n_features, values = sum(FEATURE_SIZES[kind] for kind in kinds), (-MAX_WEIGHT, MAX_WEIGHT)
    units = [f"{prefix} units {at}" for at in range(len(layers) - 1)]
    sizes = ((before + 1 + after) * n_features, *units, contents.header["n_speech"])
    contents.tensors(
        {
            f"{prefix}.mean": Tensor("float32", (n_features,), *values),
            f"{prefix}.spread": Tensor("float32", (n_features,), 0.0, MAX_WEIGHT),
            **({f"{prefix}.fps": Tensor("float64", (1,), *FPS_LIMITS)} if f"{prefix}.fps" in contents.arrays else {}),
            **{
                f"{prefix}.{name}": Tensor("float32", shape, *values)
                for names, (inner, outer) in zip(layers, pairwise(sizes), strict=True)
                for name, shape in zip(names, ((outer, inner), (outer,)), strict=True)
            },
        }
    )
    contents.require(
        bool((contents.arrays[f"{prefix}.spread"] > 0).all()), f"{prefix}.spread holds 0; it must be above 0"
    )
