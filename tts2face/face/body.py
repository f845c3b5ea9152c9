"""Body of a face, which moves whatever the face says: hair, shoulders and pupils, each if there are shapes for them."""

from collections.abc import Sequence

from lexicon.sequence import PhoneSequence
from tts2face.face.breathing import Breath, Breathing, part_lips
from tts2face.face.hair_swing import HairSwing, Swing
from tts2face.face.pupils import Dilation, Pupils
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Trajectory


class Body:
    """Hair, shoulders and pupils of a face with some channels, piece by piece of a clip."""

    def __init__(self, channels: Sequence[str], seed: int) -> None:
        self._hair = HairSwing.of_channels(channels)
        self._breathing = Breathing.of_channels(channels)
        self._pupils = Pupils.of_channels(channels)
        self._seed = seed
        self._swing: Swing | None = None  # after the last piece
        self._breath: Breath | None = None
        self._dilation: Dilation | None = None

    def move(
        self,
        face: Trajectory,
        head: Trajectory,
        phones: PhoneSequence,
        turns: Sequence[float] = (),
        breath: FloatArray | None = None,
    ) -> Trajectory:
        """Motion (T, K) of the next piece with these, from that of the face and the head (T, 6).

        Before `turns`, seconds of the piece at which speech begins after listening, the lips part for the breath.
        `breath` (T,) are shares of a full breath that gestures hold.
        """
        if not len(face):
            return face
        face = part_lips(face, turns)
        if self._hair is not None:
            face, self._swing = self._hair.apply(face, head, self._swing)
        if self._breathing is not None:
            face, self._breath = self._breathing.apply(face, phones, self._seed, self._breath, breath)
        if self._pupils is not None:
            face, self._dilation = self._pupils.apply(face, phones, self._seed, self._dilation)
        return face
