"""Teeth are tooth-coloured and the tongue is pink in every pose of faces with baked light."""

import numpy as np
import pytest

from tests.face.people import LIT, load_plain
from tests.picture.mouths import mixes, shape_weights
from tts2face.face.deformation import REST_HEAD
from tts2face.numeric.arrays import decode_srgb
from tts2face.picture.baked.mouth_colours import MouthColours
from tts2face.picture.baked.scene import LitScene
from tts2face.picture.kernels.tables import NORMAL
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer

SMILE = {"mouthSmile*": 0.9, "mouthUpperUp*": 0.4, "jawOpen": 0.2}
FRONT_MM = 9.0  # of the teeth in front, and of the tip of the tongue
TO_XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])  # IEC 61966-2-1


def lab(colours: np.ndarray) -> np.ndarray:
    """(N, 3) CIELAB of displayed colours (N, 3), 0 to 255."""
    xyz = decode_srgb(colours / 255) @ TO_XYZ.T / TO_XYZ.sum(axis=1)
    roots = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    x, y, z = roots.T
    return np.column_stack([116 * y - 16, 500 * (x - y), 200 * (y - z)])


class Mouth:
    """Colours of parts of a mouth in poses."""

    def __init__(self, name: str) -> None:
        self.face = load_plain(name)
        scene = mesh_renderer(self.face, Picture(size="32x32")).scene
        assert isinstance(scene, LitScene)
        self.scene, self.buffers = scene, scene.allocate_buffers()

    def front_of(self, part: str) -> np.ndarray:
        """Which vertices of the mouth are those of the front of a part, on its upper or outer side."""
        rows = self.scene.surface.light.mouth_rows
        own = next(p for p in self.face.parts if p.name == part)
        of_part = np.isin(rows, self.face.triangles[own.first : own.first + own.count])
        depth = self.face.vertices[rows, 2]
        return of_part & (depth > depth[of_part].max() - FRONT_MM)

    def colours(self, weights: np.ndarray, rows: np.ndarray) -> np.ndarray:
        self.scene.light_pose(self.scene.deform(weights), REST_HEAD, self.buffers)
        return np.asarray(self.buffers.mouth[:, rows].mean(axis=1))


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=() if name == "mara" else pytest.mark.nightly) for name in LIT]
)
def test_teeth_are_tooth_coloured_and_the_tongue_is_pink_in_every_pose(name: str) -> None:
    mouth = Mouth(name)
    teeth, tongue = mouth.front_of("teeth_upper"), mouth.front_of("tongue")
    poses = mixes(mouth.face, 200)  # at their darkest, teeth had an L* of 7 to 14, and a tongue that was out one of 0
    smile = lab(mouth.colours(shape_weights(mouth.face, SMILE), teeth)[None])[0]
    spoken = lab(np.array([mouth.colours(weights, teeth) for weights in poses]))
    assert spoken[:, 0].min() > 0.7 * smile[0]
    assert np.linalg.norm(spoken[:, 1:] - smile[1:], axis=1).max() < 8
    out = [shape_weights(mouth.face, {"tongueOut": share, "jawOpen": 0.3}) for share in (0.25, 0.5, 0.75, 1.0)]
    pink = lab(np.array([mouth.colours(weights, tongue) for weights in [*poses, *out]]))
    assert pink[:, 0].min() > 20  # deep in a mouth that is wide open
    assert pink[-len(out) :, 0].min() > 38
    assert pink[:, 1].min() > 18
    assert (pink[:, 2] > 3).all()
    assert (pink[:, 2] < pink[:, 1]).all()


def test_what_is_seen_is_never_darker_than_its_place_allows() -> None:
    own = np.full((3, 3), 200, np.float32)
    colours = MouthColours(np.arange(3, dtype=np.int32), own, np.float32(50))
    places = np.array([[0, 0, 0], [0, 0, -25], [0, 0, -50]], np.float32)
    table = np.zeros((3, NORMAL + 3), np.float32)
    table[:, NORMAL + 2] = 1
    ring = np.array([[-25, 0, 0], [25, 0, 0]], np.float32)
    light = np.zeros((3, 3), np.float32)
    colours.hold(places, ring, table, light)
    assert light[0, 0] > 150
    assert 2 * light[0, 1] == pytest.approx(light[0, 0], rel=0.01)
    assert (np.diff(light[0]) < 0).all()
    assert light[2, 2] < light[1, 2] < light[0, 2]  # what is deep is red
    grey = np.full((3, 3), 230, np.float32)
    colours.hold(places, ring, table, grey)
    assert grey[0] == pytest.approx(230, rel=0.1)
