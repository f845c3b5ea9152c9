"""Structural mutations of model files: valid containers with invalid arrays or metadata."""

import json
import math
from pathlib import Path

import numpy as np
from safetensors.numpy import save

from tts2face.storage.tensors import read_tensors

DEEP = "@DEEP@"  # placeholder in metadata for 5,000 nested lists, which the json module cannot write
FLOATS = (math.nan, math.inf, -math.inf, 1e30, -1e30, 65504.0, 1e-30, 0.0, -1.0, 1.0, 12345.0)
WHOLE = (-1, 0, 1, 467, 468, 478, 65535, 10**6, 2**31 - 1, -(2**31), 2**15 - 1, -(2**15))
WRONG = (
    None, True, False, -1, 0, 1, 2.5, -0.5, 1e308, -1e308, 1e-300, 2**31, 2**63, 10**400, math.nan, math.inf, -math.inf,
    "", "x", "sil", "x" * 200_000, "\ud800", "a\0b", [], {}, [[]], [1, 2, 3], {"x": 1}, DEEP, "../../etc/passwd",
)  # fmt: skip


def mutate(source: Path, kind: str, out: Path, seed: int) -> str:
    """Write a copy of a model file with one or two changes; returns their description."""
    rng = np.random.default_rng(seed)
    arrays, header = read_tensors(source, kind, 1)
    arrays = {name: np.array(array) for name, array in arrays.items()}
    done = []
    for _ in range(1 if rng.random() < 0.8 else 2):
        done.append(_change_arrays(arrays, rng) if rng.random() < 0.55 else _change_metadata(header, rng))
    text = json.dumps(header).replace(f'"{DEEP}"', "[" * 5000 + "]" * 5000)
    if rng.random() < 0.03:
        key = next(iter(header))
        text, done = text.replace("{", f"{{{json.dumps(key)}: 1, ", 1), [*done, f"{key} twice"]
    out.write_bytes(save(arrays, {"kind": kind, "version": "1", "metadata": text}))
    return "; ".join(done)


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


def _change_metadata(header: dict, rng: np.random.Generator) -> str:
    """Change the value at a random path of the metadata."""
    at, path = header, []
    while True:
        key = rng.integers(len(at)) if isinstance(at, list) else str(rng.choice(list(at)))
        path.append(str(key))
        if not isinstance(at[key], list | dict) or not at[key] or rng.random() < 0.2:
            break
        at = at[key]
    value = at[key]
    match int(rng.integers(8)):
        case 0:
            del at[key]
            what = "removed"
        case 1 if isinstance(at, dict):
            at[key + "x"] = at.pop(key)
            what = "renamed"
        case 2 if isinstance(at, list):
            at.append(value)
            what = "twice"
        case 3 if isinstance(value, int | float) and not isinstance(value, bool):
            at[key] = value * float(rng.choice([-1.0, 1000.0, 0.001, 1e9])) if rng.random() < 0.6 else value + 1
            what = f"{value} is {at[key]}"
        case 4:
            at[key] = str(value)[:1000] if not isinstance(value, str) else len(value)
            what = "is of another type"
        case _:
            wrong = WRONG[int(rng.integers(len(WRONG)))]
            at[key] = list(wrong) if isinstance(wrong, list) else dict(wrong) if isinstance(wrong, dict) else wrong
            what = f"is {repr(wrong)[:40]}"
    return f"{'/'.join(path)} {what}"
