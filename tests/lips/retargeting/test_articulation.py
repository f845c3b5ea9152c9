"""Visible articulation on faces: rounding, spreading, opening, teeth, tongue, and lips that meet."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence
from tests.face.posing import posed_vertices
from tts2face.face.landmarks import landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import MIDDLE_PAIR
from tts2face.lips.articulation import build_articulator
from tts2face.lips.articulation_tracks import articulation_tracks, pause_closure, seconds_from_closure
from tts2face.lips.exemplar import ExemplarModel, select_tokens
from tts2face.lips.options import THEOBALD_2007, SynthesisOptions
from tts2face.lips.teeth_and_tongue import incisor_edge, upper_teeth
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import LOWER_LIP_INNER_MID, inner_lip_gaps
from tts2face.models.talker import Talker
from tts2face.session.animated_face import mesh_face
from tts2face.types import Trajectory

FPS = 60.0
WORDS = "ʃ i w ʊ d f i l ɑ b u sil θ ɪ n v æ n w i m u v ɑ m ʃ u f ɑ ð ɚ"
LONG_PAUSE_S = 0.4


def sequence(words: str, phone_s: float = 0.1, pause_s: float = LONG_PAUSE_S) -> PhoneSequence:
    """Phones of equal duration between two long pauses."""
    labels = [SILENCE, *words.split(), SILENCE]
    durations = [pause_s if label == SILENCE else phone_s for label in labels]
    return PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(durations)]))


@cache
def named_face(identity: str | None) -> Face:
    return load_face("head", identity, hair="bald")


class Spoken:
    """Motion of a face with three factors of articulation, and how the mouth looks in it."""

    def __init__(self, face: Face, talker: Talker, exemplars: ExemplarModel, phones: PhoneSequence) -> None:
        self.face, self.phones, self.articulator = face, phones, build_articulator(face)
        animated = mesh_face(talker, exemplars, face)
        n_frames = int(phones.end * FPS)
        self.times = np.arange(n_frames) / FPS

        def speak(**options: object) -> Trajectory:
            selection = select_tokens(phones, exemplars, SynthesisOptions(**options))  # type: ignore[arg-type]
            return animated.motion_of_tokens(selection, fps=FPS, n_frames=n_frames)

        self.recorded = speak(contacts=True, articulation=1.0)
        self.clear, self.more, self.less = (speak(articulation=factor) for factor in (1.5, 2.0, 0.5))
        self.default = speak()

    def middles(self, *labels: str) -> NDArray[np.int64]:
        edges = self.phones.edges
        at = [at for at, label in enumerate(self.phones.phones) if label in labels]
        return np.array([round((edges[i] + edges[i + 1]) / 2 * FPS) for i in at])

    def within(self, *labels: str) -> list[slice]:
        edges = self.phones.edges
        return [
            slice(int(edges[at] * FPS), int(np.ceil(edges[at + 1] * FPS)) + 1)
            for at, label in enumerate(self.phones.phones)
            if label in labels
        ]

    def widths(self, motion: Trajectory) -> NDArray[np.float64]:
        return 1 + motion.values @ self.articulator.mouth.width / self.articulator.rest_width

    def gaps(self, motion: Trajectory) -> NDArray[np.float64]:
        return np.asarray(motion.values @ self.articulator.mouth.gaps[MIDDLE_PAIR], np.float64)

    def weight(self, motion: Trajectory, name: str) -> NDArray[np.float32]:
        return motion.values[:, motion.channels.index(name)]


@pytest.fixture(scope="module")
def spoken(talker: Talker, exemplars: ExemplarModel) -> Spoken:
    return Spoken(named_face(None), talker, exemplars, sequence(WORDS))


def lip_triangles(face: Face) -> NDArray[np.int32]:
    """Triangles of the skin about the middle of the lower lip."""
    jaw = np.linalg.norm(face.shapes[face.shape_names.index("jawOpen")], axis=1)
    lip = scatter_landmarks(face, landmark_positions(face))[LOWER_LIP_INNER_MID]
    near = np.linalg.norm(face.vertices - lip, axis=1) < 12
    near &= (np.abs(face.vertices[:, 0]) < 6) & (jaw > 0.4 * jaw.max())
    skin = face.triangles[face.parts[0].first : face.parts[0].first + face.parts[0].count]
    return np.asarray(skin[near[skin].all(axis=1)], np.int32)


def tooth_distance(face: Face, weights: NDArray[np.float32]) -> float:
    """Distance of the lower lip, sampled every quarter millimetre, from the edge of the upper incisors, mm."""
    corners = posed_vertices(face, weights).astype(np.float64)[lip_triangles(face)]
    shares = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
    lip = np.einsum("bk,nkc->nbc", shares, corners).reshape(-1, 3)
    teeth = upper_teeth(face)
    teeth = teeth[np.abs(teeth[:, 0]) < 4]
    teeth = teeth[teeth[:, 2] > teeth[:, 2].max() - 3]
    edge = teeth[teeth[:, 1] < teeth[:, 1].min() + 4]
    return float(np.sqrt(((lip[:, None] - edge[None]) ** 2).sum(axis=2)).min())


def test_targets_are_held_in_the_middle_of_their_phones() -> None:
    phones = sequence("t u t i b f")
    middles = (phones.edges[:-1] + phones.edges[1:]) / 2
    tracks = articulation_tracks(phones, middles)
    np.testing.assert_allclose(tracks["rounding"][[2, 4, 6]], [1, 0, 0], atol=0.06)
    np.testing.assert_allclose(tracks["spreading"][[2, 4]], [0, 1], atol=0.06)
    np.testing.assert_allclose(tracks["incisor_contact"][[4, 6]], [0, 1], atol=0.06)
    assert tracks["incisor_contact"][5] < 0.2
    assert 0.2 < tracks["rounding"][1] < 0.98  # /t/ before /u/ is being rounded
    assert not tracks["rounding"][0]


def test_tracks_are_smooth_and_fall_short_in_fast_speech() -> None:
    for phone_s in (0.04, 0.1, 0.3):
        phones = sequence("ʃ f i θ u v l w ɑ m", phone_s)
        tracks = articulation_tracks(phones, np.arange(0, phones.end, 0.001))
        for track in tracks.values():
            assert np.abs(np.diff(track)).max() < 0.045  # per millisecond
            assert -1e-9 <= track.min() <= track.max() <= 1 + 1e-9
    fast, slow = (articulation_tracks(sequence("s u s", s), np.array([0.4 + 1.5 * s])) for s in (0.03, 0.1))
    assert fast["rounding"][0] < 0.8
    assert slow["rounding"][0] > 0.95


def test_contacts_are_reached_in_fast_speech_and_begin_before_their_phones() -> None:
    for phone_s in (0.03, 0.1):
        phones = sequence("s f s", phone_s)
        middle, before = (
            articulation_tracks(phones, np.array([0.4 + at]))["incisor_contact"]
            for at in (1.5 * phone_s, 1.1 * phone_s - 0.03)
        )
        assert middle[0] == 1.0
        assert 0.3 < before[0] < 0.95


def test_lips_meet_in_long_pauses_only() -> None:
    for pause_s, closure in ((0.12, 0.0), (0.29, 0.0), (0.41, 1.0), (0.9, 1.0)):
        phones = sequence("ɑ sil ɑ", pause_s=pause_s)
        start, end = phones.edges[2], phones.edges[3]
        times = np.arange(0, phones.end, 0.002)
        found = pause_closure(phones, times)
        within = (times > start) & (times < end)
        assert found[within].max() == pytest.approx(closure, abs=0.02)
        speech = (times > phones.edges[1]) & (times < start)
        assert not found[speech].any()
        assert np.abs(np.diff(found)).max() < 0.04
        assert found[0] == found[-1] == 1 or pause_s < 0.4
    assert found[times < end][-1] < 0.01  # speakers breathe in before they speak
    assert found[(times > end - 0.18) & (times < end)].max() < 0.55


def test_clear_articulation_is_seen_as_round_and_spread(spoken: Spoken) -> None:
    at, front = spoken.middles("u", "w", "ʃ"), spoken.middles("i")
    widths, forward = spoken.widths(spoken.clear), spoken.clear.values @ spoken.articulator.protrusion
    assert widths[at].mean() <= 0.85
    assert widths[at].max() <= 0.89
    assert forward[at].mean() >= 3.0
    assert spoken.widths(spoken.recorded)[at].mean() > 0.93
    assert widths[front].mean() > max(1.03, spoken.widths(spoken.recorded)[front].mean() + 0.03)
    assert (
        spoken.gaps(spoken.clear)[spoken.middles("ɑ")].min()
        > 1.05 * spoken.gaps(spoken.recorded)[spoken.middles("ɑ")].min()
    )


def test_factors_are_ordered_and_clear_is_the_default_of_a_mesh(spoken: Spoken) -> None:
    at = spoken.middles("u", "w", "ʃ")
    less, natural, clear, more = (
        spoken.widths(motion)[at].mean() for motion in (spoken.less, spoken.recorded, spoken.clear, spoken.more)
    )
    assert more < clear < natural < less <= 1.0
    np.testing.assert_array_equal(spoken.default.values, spoken.clear.values)


def largest_closed_gap(spoken: Spoken, motion: Trajectory, *labels: str) -> float:
    """Largest gap of all pairs of inner lip points at the middle of phones, mm."""
    rest = inner_lip_gaps(scatter_landmarks(spoken.face, landmark_positions(spoken.face)))
    gaps = motion.values[spoken.middles(*labels)] @ spoken.articulator.mouth.gaps.T + rest
    return float(gaps.max())


def test_bilabials_stay_closed_and_open_vowels_open(spoken: Spoken) -> None:
    natural = spoken.gaps(spoken.recorded)
    for motion in (spoken.recorded, spoken.clear, spoken.more, spoken.less):
        assert largest_closed_gap(spoken, motion, "b", "m") <= 0.1
        if motion is not spoken.less:
            assert (gaps_of(spoken, motion, "ɑ", "æ") > 0.98 * natural[spoken.middles("ɑ", "æ")]).all()


def gaps_of(spoken: Spoken, motion: Trajectory, *labels: str) -> NDArray[np.float64]:
    """Gap of the middle of the lips at the middle of phones, mm."""
    return spoken.gaps(motion)[spoken.middles(*labels)]


def test_weights_are_smooth_and_within_their_limits(spoken: Spoken) -> None:
    low, high = spoken.face.limits.T
    for motion in (spoken.recorded, spoken.clear, spoken.less):
        assert (motion.values >= low - 1e-6).all()
        assert (motion.values <= high + 1e-6).all()
        assert np.abs(np.diff(motion.values, axis=0)).max() < 0.34  # per 1/60 s, as scores in recordings of people


def test_natural_changes_neither_vowels_nor_consonants_without_a_contact(
    spoken: Spoken, talker: Talker, exemplars: ExemplarModel
) -> None:
    animated = mesh_face(talker, exemplars, spoken.face)
    selection = select_tokens(spoken.phones, exemplars)
    retargeted = animated.retargeter.retarget(
        Trajectory(exemplars.channels, lips_of(selection, exemplars, len(spoken.times)), FPS)
    )
    tracks = articulation_tracks(spoken.phones, spoken.times)
    free = (tracks["incisor_contact"] == 0) & (pause_closure(spoken.phones, spoken.times) == 0)
    free &= seconds_from_closure(spoken.phones, spoken.times) > 0.1
    fast = np.abs(np.diff(retargeted.values, axis=0, append=0)).max(axis=1) > 0.25
    free &= np.convolve(fast, np.ones(7), "same") == 0
    lips = animated.articulator.mouth.moving
    assert free.sum() > 40
    np.testing.assert_allclose(
        spoken.recorded.values[np.ix_(free, lips)], retargeted.values[np.ix_(free, lips)], atol=0.01
    )


def lips_of(selection: object, exemplars: ExemplarModel, n_frames: int) -> NDArray[np.float32]:
    from tts2face.lips.exemplar import blend_trajectory

    return blend_trajectory(selection, exemplars, fps=FPS, n_frames=n_frames).values  # type: ignore[arg-type]


def test_the_published_method_is_not_changed(spoken: Spoken, talker: Talker, exemplars: ExemplarModel) -> None:
    animated = mesh_face(talker, exemplars, spoken.face)
    selection = select_tokens(spoken.phones, exemplars, THEOBALD_2007)
    motion = animated.motion_of_tokens(selection, fps=FPS, n_frames=60)
    lips = Trajectory(exemplars.channels, lips_of(selection, exemplars, 60), FPS)
    np.testing.assert_array_equal(motion.values, animated.retargeter.retarget(lips).values)


def test_lips_meet_in_the_pauses_of_a_clip(spoken: Spoken) -> None:
    for motion in (spoken.recorded, spoken.clear):
        gaps = motion.values @ spoken.articulator.mouth.gaps.T
        for span in spoken.within(SILENCE):
            assert gaps[span].max(axis=1).min() <= 0.02
    resting = [0, -1]
    assert np.abs(spoken.gaps(spoken.clear)[resting]).max() <= 0.02


def test_the_tongue_moves_with_its_phones(spoken: Spoken) -> None:
    names = {"tongueOut": ("θ", "ð"), "tongueUp": ("l", "n", "d", "θ", "ð")}
    for name, labels in names.items():
        if name not in spoken.face.shape_names:
            continue
        weights = spoken.weight(spoken.clear, name)
        far = np.ones(len(weights), bool)
        for span in spoken.within(*labels):
            far[max(0, span.start - 6) : span.stop + 6] = False
        assert not weights[far].any()
        assert weights.max() <= 0.9
    assert spoken.weight(spoken.clear, "tongueOut")[spoken.middles("θ", "ð")].min() > 0.15


def test_the_tip_of_the_tongue_stays_between_teeth_and_lips(spoken: Spoken) -> None:
    """The tip reaches the incisors' edge, and stays behind the front of the lower lip."""
    face = spoken.face
    tongue = next(part for part in face.parts if part.name == "tongue")
    vertices = np.unique(face.triangles[tongue.first : tongue.first + tongue.count])
    places = scatter_landmarks(face, landmark_positions(face))
    _, edge = incisor_edge(face, places, spoken.articulator.rest_width)
    for at in spoken.middles("θ", "ð"):
        posed = posed_vertices(face, spoken.clear.values[at])
        tip = posed[vertices, 2].max()
        lip = posed[face.landmark_vertices[face.landmarks == LOWER_LIP_INNER_MID][0], 2].max()
        assert edge - 6 < tip < lip + 0.5


