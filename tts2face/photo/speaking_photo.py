"""A face that speaks in a photograph: a mesh with the shapes of the shipped head, in the light of the picture.

`speaking_photo` is a column of steps. Each takes the face as the one before it left it, and returns it with more parts.
"""

from collections.abc import Mapping
from dataclasses import fields, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from tts2face.models.face import Face, FacePart
from tts2face.models.landmarks import N_LANDMARKS
from tts2face.models.light import Photographed
from tts2face.models.photo_view import PhotoView
from tts2face.numeric.arrays import FloatArray, IntArray
from tts2face.photo.camera import PhotoCamera, find_camera
from tts2face.photo.eyes import EYE_BEHIND_MM, SIDES, EyePatch, eye_patches, gaze_shapes
from tts2face.photo.fit import NOTHING_GIVEN, PhotoFit, PhotoPlaces
from tts2face.photo.found_face import PhotographedFace
from tts2face.photo.lids import (
    EYE_FORWARD_MM,
    FORWARD_MM,
    LASHES_INTO,
    LASHES_MM,
    LidFrame,
    LidPicture,
    LidSheet,
    sheet_over_eye,
    sheets_over_skin,
    shut_eye,
)
from tts2face.photo.light import SMILING, Changing, MouthRows, picture_light, wrinkles
from tts2face.photo.lines import darken_lip_edges, find_lid_lines
from tts2face.photo.mesh import PhotoMesh, build_mesh
from tts2face.photo.moustache import find_lips
from tts2face.photo.mouth import MouthInside, MouthPlace, cheek_light, mouth_light, mouth_walls
from tts2face.photo.photograph import OPAQUE, Photograph
from tts2face.photo.shapes import (
    LOOK_DOWN,
    LOOK_UP,
    PhotoPerson,
    breathing,
    closing,
    depths,
    face_shapes,
    head_follow,
    lid_motion,
    lid_ways,
)
from tts2face.photo.spreading import Spreading
from tts2face.photo.steps import BREATH, Filled, HeadModel, Laid, Pictured, Skinned, Traced, after
from tts2face.photo.surface import (
    EYES,
    LASHES,
    LID_OVER_EYE,
    LIDS,
    SKIN,
    PhotoPages,
    PhotoSurface,
    Vertices,
    between_vertices,
    lay_pages,
    moves,
    place_landmarks,
)
from tts2face.photo.teeth import OwnTeeth, find_teeth, teeth_and_tongue

SMILE_KEPT = 0.6  # of a smile with parted lips, while they speak
INTO_LIP = 0.012  # of the eye distance, by which the edges of parted lips are taken from within the lip
SHADE_MM, EYE_SHADE = 2.0, 0.5  # way back of an eye in a blink, and the share of its light that the lids take
N_NEAR = 6  # vertices of the skin around a place behind it
FOLLOW_STEPS = 255  # of the share of the head's motion, as files hold it


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
    model, picture, found = HeadModel.of(head), seen.picture, seen.found
    pixels, scale = picture.pixels, found.eye_distance_px
    camera = find_camera(found, model.landmarks)
    landmarks = camera.depths_of(found.landmarks)
    line = find_lips(pixels, found)
    given = PhotoPlaces(fit, (pixels.shape[1], pixels.shape[0]), picture.reduced_by, scale)
    lips = given.lips(replace(line, upper=camera.depths_of(line.upper), lower=camera.depths_of(line.lower)))
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
    return after(Skinned, face, mesh=mesh, photo=photo, skin=skin, creases=creases)


