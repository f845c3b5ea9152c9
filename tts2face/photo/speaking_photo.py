"""A face that speaks in a photograph: a mesh with the shapes of the shipped head, in the light of the picture.

`speaking_photo` is a column of steps. Each takes the face as the one before it left it, and returns it with more parts.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.models.face import Face, FacePart
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.light import Photographed
from tts2face.models.photo_view import PhotoView
from tts2face.numeric.arrays import Float32Array, FloatArray, IntArray, Pixels
from tts2face.photo.camera import PhotoCamera, find_camera
from tts2face.photo.eyes import EYE_BEHIND_MM, SIDES, EyePatch, eye_patches, gaze_shapes
from tts2face.photo.fit import NOTHING_GIVEN, PhotoFit, PhotoPlaces
from tts2face.photo.found_face import PhotographedFace
from tts2face.photo.light import SMILING, MouthRows, picture_light, wrinkles
from tts2face.photo.lines import InnerLips, LidLines, darken_lip_edges, find_lid_lines, find_lip_line
from tts2face.photo.mesh import PhotoMesh, build_mesh
from tts2face.photo.mouth import MouthInside, MouthPlace, cheek_light, mouth_light, mouth_walls
from tts2face.photo.photograph import OPAQUE, Photograph
from tts2face.photo.shapes import GAZE_LIDS, PhotoPerson, blink, breathing, closing, depths, face_shapes, head_follow
from tts2face.photo.spreading import Spreading
from tts2face.photo.surface import (
    EYES,
    SKIN,
    PhotoPages,
    PhotoSurface,
    Vertices,
    add_lids,
    lay_pages,
    moves,
    place_landmarks,
)
from tts2face.photo.teeth import OwnTeeth, find_teeth, teeth_and_tongue

BREATH = "breath"
SMILE_KEPT = 0.6  # of a smile with parted lips, while they speak
INTO_LIP = 0.012  # of the eye distance, by which the edges of parted lips are taken from within the lip
N_NEAR = 6  # vertices of the skin around a place behind it
FOLLOW_STEPS = 255  # of the share of the head's motion, as files hold it


@dataclass(frozen=True, slots=True, eq=False)
class _Model:
    """The shipped head without hair, its landmarks (478, 3), mm, and the names of the shapes of photographed faces."""

    head: Face
    landmarks: FloatArray
    names: tuple[str, ...]

    @classmethod
    def of(cls, head: Face) -> "_Model":
        return cls(head, scatter_landmarks(head, landmark_positions(head)), (*head.shape_names, BREATH))

    def motion(self) -> dict[str, FloatArray]:
        """(478, 3) motion of the landmarks in each shape, mm; 0 for those that the head lacks."""
        moved = landmark_motion(self.head, np.arange(len(self.head.shapes)))
        spread = np.nan_to_num(scatter_landmarks(self.head, moved))
        return dict(zip(self.head.shape_names, np.moveaxis(spread, -1, 0), strict=True))


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Traced:
    """A face in a picture after the first step: its camera, landmarks, lips and lids, corrected where a person did so.

    ``landmarks`` (478, 3) and ``pivot`` (3,) are pixels and depths.
    """

    model: _Model
    seen: PhotographedFace
    camera: PhotoCamera
    landmarks: FloatArray
    given: PhotoPlaces
    person: PhotoPerson
    lids: LidLines
    pivot: FloatArray

    @property
    def pixels(self) -> Pixels:
        """(H, W, 3) of the picture."""
        return self.seen.picture.pixels


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Skinned(Traced):
    """The face with its skin: a mesh over the picture, pixels and depths (V, 3) of it, its motion and its creases."""

    mesh: PhotoMesh
    photo: FloatArray
    skin: Vertices
    creases: FloatArray


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Pictured(Skinned):
    """The face with pictures of what lies behind its skin: patches of both eyes, and the person's own teeth."""

    patches: Sequence[Sequence[EyePatch]]
    teeth: OwnTeeth | None
    pages: PhotoPages


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Laid(Pictured):
    """The face with a surface of skin, lids and eyes, which the mouth is added to; landmarks lie on its corners."""

    surface: PhotoSurface
    corners: NDArray[np.int32]
    weights: Float32Array


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Filled(Laid):
    """The face with a mouth, and the place (3,) of the edge of its upper teeth."""

    mouth: MouthRows
    teeth_edge: FloatArray


