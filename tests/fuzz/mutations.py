"""Mutations of files: values of documents in JSON and TOML, arrays of model files, and bytes of any file."""

import copy
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from safetensors.numpy import load_file, save

from tts2face.storage.tensors import read_metadata, read_tensors

# Values that the writers of JSON and TOML cannot write: names in a document, and what stands in the file instead.
DEEP, DIGITS = "@DEEP@", "@DIGITS@"
WRITTEN = {f'"{DEEP}"': "[" * 5000 + "]" * 5000, f'"{DIGITS}"': "9" * 5000}
WRONG = (
    None, True, False, -1, 0, 1, 2.5, -0.5, 1e308, -1e308, 1e-300, 2**31, 2**63, 10**300, 10**400, math.nan, math.inf,
    -math.inf, "", "x", "sil", "1", "x" * 200_000, "\ud800", "a\0b", "../../etc/passwd", [], {}, [[]], [1, 2, 3],
    {"x": 1}, DEEP, DIGITS,
)  # fmt: skip
INSERTED = (
    b"\0", b"\x1b[2J", b"\xff", b"\xed\xa0\x80", b"\\u0000", b'"', b"{", b"]", b",", b"=", b"\n", b"-", b".", b"NaN",
    b"1e999", b"9" * 500, b"9" * 5000, b"[" * 5000, b"a." * 5000, b"0x" + b"f" * 5000,
)  # fmt: skip
FLOATS = (math.nan, math.inf, -math.inf, 1e30, -1e30, 65504.0, 1e-30, 0.0, -1.0, 1.0, 12345.0)
WHOLE = (-1, 0, 1, 467, 468, 478, 65535, 10**6, 2**31 - 1, -(2**31), 2**15 - 1, -(2**15))


def change_value(document: Any, rng: np.random.Generator) -> str:
    """Change the value at a random path of a document that is not empty; returns a description."""
    at, path = document, []
    while True:
        key = int(rng.integers(len(at))) if isinstance(at, list) else list(at)[int(rng.integers(len(at)))]
        path.append(str(key))
        if not isinstance(at[key], list | dict) or not at[key] or rng.random() < 0.2:
            break
        at = at[key]
    return f"{'/'.join(path)} {_change_at(at, key, rng)}"


def _change_at(at: Any, key: Any, rng: np.random.Generator) -> str:
    """Change an entry of a list or an object."""
    value, how, is_list = at[key], int(rng.integers(10)), isinstance(at, list)
    if how == 0:
        del at[key]
        return "removed"
    if how in (1, 2) and is_list:
        at.append(value)
        return "twice"
    if how in (1, 2):
        at["unknown" if how == 1 else key + "x"] = value if how == 1 else at.pop(key)
        return "beside an unknown key" if how == 1 else "renamed"
    if how == 3 and isinstance(value, int | float) and not isinstance(value, bool):
        at[key] = value * float(rng.choice([-1.0, 1000.0, 0.001, 1e9])) if rng.random() < 0.6 else value + 1
    elif how == 4:
        at[key] = str(value)[:1000] if not isinstance(value, str) else len(value)
    else:
        at[key] = copy.deepcopy(WRONG[int(rng.integers(len(WRONG)))])
    return f"is {repr(at[key])[:40]}"


def json_bytes(document: Any) -> bytes:
    """A document as JSON, with what Python's writer cannot write."""
    return _written(json.dumps(document))


def toml_bytes(document: dict[str, Any]) -> bytes:
    """A document as TOML, one key in a line; a date in place of None, which TOML does not have."""
    return _written("".join(f"{json.dumps(key)} = {_toml(value)}\n" for key, value in document.items()))


def change_bytes(content: bytes, rng: np.random.Generator, reach: int | None = None) -> tuple[bytes, str]:
    """Content that is cut, or with bytes inserted, removed, doubled or changed, and a description.

    Parameters
    ----------
    reach
        The change begins within so many bytes; None: anywhere.
    """
    at = int(rng.integers(min(len(content), reach or len(content)) + 1))
    n = int(rng.choice([1, 8, 100]))
    match int(rng.integers(5)):
        case 0:
            return content[:at], f"cut at {at}"
        case 1:
            return content[:at] + content[at + n :], f"{n} bytes removed at {at}"
        case 2:
            return content[:at] + content[max(0, at - n) :], f"{n} bytes twice at {at}"
        case 3:
            return content[:at] + rng.bytes(n) + content[at + n :], f"{n} bytes changed at {at}"
        case _:
            inserted = INSERTED[int(rng.integers(len(INSERTED)))]
            return content[:at] + inserted + content[at:], f"{inserted[:10]!r} inserted at {at}"