def test_a_face_without_these_shapes_shows_what_it_can(talker: Talker, exemplars: ExemplarModel) -> None:
    head = named_face(None)
    kept = [
        at
        for at, name in enumerate(head.shape_names)
        if not name.startswith(("tongue", "mouthPucker", "mouthFunnel", "mouthRoll"))
    ]
    teeth = tuple(part for part in head.parts if "teeth" not in part.name)
    assert len(teeth) < len(head.parts)
    plain = replace(
        head,
        shape_names=tuple(head.shape_names[at] for at in kept),
        shapes=head.shapes[kept],
        limits=head.limits[kept],
        parts=tuple(replace(part, name=part.name.replace("teeth", "part")) for part in head.parts),
    )
    assert not len(upper_teeth(plain))
    spoken = Spoken(plain, talker, exemplars, sequence("ʃ i f θ m u"))
    assert np.isfinite(spoken.clear.values).all()
    edge = incisor_edge(plain, scatter_landmarks(plain, landmark_positions(plain)), spoken.articulator.rest_width)
    own = incisor_edge(head, scatter_landmarks(head, landmark_positions(head)), spoken.articulator.rest_width)
    np.testing.assert_allclose(edge, own, atol=5.0)  # in proportion to the mouth, as on the default head
    for span in spoken.within("m"):
        assert spoken.gaps(spoken.clear)[span].min() <= 0.15