def _picture_eyes_and_teeth(face: Skinned, teeth: OwnTeeth | None) -> Pictured:
    """Pictures of what opens behind lids and lips, on pages beside the picture of what moves."""
    pixels, person = face.pixels, face.person
    patches = eye_patches(pixels, face.landmarks, face.lids, person.scale)
    if teeth is None:
        teeth = find_teeth(pixels, face.seen.found, person.lips, face.camera, face.model.head)
    if teeth is not None:
        teeth = teeth.in_light_of(cheek_light(pixels, face.landmarks))
    frames = [LidFrame.of(face.landmarks, face.lids, eye, person.scale) for eye in (0, 1)]
    shut = [shut_eye(pixels, frame) for frame in frames]
    of_lids = [picture for eye in shut for picture in (eye.picture, eye.lashes)]
    pictures: list[EyePatch | LidPicture | OwnTeeth] = [*of_lids, *patches[0], *patches[1]]
    if teeth is not None:
        pictures.append(teeth)
    darkened = darken_lip_edges(pixels, person.lips, person.scale)
    pages = lay_pages(darkened, face.mesh, moves(face.skin), pictures)
    return after(Pictured, face, patches=patches, teeth=teeth, frames=frames, shut=shut, pages=pages)


def _lay_surface(face: Pictured) -> Laid:
    """The parts in the order in which they are drawn, those of the skin first."""
    mesh, pages, surface = face.mesh, face.pages, PhotoSurface()
    surface.add(face.skin, uv=pages.uv(_shown_places(mesh, face.person)))
    surface.parts.append((SKIN, mesh.triangles))
    of_lids = [rows for eye in (0, 1) for rows in _add_lids(face, surface, eye)]
    shaded = []
    eyes, corners_of = [], iter(pages.patch_corners[2 * len(face.shut) :])
    for eye, parts in enumerate(face.patches):
        for patch in parts:
            vertices = _eye_vertices(face, patch.places, patch.ahead_mm)
            for name, way in gaze_shapes(face.model.head, patch.turning, eye).items():
                vertices.shapes[face.model.names.index(name)] = way
            way = np.tile((0.0, 0.0, -SHADE_MM), (len(patch.places), 1))
            _blink(face, vertices, eye, way)
            rows = surface.add(vertices, uv=pages.uv(patch.places, next(corners_of)))
            shaded.append(Changing(rows, way, -EYE_SHADE * patch.colours()))
            surface.parts.append((EYES, rows[_before_person(patch, face.seen.picture)]))
            if patch is parts[0]:  # the others are catchlights before it
                eyes.append((patch, rows))
    margins = [_add_margin(face, surface, eye) for eye in (0, 1)]
    corners, weights = place_landmarks(mesh, face.landmarks, eyes, margins)
    joined = Changing(
        *(np.concatenate([getattr(rows, column.name) for rows in (*of_lids, *shaded)]) for column in fields(Changing))
    )
    return after(Laid, face, surface=surface, corners=corners, weights=weights, lashes=joined)


def _add_lids(face: Pictured, surface: PhotoSurface, eye: int) -> list[Changing]:
    """Add what comes over an eye that shuts; returns vertices of lid and lashes, whose colours change on their way."""
    mesh, frame = face.mesh, face.frames[eye]
    own, of_lashes = face.pages.patch_corners[2 * eye : 2 * eye + 2]

    shut, changing = face.shut[eye], []

    def add(part: str, sheet: LidSheet, vertices: Vertices, way: FloatArray, uv: FloatArray) -> IntArray:
        _blink(face, vertices, eye, way)
        numbers = surface.add(vertices, uv=uv)
        surface.parts.append((part, numbers[sheet.triangles]))
        return numbers

    def forward(places: FloatArray, mm: FloatArray | float) -> FloatArray:
        photo = np.column_stack([places, np.zeros(len(places))])
        nearer = np.column_stack([places, np.broadcast_to(mm * face.camera.scale, len(places))])
        return face.camera.to_head(nearer) - face.camera.to_head(photo)

    for sheet in sheets_over_skin(frame):
        skin = face.skin.between(*between_vertices(mesh, sheet.places))
        placed = replace(skin, places=skin.places - forward(sheet.places, FORWARD_MM * sheet.come))
        way = forward(sheet.places, FORWARD_MM)
        numbers = add(LIDS, sheet, placed, way, face.pages.uv(sheet.places, own))
        changing.append(Changing(numbers, way, shut.light_at(sheet.places)))
    sheet = sheet_over_eye(frame)
    over = _eye_vertices(face, sheet.places, 0.0)
    over = replace(over, places=over.places - forward(sheet.places, EYE_FORWARD_MM * sheet.come))
    way = forward(sheet.places, EYE_FORWARD_MM)
    numbers = add(LID_OVER_EYE, sheet, over, way, face.pages.uv(sheet.places, own))
    changing.append(Changing(numbers, way, shut.light_at(sheet.places)))
    upper = mesh.upper_lids[eye]
    rows = np.stack([*(np.concatenate([upper[:1], row, upper[-1:]]) for row in mesh.bands[eye][::-1]), upper])
    sheet = LidSheet.of(mesh.places[rows], np.zeros(rows.shape))
    skin = face.skin.at(rows.ravel())
    placed = replace(skin, places=skin.places - forward(sheet.places, LASHES_MM))
    way = np.tile(face.camera.ways_to_head(lid_ways(mesh, eye)[0]), (len(rows), 1)) + forward(sheet.places, FORWARD_MM)
    shown = sheet.places + LASHES_INTO * frame.scale * frame.up
    numbers = add(LASHES, sheet, placed, way, face.pages.uv(shown, of_lashes))
    return [*changing, Changing(numbers, way, shut.change.reshape(-1, 3))]


