"""Head mesh with blend shapes, skeleton and animation as USD (UsdSkel), by usd-core (extra ``[usd]``).

Millimetres (``metersPerUnit`` 0.001), y up, the face looks along +z. Time code i is frame i; the last frame holds up to
the end of the sound. Textures lie beside the file; a .usdz file holds them.
"""

import errno
import importlib
import os
import re
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError, import_of_extra
from tts2face.interchange.exports.parts import Part, Target
from tts2face.interchange.exports.plain_face import plain_face
from tts2face.interchange.exports.skeleton import HEAD, Skeleton, build_skeleton
from tts2face.interchange.exports.surfaces import (
    ExportSurface,
    divide_surface,
    linear_colours,
    morph_targets,
    vertex_normals,
)
from tts2face.interchange.exports.usd_materials import TextureFiles, define_material
from tts2face.interchange.gltf.container import key_times
from tts2face.models.face import Face
from tts2face.numeric.arrays import decode_srgb
from tts2face.storage.marks import PROGRAM, mark_fields
from tts2face.storage.spool import Spool

# millimetres, as faces have them
METRES_PER_UNIT = 0.001
ROOT_PATH = "/Face"
SINGLE_FILE = ".usdz"
STAGE_IN_IT = "face.usdc"  # its name there: the first file is the one that is opened
DATE_IN_IT = (1980, 1, 1)  # of all files, by the local clock, as USD dates them: equal clips are equal bytes


