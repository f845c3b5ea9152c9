"""Import of a character of another program as a face: ``tts2face face import``."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from hashlib import sha256
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.face.mesh_calibration import calibrate_on_mesh, strengths
from tts2face.face.mouth_bag import close_mouth
from tts2face.face.shape_transfer import eye_distance
from tts2face.face.stand_in import VISEME_PREFIX
from tts2face.interchange.characters.binding import KEY, CharacterBinding
from tts2face.interchange.characters.character import Character
from tts2face.interchange.characters.eyeballs import mark_eyeballs
from tts2face.interchange.characters.fitting import drop_unsuited_shapes, missing_shapes, place_face
from tts2face.interchange.characters.gltf_reader import read_gltf_character
from tts2face.interchange.characters.head_mesh import HeadMesh, build_head_mesh, moved_box, source_weights
from tts2face.interchange.characters.import_notes import colour_notes, name_notes, place_notes, pose_notes, some_of
from tts2face.interchange.characters.landmark_table import read_landmark_table
from tts2face.interchange.characters.landmarks import (
    SKIN,
    CharacterViews,
    LocatedLandmarks,
    locate_landmarks,
    part_triangles,
)
from tts2face.interchange.characters.obj_reader import OBJ, read_obj, read_obj_folder
from tts2face.interchange.characters.shape_names import guess_mapping, with_combinations
from tts2face.interchange.characters.shapes import TRANSFER, ShapeMapping, read_mapping
from tts2face.interchange.characters.surface import (
    Placement,
    add_gaze_shapes,
    build_face,
    unwrap,
)
from tts2face.interchange.characters.surface_points import SurfacePoints, nearest_points
from tts2face.interchange.characters.transfer.first_look import find_head, placed_head
from tts2face.interchange.characters.transfer.tracked import locate_bare_landmarks
from tts2face.interchange.characters.transfer.transfer import transfer_shapes
from tts2face.interchange.characters.two_way import with_directions
from tts2face.interchange.gltf.reader import SUFFIXES
from tts2face.models.face import WIDE_OPEN, Face
from tts2face.models.landmarks import N_MESH_LANDMARKS
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.occlusion import bake_occlusion
from tts2face.processes.threads import available_cores
from tts2face.types import Progress, ignore_progress
from tts2face.video.tracking import MIN_SCORE

WEAK_JAW_SHARE = 0.1  # of the largest motion by a viseme
FRONTS = {"+z": 0.0, "-z": 180.0, "+x": -90.0, "-x": 90.0}  # axis that a character looks along -> turn, degrees
NO_LANDMARKS = LocatedLandmarks(np.zeros(0, np.int64), SurfacePoints(np.zeros((0, 3), np.int64), np.zeros((0, 3))), 0.0)
WITHOUT_LANDMARKS = (
    "no face is recognised in its pictures, so speech and gestures give its shapes the weights of the default head, by "
    "name; if it has a human face, give `tts2face face import` the axis that it looks along with --front, or its "
    "landmarks with --landmarks"
)
N_STEPS = 10  # of a transfer's progress
PROVISIONAL_HEIGHT_MM = 150.0  # of the moved part of a face, until the distance of its eyes is known


@dataclass(frozen=True, slots=True, eq=False)
class ImportReport:
    """Report of an import: how much it found and did.

    Parameters
    ----------
    mapping
        Morph targets or expressions that each shape of the face uses.
    unused
        Names of the character that no shape uses.
    missing
        ARKit shapes that the character lacks -> what replaces them.
    landmarks
        Position (3,) of each landmark in the units and axes of the file.
    score
        Mean score of the face tracker, 0 to 1; None for landmarks of a table.
    n_eyeballs
        Eyeballs that gaze turns.
    notes
        What was changed or left out, in sentences.
    licence
        What the file says about its licence and author.
    strengths
        Weight of the default head's shape of the same name that moves its mouth as weight 1 of a shape does.
    carried_from, n_carried
        Shipped face whose shapes were carried over, and how many of them move something; "" and 0 without.
    """

    mapping: ShapeMapping
    unused: tuple[str, ...]
    missing: Mapping[str, str]
    landmarks: Mapping[int, NDArray[np.float64]]
    score: float | None
    n_eyeballs: int
    notes: tuple[str, ...]
    licence: str
    strengths: Mapping[str, float]
    carried_from: str = ""
    n_carried: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class ImportedFace:
    """A face made from a character, and the report of its import."""

    face: Face
    report: ImportReport


def read_character(path: Path) -> Character:
    """Character of a .glb, .gltf or .vrm file, of an .obj file, or of a folder of .obj files."""
    if path.is_dir():
        return read_obj_folder(path)
    if not path.exists():
        raise InputError(f"there is no character {path}; check the path")
    if path.suffix.lower() == OBJ:
        return read_obj(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"a character is a {', '.join((*SUFFIXES, OBJ))} file or a folder of .obj files, not {path.name}; export "
            "it as .glb (docs/examples.md has a program that makes one of an .fbx file; Blender opens .ply and .stl)"
        )
    return read_gltf_character(path)


def propose_mapping(character: Character) -> ShapeMapping:
    """Mapping guessed from the names of a character's morph targets and expressions that move it.

    A jaw that moves next to nothing beside the visemes is none: the character speaks by these.
    """
    return with_combinations(with_directions(_named_mapping(character), character), character.moving_names)


def _named_mapping(character: Character) -> ShapeMapping:
    names = character.moving_names
    mapping = guess_mapping(names)
    jaw = {source.name for source in mapping.get(WIDE_OPEN, ())}
    by_visemes = guess_mapping([name for name in names if name not in jaw]) if jaw else mapping
    visemes = {s.name for shape, sources in by_visemes.items() if shape.startswith(VISEME_PREFIX) for s in sources}
    reach = max(map(character.reach, jaw), default=0.0)
    return by_visemes if reach < WEAK_JAW_SHARE * max(map(character.reach, visemes), default=0.0) else mapping


def import_face(  # noqa: PLR0913 - one parameter an option
    path: str | Path,
    *,
    mapping: str | Path | ShapeMapping | None = None,
    landmarks: str | Path | None = None,
    front: str | None = None,
    shapes: str | None = None,
    model: Path | None = None,
    on_progress: Progress = ignore_progress,
) -> ImportedFace:
    """Make a face of a character's file.

    Parameters
    ----------
    path
        .glb, .gltf, .vrm or .obj file, or a folder with ``neutral.obj`` and one .obj file for each shape.
    mapping
        Mapping or its file (.tsv or .toml), which replaces the guess for the shapes that it names.
    landmarks
        Table of landmark positions (.tsv); without it the face is tracked in rendered views (extra ``[capture]``).
    front
        Axis that the character looks along: ``+z``, ``-z``, ``+x`` or ``-x``; by default the one where a face is
        recognised.
    shapes
        ``transfer`` gives the character the shapes of a shipped head, whatever shapes it has; by default its own.
    model
        Path of ``face_landmarker.task``.
    on_progress
        Called after each step of a transfer.

    Raises
    ------
    InputError
        A path does not exist, or an option is unknown or has no effect.
    DataError
        A file is damaged, or the character has no shape that moves its mouth, or no face is recognised.
    BackendError
        The face tracker is not installed.

    Examples
    --------
    >>> imported = import_face("character.glb")  # doctest: +SKIP
    >>> sorted(imported.report.missing)  # doctest: +SKIP
    ['tongueOut']
    """
    path = Path(path)
    if front is not None and front not in FRONTS:
        raise InputError(f"there is no front {front!r}; choose {', '.join(FRONTS)}")
    is_transferred = _is_transfer(shapes, mapping)
    made_of: dict[str, Any]
    character = read_character(path)
    chosen = {} if is_transferred else _complete_mapping(character, mapping)
    table = None if landmarks is None else read_landmark_table(Path(landmarks))
    step = _step_counter(on_progress)
    if is_transferred:
        (head, provisional), views = _shapeless_head(character, front, table, model), None
        step()
    elif table is None:
        head, provisional, views = _find_front(_turned_heads(character, chosen, front), character, model)
    else:
        head = next(_turned_heads(character, chosen, front))
        provisional, views = _provisional_placement(head), None
    drawn = build_face(head, character, provisional) if views is None else views.face
    located = _project_table(table, head, drawn) if table is not None else _track(drawn, views, model)
    face = place_face(_with_landmarks(drawn, located), character, head, provisional)
    step()
    if is_transferred:
        carried = transfer_shapes(face, is_tracked=table is None, on_step=step)
        face, made_of = calibrate_on_mesh(carried.face), {"shapes_from": carried.source}
        notes = list(carried.notes)
    else:
        notes = [WITHOUT_LANDMARKS]
        if located is not NO_LANDMARKS:
            face, notes = drop_unsuited_shapes(face)
            face = calibrate_on_mesh(face)
        made_of = {KEY: _binding(path, chosen, head, face).as_metadata()}
    face = replace(face, metadata=_provenance(path, character) | made_of)
    face = bake_occlusion(close_mouth(face), available_cores())
    step()
    positions = located.points.places(drawn.vertices) / provisional.scale + provisional.origin
    places = dict(zip(located.numbers.tolist(), positions @ head.turn, strict=True))
    report = ImportReport(
        mapping={name: sources for name, sources in chosen.items() if name in face.shape_names},
        unused=_unused_names(character, chosen),
        missing=missing_shapes(face),
        landmarks=places,
        score=None if table is not None or located is NO_LANDMARKS else located.score,
        n_eyeballs=len(face.eyes),
        notes=(
            *character.notes,
            *name_notes(character, chosen),
            *pose_notes(character, chosen),
            *colour_notes(character, head),
            *notes,
            *(place_notes(head.turn, places, eye_distance(face)) if is_transferred and table is None else ()),
        ),
        licence=character.licence,
        strengths=strengths(face) if located is not NO_LANDMARKS else {},
        carried_from=made_of.get("shapes_from", ""),
        n_carried=int(face.shapes.any(axis=(1, 2)).sum()) if is_transferred else 0,
    )
    return ImportedFace(face, report)


def _complete_mapping(character: Character, given: str | Path | ShapeMapping | None) -> ShapeMapping:
    """The guessed mapping with the given rows in its place, without shapes that have no source."""
    mapping = dict(propose_mapping(character))
    if given is not None:
        rows = given if isinstance(given, Mapping) else read_mapping(Path(given))
        known = {*character.target_names.values(), *character.expressions}
        unknown = [source.name for sources in rows.values() for source in sources if source.name not in known]
        if unknown:
            raise InputError(f"the character has no shape {unknown[0]!r}; it has: {some_of(sorted(known))}")
        mapping |= rows
    mapping = {
        name: sources
        for name, sources in mapping.items()
        if any(source_weights(character, source) for source in sources)
    }
    if not any(name.startswith(("jaw", "mouth")) for name in mapping):
        raise DataError(_without_mouth(character))
    return mapping


def _without_mouth(character: Character) -> str:
    """Why speech cannot move a character's mouth, and what to do about it."""
    names = sorted({*character.target_names.values(), *character.expressions})
    vowels = [source.name for sources in guess_mapping(character.painted).values() for source in sources]
    if vowels:
        return (
            f"the character's mouth is painted: {some_of(sorted(set(vowels)))} exchange textures or colours and move "
            "no vertex, so speech cannot move it; take a character whose mouth has shapes, or, if its mesh has lips, "
            "carry over those of a shipped head with --shapes transfer"
        )
    empty = f"; {some_of(character.still_names)} move no vertex" if character.still_names else ""
    return (
        "the character has no shape of a known name that moves its mouth, so speech cannot move it; "
        "carry over those of a shipped head with --shapes transfer, or name its shapes in a file and give it as "
        f"--mapping; it has: {some_of(names)}{empty}"
    )