def mutate_model(source: Path, kind: str, out: Path, seed: int) -> str:
    """Write a copy of a model file with one or two changes of arrays or metadata; returns their description.

    Arrays that are packed stay so in one of three copies, so that their bytes and their list are changed.
    """
    rng = np.random.default_rng(seed)
    arrays, header = read_tensors(source, kind, 1)
    if seed % 3 == 0:
        arrays, header = load_file(source), read_metadata(source, kind, 1)
    arrays = {name: np.array(array) for name, array in arrays.items()}
    done = []
    for _ in range(1 if rng.random() < 0.8 else 2):
        done.append(_change_arrays(arrays, rng) if rng.random() < 0.55 else change_value(header, rng))
    text = json_bytes(header).decode()
    if rng.random() < 0.03:
        key = next(iter(header))
        text, done = text.replace("{", f"{{{json.dumps(key)}: 1, ", 1), [*done, f"{key} twice"]
    out.write_bytes(save(arrays, {"kind": kind, "version": "1", "metadata": text}))
    return "; ".join(done)


def _written(text: str) -> bytes:
    for name, instead in WRITTEN.items():
        text = text.replace(name, instead)
    return text.encode("utf-8", "surrogatepass")


def _toml(value: Any) -> str:
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(key)} = {_toml(one)}' for key, one in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(_toml, value))}]"
    if isinstance(value, float):
        return repr(value)  # nan, inf
    return "1979-05-27T07:32:00Z" if value is None else json.dumps(value, ensure_ascii=False)


def _change_arrays(arrays: dict[str, np.ndarray], rng: np.random.Generator) -> str:
    name = str(rng.choice(sorted(arrays)))
    how = str(rng.choice(["number"] * 6 + ["values"] * 3 + ["shape"] * 3 + ["dtype"] * 2 + ["names"]))
    if how == "names":
        return _change_names(arrays, name, rng)
    changed, what = {"number": _number, "values": _values, "shape": _shape, "dtype": _dtype}[how](arrays[name], rng)
    arrays[name] = np.ascontiguousarray(changed)
    return f"{name}: {what}"


def _change_names(arrays: dict[str, np.ndarray], name: str, rng: np.random.Generator) -> str:
    other = str(rng.choice(sorted(arrays)))
    match int(rng.integers(3)):
        case 0:
            arrays[name], arrays[other] = arrays[other], arrays[name]
            return f"{name} and {other} exchanged"
        case 1:
            arrays[name + "x"] = arrays.pop(name)
            return f"{name} renamed"
        case _:
            del arrays[name]
            return f"{name} removed"


def _number(array: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    values = array.copy().reshape(-1)
    if not values.size:
        return array, "nothing"
    places = rng.integers(0, values.size, int(rng.choice([1, 1, 1, 5, 100])))
    if values.dtype.kind == "f":
        with np.errstate(over="ignore"):
            number = np.array(rng.choice(FLOATS), values.dtype)
    else:
        limits = np.iinfo(values.dtype)
        wanted = [int(rng.choice(WHOLE)), int(values.max()) + 1, limits.max, limits.min]
        number = np.clip(wanted[int(rng.integers(4))], limits.min, limits.max)
    values[places] = number
    return values.reshape(array.shape), f"{len(places)} numbers are {number}"


def _values(array: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    how = str(rng.choice(["zero", "constant", "shuffled", "sorted", "negative", "large", "small", "noise", "reversed"]))
    with np.errstate(over="ignore", invalid="ignore"):
        if how == "noise":
            noise = rng.integers(0, 256, max(array.nbytes, 1), np.uint8)[: array.nbytes]
            return noise.view(array.dtype).reshape(array.shape), how
        made = {
            "zero": lambda: np.zeros_like(array),
            "constant": lambda: np.full_like(array, array.max(initial=0)),
            "shuffled": lambda: rng.permutation(array.reshape(-1)).reshape(array.shape),
            "sorted": lambda: np.sort(array.reshape(-1)).reshape(array.shape),
            "negative": lambda: (-array.astype(np.float64)).astype(array.dtype),
            "large": lambda: (array * np.float64(1000)).astype(array.dtype),
            "small": lambda: (array * np.float64(0.001)).astype(array.dtype),
            "reversed": lambda: array[::-1],
        }[how]()
    return made, how


def _shape(array: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    made = (
        lambda: array[: len(array) // 2],
        lambda: array[:-1],
        lambda: array[:0],
        lambda: np.concatenate([array, array[:1]]),
        lambda: array.reshape(-1),
        lambda: array.T,
        lambda: array[None],
        lambda: array[..., :-1],
        lambda: np.repeat(array, 2, axis=-1),
        lambda: np.zeros((0, 10**9), array.dtype),
        lambda: array.reshape(-1)[:1].reshape(()) if array.size else array,
    )
    changed = made[int(rng.integers(len(made)))]()
    return changed, f"shape {array.shape} is {changed.shape}"


def _dtype(array: np.ndarray, rng: np.random.Generator) -> tuple[np.ndarray, str]:
    kinds = ("float16", "float32", "float64", "int8", "int16", "int32", "int64", "uint8", "uint16", "bool")
    kind = np.dtype(str(rng.choice(kinds)))
    if rng.random() < 0.5 and kind.itemsize == array.dtype.itemsize:
        return array.view(kind), f"read as {kind}"
    with np.errstate(over="ignore", invalid="ignore"):
        return array.astype(kind), f"cast to {kind}"