def _add_margin(face: Pictured, surface: PhotoSurface, eye: int) -> IntArray:
    """Add the margin (25,) of an upper lid, which no triangle shows: it moves as the lashes do, and not forward."""
    margin = face.skin.at(face.mesh.upper_lids[eye])
    _blink(face, margin, eye, face.camera.ways_to_head(lid_ways(face.mesh, eye)[0]))
    return surface.add(margin)


def _blink(face: Pictured, vertices: Vertices, eye: int, way: FloatArray) -> None:
    """Add a way (N, 3), mm, to what moves vertices (N,) in a blink of an eye, and a share of it as the gaze does."""
    for name, share in (("eyeBlink", 1.0), ("eyeLookDown", LOOK_DOWN), ("eyeLookUp", LOOK_UP)):
        vertices.shapes[face.model.names.index(f"{name}{SIDES[eye]}")] += share * way


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
        lit=[_add_inside(surface, part, pages) for part in (*inside, walls) if part.texels is None],
        dark=light.dark,
    )
    return after(Filled, face, mouth=mouth, teeth_edge=edge)


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
            picture_light(face.pixels, face.pages.pages, skin, drawn, face.mouth, face.lashes),
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


def _skin(mesh: PhotoMesh, person: PhotoPerson, camera: PhotoCamera, model: HeadModel) -> tuple[FloatArray, Vertices]:
    """Pixels and depths (V, 3) of the picture, and vertices of its skin with closed lips."""
    spreading = Spreading(mesh.places, mesh.triangles, person.scale)
    found = face_shapes(mesh, spreading, model.motion(), person)
    follow = head_follow(mesh, person)
    for eye, side in enumerate(SIDES):
        shut, lowered = (camera.ways_to_head(way) for way in lid_motion(mesh, spreading, person, eye))
        found[f"eyeBlink{side}"] = shut
        found[f"eyeLookDown{side}"], found[f"eyeLookUp{side}"] = LOOK_DOWN * shut, LOOK_UP * (shut + lowered)
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


def _eye_vertices(face: Pictured, places: FloatArray, ahead_mm: float) -> Vertices:
    """Vertices without motion at places (N, 2), behind the skin around them, or some way before that."""
    away, near = cKDTree(face.photo[:, :2]).query(places, N_NEAR)
    shares = 1 / (np.asarray(away) + 1)
    depth = (face.photo[near, 2] * shares).sum(axis=1) / shares.sum(axis=1) + (
        ahead_mm - EYE_BEHIND_MM
    ) * face.camera.scale
    still = np.zeros((len(face.model.names), len(places), 3))
    return Vertices(face.camera.to_head(np.column_stack([places, depth])), still, np.ones(len(places)))


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
