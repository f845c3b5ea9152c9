"""Material libraries of .obj files."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from lexicon.errors import DataError
from tts2face.interchange.characters.atlas import coverage
from tts2face.interchange.characters.character import BLEND, OPAQUE
from tts2face.interchange.characters.obj_materials import read_libraries

LIBRARY = """# comment
newmtl skin
Kd 0.8 0.8 0.8
newmtl shirt
Kd 1.0 0.5 0.0
newmtl lens
Kd 0.2 0.4 0.9
Tr 0.7
newmtl hair
Kd 0.1 0.1 0.1
map_Kd -s 1 1 1 hair.png
map_d holes.png
newmtl lashes
map_Kd my lashes.png
newmtl outside
map_Kd ../hair.png
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a.mtl").write_text(LIBRARY)
    Image.new("RGB", (8, 8), (90, 60, 30)).save(tmp_path / "hair.png")
    Image.fromarray(np.repeat([[0, 255]], 4, axis=0).astype(np.uint8)).resize((4, 4), 0).save(tmp_path / "holes.png")
    Image.new("RGBA", (4, 4), (10, 10, 10, 60)).save(tmp_path / "my lashes.png")
    return tmp_path


def test_colours_images_and_holes(folder: Path) -> None:
    found = read_libraries(folder, ["a.mtl", "missing.mtl"])
    assert found["skin"].colour == (1.0, 1.0, 1.0, 1.0)  # an unpainted grey
    assert found["shirt"].colour == pytest.approx((1.0, 0.216, 0.0, 1.0), abs=2e-3)  # linear light
    assert found["lens"].colour[3] == pytest.approx(0.3)
    assert [found[name].alpha_mode for name in ("skin", "shirt", "lens", "hair", "lashes")] == [
        OPAQUE, OPAQUE, BLEND, BLEND, BLEND,
    ]  # fmt: skip
    assert found["hair"].colour[:3] == (1.0, 1.0, 1.0)
    covered = coverage(found["hair"])
    assert covered.shape == (8, 8)
    assert (covered[:, :2] < 30).all()
    assert (covered[:, 6:] > 225).all()
    assert (coverage(found["lashes"]) == 60).all()
    assert found["outside"].image is None


def test_a_damaged_image_is_refused(folder: Path) -> None:
    (folder / "holes.png").write_bytes(b"no picture")
    with pytest.raises(DataError, match=r"holes\.png: the image cannot be decoded"):
        read_libraries(folder, ["a.mtl"])
