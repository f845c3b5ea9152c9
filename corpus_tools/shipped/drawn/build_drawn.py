"""The drawn characters, from MakeHuman's mesh alone."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.drawn.brows import brow_piece
from corpus_tools.shipped.drawn.character import DrawnCharacter
from corpus_tools.shipped.drawn.clothes import breath, stud_pieces, sweater_piece
from corpus_tools.shipped.drawn.elder import ELDER
from corpus_tools.shipped.drawn.expressions import close_jaw, part_lips, rest_in, round_lips, soften, thin_lips
from corpus_tools.shipped.drawn.girl import GIRL
from corpus_tools.shipped.drawn.glasses import glasses_piece
from corpus_tools.shipped.drawn.hair import OtherHair, hair_cover, hair_piece, other_palettes
from corpus_tools.shipped.drawn.lash_bands import lash_piece
from corpus_tools.shipped.drawn.lids import find_lining, shut_lids, still_lining, tuck_lining
from corpus_tools.shipped.drawn.man import MAN
from corpus_tools.shipped.drawn.paint import paint_eye, paint_skin, vertex_masks
from corpus_tools.shipped.drawn.people import REALISTIC_MAN, REALISTIC_WOMAN
from corpus_tools.shipped.drawn.sculpt import drawn_cage
from corpus_tools.shipped.drawn.teeth import teeth_pieces
from corpus_tools.shipped.drawn.woman import WOMAN
from corpus_tools.shipped.head.build_head import METADATA, shape_names
from corpus_tools.shipped.head.cage import Cage, build_cage
from corpus_tools.shipped.head.correspondence import add_landmarks
from corpus_tools.shipped.head.eyes import eyeball_piece, fit_eyeballs
from corpus_tools.shipped.head.head import PIVOT, REFERENCE_PERSON, ReferenceHead, skin_piece
from corpus_tools.shipped.head.jaw import fit_jaw
from corpus_tools.shipped.head.lid_edges import find_lid_edges, wet_piece
from corpus_tools.shipped.head.lips import close_lips, lip_ring
from corpus_tools.shipped.head.parts import Eyeball, HeadPart, HeadPieces, assemble_face
from corpus_tools.shipped.head.shapes import LID_SHAPES, clear_eyeballs, correct_shapes
from corpus_tools.shipped.head.shirt import shirt_piece
from corpus_tools.shipped.head.skin import HeadSkin, build_shoulders, build_skin
from corpus_tools.shipped.head.source import SourceMesh
from corpus_tools.shipped.head.tongue import tongue_piece
from corpus_tools.shipped.head.tongue_out import give_way
from corpus_tools.training.calibrate_file import calibrate_face_file
from tts2face.face.breathing import BREATH_SHAPE
from tts2face.face.hair_swing import LIMIT_RAD
from tts2face.face.pupils import PUPIL_SHAPE
from tts2face.models.face import Face, Hairdo, Texture
from tts2face.models.face_file import write_face
from tts2face.models.lit_hair import SWING_SHAPES

CAST: Mapping[str, DrawnCharacter] = {
    item.name: item for item in (WOMAN, MAN, ELDER, GIRL, REALISTIC_WOMAN, REALISTIC_MAN)
}
CLEAR_MM = 0.6  # between lid and eyeball: the edges of stretched lids are 6 mm long and sink between vertices
BODY_SHAPES = (BREATH_SHAPE, *SWING_SHAPES, PUPIL_SHAPE)
BODY_LIMITS = ((0.0, 1.0), *[(-LIMIT_RAD, LIMIT_RAD)] * len(SWING_SHAPES), (-1.0, 1.0))
NO_TEXTURE = Texture(np.zeros((4, 4, 3), np.uint8))  # in place of the cards of brows and lashes


def drawn_face(source: SourceMesh, character: DrawnCharacter) -> Face:
    """The face of a character, without score map."""
    reference, cage, balls, skin = _sculpted(source, character)
    pieces = [_breathing(piece) for piece in _pieces(cage, skin, reference, balls, character)]
    built = HeadPieces(tuple(pieces), (1, 2), balls, PIVOT)
    lips = skin.vertices[reference.lips]
    mouth_y = float(lips[np.abs(lips[:, 0]) < 6, 1].mean())
    hair = hair_cover(skin, character.hair)
    textures = (
        Texture(paint_skin(source, skin, reference.lids, character, mouth_y, hair)),
        NO_TEXTURE,
        Texture(paint_eye(character.eyes, character.palette)),
    )
    about = {"name": character.name, "summary": character.summary, **METADATA}
    face = assemble_face(built, [*shape_names(cage), *BODY_SHAPES], textures, about)
    limits = face.limits.copy()
    limits[-len(BODY_SHAPES) :] = BODY_LIMITS
    return give_way(add_landmarks(_centred(replace(face, limits=limits)), skin.base))


def own_hairdo(character: DrawnCharacter) -> Hairdo:
    """Haircut and hair colour of a character; its face has them once it has the light of its hair, and others fit."""
    colour = "#" + "".join(f"{round(255 * share):02x}" for share in character.palette.hair)
    return Hairdo(character.hair.name, colour)


def other_hair(source: SourceMesh, character: DrawnCharacter) -> OtherHair:
    """The hair of a character in other colours."""
    skin = _sculpted(source, character)[-1]
    others = other_palettes(character.palette)
    painted = [hair_piece(skin, character.hair, palette).colours for palette in others]
    known = [palette.hair for palette in (character.palette, *others)]
    return OtherHair(np.rint(255 * np.clip(painted, 0, 1)).astype(np.uint8), np.array(known, np.float32))


def _sculpted(
    source: SourceMesh, character: DrawnCharacter
) -> tuple[ReferenceHead, Cage, tuple[Eyeball, Eyeball], HeadSkin]:
    """A person's head for reference, and a character's cage, eyeballs and skin."""
    reference = _reference(source)
    cage = drawn_cage(source, character.targets, character.proportions)
    balls = fit_eyeballs(cage, character.eyes)
    return reference, cage, balls, _skin(build_skin(cage), reference, balls, character)


def _centred(face: Face) -> Face:
    """The face with its origin midway between its eyes."""
    middle = np.mean([eye.centre for eye in face.eyes], axis=0)
    eyes = tuple(replace(eye, centre=eye.centre - middle) for eye in face.eyes)
    return replace(face, vertices=face.vertices - middle, eyes=eyes, pivot=face.pivot - middle)


def _breathing(piece: HeadPart) -> HeadPart:
    moved = breath(piece.vertices)
    return replace(piece, shapes={**piece.shapes, BREATH_SHAPE: moved}) if moved.any() else piece


def face_masks(source: SourceMesh, face: Face) -> dict[str, NDArray[np.float64]]:
    """Shares (V,) of a character's vertices that are lips and the inside of the mouth, for its film light."""
    where = build_skin(build_cage(source, {})).source_uv  # the same for everybody
    masks = vertex_masks(source, where, face.vertices[: len(where), 2].astype(np.float64))
    n_others = len(face.vertices) - len(where)
    return {name: np.append(share, np.zeros(n_others)) for name, share in masks.items()}


