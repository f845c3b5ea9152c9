"""A part of a serialised ONNX model between tensors, by its protocol buffers (ONNX IR), without the package onnx."""

from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import NamedTuple

# numbers of fields
MODEL_GRAPH = 7
GRAPH_NODE = 1
GRAPH_TENSOR = 5
GRAPH_INPUT = 11
GRAPH_OUTPUT = 12
NODE_INPUT = 1
NODE_OUTPUT = 2
TENSOR_NAME = 8
# kinds of fields: a number; bytes behind their length; others by their size
VARINT = 0
DELIMITED = 2
FIXED_SIZES = MappingProxyType({1: 8, 5: 4})
FLOAT, INT64 = 1, 7  # types of elements
Shape = Sequence[int | str]  # a name is an axis of any length


class Field(NamedTuple):
    """A field of a message: its number, all its bytes, and the content of those behind a length."""

    number: int
    whole: bytes
    content: bytes


def cut_model(model: bytes, inputs: Mapping[str, tuple[int, Shape]], outputs: Sequence[str]) -> bytes:
    """The part of a model that makes some of its tensors from others.

    Parameters
    ----------
    inputs
        Type and shape of each tensor that is given.
    outputs
        Tensors that are returned.
    """
    graph = next(field.content for field in _fields(model) if field.number == MODEL_GRAPH)
    fields = list(_fields(graph))
    kept: list[bytes] = []
    needed = set(outputs)
    # backwards: a node stands after those whose results it takes
    for field in reversed(fields):
        if field.number != GRAPH_NODE:
            continue
        parts = list(_fields(field.content))
        made = {part.content.decode() for part in parts if part.number == NODE_OUTPUT}
        if made & needed and not made & inputs.keys():
            kept.append(field.whole)
            needed |= {part.content.decode() for part in parts if part.number == NODE_INPUT}
    kept.reverse()
    kept += [field.whole for field in fields if field.number == GRAPH_TENSOR and _tensor_name(field.content) in needed]
    kept += [_field(GRAPH_INPUT, _value(name, *kind)) for name, kind in inputs.items()]
    kept += [_field(GRAPH_OUTPUT, _field(1, name.encode())) for name in outputs]
    rest = b"".join(field.whole for field in _fields(model) if field.number != MODEL_GRAPH)
    return rest + _field(MODEL_GRAPH, b"".join(kept))


def onnx_errors() -> tuple[type[Exception], ...]:
    """Exceptions for damaged files of ONNX Runtime, which have no common base but Exception."""
    from onnxruntime.capi import onnxruntime_pybind11_state as state

    runtime = [error for error in vars(state).values() if isinstance(error, type) and issubclass(error, Exception)]
    return TypeError, ValueError, KeyError, AttributeError, *runtime


def _tensor_name(tensor: bytes) -> str:
    return next(field.content.decode() for field in _fields(tensor) if field.number == TENSOR_NAME)


def _fields(message: bytes) -> Iterator[Field]:
    at = 0
    while at < len(message):
        start = at
        key, at = _read_varint(message, at)
        if key & 7 == DELIMITED:
            size, at = _read_varint(message, at)
            yield Field(key >> 3, message[start : at + size], message[at : at + size])
            at += size
        else:
            at = _read_varint(message, at)[1] if key & 7 == VARINT else at + FIXED_SIZES[key & 7]
            yield Field(key >> 3, message[start:at], b"")


def _read_varint(message: bytes, at: int) -> tuple[int, int]:
    """A number, and the index after it."""
    value = shift = 0
    while True:
        value |= (message[at] & 0x7F) << shift
        at += 1
        shift += 7
        if message[at - 1] < 1 << 7:
            return value, at


def _varint(number: int) -> bytes:
    low, rest = number & 0x7F, number >> 7
    return bytes([low | 0x80]) + _varint(rest) if rest else bytes([low])


def _field(number: int, content: bytes) -> bytes:
    return _varint(number << 3 | DELIMITED) + _varint(len(content)) + content


def _number(number: int, value: int) -> bytes:
    return _varint(number << 3 | VARINT) + _varint(value)


def _value(name: str, kind: int, shape: Shape) -> bytes:
    """``ValueInfoProto`` of a tensor."""
    axes = (_field(2, axis.encode()) if isinstance(axis, str) else _number(1, axis) for axis in shape)
    tensor = _number(1, kind) + _field(2, b"".join(_field(1, axis) for axis in axes))
    return _field(1, name.encode()) + _field(2, _field(1, tensor))
