"""A talker's own face: warps against a slow exact computation, and pixels of the plate that speech does not move."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.appearance.frame import MOUTH_LANDMARKS
from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.picture.tiny_talker import SIZE, face_points, own_talker
from tts2face.models.talker import Talker
from tts2face.picture import plate
from tts2face.picture.kernels.warps import warp_image
from tts2face.picture.options import Picture
from tts2face.picture.own_face import draw_video_frame, own_face_renderer
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform


def motion_of_plate(talker: Talker, number: int) -> np.ndarray:
    plate = talker.appearance.plate
    return np.concatenate([plate.shape[number, :2], plate.texture_parameters[number], np.zeros(2)]).astype(np.float32)


def clip_of(channels: tuple[str, ...], values: np.ndarray) -> Clip:
    n_frames = len(values)
    speech = Speech(
        Waveform(np.zeros(320 * n_frames, np.float32), 8000), PhoneSequence([SILENCE], [0, 0.04 * n_frames]), ()
    )
    head = Trajectory(HEAD_CHANNELS, np.zeros((n_frames, len(HEAD_CHANNELS))), 25.0)
    return Clip(Trajectory(channels, values, 25.0), head, speech)


def test_a_warp_maps_the_corners_exactly():
    target = np.array([[5.2, 4.1], [40.7, 8.3], [12.9, 38.2]])
    source = np.array([[10.0, 10.0], [50.0, 14.0], [16.0, 48.0]])
    y, x = np.mgrid[:64, :64]
    plate = np.stack([x * 2.0, y * 3.0, x + y], axis=2)
    drawn = np.full((50, 50, 3), -1.0, np.float32)
    none = np.zeros((2, 2, 3), np.float32), np.zeros((0, 2))
    warp_image(np.array([[0, 1, 2]], np.int32), target, source, plate, none, drawn)
    affine = np.linalg.solve(np.column_stack([target, np.ones(3)]), source)
    edges = np.roll(target, -1, axis=0) - target
    for row in range(50):
        for column in range(50):
            off = np.array([column, row]) - target
            inside = (edges[:, 0] * off[:, 1] - edges[:, 1] * off[:, 0] > 1e-3).all()
            outside = (edges[:, 0] * off[:, 1] - edges[:, 1] * off[:, 0] < -1e-3).any()
            if inside:
                u, v = np.array([column, row, 1.0]) @ affine
                assert drawn[row, column] == pytest.approx([2 * u, 3 * v, u + v], abs=1e-3)
            elif outside:
                assert (drawn[row, column] == -1).all()


def test_a_texture_is_drawn_at_its_points():
    places = np.array([[0.0, 0], [7, 0], [0, 7]])
    texture = np.mgrid[:8, :8].transpose(1, 2, 0)[:, :, [1, 0, 0]].astype(np.float32)
    drawn = np.zeros((16, 16, 3), np.float32)
    warp_image(np.array([[0, 1, 2]], np.int32), 2 * places, places, texture, (texture, places[:0]), drawn)
    assert drawn[4, 6].tolist() == [3.0, 2.0, 2.0]


def test_the_parameters_of_the_plate_change_only_the_open_mouth():
    talker = own_talker()
    renderer = own_face_renderer(talker, Picture(size=f"{SIZE}x{SIZE}"))
    drawn = draw_video_frame(renderer, motion_of_plate(talker, 2), 2)
    changed = np.abs(drawn.astype(int) - renderer.plate[2]).max(axis=2) > 1
    y, x = np.nonzero(changed)
    lips = face_points()[list(MOUTH_LANDMARKS)]
    assert changed.any()
    assert lips[:, 0].min() - 2 <= x.min() <= x.max() <= lips[:, 0].max() + 2
    assert lips[:, 1].min() - 2 <= y.min() <= y.max() <= lips[:, 1].max() + 2
    assert np.abs(drawn[int(lips[:, 1].mean()), int(lips[:, 0].mean())] - 30.0).max() <= 1


def test_motion_moves_the_face_and_not_the_corner_of_the_picture():
    talker = own_talker()
    renderer = own_face_renderer(talker, Picture(size=f"{SIZE}x{SIZE}"))
    motion = motion_of_plate(talker, 0)
    motion[0] += 40
    moved = draw_video_frame(renderer, motion, 0)
    assert np.abs(moved.astype(int) - renderer.plate[0]).max() > 10
    assert np.array_equal(moved[:6, :6], renderer.plate[0][:6, :6])


def test_appearance_parameters_change_the_texture_by_their_basis():
    talker = own_talker()
    renderer = own_face_renderer(talker, Picture(size=f"{SIZE}x{SIZE}"))
    motion = motion_of_plate(talker, 1)
    motion[2] += 2000
    difference = draw_video_frame(renderer, motion, 1).astype(float) - renderer.plate[1]
    wanted = 2000 * talker.appearance.face.basis[0]
    assert 0.3 * np.abs(wanted).max() < np.abs(difference).max() <= np.abs(wanted).max() + 1


@pytest.mark.parametrize(("instant", "number"), [(0.0, 0), (0.08, 2), (0.12, 3), (0.16, 2), (0.24, 0), (0.28, 1)])
def test_the_plate_plays_forwards_and_backwards(instant, number):
    assert own_face_renderer(own_talker(), Picture(size="96x96")).plate_frame(instant) == number


@pytest.mark.parametrize("n_frames", [1, 2, 3, 5, 12, 13, 14, 40])
def test_a_video_that_returns_begins_and_ends_at_its_first_frame_without_a_jump(n_frames):
    renderer = replace(own_face_renderer(own_talker(), Picture(size="96x96")), n_returning=n_frames)
    positions = renderer._positions(np.arange(n_frames), renderer.fps) / renderer.fps
    shown = [renderer.plate_frame(float(instant)) for instant in positions]
    assert (shown[0], shown[-1]) == (0, 0)
    assert np.abs(np.diff(shown)).max(initial=0) <= 1
    plays_on = [renderer.plate_frame(number / renderer.fps) for number in range(n_frames)]
    assert shown[: n_frames // 2] == plays_on[: n_frames // 2]


def test_without_a_size_the_picture_is_as_large_as_the_video():
    renderer = own_face_renderer(own_talker(), Picture())
    assert (renderer.picture.width, renderer.picture.height) == (SIZE, SIZE)
    assert renderer.scale == 1.0
    assert renderer.plate[0].shape == (SIZE, SIZE, 3)


def test_large_frames_are_compressed_with_little_loss(monkeypatch):
    talker = own_talker()  # one encoded video: the encoder does not give the same bytes each time
    raw = own_face_renderer(talker, Picture()).plate
    monkeypatch.setattr(plate, "MAX_RAW_BYTES", raw[0].size)
    packed = own_face_renderer(talker, Picture()).plate
    assert len(packed) == len(raw)
    assert np.array_equal(packed[0], raw[0])
    for number in range(1, len(raw)):
        assert np.abs(packed[number].astype(int) - raw[number]).mean() <= 2  # of 255


def test_a_clip_continues_the_video_of_the_previous_clip():
    talker = own_talker()
    renderer = own_face_renderer(talker, Picture(size="96x96"))
    values = np.array([motion_of_plate(talker, 0)] * 4)
    whole = list(renderer.frames(clip_of(renderer.channels, values), threads=2))
    rest = list(renderer.frames(clip_of(renderer.channels, values[2:]), first=2))
    assert np.array_equal(whole[2], rest[0])
    assert np.array_equal(whole[3], rest[1])


def test_a_talker_without_appearance_is_refused():
    with pytest.raises(InputError, match="Ada has motion only"):
        own_face_renderer(own_talker(has_face=False), Picture())


def test_a_plate_is_not_transparent():
    with pytest.raises(InputError, match="cannot have a transparent background"):
        own_face_renderer(own_talker(), Picture(background="transparent"))


def test_a_clip_for_another_face_is_refused():
    renderer = own_face_renderer(own_talker(), Picture(size="96x96"))
    with pytest.raises(InputError, match="not in the channels"):
        list(renderer.frames(clip_of(("jawOpen",), np.zeros((1, 1)))))