def _is_transfer(shapes: str | None, mapping: object) -> bool:
    if shapes is not None and shapes != TRANSFER:
        raise InputError(f"there are no shapes {shapes!r}; choose {TRANSFER}, or leave --shapes out for its own")
    if shapes == TRANSFER and mapping is not None:
        raise InputError("--mapping has no effect with --shapes transfer; remove one of them")
    return shapes == TRANSFER


def _step_counter(on_progress: Progress) -> Callable[[], None]:
    done = count(1)
    return lambda: on_progress(min(next(done), N_STEPS), N_STEPS)


def _shapeless_head(
    character: Character, front: str | None, table: Mapping[int, FloatArray] | None, model: Path | None
) -> tuple[HeadMesh, Placement]:
    """Head of a character without its own shapes."""
    fronts = _turns(character, front)
    found = find_head(character, fronts, model) if table is None else placed_head(character, fronts[0], table)
    return found.mesh, found.placement


def _turns(character: Character, front: str | None) -> list[float]:
    """Turns from the given axis, or from each one, the likely one first, degrees."""
    likely = ["-z", "+z"] if character.faces_back else ["+z", "-z"]
    return [FRONTS[axis] for axis in ([front] if front is not None else [*likely, "+x", "-x"])]


def _turned_heads(character: Character, mapping: ShapeMapping, front: str | None) -> Iterator[HeadMesh]:
    """Heads turned to look along z from the given axis, or from each axis, the likely one first."""
    for turn in _turns(character, front):
        head = build_head_mesh(character, mapping, turn)
        yield add_gaze_shapes(mark_eyeballs(unwrap(head, character), character))


