"""Scene of a photographed face: what moves of the picture is drawn over what does not."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.face import Face, PhotoView
from tts2face.render.camera import photo_crop
from tts2face.render.film.scene import LitScene, build_lit_scene
from tts2face.render.picture import AUTO_SIZE, PYVISTA, SIDE_LIMITS_PX, STUDIO, Picture
from tts2face.render.scene import draw_background


def build_photo_scene(face: Face, view: PhotoView, picture: Picture) -> LitScene:
    """Scene of a photographed face, in the size of the photograph where none is asked for.

    Raises
    ------
    InputError
        The camera does not see the face from where it was taken, or an opaque picture shall have another background.
    DataError
        The background image cannot be read, or the photograph does not fit its view.
    """
    if picture.renderer == PYVISTA:
        raise InputError("a photograph is drawn by the renderer numba; remove --renderer pyvista")
    if view.alpha is None and picture.background != STUDIO:
        raise InputError(
            "the photograph is opaque and keeps its own background; remove --background, or give a PNG or WebP picture "
            "whose background is transparent"
        )
    if picture.size == AUTO_SIZE:
        picture = replace(picture, size=_own_size(view))
    if face.light[0].backdrop.shape[1::-1] != view.size:
        raise DataError("the photograph of the face has another size than its view; make or copy the face again")
    size = (picture.width, picture.height)
    crop = photo_crop(picture.view, face, size)
    shown = _resized(face.light[0].backdrop, size, crop)
    if view.alpha is None:
        return build_lit_scene(face, face.light[0], picture, shown)
    cover, wall = _resized(view.alpha, size, crop), draw_background(picture)
    part = cover[..., None] / 255.0
    still = shown if picture.is_transparent else np.rint(part * shown + (1 - part) * wall).astype(np.uint8)
    scene = build_lit_scene(face, face.light[0], picture, wall, cover)
    return replace(scene, background=still)


def _own_size(view: PhotoView) -> str:
    """Width x height of a photograph, in even numbers."""
    least, most = SIDE_LIMITS_PX
    wide, high = (min(max(side - side % 2, least), most) for side in view.size)
    return f"{wide}x{high}"


def _resized(
    values: NDArray[np.uint8], size: tuple[int, int], crop: tuple[float, float, float, float]
) -> NDArray[np.uint8]:
    """A part of a picture in another size."""
    from PIL import Image

    return np.asarray(Image.fromarray(values).resize(size, Image.Resampling.LANCZOS, crop))
