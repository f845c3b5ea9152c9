"""Basis expressions B_i of a person, transferred from a face that has them, or captured.

Source: Ju and Lee 2008, Fig. 4.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.decomposition.stills import NEUTRAL, Still, required_stills
from lexicon.errors import DataError, InputError
from tts2face.models.landmarks import N_LANDMARKS, N_MESH_LANDMARKS
from tts2face.models.palette import EXPRESSIONS
from tts2face.numeric.arrays import FloatArray

MIN_EXPRESSION_MM = 0.3  # root mean square over landmarks; trackers differ by half of it from still to still


@dataclass(frozen=True, slots=True, eq=False)
class ExpressionBasis:
    """A person's basis expressions.

    Parameters
    ----------
    rest : (478, 3)
        The person's landmarks at rest, mm.
    expressions : (5, 478, 3)
        Displacement of each of `tts2face.models.palette.EXPRESSIONS` from rest, mm.
    """

    rest: FloatArray
    expressions: FloatArray


def transfer_basis(
    expressions: NDArray[np.floating], face_rest: NDArray[np.floating], rest: NDArray[np.floating]
) -> ExpressionBasis:
    """Expressions of one face transferred to a person.

    Parameters
    ----------
    expressions : (5, 478, 3)
        Displacements from `face_rest`, mm.
    face_rest, rest : (478, 3)
        Landmarks at rest of the face that has the expressions, and of the person.

    Raises
    ------
    InputError
        An array has a wrong shape.

    Notes
    -----
    Displacements are transformed by the least-squares affine map between the faces at rest, which rotates them into the
    person's axes and scales width, height and depth separately.
    """
    shapes = (np.shape(expressions), np.shape(face_rest), np.shape(rest))
    if shapes != ((len(EXPRESSIONS), N_LANDMARKS, 3), (N_LANDMARKS, 3), (N_LANDMARKS, 3)):
        raise InputError(f"expressions and faces at rest have the shapes {shapes}; all need {N_LANDMARKS} landmarks")
    own = np.asarray(rest, np.float64)
    there = np.asarray(face_rest, np.float64)[:N_MESH_LANDMARKS]
    centred = there - there.mean(axis=0)
    affine, *_ = np.linalg.lstsq(centred, own[:N_MESH_LANDMARKS] - own[:N_MESH_LANDMARKS].mean(axis=0), rcond=None)
    return ExpressionBasis(own, np.asarray(expressions, np.float64) @ affine)


def basis_from_stills(
    stills: Mapping[str, Still], read: Callable[[Still], FloatArray], *, rest: NDArray[np.floating] | None = None
) -> ExpressionBasis:
    """Captured expressions of a person.

    Parameters
    ----------
    stills
        One for each of `tts2face.models.palette.EXPRESSIONS`, and neutral where `rest` is not given.
    read
        Landmarks (478, 3) of a still, mm, head pose removed: `PictureReader` or `marker_reader`.
    rest : (478, 3)
        The person's landmarks at rest as the recordings have them.

    Raises
    ------
    InputError
        A still is missing.
    DataError
        A still shows no face, or no difference from the face at rest; or as `read` says.
    """
    needed = required_stills(stills, is_rest_known=rest is not None)
    own = np.asarray(read(stills[NEUTRAL]) if rest is None else rest, np.float64)
    expressions = np.stack([read(stills[name]) - own for name in needed if name != NEUTRAL])
    expressions[:, N_MESH_LANDMARKS:] = 0.0
    sizes = np.sqrt(np.square(expressions[:, :N_MESH_LANDMARKS]).sum(axis=2).mean(axis=1))
    for name, size in zip(EXPRESSIONS, sizes, strict=True):
        if size < MIN_EXPRESSION_MM:
            raise DataError(f"{stills[name]} shows no {name} expression; capture a stronger one")
    return ExpressionBasis(own, expressions)
