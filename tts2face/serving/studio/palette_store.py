"""The own styles of each owner on disk: one palette file, which also holds the shipped styles, and the take in work.

``palettes/OWNER.styles/my-styles.palette`` exists while there are own styles; ``swatches/`` their moving pictures;
``take/`` the one take of which a style is to be made, until it is made or deleted. All methods block.
"""

import hashlib
import os
import shutil
import threading
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path

from lexicon.errors import InputError
from tts2face import __version__
from tts2face.models.palette import Palette
from tts2face.models.palette_file import load_palette, write_palette
from tts2face.session.named_models import Models
from tts2face.storage.files import translate_disk_errors

SHIPPED = str(Models().palette)
MY_STYLES = "my-styles"  # name of the palette for clients
FILE = f"{MY_STYLES}.palette"
MAX_OWN_STYLES = 50
TAKE = "take"
CACHE = "cache"
MADE = "made.palette"
SUFFIXES = frozenset({".webm", ".mp4", ".mov", ".mkv", ".avi", ".mpg", ".ts", ".csv"})  # of takes


def own_palette(studio: Path, owner: str) -> Path:
    """Path of the palette of an owner, who may have none."""
    return studio / "palettes" / f"{owner}.styles" / FILE


def is_own_palette(name: str, own: Path) -> bool:
    """Whether a name or a path in a project means an owner's own palette."""
    return name in {MY_STYLES, FILE} or (os.sep in name and os.path.normpath(name) == str(own))


class PaletteStore:
    """Own styles of all owners in the folder of a studio."""

    def __init__(self, studio: Path) -> None:
        self._studio = studio
        self._lock = threading.Lock()

    def path(self, owner: str) -> Path:
        """Path of an owner's palette; there is no file without own styles."""
        return own_palette(self._studio, owner)

    def read(self, owner: str) -> Palette:
        """The owner's palette; the shipped one while there are no own styles.

        Raises
        ------
        DataError
            It is damaged.
        """
        path = self.path(owner)
        return load_palette(str(path)) if path.is_file() else shipped()

    def own_names(self, owner: str) -> tuple[str, ...]:
        """Names of the own styles, derived ones first."""
        return _own_names(self.read(owner))

    def base(self, owner: str) -> str:
        """Palette to which a style is added: the own one, or the shipped one."""
        path = self.path(owner)
        return str(path) if path.is_file() else SHIPPED

    def change(self, owner: str, change: Callable[[Palette], Palette]) -> None:
        """Replace the palette by a changed one; without own styles, the file is removed.

        Raises
        ------
        InputError
            `change` refuses, or there are too many styles.
        BackendError
            The file cannot be written.
        """
        with self._lock:
            before = self.read(owner)
            after = change(before)
            names, path = _own_names(after), self.path(owner)
            if len(names) > max(MAX_OWN_STYLES, len(_own_names(before))):
                raise InputError(f"there are {MAX_OWN_STYLES} own styles already; delete one")
            with translate_disk_errors(path):
                path.parent.mkdir(parents=True, exist_ok=True)
                if names:
                    write_palette(path, after)
                else:
                    path.unlink(missing_ok=True)
            for gone in set(_own_names(before)) - set(names):
                self.swatch(owner, gone).unlink(missing_ok=True)

    def swatch(self, owner: str, style: str) -> Path:
        """File of the moving picture of a style, which may not exist yet."""
        own = style not in shipped().names
        folder = self.path(owner).parent / "swatches" if own else self._studio / "swatches"
        # with the version: another one draws other pictures
        return folder / f"{hashlib.sha256(f'{__version__} {style}'.encode()).hexdigest()[:24]}.webp"

    def take_folder(self, owner: str) -> Path:
        """Folder of the take, which may not exist."""
        return self.path(owner).parent / TAKE

    def take(self, owner: str) -> Path | None:
        """The take of which a style is to be made."""
        return next((file for file in self.take_folder(owner).glob("take.*") if file.suffix in SUFFIXES), None)

    def put_take(self, owner: str, source: Path, suffix: str, sound: Path | None = None) -> Path:
        """Keep a file, which is moved, as the take in place of an earlier one; the sound of a table is copied."""
        if suffix not in SUFFIXES:
            raise InputError(f"a take {suffix[:10]!r} cannot be read; give {', '.join(sorted(SUFFIXES))}")
        self.delete_take(owner)
        target = self.take_folder(owner) / f"take{suffix}"
        with translate_disk_errors(target):
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.move(source, target)
            if sound is not None:
                shutil.copyfile(sound, target.with_suffix(".wav"))
        return target

    def delete_take(self, owner: str) -> None:
        """Delete the take, and what its check and the making of a style have stored of it."""
        folder = self.take_folder(owner)
        with translate_disk_errors(folder):
            if folder.is_dir():
                shutil.rmtree(folder)


@lru_cache(maxsize=1)
def shipped() -> Palette:
    """The shipped palette."""
    return load_palette(SHIPPED)


def _own_names(palette: Palette) -> tuple[str, ...]:
    known = shipped().names
    return tuple(name for name in palette.names if name not in known)
