"""Images with holes: hair cards of an imported character are drawn pixel by pixel."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.interchange.characters.made import (
    METRES,
    GltfMaker,
    bounds,
    split_glb,
    write_character_file,
    write_landmarks,
)
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.saving import save_face
from tts2face.models.face_file import read_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import draw

STRIPE = 8  # pixels of the image
RED = 200


def write_with_card(path: Path, mode: str) -> Path:
    """The shipped head with a card before its forehead, whose image has red stripes between black holes."""
    root, binary = split_glb(write_character_file(path).read_bytes())
    maker = GltfMaker()
    maker.json, maker.binary = root, bytearray(binary)
    striped = np.arange(64) // STRIPE % 2 == 0
    image = np.zeros((64, 64, 4), np.uint8)
    image[:, striped] = (RED, 0, 0, 255)
    content = io.BytesIO()
    Image.fromarray(image).save(content, "PNG")
    number = maker.add("images", {"bufferView": maker.view(content.getvalue()), "mimeType": "image/png"})
    texture = {"baseColorTexture": {"index": maker.add("textures", {"source": number})}, "metallicFactor": 0}
    material = maker.add("materials", {"name": "HairCard", "alphaMode": mode, "pbrMetallicRoughness": texture})
    places = np.array([[-60, 30, 120], [60, 30, 120], [60, 90, 120], [-60, 90, 120]], "<f4") * np.float32(METRES)
    corners = np.array([0, 1, 2, 0, 2, 3], "<u2").reshape(-1, 1)
    attributes = {
        "POSITION": maker.accessor(places, **bounds(places)),
        "TEXCOORD_0": maker.accessor(np.array([[0, 1], [1, 1], [1, 0], [0, 0]], "<f4")),
    }
    primitive = {"attributes": attributes, "indices": maker.accessor(corners), "material": material}
    mesh = maker.add("meshes", {"name": "HairCard", "primitives": [primitive]})
    above = maker.json["nodes"][maker.json["scenes"][0]["nodes"][0]]
    above["children"].append(maker.add("nodes", {"name": "HairCard", "mesh": mesh}))
    path.write_bytes(maker.content())
    return path


@pytest.mark.parametrize("mode", ["MASK", "BLEND"])
def test_stripes_between_holes_stay_stripes(mode: str, tmp_path: Path) -> None:
    character = write_with_card(tmp_path / "card.glb", mode)
    imported = import_face(character, landmarks=write_landmarks(tmp_path / "landmarks.tsv"))
    save_face(tmp_path / "me.face", imported.face)
    face = read_face(tmp_path / "me.face")
    assert {part.name for part in face.parts if part.cutout} == {
        "brows:brows",
        "lashes:lashes",
        "hair:hair",
        "hair:HairCard",
    }
    pixels = draw(face, np.zeros(len(face.shape_names)), picture=Picture(size="512x512", camera="0,0,900"))
    red = pixels[:, :, 0].astype(int) - pixels[:, :, 1:].max(axis=2) > 80
    rows = np.flatnonzero(red.sum(axis=1) > 40)
    assert len(rows) > 30
    row = red[rows[len(rows) // 2]]
    assert np.diff(row.astype(int)).clip(0).sum() == 4  # red stripes
    covered = np.flatnonzero(row)
    assert red[rows[3:-3], covered[0] : covered[-1]].mean() == pytest.approx(4 / 7, abs=0.05)