Step = TypeVar("Step", bound=Traced)


def _and(step: type[Step], before: Traced, **parts: Any) -> Step:
    """The face after a step, with what the step adds."""
    return step(**{field.name: getattr(before, field.name) for field in fields(before)}, **parts)


def speaking_photo(
    seen: PhotographedFace,
    head: Face,
    metadata: Mapping[str, Any],
    *,
    teeth: OwnTeeth | None = None,
    fit: PhotoFit = NOTHING_GIVEN,
) -> Face:
    """Face of a picture in which a face was found, with the shapes of a head without hair.

    Parameters
    ----------
    metadata
        Name and consent.
    teeth
        Of the person in another picture; those in this one, or the head's, if omitted.
    fit
        Corrections by a person. The places that were used are those of the fit in the metadata of the face.
    """
    traced = _trace(seen, head, fit)
    skinned = _cover_with_skin(traced)
    pictured = _picture_eyes_and_teeth(skinned, teeth)
    laid = _lay_surface(pictured)
    filled = _fill_mouth(laid)
    return _face(filled, metadata)


def _trace(seen: PhotographedFace, head: Face, fit: PhotoFit) -> Traced:
    """The camera that took the picture, and lines of the face in it."""
    model, picture, found = _Model.of(head), seen.picture, seen.found
    pixels, scale = picture.pixels, found.eye_distance_px
    camera = find_camera(found, model.landmarks)
    landmarks = camera.depths_of(found.landmarks)
    line = find_lip_line(pixels, found)
    given = PhotoPlaces(fit, (pixels.shape[1], pixels.shape[0]), picture.reduced_by, scale)
    lips = given.lips(InnerLips(camera.depths_of(line.upper), camera.depths_of(line.lower), line.gap))
    return Traced(
        model=model,
        seen=seen,
        camera=camera,
        landmarks=landmarks,
        given=given,
        person=PhotoPerson(given.size, landmarks, lips, seen.mean_score(SMILING), scale),
        lids=given.lids(find_lid_lines(pixels, landmarks, scale)),
        pivot=given.point("pivot", camera.to_pixels(head.pivot[None].astype(np.float64))[0]),
    )


def _cover_with_skin(face: Traced) -> Skinned:
    """A mesh over the picture that moves as the head does."""
    person, model = face.person, face.model
    mesh = build_mesh(person.size, face.landmarks, person.lips, face.lids, person.scale)
    photo, skin = _skin(mesh, person, face.camera, model)
    creases = wrinkles(face.pixels, mesh, dict(zip(model.names, skin.shapes, strict=True)), person)
    return _and(Skinned, face, mesh=mesh, photo=photo, skin=skin, creases=creases)


def _picture_eyes_and_teeth(face: Skinned, teeth: OwnTeeth | None) -> Pictured:
    """Pictures of what opens behind lids and lips, on pages beside the picture of what moves."""
    pixels, person = face.pixels, face.person
    patches = eye_patches(pixels, face.landmarks, face.lids, person.scale)
    if teeth is None:
        teeth = find_teeth(pixels, face.seen.found, person.lips, face.camera, face.model.head)
    if teeth is not None:
        teeth = teeth.in_light_of(cheek_light(pixels, face.landmarks))
    pictures: list[EyePatch | OwnTeeth] = [*patches[0], *patches[1]]
    if teeth is not None:
        pictures.append(teeth)
    darkened = darken_lip_edges(pixels, person.lips, person.scale)
    pages = lay_pages(darkened, face.mesh, moves(face.skin), pictures)
    return _and(Pictured, face, patches=patches, teeth=teeth, pages=pages)


