"""Materials of a glTF file: base colour, image and alpha; images are decoded within limits."""

import io
import warnings
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.interchange.characters.character import (
    BLEND,
    MASK,
    OPAQUE,
    Material,
)
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.reader import GltfFile
from tts2face.storage.pictures import MAX_DECODING_BYTES, decoding_bytes

# checked before decoding: a small file can declare any size
MAX_IMAGE_PIXELS = 8192 * 8192
MAX_IMAGE_SIDE = 2048  # pixels; larger images are reduced
FORMATS = ("PNG", "JPEG", "WEBP")
KTX2 = b"\xabKTX 20\xbb"


class MaterialReader:
    """Reader of the materials of a file; images that cannot be read become notes.

    Parameters
    ----------
    file
        The opened file.
    notes
        List to which sentences about skipped images are added.
    """

    def __init__(self, file: GltfFile, notes: list[str]) -> None:
        self._file, self._notes = file, notes
        self._images: dict[int, NDArray[np.uint8] | None] = {}

    def materials(self) -> Iterator[Material]:
        """All materials of the file in order."""
        earlier = self._file.root.extension("VRM")
        toon = earlier.children("materialProperties") if earlier is not None else []
        for number, fields in enumerate(self._file.entries("materials")):
            yield self._material(fields, toon[number] if number < len(toon) else None)

    def _material(self, fields: Fields, toon: Fields | None) -> Material:
        rough = fields.child("pbrMetallicRoughness")
        glossy = fields.extension("KHR_materials_pbrSpecularGlossiness")
        holder = rough
        colour_key = "baseColorFactor"
        image_key = "baseColorTexture"
        if glossy is not None and not rough.has(image_key):
            holder = glossy
            colour_key = "diffuseFactor"
            image_key = "diffuseTexture"
        colour = holder.numbers(colour_key, 4, (1.0, 1.0, 1.0, 1.0))
        texture = holder.child(image_key)
        index = texture.index("index", self._file.count("textures"), "textures") if holder.has(image_key) else None
        # VRM 0 names the image of a toon material in its own extension
        if index is None and toon is not None and toon.child("textureProperties").has("_MainTex"):
            index = toon.child("textureProperties").index("_MainTex", self._file.count("textures"), "textures")
        image = None if index is None else self._texture(index)
        if texture.integer("texCoord", 0) != 0:
            self._notes.append(f"{fields.place}: its image uses a second set of coordinates, which is not read")
            image = None
        mode = fields.text("alphaMode", OPAQUE)
        red, green, blue, alpha = (min(max(value, 0.0), 1.0) for value in colour or ())
        return Material(
            name=fields.text("name") or fields.place.rpartition(".")[2],
            colour=(red, green, blue, alpha),
            image=image,
            transform=_texture_transform(texture),
            alpha_mode=mode if mode in (MASK, BLEND) else OPAQUE,
            cutoff=fields.number("alphaCutoff", 0.5),
            roughness=min(max(rough.number("roughnessFactor", 1.0), 0.0), 1.0),
        )

    def _texture(self, number: int) -> NDArray[np.uint8] | None:
        fields = self._file.entries("textures")[number]
        n_images = self._file.count("images")
        source = fields.index("source", n_images, "images")
        for name in ("EXT_texture_webp", "KHR_texture_basisu"):
            extension = fields.extension(name)
            if source is None and extension is not None:
                source = extension.index("source", n_images, "images")
        if source is None:
            return None
        if source not in self._images:
            self._images[source] = self._image(self._file.entries("images")[source])
        return self._images[source]

    def _image(self, fields: Fields) -> NDArray[np.uint8] | None:
        """Pixels (H, W, 4) of an image, at most `MAX_IMAGE_SIDE` on a side; None with a note if it cannot be read."""
        view = fields.index("bufferView", self._file.count("bufferViews"), "buffer views")
        content = self._file.uri(fields.text("uri"), fields) if view is None else self._file.view(view).tobytes()
        # no package on PyPI decodes KTX2 (decision 078)
        if content[:8] == KTX2[:8]:
            self._notes.append(
                f"{fields.place} is a KTX2 image, which is not read: its material has one colour; "
                "convert it to PNG or JPEG to keep it"
            )
            return None
        return decode_image(content, fields.place)


def decode_image(content: bytes, place: str) -> NDArray[np.uint8]:
    """Pixels (H, W, 4) of a PNG, JPEG or WebP image, reduced to at most `MAX_IMAGE_SIDE` on a side."""
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            with Image.open(io.BytesIO(content), formats=FORMATS) as image:
                if image.width * image.height > MAX_IMAGE_PIXELS or decoding_bytes(image) > MAX_DECODING_BYTES:
                    raise DataError(f"{place}: has {image.width} x {image.height} pixels; use 4096 x 4096 or less")
                image.draft("RGB", (MAX_IMAGE_SIDE, MAX_IMAGE_SIDE))
                pixels = image.convert("RGBA")
                pixels.thumbnail((MAX_IMAGE_SIDE, MAX_IMAGE_SIDE))
                return np.array(pixels)
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"{place}: the image cannot be decoded; convert it to PNG or JPEG") from error


def _texture_transform(texture: Fields) -> NDArray[np.float64]:
    """Affine transform (2, 3) of texture coordinates (KHR_texture_transform)."""
    fields = texture.extension("KHR_texture_transform")
    placed = np.eye(2, 3)
    if fields is None:
        return placed
    turn = fields.number("rotation", 0.0)
    scale = np.array(fields.numbers("scale", 2, (1.0, 1.0)))
    cos, sin = np.cos(turn), np.sin(turn)
    placed[:, :2] = np.array([[cos, sin], [-sin, cos]]) * scale
    placed[:, 2] = fields.numbers("offset", 2, (0.0, 0.0))
    return placed
