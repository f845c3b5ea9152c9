"""Files that clients send to be kept under a name: their checks and their storing."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from tts2face.models.face_file import FORMAT_VERSION
from tts2face.models.face_schema import PHOTOGRAPH
from tts2face.serving.service.consents import check_consent
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.service.library import check_new_name
from tts2face.serving.service.state import ServiceState
from tts2face.serving.service.uploads import UploadFolder, upload_folder
from tts2face.serving.work.resource_check import CHARACTER, CONTENT, FACE, N_MAGIC, PHOTO, is_of_photo, kind_of_face
from tts2face.serving.work.resources import StoredResource
from tts2face.storage.tensors import read_metadata

# Characters of texts.
# characters, as `library.check_new_name` allows
MAX_NAME = 40
# characters of a statement
MAX_CONSENT = 1000
# characters of JSON
MAX_FIT = 100_000
# characters of a table
MAX_MAPPING = 100_000
SPEAKING_PICTURE, AVATAR = "picture", "avatar"  # what is made of a photo
NO_PHOTOS = "this service has no faces of photos; its operator allows them with the setting photos"


@dataclass(frozen=True, slots=True)
class SentPhoto:
    """Statements with a photo: the consent of the person shown, what it makes, and the choices of each.

    A picture that speaks takes the JSON of a ``fit``, a head the colour of its eyes and whether wrinkles stay.
    """

    consent: str | None = None
    makes: str = SPEAKING_PICTURE
    fit: str | None = None
    eye_color: str | None = None
    age_keep: bool = False
    no_glasses: bool = False


NO_CHOICES = SentPhoto()
# Fields of a photo that are true or false, and what they do.
HEAD_SWITCHES = {"age_keep": "keep the wrinkles of the skin", "no_glasses": "leave off glasses that are seen"}


@dataclass(frozen=True, slots=True)
class Sent:
    """A file that a client sends to be kept under a name: its kind, its size in bytes, and how it is saved to a path.

    With a photo comes what is said of it, with a character the names of its shapes: the text of a mapping's file.
    """

    kind: str
    name: str
    size: int
    save: Callable[[Path], Awaitable[None]]
    photo: SentPhoto = NO_CHOICES
    mapping: str | None = None
    shapes: str | None = None


async def store_resource(state: ServiceState, key: ApiKey, sent: Sent) -> StoredResource:
    """Check a file in a child process, and store it.

    Raises
    ------
    RefusedError
        The key may not build, the name is wrong or taken, the consent is none, the quota is used up, too many files are
        checked, or this one is refused.
    """
    key = state.keys.with_scope(key, "build")
    check_new_name(sent.kind, sent.name)
    check_consent(sent.photo.consent)
    await asyncio.to_thread(state.library.check_room, key, sent.kind, sent.name, sent.size)
    async with upload_folder(state.settings, state.decoders, key.name) as folder:
        given = folder.path / f"{sent.kind}.upload"
        await sent.save(given)
        checked = await _checked(state, key, sent, folder, given)
        return await asyncio.to_thread(state.library.add, key, sent.kind, sent.name, checked)


async def _checked(state: ServiceState, key: ApiKey, sent: Sent, folder: UploadFolder, given: Path) -> Path:
    """Folder with a checked resource of a saved file."""
    n_bytes = state.library.limits(key).n_bytes
    kind = await asyncio.to_thread(_kind_of, sent.kind, given)
    if sent.mapping is not None and kind != CHARACTER:
        raise RefusedError(422, "invalid_request", "a mapping names shapes of a character; send one, or leave it out")
    if sent.shapes is not None and kind != CHARACTER:
        raise RefusedError(422, "invalid_request", "shapes are those of a character; send one, or leave shapes out")
    if kind == PHOTO:
        with _photo_turn(state, key):
            folder.state(given, {"name": sent.name, **asdict(sent.photo)})
            if sent.photo.makes == AVATAR:
                return await folder.avatar(given, n_bytes)
            return await folder.resource(FACE, given, n_bytes)
    if sent.photo.makes == AVATAR:
        raise RefusedError(422, "invalid_request", "a head is made of a picture; send one, or leave out makes")
    if kind == CHARACTER:
        folder.state(given, {"mapping": sent.mapping, "shapes": sent.shapes})
    checked = await folder.resource(sent.kind, given, n_bytes)
    # also a face that was made of a photo elsewhere
    if sent.kind == FACE and not state.settings.photos:
        await asyncio.to_thread(_refuse_photograph, checked / CONTENT)
    return checked


async def find_photo_places(
    state: ServiceState, key: ApiKey, folder: UploadFolder, photo: Path
) -> tuple[Path, dict[str, Any]]:
    """Lips, lids, teeth and pivot in a photo that is saved in a private folder, as `UploadFolder.places`.

    Raises
    ------
    RefusedError
        The operator allows no photos, the key may not build or reads one already, too many files are checked, or it
        shows no face.
    """
    key = state.keys.with_scope(key, "build")
    with _photo_turn(state, key, counts=False):
        folder.state(photo, {"name": photo.name})
        return await folder.places(photo)


def _photo_turn(state: ServiceState, key: ApiKey, *, counts: bool = True) -> AbstractContextManager[None]:
    """A turn of a key to read a photo, if the operator allows them; errors as `RateLimits.photo`."""
    if not state.settings.photos:
        raise RefusedError(403, "forbidden", NO_PHOTOS)
    return state.limits.photo(key, state.settings.photos_per_day, counts=counts)


def _kind_of(kind: str, file: Path) -> str:
    """Kind of a file that is sent as one of a kind: of a face it may be a character or a photo."""
    with file.open("rb") as opened:
        return kind_of_face(opened.read(N_MAGIC)) if kind == FACE else kind


def _refuse_photograph(face: Path) -> None:
    """Refuse the file of a face that speaks in a photograph, or of a head that was made of one."""
    header = read_metadata(face, FACE, FORMAT_VERSION)
    if is_of_photo(header["metadata"], in_picture=PHOTOGRAPH in header):
        raise RefusedError(403, "forbidden", NO_PHOTOS)