class UsdWriter:
    """Keeps frames in temporary files, and builds the stage when their number is known.

    USD itself keeps the animation in memory: about 15 MB for ten minutes at 30 frames/s.
    """

    def __init__(self, target: Target) -> None:
        if target.face is None:
            raise InputError(f"{target.name} holds the mesh of the face; give the face, as in face=session.face")
        self._usd = _UsdModules()
        self._target, self._face = target, plain_face(target.face)
        self._skeleton = build_skeleton(target.face, len(target.channels))
        self._targets = morph_targets(target.face, target.channels)
        self._weights, self._places = Spool(len(self._targets.names)), Spool(3)
        self._turns = [Spool(4) for _ in self._skeleton.names[HEAD:]]
        self._end_s = 0.0
        self._folder: tempfile.TemporaryDirectory[str] | None = None
        if target.name.lower().endswith(SINGLE_FILE):
            self._folder = tempfile.TemporaryDirectory(prefix="tts2face-")
            target = replace(target, name="face", beside=Path(self._folder.name).joinpath)
        self._surfaces = divide_surface(self._face)
        self._textures = TextureFiles(target, self._face, self._surfaces)

    def add(self, part: Part) -> None:
        """Append frames."""
        self._end_s = max(self._end_s, part.end)
        self._weights.add(self._targets.weights(part.motion))
        self._places.add(self._skeleton.head_places(part.head))
        self._turns[0].add(self._skeleton.head_rotations(part.head))
        for eye, spool in enumerate(self._turns[1:]):
            spool.add(self._skeleton.eye_rotations(part.motion, eye))

    def finish(self) -> None:
        """Write the file, as text, crate or package by the suffix of its name."""
        usd, target = self._usd, self._target
        stage = usd.Usd.Stage.CreateInMemory()
        stage.SetMetadata("metersPerUnit", METRES_PER_UNIT)
        stage.SetMetadata("upAxis", "Y")
        stage.SetTimeCodesPerSecond(float(target.fps))
        stage.SetFramesPerSecond(float(target.fps))
        stage.SetStartTimeCode(0)
        codes = key_times(self._weights.n_rows, 1.0, self._end_s * float(target.fps)).tolist()
        stage.SetEndTimeCode(codes[-1])
        about = {"sound": target.sound_name, "generator": PROGRAM, **mark_fields(target.mark)}
        stage.GetRootLayer().customLayerData = {name: value for name, value in about.items() if value}
        root = usd.UsdSkel.Root.Define(stage, ROOT_PATH)
        stage.SetDefaultPrim(root.GetPrim())
        names = _identifiers(self._targets.names)
        _define_skeleton(usd, stage, self._skeleton)
        self._define_animation(stage, names, codes)
        for number, surface in enumerate(self._surfaces):
            self._define_surface(stage, surface, number, names)
        textures = self._textures.write()
        suffix = target.name.lower().rpartition(".")[2].replace("usdz", "usdc")
        written = target.path.with_name(f"{target.path.name}.{suffix}")  # USD goes by suffix
        try:
            if not stage.GetRootLayer().Export(str(written)):
                raise OSError(errno.EIO, "USD could not write the file", str(target.path))
            if self._folder is None:
                written.replace(target.path)
            else:
                self._pack({STAGE_IN_IT: written, **textures})
        finally:
            written.unlink(missing_ok=True)

    def _pack(self, files: dict[str, Path]) -> None:
        """Write the files, by their names in it, to one of USD's packages."""
        path = self._target.path
        dated = time.mktime((*DATE_IN_IT, 0, 0, 0, 0, 0, -1))
        for file in files.values():
            os.utime(file, (dated, dated))
        with self._usd.Sdf.ZipFileWriter.CreateNew(str(path)) as package:
            if not all(package.AddFile(str(file), name) for name, file in files.items()):
                raise OSError(errno.EIO, "USD could not write the file", str(path))

    def close(self) -> None:
        """Remove the temporary files."""
        for spool in (self._weights, self._places, *self._turns):
            spool.close()
        if self._folder is not None:
            self._folder.cleanup()

    def _define_animation(self, stage: Any, names: list[str], codes: list[float]) -> None:
        usd = self._usd
        animation = usd.UsdSkel.Animation.Define(stage, f"{ROOT_PATH}/Skeleton/Animation")
        animation.CreateBlendShapesAttr(names)
        joints = _joint_paths(self._skeleton)[HEAD:]
        animation.CreateJointsAttr(joints)
        animation.CreateScalesAttr(usd.Vt.Vec3hArray.FromNumpy(np.ones((len(joints), 3), np.float16)))
        weights = animation.CreateBlendShapeWeightsAttr()
        rotations, translations = animation.CreateRotationsAttr(), animation.CreateTranslationsAttr()
        still = self._skeleton.places[HEAD + 1 :] - self._skeleton.places[HEAD]
        rows = np.asarray(self._weights.rows())
        places = np.asarray(self._places.rows())
        turns = np.stack([np.asarray(spool.rows()) for spool in self._turns], axis=1)
        for number, code in enumerate(codes):
            frame = min(number, len(rows) - 1)
            weights.Set(usd.Vt.FloatArray.FromNumpy(rows[frame].copy()), code)
            rotations.Set(usd.Vt.QuatfArray.FromNumpy(turns[frame].copy()), code)
            moved = np.vstack([places[frame : frame + 1], still]).astype(np.float32)
            translations.Set(usd.Vt.Vec3fArray.FromNumpy(moved), code)

    def _define_surface(self, stage: Any, surface: ExportSurface, number: int, shape_names: list[str]) -> None:
        usd = self._usd
        face = self._face
        skeleton = self._skeleton
        own = surface.vertices
        path = f"{ROOT_PATH}/{re.sub(r'[^A-Za-z0-9_]', '_', f'{surface.part.name}_{number}')}"
        mesh = usd.UsdGeom.Mesh.Define(stage, path)
        mesh.CreatePointsAttr(_vectors(usd, face.vertices[own]))
        mesh.CreateFaceVertexCountsAttr(usd.Vt.IntArray.FromNumpy(np.full(len(surface.triangles), 3, np.int32)))
        mesh.CreateFaceVertexIndicesAttr(usd.Vt.IntArray.FromNumpy(surface.triangles.ravel().astype(np.int32)))
        mesh.CreateNormalsAttr(_vectors(usd, vertex_normals(face)[own]))
        mesh.SetNormalsInterpolation(usd.UsdGeom.Tokens.vertex)
        mesh.CreateSubdivisionSchemeAttr(usd.UsdGeom.Tokens.none)
        mesh.CreateDoubleSidedAttr(True)
        mesh.CreateExtentAttr(usd.UsdGeom.PointBased.ComputeExtent(mesh.GetPointsAttr().Get()))
        mesh.CreateDisplayColorPrimvar(usd.UsdGeom.Tokens.vertex).Set(_vectors(usd, _display_colours(face, surface)))
        material = f"{ROOT_PATH}/Materials/{mesh.GetPrim().GetName()}"
        define_material(usd, stage, mesh, surface, material, self._textures.of(number, surface))
        binding = usd.UsdSkel.BindingAPI.Apply(mesh.GetPrim())
        binding.CreateSkeletonRel().SetTargets([usd.Sdf.Path(f"{ROOT_PATH}/Skeleton")])
        joints = skeleton.joints[own].astype(np.int32).ravel()
        binding.CreateJointIndicesPrimvar(False, 2).Set(usd.Vt.IntArray.FromNumpy(joints))
        weights = skeleton.weights[own].astype(np.float32).ravel()
        binding.CreateJointWeightsPrimvar(False, 2).Set(usd.Vt.FloatArray.FromNumpy(weights))
        used, targets = [], []
        for shape_name, shape in zip(shape_names, self._targets.displacements(face, own), strict=True):
            moved = np.flatnonzero(shape.any(axis=1))
            if len(moved):
                target = usd.UsdSkel.BlendShape.Define(stage, f"{path}/{shape_name}")
                target.CreateOffsetsAttr(_vectors(usd, shape[moved]))
                target.CreatePointIndicesAttr(usd.Vt.IntArray.FromNumpy(moved.astype(np.int32)))
                used.append(shape_name)
                targets.append(target.GetPath())
        if used:  # TinyUSDZ 0.9.4 refuses a file with an empty list
            binding.CreateBlendShapesAttr(used)
            binding.CreateBlendShapeTargetsRel().SetTargets(targets)


