"""Scene of a photographed face: what moves of the picture is drawn over what does not."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.face import Face
from tts2face.models.light import Photographed
from tts2face.models.photo_view import PhotoView
from tts2face.picture.baked.cut_out import moving_pixels, page_covers, without_background
from tts2face.picture.baked.scene import LitScene, build_lit_scene
from tts2face.picture.baked.softening import missing_blur, photograph_blur
from tts2face.picture.camera import photo_crop, photo_matrices
from tts2face.picture.options import AUTO_SIZE, BLUR, SIDE_LIMITS_PX, STUDIO, Picture
from tts2face.picture.scene import draw_background

BLUR_MM = 12.0  # standard deviation, where the person is


def build_photo_scene(face: Face, light: Photographed, picture: Picture) -> LitScene:
    """Scene of a photographed face, in the size of the photograph where none is asked for."""
    view, baked = light.view, light.baked
    _check(light, picture)
    if picture.size == AUTO_SIZE:
        picture = replace(picture, size=_own_size(view))
    size = (picture.width, picture.height)
    crop = photo_crop(picture.view, face, view, size)
    optics = photo_matrices(view, crop, picture.samples)
    shown = _resized(baked.backdrop, size, crop)
    softness = missing_blur(photograph_blur(face, view, baked.backdrop) * size[0] / (crop[2] - crop[0]))
    if view.alpha is None:
        return replace(build_lit_scene(face, light, picture, optics, shown), softness=softness)
    # the wall behind a person was filled in when the face was made
    if view.behind is not None and picture.background in (STUDIO, BLUR):
        wall = _own_background(view, view.behind, picture, crop)
    else:
        wall = draw_background(picture)
    scene = build_lit_scene(face, light, picture, optics, wall, page_covers(baked, view))
    is_moving = moving_pixels(scene.surface, optics, size, picture.samples_per_side)
    cover = np.where(is_moving, 0, _resized(view.alpha, size, crop))[..., None]
    if picture.is_transparent:
        still = np.concatenate([shown, cover], axis=2)
    else:
        still = np.rint((cover * shown.astype(np.float32) + (255 - cover) * wall.astype(np.float32)) / 255)
    surface = without_background(scene.surface, scene.texels, scene.texture_size[0])
    return replace(scene, surface=surface, background=still.astype(np.uint8), softness=softness)


def _check(light: Photographed, picture: Picture) -> None:
    """Refuse what a photograph does not show; errors as `build_photo_scene`."""
    view = light.view
    if view.alpha is None and picture.background != STUDIO:
        raise InputError(
            "the person in the photograph was not told from its background, which stays; remove --background, or give "
            "a PNG or WebP picture whose background is transparent"
        )
    if view.behind is None and picture.background == BLUR:
        raise InputError("the photograph has no background that could be blurred; choose another --background")
    if light.baked.backdrop.shape[1::-1] != view.size:
        raise DataError("the photograph of the face has another size than its view; make or copy the face again")


def _own_background(
    view: PhotoView, behind: NDArray[np.uint8], picture: Picture, crop: tuple[float, float, float, float]
) -> NDArray[np.uint8]:
    """Background (H, W, 3) of a photograph in a picture, blurred if this is asked for."""
    from PIL import Image, ImageFilter

    shown = _resized(behind, (picture.width, picture.height), crop)
    if picture.background != BLUR:
        return shown
    px_per_mm = float(view.lens[0] / view.view[2, 3]) * picture.width / (crop[2] - crop[0])
    return np.asarray(Image.fromarray(shown).filter(ImageFilter.GaussianBlur(BLUR_MM * px_per_mm)))


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
