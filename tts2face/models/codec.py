"""Files of models: the fields of a dataclass say how they lie in a file, and one writer, check and reader follow them.

The recipe for a model:

1. derive its dataclass from `StoredModel`, and annotate each array with its `Tensor`, or with `Stored` where the file
   holds another form of it: ``mean: Annotated[NDArray[np.float32], Tensor("float32", ("features",))]``;
2. annotate what is in the metadata with `InHeader`, a tuple of arrays with `Numbered`, a model within it with
   `Submodel`;
3. name sizes that several arrays share. ``{prefix}`` in such a name is that of all arrays of the model, ``{own}`` the
   prefix after its first word, ``{around}`` and ``{name}`` all of this but its last word, and that word; ``{last}``,
   ``{at}`` and ``{next}`` are numbers of `Numbered` arrays;
4. say in `prepare_check` what follows for sizes from the rest of the file, and refuse in `check_stored` what no single
   array shows.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from lexicon.values.checks import Check
from tts2face.storage.schema import Contents, Tensor
from tts2face.storage.tensors import read_tensors

Arrays = Mapping[str, NDArray[Any]]


def as_it_is(value: Any) -> Any:
    """The value."""
    return value


def in_32_bits(array: NDArray[Any]) -> NDArray[np.float32]:
    """Numbers as a model has them that a file holds in 16 bits."""
    return array.astype(np.float32)


def in_64_bits(array: NDArray[Any]) -> NDArray[np.float64]:
    """Numbers as a model has them that a file holds in 32 bits."""
    return array.astype(np.float64)


class StoredModel:
    """Model whose fields say how they lie in a file."""

    __slots__ = ()

    @classmethod
    def prepare_check(cls, contents: Contents, prefix: str) -> None:
        """Set sizes that follow from the metadata or from other arrays."""

    @classmethod
    def check_stored(cls, contents: Contents, prefix: str) -> None:
        """Refuse arrays, each of which is right, that contradict each other or the metadata."""


Model = TypeVar("Model", bound=StoredModel)


@dataclass(frozen=True, slots=True)
class Stored:
    """Array of a file, under the name of the field unless it has another."""

    tensor: Tensor
    name: str | None = None
    encode: Callable[[Any], Any] = as_it_is
    decode: Callable[[NDArray[Any]], Any] = as_it_is


@dataclass(frozen=True, slots=True)
class InHeader:
    """Value of the metadata, under the name of the field unless it has another."""

    check: Check
    name: str | None = None
    encode: Callable[[Any], Any] = as_it_is
    decode: Callable[[Any], Any] = as_it_is


@dataclass(frozen=True, slots=True)
class Numbered:
    """Tuple of arrays, each ``stored`` as its own, or as the last of these; ``count`` gives their number in a file.

    ``names`` gives their names for a number of them; without it they have the name of the field and their number.
    """

    stored: tuple[Stored, ...]
    count: int | Callable[[Arrays, str], int]
    names: Callable[[int], Sequence[str]] | None = None

    def count_in(self, arrays: Arrays, prefix: str) -> int:
        """Number of the arrays in a file."""
        return self.count if isinstance(self.count, int) else self.count(arrays, prefix)

    def listed(self, field: str, n: int) -> Iterator[tuple[str, Stored]]:
        """Name of each of `n` arrays of a field, and how it is stored."""
        names = self.names(n) if self.names else [f"{field}{at}" for at in range(n)]
        for at, name in enumerate(names):
            yield name, self.stored[min(at, len(self.stored) - 1)]


@dataclass(frozen=True, slots=True)
class Submodel:
    """Model within a model; the name of the field stands before the names of its arrays."""

    model: type[StoredModel]


def half(*shape: int | str, low: float | None = None, high: float | None = None) -> Stored:
    """Numbers of 32 bits that the file holds in 16."""
    return Stored(Tensor("float16", shape, low, high), decode=in_32_bits)


def _stored_fields(model: Any) -> Mapping[str, Any]:
    """How each field lies in a file; without those that do not."""
    kinds = Stored, InHeader, Numbered, Submodel
    found: dict[str, Any] = {}
    for field in fields(model):
        for note in getattr(field.type, "__metadata__", ()):
            if isinstance(note, Tensor):
                found[field.name] = Stored(note)
            elif isinstance(note, kinds):
                found[field.name] = note
    return found


def _joined(prefix: str, name: str) -> str:
    return f"{prefix}.{name}" if prefix and name else prefix or name


def _name(field: str, note: Any) -> str:
    return field if note.name is None else str(note.name)


def stored_arrays(model: StoredModel, prefix: str = "") -> dict[str, NDArray[Any]]:
    """Arrays of a model by their names in a file."""
    found: dict[str, NDArray[Any]] = {}
    for field, note in _stored_fields(type(model)).items():
        value = getattr(model, field)
        if isinstance(note, InHeader) or value is None:
            continue
        if isinstance(note, Numbered):
            listed = zip(note.listed(field, len(value)), value, strict=True)
            found |= {_joined(prefix, name): _encoded(stored, item) for (name, stored), item in listed}
        elif isinstance(note, Stored):
            found[_joined(prefix, _name(field, note))] = _encoded(note, value)
        else:
            found |= stored_arrays(value, _joined(prefix, field))
    return found


def _encoded(note: Stored, value: Any) -> NDArray[Any]:
    return np.asarray(note.encode(value)).astype(note.tensor.dtype, copy=False)


def stored_header(model: StoredModel) -> dict[str, Any]:
    """Metadata of a model."""
    notes = _stored_fields(type(model)).items()
    return {
        _name(field, note): note.encode(getattr(model, field)) for field, note in notes if isinstance(note, InHeader)
    }


def header_checks(model: type[StoredModel]) -> dict[str, Check]:
    """Checks of the metadata that `stored_header` gives."""
    notes = _stored_fields(model).items()
    return {_name(field, note): note.check for field, note in notes if isinstance(note, InHeader)}


def stored_tensors(model: type[StoredModel], prefix: str, arrays: Arrays) -> dict[str, Tensor]:
    """Requirements of the arrays of a model itself, without its parts; of `Numbered` ones those in a file's arrays."""
    own = prefix.partition(".")[2]
    around, _, name = own.rpartition(".")
    known = {"prefix": prefix, "own": own, "around": around, "name": name}
    before: dict[str, Tensor] = {}
    layers: dict[int, dict[str, Tensor]] = {}
    after: dict[str, Tensor] = {}
    for field, note in _stored_fields(model).items():
        if isinstance(note, Stored):
            found = after if layers else before
            found[_joined(prefix, _name(field, note))] = _sized(note.tensor, known)
        elif isinstance(note, Numbered):
            for at, (layer, stored) in enumerate(note.listed(field, note.count_in(arrays, prefix))):
                numbers = {"last": str(at - 1), "at": str(at), "next": str(at + 1)}
                layers.setdefault(at, {})[_joined(prefix, layer)] = _sized(stored.tensor, known | numbers)
    # All arrays of a layer come before those of the next one, which has as many inputs.
    ordered = {name: tensor for at in sorted(layers) for name, tensor in layers[at].items()}
    return before | ordered | after