def _lay_surface(face: Pictured) -> Laid:
    """The parts in the order in which they are drawn, those of the skin first."""
    mesh, pages, surface = face.mesh, face.pages, PhotoSurface()
    surface.add(face.skin, uv=pages.uv(_shown_places(mesh, face.person)))
    surface.parts.append((SKIN, mesh.triangles))
    add_lids(surface, mesh, pages, face.person.scale)
    eyes, corners_of = [], iter(pages.patch_corners)
    for eye, parts in enumerate(face.patches):
        for patch in parts:
            vertices = _eye_vertices(patch, eye, face.photo, face.camera, face.model)
            rows = surface.add(vertices, uv=pages.uv(patch.places, next(corners_of)))
            surface.parts.append((EYES, rows[_before_person(patch, face.seen.picture)]))
            if patch is parts[0]:  # the others are catchlights before it
                eyes.append((patch, rows))
    corners, weights = place_landmarks(mesh, face.landmarks, eyes)
    return _and(Laid, face, surface=surface, corners=corners, weights=weights)


def _fill_mouth(face: Laid) -> Filled:
    """Teeth, gums, tongue and walls behind the lips."""
    model, camera, surface, pages = face.model, face.camera, face.surface, face.pages
    light = mouth_light(face.pixels, face.landmarks, np.mean([parts[0].white for parts in face.patches], axis=0))
    at_rest = np.einsum("lc,lcx->lx", face.weights, surface.places[face.corners])
    place = MouthPlace.of(model.landmarks, at_rest, is_parted=face.person.is_parted)
    inside = teeth_and_tongue(model.head, place, light, face.teeth)
    edge = face.given.point("teeth", camera.to_pixels(inside[0].teeth_edge[None])[0])
    way = camera.to_head(edge[None])[0] - inside[0].teeth_edge
    inside = [part.moved(way) for part in inside]
    walls = mouth_walls(face.mesh, face.skin.places, face.skin.shapes, light)
    mouth = MouthRows(
        pictured=[_add_inside(surface, part, pages) for part in inside if part.texels is not None],
        lit=[_add_inside(surface, part, pages) for part in inside if part.texels is None],
        walls=[_add_inside(surface, walls, pages)],
        dark=light.dark,
    )
    return _and(Filled, face, mouth=mouth, teeth_edge=edge)


def _face(face: Filled, metadata: Mapping[str, Any]) -> Face:
    """The face in its file, with the places that were used."""
    model, surface, head = face.model, face.surface, face.model.head
    every = surface.every()
    triangles = np.concatenate([part for _, part in surface.parts])
    drawn = np.flatnonzero(moves(every)[triangles].any(axis=1))
    skin = (face.mesh, face.skin.places, face.creases)
    used = face.given.used(face.person.lips, face.lids, {"teeth": face.teeth_edge, "pivot": face.pivot})
    return Face(
        vertices=every.places.astype(np.float32),
        triangles=triangles.astype(np.int32),
        parts=_parts(surface),
        shape_names=model.names,
        shapes=every.shapes.astype(np.float32),
        limits=np.concatenate([head.limits, [[0.0, 1.0]]]).astype(np.float32),
        eyes=(),
        colours=np.rint(np.concatenate(surface.colours)).clip(0, 255).astype(np.uint8),
        uv=np.concatenate(surface.uv).astype(np.float32),
        textures=(),
        landmarks=np.arange(N_LANDMARKS, dtype=np.int32),
        landmark_vertices=face.corners,
        landmark_weights=face.weights,
        pivot=face.camera.to_head(face.pivot[None])[0].astype(np.float32),
        metadata={**metadata, "fit": used.as_json()},
        scores=head.scores,
        light=Photographed(
            picture_light(face.pixels, face.pages.pages, skin, drawn, face.mouth),
            _view(face.seen.picture, face.camera, every.follow, face.pages),
        ),
    )


def _view(picture: Photograph, camera: PhotoCamera, follow: FloatArray, pages: PhotoPages) -> PhotoView:
    high, wide = picture.pixels.shape[:2]
    lens = np.array([camera.focal_px, *camera.origin])
    rounded = np.rint(follow * FOLLOW_STEPS) / FOLLOW_STEPS
    corner = (round(float(pages.corner[0])), round(float(pages.corner[1])))
    layers = (picture.alpha, picture.behind)
    return PhotoView((wide, high), camera.view, lens, rounded.astype(np.float32), corner, *layers)


def _parts(surface: PhotoSurface) -> tuple[FacePart, ...]:
    first, parts = 0, []
    for name, triangles in surface.parts:
        parts.append(FacePart(name, first, len(triangles)))
        first += len(triangles)
    return tuple(parts)