class _UsdModules:
    """Modules of usd-core."""

    def __init__(self) -> None:
        with import_of_extra("USD files need usd-core; install it with: pip install 'tts2face[usd]'"):
            for name in ("Gf", "Sdf", "Usd", "UsdGeom", "UsdShade", "UsdSkel", "Vt"):
                setattr(self, name, importlib.import_module(f"pxr.{name}"))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


def _identifiers(names: tuple[str, ...]) -> list[str]:
    """Names as USD allows them: letters, digits and underscores."""
    safe = [re.sub(r"\W|^(?=\d)", "_", name, flags=re.ASCII) for name in names]
    return safe if len(set(safe)) == len(safe) else [f"{name}_{number}" for number, name in enumerate(safe)]


def _joint_paths(skeleton: Skeleton) -> list[str]:
    paths = ["root", "root/head"]
    return paths + [f"root/head/{name}" for name in skeleton.names[HEAD + 1 :]]


def _define_skeleton(usd: Any, stage: Any, skeleton: Skeleton) -> None:
    prim = usd.UsdSkel.Skeleton.Define(stage, f"{ROOT_PATH}/Skeleton")
    prim.CreateJointsAttr(_joint_paths(skeleton))
    world, local = [], []
    for number, place in enumerate(skeleton.places):
        parent = np.zeros(3) if number <= HEAD else skeleton.places[HEAD]
        world.append(usd.Gf.Matrix4d().SetTranslate(usd.Gf.Vec3d(*map(float, place))))
        local.append(usd.Gf.Matrix4d().SetTranslate(usd.Gf.Vec3d(*map(float, place - parent))))
    prim.CreateBindTransformsAttr(usd.Vt.Matrix4dArray(world))
    prim.CreateRestTransformsAttr(usd.Vt.Matrix4dArray(local))
    binding = usd.UsdSkel.BindingAPI.Apply(prim.GetPrim())
    binding.CreateAnimationSourceRel().SetTargets([usd.Sdf.Path(f"{ROOT_PATH}/Skeleton/Animation")])


def _vectors(usd: Any, values: NDArray[Any]) -> Any:
    return usd.Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32))


def _display_colours(face: Face, surface: ExportSurface) -> NDArray[np.float64]:
    """Linear colours (n, 3) of the vertices; those of textured parts from the texture."""
    own = surface.vertices
    if not surface.part.is_textured or face.uv is None:
        return linear_colours(face)[own]
    pixels = face.textures[surface.part.texture].pixels
    height, width = pixels.shape[:2]
    column = np.clip((face.uv[own, 0] * width).astype(int), 0, width - 1)
    row = np.clip((face.uv[own, 1] * height).astype(int), 0, height - 1)
    return decode_srgb(pixels[row, column] / 255.0)
