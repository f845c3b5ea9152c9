"""Binary glTF of a face for the live preview of the studio: small, without animation, with what its shading takes.

Geometry and textures are plain glTF 2.0 with the extensions KHR_mesh_quantization and EXT_texture_webp, so that other
viewers read it. Attributes whose names begin with an underscore and ``asset.extras`` hold what the renderer knows and
glTF does not: visibility of the light, share of the head's motion, kinds of materials, lamps and cameras.
"""

import io
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.face.eyeballs import SINK_SHARE, SINK_SLOPE
from tts2face.face.landmarks import landmark_positions
from tts2face.face.rest_light import in_rest_light
from tts2face.interchange.exports.skeleton import HEAD, Skeleton, build_skeleton
from tts2face.interchange.exports.stage_surfaces import stage_surfaces
from tts2face.interchange.exports.surfaces import MM_PER_M, ExportSurface, linear_colours
from tts2face.interchange.gltf.container import INDICES, VERTICES, GltfBuffer
from tts2face.models.face import Face, Texture
from tts2face.models.light import Lamps, Photographed
from tts2face.models.photo_view import HEAD_LIMIT_RAD, SHIFT_GAIN
from tts2face.picture import catchlights
from tts2face.picture.camera import FIELD_OF_VIEW_RAD, framing_box
from tts2face.picture.camera_view import NAMED_VIEWS
from tts2face.picture.cards import SKULL_CENTRE_MM
from tts2face.picture.kernels import lamps
from tts2face.picture.kernels.tables import DARK_GLOSS, GLOSS, OPEN_SURFACE, ROUGHNESS, SECOND_LOBE, WRAP
from tts2face.picture.light import lip_opening
from tts2face.picture.light_fields import light_fields
from tts2face.picture.materials import STRANDS
from tts2face.picture.scene import STUDIO_BRIGHT, STUDIO_CENTRE, STUDIO_DARK
from tts2face.picture.surface import Surface, build_surface
from tts2face.processes.threads import available_cores
from tts2face.types import HEAD_CHANNELS

MAX_TEXTURE_PX = 1024  # along a side: more than a preview of 1000 pixels shows
WEBP_QUALITY = 88
LEAST_MOVE_MM = 0.01  # displacements below this are 0: a fortieth of a pixel
HALF = 127  # of the coverage of a texel
LEAST_APART = 0.1  # of typical colours
FULL = 32767  # of a quantised displacement
FIELD_SCALE = 2.0  # light fields lie within 2
PHOTO_MARGIN = 0.5  # around the face in a photograph, of its size
TEXTURE_EXTENSION, QUANTISED = "EXT_texture_webp", "KHR_mesh_quantization"


@dataclass(frozen=True, slots=True, eq=False)
class _Rows:
    """Values of all vertices V: light fields (V, 20), strands (V, 4), joint and share (V, 2), linear colours (V, 3)."""

    fields: NDArray[np.int8]
    strands: NDArray[np.int8]
    skin: NDArray[np.uint16]
    colours: NDArray[np.uint16]


def stage_glb(face: Face, channels: tuple[str, ...]) -> bytes:
    """The face as binary glTF whose morph targets are `channels`, its first shapes.

    Target k has weight 1 where its channel has the value ``scales[k]`` of the mesh's extras. A face in a photograph is
    turned as the picture shows it.
    """
    face, unlit = in_rest_light(_as_seen(face))
    surface = build_surface(face, scatters=False)
    skeleton, buffer = build_skeleton(face, len(channels)), GltfBuffer()
    moves, scales = quantised_moves(face.shapes[: len(channels)])
    fields = light_fields(face, surface, available_cores())
    rows = _rows(face, surface, skeleton, fields)
    moved = np.where(moves.any(axis=2, keepdims=True), face.shapes[: len(channels)], np.float32(0))
    surfaces = stage_surfaces(face, fields, moved)
    primitives = [_primitive(face, number, drawn, (rows, moves), buffer) for number, drawn in enumerate(surfaces)]
    content = {
        "asset": {"version": "2.0", "generator": "tts2face", "extras": _stage(face, surface, skeleton, channels)},
        "extensionsUsed": [QUANTISED, *([TEXTURE_EXTENSION] if face.textures else [])],
        "extensionsRequired": [QUANTISED, *([TEXTURE_EXTENSION] if face.textures else [])],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": "face", "mesh": 0}],
        "materials": [_material(drawn, surface, face, unlit=drawn.part.name in unlit) for drawn in surfaces],
        "meshes": [
            {
                "name": "face",
                "primitives": primitives,
                "weights": [0] * len(channels),
                "extras": {"targetNames": list(channels), "scales": scales.tolist()},
            }
        ],
        **_textures(face, buffer),
    }
    return buffer.content(content, "the face")