ROLLS = ("mouthRollLower", "mouthRollUpper", "mouthPressLeft", "mouthPressRight", "mouthClose")


def bare_face(visemes: dict[str, str]) -> Face:
    """The shipped head without shapes that roll or press the lips, and with visemes made of those."""
    head = named_face(None)
    kept = [at for at, name in enumerate(head.shape_names) if name not in ROLLS]
    added = [head.shapes[head.shape_names.index(name)] for name in visemes.values()]
    return replace(
        head,
        shape_names=(*(head.shape_names[at] for at in kept), *visemes),
        shapes=np.concatenate([head.shapes[kept], *(shape[None] for shape in added)]),
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(kept) + len(added), 1)),
        scores=None,
    )


@pytest.mark.parametrize("has_visemes", [True, False])
def test_labiodentals_without_shapes_that_roll_are_no_grin(has_visemes: bool) -> None:
    visemes = {"mouthViseme_ff": "mouthRollLower", "mouthViseme_pp": "mouthRollUpper"} if has_visemes else {}
    face = bare_face(visemes)
    phones, n_frames = sequence("ɑ f ɑ b ɑ"), int((2 * LONG_PAUSE_S + 0.5) * FPS)
    speech = np.zeros((n_frames, len(face.shape_names)), np.float32)
    speech[24:-24, face.shape_names.index("jawOpen")] = 0.2
    articulator = build_articulator(face)
    spoken = articulator.articulate(Trajectory(face.shape_names, speech, FPS), phones, 1.0)
    at = {label: round((LONG_PAUSE_S + when) * FPS) for label, when in {"f": 0.15, "b": 0.35}.items()}
    gaps = spoken.values @ articulator.mouth.gaps[MIDDLE_PAIR]
    assert gaps[at["b"]] < 0.5
    smile, jaw = (spoken.columns([f"{stem}Left", f"{stem}Right"]) for stem in ("mouthSmile", "jaw"))
    for frame in at.values():
        assert smile[frame].max() < 0.3
        assert jaw[frame].min() < 0.1
    if has_visemes:
        assert spoken.columns(["mouthViseme_ff"])[at["f"], 0] > 0.5
        assert spoken.columns(["mouthViseme_pp"])[at["b"], 0] > 0.4
        assert spoken.columns(["mouthViseme_ff"])[at["b"], 0] < 0.3


def test_a_face_of_visemes_rounds_by_one_of_them() -> None:
    head = named_face(None)
    own = {"jawOpen": "mouthViseme_aa", "mouthPucker": "mouthViseme_ou", "mouthStretchLeft": "mouthViseme_ih"}
    rows = [head.shape_names.index(name) for name in own]
    face = replace(
        head, shape_names=tuple(own.values()), shapes=head.shapes[rows], limits=head.limits[rows], scores=None,
        occlusion=None, eyes=(), opened_by="mouthViseme_aa",
    )  # fmt: skip
    phones, n_frames = sequence("ɑ w ɑ"), int((2 * LONG_PAUSE_S + 0.3) * FPS)
    speech = np.zeros((n_frames, 3), np.float32)
    speech[24:-24, 0] = 0.2
    spoken = build_articulator(face).articulate(Trajectory(face.shape_names, speech, FPS), phones, 1.5)
    rounded = spoken.columns(["mouthViseme_ou"])[:, 0]
    assert rounded[round((LONG_PAUSE_S + 0.15) * FPS)] > 0.4
    assert rounded[[0, -1]].max() < 0.05