def _sized(tensor: Tensor, known: Mapping[str, str]) -> Tensor:
    shape = tuple(size.format_map(known) if isinstance(size, str) else size for size in tensor.shape)
    return replace(tensor, shape=shape)


def has_part(contents: Contents, prefix: str) -> bool:
    """Whether a file holds an array of a part."""
    return any(name.startswith(f"{prefix}.") for name in contents.arrays)


def check_model(model: type[StoredModel], contents: Contents, prefix: str = "") -> None:
    """Check the arrays of a model, then those of its parts; raises `DataError`."""
    model.prepare_check(contents, prefix)
    contents.tensors(stored_tensors(model, prefix, contents.arrays))
    model.check_stored(contents, prefix)
    for field, note in _stored_fields(model).items():
        if isinstance(note, Submodel):
            check_model(note.model, contents, _joined(prefix, field))


def model_of(model: type[Model], contents: Contents, prefix: str = "", **others: Any) -> Model:
    """Model of the arrays and metadata of a checked file, with the values of its other fields."""
    arrays, values = contents.arrays, dict(others)
    for field, note in _stored_fields(model).items():
        if isinstance(note, InHeader):
            values[field] = note.decode(contents.header[_name(field, note)])
        elif isinstance(note, Numbered):
            listed = note.listed(field, note.count_in(arrays, prefix))
            values[field] = tuple(stored.decode(arrays[_joined(prefix, name)]) for name, stored in listed)
        elif isinstance(note, Stored):
            array = arrays.get(_joined(prefix, _name(field, note)))
            values[field] = None if array is None else note.decode(array)
        else:
            values[field] = model_of(note.model, contents, _joined(prefix, field))
    return model(**values)


def read_model(
    path: Path, kind: str, version: int, model: type[Model], header: Mapping[str, Check] | None = None
) -> Model:
    """Model of a file, whose metadata hold values beside those of the model, which are checked, too."""
    arrays, metadata = read_tensors(path, kind, version)
    contents = Contents(path, kind, arrays, metadata)
    contents.metadata({**(header or {}), **header_checks(model)})
    check_model(model, contents)
    contents.only_known()
    return model_of(model, contents)