def _as_seen(face: Face) -> Face:
    """The face, that of a photograph in the axes of the camera that took it."""
    if not isinstance(face.light, Photographed):
        return face
    turn = face.light.view.turn
    vertices, shapes, pivot = (
        (values @ turn.T).astype(np.float32) for values in (face.vertices, face.shapes, face.pivot)
    )
    return replace(face, vertices=vertices, shapes=shapes, pivot=pivot)


def _rows(face: Face, surface: Surface, skeleton: Skeleton, fields: NDArray[np.float32]) -> _Rows:
    quantised = np.rint(np.clip(fields / FIELD_SCALE, -1, 1) * 127).astype(np.int8)
    joint = skeleton.joints[:, 1]
    skin = np.column_stack([joint, np.rint(skeleton.weights[:, 1] * 0xFFFF)]).astype(np.uint16)
    # four: accessors are aligned to 4 bytes (glTF 2.0, 3.6.2.4)
    strands = np.zeros((len(face.vertices), 4), np.int8)
    strands[surface.strands.vertices, :3] = np.rint(surface.strands.tangents * 127)
    return _Rows(quantised, strands, skin, np.rint(linear_colours(face) * 0xFFFF).astype(np.uint16))


def _primitive(
    face: Face, number: int, surface: ExportSurface, values: tuple[_Rows, NDArray[np.int16]], buffer: GltfBuffer
) -> dict[str, Any]:
    own, (rows, moves) = surface.vertices, values
    places = (face.vertices[own] / MM_PER_M).astype("<f4")
    bounds = {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    attributes = {
        "POSITION": buffer.add_accessor(places, VERTICES, **bounds),
        "_SKIN": buffer.add_accessor(rows.skin[own], VERTICES),
    }
    # WebGL has attributes of at most four numbers
    for column in range(0, rows.fields.shape[1], 4):
        four = np.ascontiguousarray(rows.fields[own, column : column + 4])
        attributes[f"_LIGHT{column // 4}"] = buffer.add_accessor(four, VERTICES, normalized=True)
    if surface.part.is_textured and face.uv is not None:
        uv = np.rint(np.clip(face.uv[own], 0, 1) * 0xFFFF).astype("<u2")
        attributes["TEXCOORD_0"] = buffer.add_accessor(uv, VERTICES, normalized=True)
    else:
        colours = np.column_stack([rows.colours[own], np.full(len(own), 0xFFFF, np.uint16)])
        attributes["COLOR_0"] = buffer.add_accessor(colours, VERTICES, normalized=True)
    if surface.part.kind == STRANDS:
        attributes["_TANGENT"] = buffer.add_accessor(rows.strands[own], VERTICES, normalized=True)
    # glTF reserves the largest index of a type (primitive restart)
    kind = "<u2" if len(own) < 0xFFFF else "<u4"
    return {
        "attributes": attributes,
        "indices": buffer.add_accessor(surface.triangles.ravel().astype(kind), INDICES),
        "material": number,
        "targets": [{"POSITION": buffer.add_sparse_accessor(move, normalized=True)} for move in moves[:, own]],
    }


def quantised_moves(shapes: NDArray[np.floating]) -> tuple[NDArray[np.int16], NDArray[np.float64]]:
    """Displacements (K, V, 3) of shapes in mm as shares of 32767 of 1 m, and the weights (K,) at which they hold.

    The farthest vertex of each shape moves by 1 m, so that small shapes keep their precision.
    """
    largest = np.abs(shapes).reshape(len(shapes), -1).max(axis=1, initial=0.0).astype(np.float64)
    scales = MM_PER_M / np.where(largest > 0, largest, MM_PER_M)
    moves = np.zeros(shapes.shape, np.int16)
    for shape, scale, target in zip(shapes, scales, moves, strict=True):
        moved = np.abs(shape).max(axis=1) >= LEAST_MOVE_MM
        target[moved] = np.rint(shape[moved] * (scale / MM_PER_M * FULL))
    return moves, scales


def _material(surface: ExportSurface, built: Surface, face: Face, *, unlit: bool) -> dict[str, Any]:
    """Material with the values of the renderer's table in its extras."""
    part, is_flat = surface.part, face.light.is_flat
    row = built.materials[face.parts.index(part)]
    shading: dict[str, Any] = {"baseColorFactor": [1, 1, 1, part.opacity], "metallicFactor": 0}
    more: dict[str, Any] = {}
    if part.is_textured:
        shading["baseColorTexture"] = {"index": part.texture}
        more["texels"] = _typical_texels(face.textures[part.texture])
    columns = {"gloss": GLOSS, "rough": ROUGHNESS, "second": SECOND_LOBE, "dark": DARK_GLOSS, "wrap": WRAP}
    extras: dict[str, Any] = {name: round(float(row[at]), 5) for name, at in columns.items()}
    extras |= {
        "kind": part.kind,
        "open": bool(row[OPEN_SURFACE]) or is_flat,
        "opacity": part.opacity,
        "cutout": part.cutout,
        "unlit": unlit or is_flat,  # also the colours of its mouth are those of the picture's light
        "behind": face.light.is_in_opening(part.name),  # eyes and mouth, which the skin hides anywhere
        **more,
    }
    material = {"name": part.name, "doubleSided": True, "pbrMetallicRoughness": shading, "extras": extras}
    return material | ({"alphaMode": "MASK"} if part.cutout else {})


def _typical_texels(texture: Texture) -> list[list[float]]:
    """Mean colour of the darker and of the brighter half of a texture, 0 to 1, apart in each channel."""
    shown = texture.pixels[texture.alpha > HALF] if texture.alpha is not None else texture.pixels.reshape(-1, 3)
    colours = shown.astype(np.float32) / 255
    sums = colours.sum(axis=1)
    middle = np.median(sums) if len(sums) else 0.0
    dark, bright = (
        colours[half].mean(axis=0) if half.any() else np.zeros(3) for half in (sums <= middle, sums > middle)
    )
    return [dark.round(4).tolist(), np.maximum(bright, dark + LEAST_APART).round(4).tolist()]


def _textures(face: Face, buffer: GltfBuffer) -> dict[str, Any]:
    if not face.textures:
        return {}
    images = [{"bufferView": buffer.add_view(_webp(texture)), "mimeType": "image/webp"} for texture in face.textures]
    textures = [{"sampler": 0, "extensions": {TEXTURE_EXTENSION: {"source": n}}} for n in range(len(images))]
    return {"images": images, "samplers": [{}], "textures": textures}


def _webp(texture: Texture) -> bytes:
    """A texture, no larger than `MAX_TEXTURE_PX`, as WebP."""
    from PIL import Image

    alpha = [] if texture.alpha is None else [texture.alpha]
    picture = Image.fromarray(np.dstack([texture.pixels, *alpha]))
    picture.thumbnail((MAX_TEXTURE_PX, MAX_TEXTURE_PX), Image.Resampling.LANCZOS)
    content = io.BytesIO()
    picture.save(content, "WEBP", quality=WEBP_QUALITY, exact=True)
    return content.getvalue()


def _stage(face: Face, surface: Surface, skeleton: Skeleton, channels: tuple[str, ...]) -> Mapping[str, Any]:
    """Values that the preview takes from the renderer: lamps, cameras, joints; lengths in metres."""
    opening = lip_opening(face)[: len(channels)]
    eyes = [
        {
            "centre": (skeleton.places[HEAD + 1 + number] / MM_PER_M).tolist(),
            "turns": {
                name: turn.tolist()
                for name, turn in zip(channels, skeleton.eye_turns[number], strict=True)
                if turn.any()
            },
            "iris": float(surface.eyes.iris[number]),
            "radius": float(surface.eyes.openings.radius[number]) / MM_PER_M,
            "catchlight": float(surface.eyes.sizes[number]),
            "lids": _lids(surface, number),
        }
        for number in range(len(face.eyes))
    ]
    return {
        "skull": (SKULL_CENTRE_MM / MM_PER_M).tolist(),
        "pivot": (skeleton.places[HEAD] / MM_PER_M).tolist(),
        "head": list(HEAD_CHANNELS),
        "eyes": eyes,
        "sink": {"slope": SINK_SLOPE, "share": SINK_SHARE},
        "catchlight": {
            "height": catchlights.HEIGHT_SHARE,
            "aside": float(np.sign(lamps.LAMPS[0][0])) * catchlights.ASIDE_SHARE,
            "most": catchlights.MOST_OF_SEEN,
            "grows": [catchlights.SMALL, catchlights.WHOLE],
            "appears": [catchlights.HIDDEN, catchlights.CLEAR],
            "turns": [catchlights.AWAY, catchlights.TOWARDS],
            "soft": catchlights.SOFT,
        },
        "opening": {name: float(value) for name, value in zip(channels, opening, strict=True) if value},
        **_cameras(face),
        "field_of_view": FIELD_OF_VIEW_RAD,
        "lamps": [[yaw, pitch, list(colour)] for yaw, pitch, colour in lamps.LAMPS],
        "sky": list(lamps.SKY_COLOUR),
        "floor": list(lamps.FLOOR_COLOUR),
        "brightness": lamps.BRIGHTNESS,
        "wall": _wall(face),
    }


def _cameras(face: Face) -> Mapping[str, Any]:
    """The box that the cameras frame, and the cameras; of a photograph also how the head moves in it."""
    views = {name: [view.yaw_deg, view.pitch_deg, view.share] for name, view in NAMED_VIEWS.items()}
    if not isinstance(face.light, Photographed):
        return {"frame": _in_metres(*framing_box(face)), "views": views}
    view = face.light.view
    return {
        "frame": _in_metres(*_shown_head(face)),
        "views": {"front": [0.0, 0.0, 1.0], "close": [0.0, 0.0, NAMED_VIEWS["close"].share]},
        "photo": {  # as `PhotoView.bearable`
            "turn": view.turn.tolist(),
            "gain": view.head_gain,
            "limit": float(HEAD_LIMIT_RAD),
            "shift": SHIFT_GAIN,
        },
    }


def _in_metres(*corners: NDArray[np.float64]) -> list[list[float]]:
    return [(corner / MM_PER_M).tolist() for corner in corners]


def _shown_head(face: Face) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners (3,), mm, of the box of a head with a margin, as far as the photograph shows it."""
    landmarks = landmark_positions(face)
    low, high = landmarks.min(axis=0), landmarks.max(axis=0)
    margin = PHOTO_MARGIN * (high - low)
    return np.maximum(low - margin, face.vertices.min(axis=0)), np.minimum(high + margin, face.vertices.max(axis=0))


def _wall(face: Face) -> list[list[float]]:
    """Colours, 0 to 255, of the wall in the middle and at the sides, and the place of its middle."""
    if isinstance(face.light, Lamps):
        return [list(STUDIO_BRIGHT), list(STUDIO_DARK), list(STUDIO_CENTRE)]
    backdrop = face.light.baked.backdrop.astype(np.float64)
    middle, side = backdrop.shape[1] // 3, backdrop.shape[1] // 6
    outer = np.concatenate([backdrop[:, :side], backdrop[:, -side:]], axis=1)
    bright, dark = backdrop[:, middle:-middle].mean(axis=(0, 1)), outer.mean(axis=(0, 1))
    return [bright.round(1).tolist(), dark.round(1).tolist(), list(STUDIO_CENTRE)]


def _lids(surface: Surface, eye: int) -> list[list[list[float]]]:
    """Places of the lid landmarks at rest in metres, upper and lower; empty for a face without them."""
    openings = surface.eyes.openings
    if not openings.found[eye]:
        return []
    places: list[list[list[float]]] = (openings.edges(surface.rig.rest)[openings.found[:eye].sum()] / MM_PER_M).tolist()
    return places