def _provisional_placement(head: HeadMesh) -> Placement:
    low, high = moved_box(head)
    return Placement((low + high) / 2, PROVISIONAL_HEIGHT_MM / float(high[1] - low[1]))


def _find_front(
    candidates: Iterator[HeadMesh], character: Character, model: Path | None
) -> tuple[HeadMesh, Placement, CharacterViews]:
    """The first head in whose frontal view the tracker sees a face, otherwise the one with the highest score."""
    scored: list[tuple[float, tuple[HeadMesh, Placement, CharacterViews]]] = []
    for head in candidates:
        placement = _provisional_placement(head)
        views = CharacterViews(build_face(head, character, placement), model)
        scored.append((views.frontal_score(), (head, placement, views)))
        # a face that the tracker reads: the other fronts need not be drawn
        if scored[-1][0] >= MIN_SCORE:
            break
    return max(scored, key=lambda found: found[0])[1]


def _track(drawn: Face, views: CharacterViews | None, model: Path | None) -> LocatedLandmarks:
    """Landmarks found in pictures; in those of a head without shapes where there are no views of its shapes."""
    return locate_bare_landmarks(drawn, model) if views is None else locate_landmarks(views) or NO_LANDMARKS


def _project_table(table: Mapping[int, NDArray[np.float64]], head: HeadMesh, drawn: Face) -> LocatedLandmarks:
    numbers = np.array(sorted(table), np.int64)
    places = np.stack([table[int(number)] for number in numbers]) @ head.turn.T
    is_skin = numbers < N_MESH_LANDMARKS
    skin = part_triangles(drawn, SKIN)
    triangles = np.asarray(head.triangles if not len(skin) else skin, np.int64)
    points = nearest_points(places, head.vertices, triangles)
    if not is_skin.all():
        irises = nearest_points(places[~is_skin], head.vertices, drawn.triangles.astype(np.int64))
        points.vertices[~is_skin], points.weights[~is_skin] = irises.vertices, irises.weights
    return LocatedLandmarks(numbers, points, 1.0)