def _skin(mesh: PhotoMesh, person: PhotoPerson, camera: PhotoCamera, model: _Model) -> tuple[FloatArray, Vertices]:
    """Pixels and depths (V, 3) of the picture, and vertices of its skin with closed lips."""
    spreading = Spreading(mesh.places, mesh.triangles, person.scale)
    found = face_shapes(mesh, spreading, model.motion(), person)
    follow = head_follow(mesh, person)
    for eye, side in enumerate(SIDES):
        shut = camera.ways_to_head(blink(mesh, spreading, person, eye))
        found[f"eyeBlink{side}"] = shut
        found |= {f"{name}{side}": share * shut for name, share in GAZE_LIDS.items()}
    found[BREATH] = camera.ways_to_head(breathing(mesh, person, follow, camera.scale))
    depth = depths(mesh, spreading, person, camera, model.head.pivot.astype(np.float64))
    photo = np.column_stack([mesh.places, depth])
    rest = camera.to_head(photo) + camera.ways_to_head(closing(mesh, spreading, person))
    if person.is_parted:
        rest -= (1 - SMILE_KEPT) * person.smile * np.sum([found[name] for name in SMILING], axis=0)
    share = person.upper_share
    met = (1 - share) * rest[mesh.upper_lip] + share * rest[mesh.lower_lip]
    rest[mesh.upper_lip] = rest[mesh.lower_lip] = met
    zero = np.zeros_like(rest)
    return photo, Vertices(rest, np.stack([found.get(name, zero) for name in model.names]), follow)


def _shown_places(mesh: PhotoMesh, person: PhotoPerson) -> FloatArray:
    """(V, 2) pixels that vertices show: their own, and some way into the lip at the edges of parted lips."""
    places = mesh.places.copy()
    if not person.lips.is_closed:
        ways = places[mesh.lower_lip] - places[mesh.upper_lip]
        into = INTO_LIP * person.scale
        ways *= into / np.maximum(np.linalg.norm(ways, axis=1, keepdims=True), into)
        places[mesh.upper_lip] -= ways
        places[mesh.lower_lip] += ways
    return places


def _before_person(patch: EyePatch, picture: Photograph) -> IntArray:
    """Triangles (M, 3) of an eye that lie within the person of a picture: large eyes reach beyond the cheeks."""
    if picture.alpha is None:
        return patch.triangles
    across, down = np.rint(patch.places).astype(int).T
    return np.asarray(patch.triangles[(picture.alpha[down, across] == OPAQUE)[patch.triangles].all(axis=1)])


def _eye_vertices(patch: EyePatch, eye: int, photo: FloatArray, camera: PhotoCamera, model: _Model) -> Vertices:
    """Vertices of a patch behind the skin around it, which is given by the pixels and depths (V, 3) of all skin."""
    away, near = cKDTree(photo[:, :2]).query(patch.places, N_NEAR)
    shares = 1 / (np.asarray(away) + 1)
    depth = (photo[near, 2] * shares).sum(axis=1) / shares.sum(axis=1) + (patch.ahead_mm - EYE_BEHIND_MM) * camera.scale
    shapes = np.zeros((len(model.names), len(patch.places), 3))
    for name, way in gaze_shapes(model.head, patch.turning, eye).items():
        shapes[model.names.index(name)] = way
    places = camera.to_head(np.column_stack([patch.places, depth]))
    return Vertices(places, shapes, np.ones(len(places)))


def _add_inside(surface: PhotoSurface, inside: MouthInside, pages: PhotoPages) -> tuple[IntArray, FloatArray]:
    """Vertices (N,) of what lies in the mouth, and their colours (N, 3) in open light."""
    n = len(inside.vertices)
    shapes = np.zeros((surface.vertices[0].shapes.shape[0], n, 3))
    shapes[: len(inside.shapes)] = inside.shapes
    vertices = Vertices(inside.vertices, shapes, np.ones(n))
    if inside.texels is None:
        numbers = surface.add(vertices, colours=inside.colours)
    else:
        numbers = surface.add(vertices, uv=pages.uv(inside.texels, pages.patch_corners[-1]))
    surface.parts += [(name, numbers[triangles]) for name, triangles in inside.parts.items()]
    return numbers, inside.colours
