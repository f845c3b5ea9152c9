"""Sessions of a test process share models and what is computed of them alone: most tests open one of the shipped ones.

A session takes 2 s of processor time, a small clip a tenth of that. Models are read-only, so that sharing changes no
result; a file that has changed is read again.
"""

from collections import OrderedDict
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest

from tts2face.storage.files import SHIPPED_FOLDER

SHARED = {  # module: functions that it calls
    "tts2face.session.models": (
        "load_talker",
        "load_face",
        "load_palette",
        "build_exemplar_model",
        "mesh_face",
    ),
    "tts2face.session.animated_face": ("gesture_face",),
    "tts2face.picture.scene": ("build_surface",),
}
MOST = 4  # results of a function that are kept


@pytest.fixture(scope="session", autouse=True)
def models_once() -> Iterator[None]:
    """Keep the last results of `SHARED`."""
    with pytest.MonkeyPatch.context() as patch:
        for module, names in SHARED.items():
            for name in names:
                patch.setattr(f"{module}.{name}", _kept(getattr(import_module(module), name)))
        yield


def _kept(function: Callable[..., Any]) -> Callable[..., Any]:
    results: OrderedDict[Any, tuple[Any, Any]] = OrderedDict()  # with the arguments, whose numbers stay theirs so

    def find(*arguments: Any, **options: Any) -> Any:
        key = tuple(map(_identity, (*arguments, *options.items())))
        if key not in results:
            results[key] = (function(*arguments, **options), (arguments, options))
        results.move_to_end(key)
        while len(results) > MOST:
            results.popitem(last=False)
        return results[key][0]

    return find


def _identity(value: Any) -> Any:
    """What a result depends on: a text and the state of the files that it may name, or an object itself."""
    if isinstance(value, tuple):
        return tuple(map(_identity, value))
    if isinstance(value, str | Path):
        shipped = SHIPPED_FOLDER.glob(f"{Path(value).name}.*")
        return str(value), tuple(_state(path) for path in (Path(value), *sorted(shipped)))
    return value if isinstance(value, bool | int | float | None) else id(value)


def _state(path: Path) -> tuple[int, ...]:
    try:
        status = path.stat()
    except (OSError, ValueError):
        return ()
    return status.st_mtime_ns, status.st_size, status.st_ino
