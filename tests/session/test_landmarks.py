"""Landmarks of animated faces under their own motion."""

import numpy as np
import pytest

from lexicon.errors import DataError
from tests.world import World
from tts2face.models.landmarks import lip_opening
from tts2face.session.session import Session
from tts2face.types import Trajectory


@pytest.fixture(scope="module")
def mesh_session(world: World) -> Session:
    return world.session(palette=None)


def test_a_mesh_opens_with_its_jaw(mesh_session: Session) -> None:
    face = mesh_session.face
    weights = np.zeros((2, len(face.channels)), np.float32)
    weights[1, face.channels.index("jawOpen")] = 0.5
    rest, opened = lip_opening(face.landmarks(Trajectory(face.channels, weights, 30.0)))
    assert opened > rest + 0.1  # of the distance of the eyes


def test_motion_of_the_first_channels_moves_as_that_of_all(mesh_session: Session) -> None:
    face = mesh_session.face
    weights = np.zeros((1, len(face.channels)), np.float32)
    n = face.channels.index("jawOpen") + 1
    weights[0, n - 1] = 0.5
    few = face.landmarks(Trajectory(face.channels[:n], weights[:, :n], 30.0))
    np.testing.assert_allclose(few, face.landmarks(Trajectory(face.channels, weights, 30.0)), atol=1e-4)  # mm
    with pytest.raises(DataError, match="not for the shapes"):
        face.landmarks(Trajectory(face.channels[n - 1 : n], weights[:, n - 1 : n], 30.0))