def _with_landmarks(face: Face, located: LocatedLandmarks) -> Face:
    return replace(
        face,
        landmarks=located.numbers.astype(np.int32),
        landmark_vertices=located.points.vertices.astype(np.int32),
        landmark_weights=located.points.weights.astype(np.float32),
    )


def _unused_names(character: Character, mapping: ShapeMapping) -> tuple[str, ...]:
    used = {source.name for sources in mapping.values() for source in sources}
    names = dict.fromkeys([*character.target_names.values(), *character.expressions])
    return tuple(name for name in names if name not in used)


def _binding(path: Path, mapping: ShapeMapping, head: HeadMesh, face: Face) -> CharacterBinding:
    """Place, scale and names by which the face's animation is written onto the character's file."""
    scale = float(np.ptp(face.vertices[:, 1]) / np.ptp(head.vertices[:, 1]))
    origin = head.vertices[0] - face.vertices[0].astype(np.float64) / scale
    digest = "" if path.is_dir() else sha256(path.read_bytes()).hexdigest()
    yaw_deg = float(np.degrees(np.arctan2(head.turn[0, 2], head.turn[0, 0])))
    x, y, z = (float(value) for value in origin)
    return CharacterBinding(str(path.resolve()), digest, round(yaw_deg, 3), scale, (x, y, z), mapping)


def _provenance(path: Path, character: Character) -> dict[str, Any]:
    return {
        "name": path.stem,
        "licence": character.licence or "not stated by the character's file",
        "attribution": "",
    }