def _reference(source: SourceMesh) -> ReferenceHead:
    """A person's head, on which lips, lids and shirt are found; it has no cards."""
    cage = build_cage(source, REFERENCE_PERSON)
    skin = build_skin(cage)
    lids = find_lid_edges(skin, fit_eyeballs(cage))
    return ReferenceHead(cage, skin, build_shoulders(cage), lip_ring(skin), lids, {}, {})


def _skin(
    own: HeadSkin, reference: ReferenceHead, balls: tuple[Eyeball, Eyeball], character: DrawnCharacter
) -> HeadSkin:
    """The skin of a character, with its expressions, and its slight smile at rest."""
    shut = shut_lids(correct_shapes(close_lips(own, reference.lips)), balls, reference.lids)
    skin = round_lips(soften(shut, reference.lids, reference.lips), character.pucker)
    skin = thin_lips(skin, reference.lips, character.still_lip)
    skin = part_lips(close_jaw(skin, reference.lips), reference.lips)
    lining = find_lining(skin, balls, -0.1)
    others = [name for name in LID_SHAPES if name != "eyeBlink"]  # that one lies on the eyeball already
    skin = tuck_lining(clear_eyeballs(skin, balls, others, CLEAR_MM, lining), balls, lining)
    return rest_in(still_lining(skin, balls), character.rest, balls)


def _pieces(
    cage: Cage, skin: HeadSkin, reference: ReferenceHead, balls: tuple[Eyeball, Eyeball], character: DrawnCharacter
) -> tuple[HeadPart, ...]:
    palette, jaw = character.palette, fit_jaw(cage)
    wet = wet_piece(skin, balls, reference.lids)
    upper, lower = teeth_pieces(cage, skin, reference, jaw, character)
    shirt = shirt_piece(reference.shoulders, build_shoulders(cage), np.array(palette.cloth))
    return (
        skin_piece(skin, palette.skin, character.skin_material),
        *(eyeball_piece(ball, side, character.eyes) for ball, side in zip(balls, ("Left", "Right"), strict=True)),
        upper,
        lower,
        tongue_piece(cage, jaw),
        replace(wet, colours=wet.colours * palette.tear_line),
        *(() if character.brow.hairs else (brow_piece(skin, character.brow, palette.brows),)),
        lash_piece(skin, reference.lids, balls, character.lashes, palette.lashes),
        sweater_piece(shirt, character.collar, palette.cloth),
        *(stud_pieces(skin) if character.has_studs else ()),
        *(() if character.glasses is None else (glasses_piece(balls, character.glasses),)),
        hair_piece(skin, character.hair, palette),  # last: another haircut takes its place
    )


def build_character(source: SourceMesh, character: DrawnCharacter, out: Path, report: Callable[[str], None]) -> None:
    """Write a character, calibrated, into a file; `report` gets the name of each step."""
    report(f"{character.name}: shape")
    face = drawn_face(source, character)
    write_face(out, face)
    report(f"{character.name}: calibration")
    calibrate_face_file(str(out), out)
