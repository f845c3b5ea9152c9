"""Names of shapes of other programs: families recognised as a whole, exact names first, combinations left alone."""

import csv
from collections.abc import Iterable
from importlib.resources import files

import numpy as np
import pytest

from tts2face.face.expressions import OWN_EXPRESSIONS
from tts2face.interchange.characters.character import Character, Material, MaterialPiece, MorphTarget
from tts2face.interchange.characters.families import FOLDER, general_family, program_families, recognised_families
from tts2face.interchange.characters.shape_names import (
    ARKIT_SHAPES,
    combinations_of_shapes,
    guess_mapping,
    with_combinations,
)
from tts2face.interchange.characters.shapes import HEADER, ShapeSource
from tts2face.interchange.characters.two_way import with_directions

JAW = MorphTarget(0, 0)

VISEMES = tuple(f"mouthViseme_{at}" for at in ("aa", "ee", "ih", "oh", "ou", "pp", "ff", "th", "dd", "kk", "ch", "ss"))
VISEMES += ("mouthViseme_nn", "mouthViseme_rr")
FAMILIES = {  # names of a file, and how many of them are understood
    "vrchat": ("vrc.v_sil vrc.v_pp vrc.v_ff vrc.v_th vrc.v_dd vrc.v_kk vrc.v_ch vrc.v_ss vrc.v_nn vrc.v_rr vrc.v_aa "
               "vrc.v_e vrc.v_ih vrc.v_oh vrc.v_ou", 14),
    "character_creator": ("V_Open V_Explosive V_Dental_Lip V_Tight_O V_Tight V_Wide V_Affricate V_Lip_Open", 8),
    "mmd": ("あ い う え お まばたき 笑い 口角上げ 困る 怒り びっくり ぺろっ", 12),
    "numbered": (" ".join(map(str, range(15))), 14),
    "azure": (" ".join(f"viseme_{number}" for number in range(22)), 13),
    "metahuman": ("CTRL_expressions_jawOpen CTRL_expressions_mouthFunnelUL CTRL_expressions_mouthFunnelDR "
                  "CTRL_expressions_mouthCornerPullL CTRL_expressions_mouthLipsPurseUR CTRL_expressions_eyeBlinkL "
                  "CTRL_expressions_browRaiseInL CTRL_expressions_eyeLookLeftR", 8),
    "facs": ("AU12_L AU12_R AU1 AU02 AU_4 AU26 AU45_L AU45_R AU9 AU17 AU20_L", 11),
    "daz": ("Genesis8Female__eCTRLMouthOpen Genesis8Female__eCTRLEyesClosedL Genesis8Female__eCTRLvF "
            "Genesis8Female__eCTRLMouthSmileSimpleR Genesis8Female__eCTRLLipBottomUp-DownL "
            "Genesis8Female__eCTRLJawSide-Side Genesis8Female__eCTRLTongueIn-Out "
            "Genesis8Female__eCTRLTongueUp-Down", 8),
    "genesis9": ("facs_jnt_JawOpen facs_bs_MouthFunnelUpperLeft facs_bs_MouthSmileLeft_div2 facs_ctrl_CheekPuff "
                 "facs_jnt_EyesWideLeft facs_bs_MouthPressLowerRight facs_jnt_TongueUp facs_ctrl_vF", 8),
    "mixamo": ("Blink_Left BrowsUp_Right EyesWide_Left JawForeward MouthNarrow_Left MouthOpen LowerLipIn "
               "UpperLipUp_Left MouthWhistle_NarrowAdjust_Right NoseScrunch_Left Midmouth_Left Smile_Right "
               "LowerLipOut", 12),
    "makehuman": ("JawDrop LipsKiss LeftUpperLidClosed RightEyeturnLeft MouthLeftPullUp MouthRightPlatysma "
                  "lowerLipBackward UpperLipForward CheeksPump ChinLeft TonguePointUp TongueUshape", 11),
    "mblab": ("Expressions_mouthOpen_max Expressions_mouthSmileL_max Expressions_eyeClosedR_max "
              "Expressions_jawHoriz_min Expressions_browsMidVert_max Expressions_tongueOut_max", 6),
    "sranipal": ("Jaw_Open Mouth_Ape_Shape Mouth_Pout Mouth_Upper_Overturn Mouth_Lower_Inside Eye_Left_Squeeze "
                 "Eye_Left_Right Mouth_Sad_Left Mouth_Upper_UpRight Tongue_LongStep2", 10),
    "unified_expressions": ("JawOpen MouthClosed LipPuckerUpperLeft LipPuckerLowerRight LipSuckUpper EyeClosedLeft "
                            "MouthCornerPullRight MouthRaiserLower BrowLowererLeft CheekPuffRight", 10),
    "preston_blair": ("AI E O U MBP FV L WQ etc rest", 9),
    "character_generator": ("h_expressions.MouthOpen_h h_teeth.t_MouthOpen_h OutMiddle_tg_h "
                            "h_expressions.RsmileClose_h "
                            "h_expressions.LLbrowUp_h h_expressions.FV_h t_JawFront_h h_expressions.ReyeClose_h", 8),
    "faceshift": ("JawOpen LipsFunnel BrowsU_C BrowsD_L EyeIn_R MouthSmile_L Puff Sneer", 8),
    "meta": ("Jaw_Drop Lip_Pucker_L Lips_Toward Eyes_Closed_R Lip_Suck_LT Chin_Raiser_B Lip_Corner_Puller_L", 7),
    "vroid": ("Face.M_F00_Fcl_MTH_A Fcl_MTH_O Fcl_EYE_Close_L Fcl_BRW_Angry Fcl_ALL_Joy", 5),
    "vrm": ("A I U E O Blink LookUp LookLeft LookRight Joy Angry Sorrow Fun Surprised", 13),
    "oculus": ("viseme_sil viseme_PP viseme_aa viseme_E viseme_RR viseme_nn", 5),
}  # fmt: skip


def understood(names: Iterable[str]) -> list[str]:
    given = list(names)
    used = {source.name for sources in guess_mapping(given).values() for source in sources}
    return [name for name in given if name in used]


@pytest.mark.parametrize("family", FAMILIES)
def test_names_of_a_family_are_understood(family: str) -> None:
    text, count = FAMILIES[family]
    names = text.split(" ")
    assert len(understood(names)) == count, set(names) - set(understood(names))


@pytest.mark.parametrize("family", FAMILIES)
def test_a_family_is_recognised_in_any_case_and_under_a_prefix(family: str) -> None:
    names = FAMILIES[family][0].split(" ")
    for spelled in (names, [f"Armature|{name}" for name in names], [name.replace("vrc.", "vrc_") for name in names]):
        assert recognised_families(spelled)[0][0].name == family


def test_every_family_is_tried() -> None:
    assert {family.name for family in program_families()} == {*FAMILIES}


@pytest.mark.parametrize("table", [*FAMILIES, "general"])
def test_tables_name_their_source_and_known_shapes(table: str) -> None:
    lines = files(FOLDER).joinpath(f"{table}.tsv").read_text("utf-8").splitlines()
    assert lines[0].startswith("# ")
    assert lines[1].startswith("# Source: ")
    rows = list(csv.DictReader(lines[2:], delimiter="\t"))
    assert tuple(rows[0]) == HEADER
    known = {*ARKIT_SHAPES, *VISEMES, *OWN_EXPRESSIONS.values(), "tongueUp"}
    for row in rows:
        shape = row["shape"]
        assert known & {shape.replace("*", "Left"), shape}, row
        assert ("*" in shape) <= (shape.replace("*", "Right") in known), row


def test_the_general_table_takes_no_place_of_a_family() -> None:
    mapping = guess_mapping(["mouthOpen", "h_expressions.MouthOpen_h", "h_expressions.Kiss_h", "h_expressions.S_h"])
    assert mapping["jawOpen"] == (ShapeSource("h_expressions.MouthOpen_h", 1.5),)


@pytest.mark.parametrize("names", [
    [f"Key {number}" for number in range(1, 16)], ["Basis", "breath", "mood"], ["a", "b", "e"], ["L", "R", "E"],
    ["1", "2", "3"], ["Smile_bone", "eyelashes", "left_hand_fist"],
])  # fmt: skip
def test_names_of_no_family_are_left_alone(names: list[str]) -> None:
    assert not understood(names)


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("JAWOPEN", "jawOpen"), ("EYEBLINKLEFT", "eyeBlinkLeft"), ("MOUTH_SMILE_R", "mouthSmileRight"),
        ("eye closed.L", "eyeBlinkLeft"), ("jawOpen.001", "jawOpen"), ("ｊａｗＯｐｅｎ", "jawOpen"),
        ("L_eyeBlink", "eyeBlinkLeft"), ("eyeLookLeft", "eyeLookOutLeft"), ("lookRight", "eyeLookInLeft"),
    ],
)  # fmt: skip
def test_spellings(name: str, shape: str) -> None:
    assert guess_mapping([name])[shape][0].name == name


def test_a_gaze_of_both_eyes_is_divided() -> None:
    mapping = guess_mapping(["lookLeft", "lookRight"])
    assert mapping["eyeLookOutLeft"] == (ShapeSource("lookLeft", 1.0, "Left"),)
    assert mapping["eyeLookInRight"] == (ShapeSource("lookLeft", 1.0, "Right"),)
    assert mapping["eyeLookOutRight"] == (ShapeSource("lookRight", 1.0, "Right"),)


@pytest.mark.parametrize(
    ("combination", "others"),
    [
        ("jawOpen_mouthClose", ["mouthClose", "jawOpen"]),
        ("jawOpen__mouthClose", ["mouthClose", "jawOpen"]),
        ("jawOpen.mouthClose", ["mouthClose", "jawOpen"]),
        ("JawOpenMouthClose", ["JawOpen", "MouthClose"]),
        ("mouthSmile_L-browDown_L", ["mouthSmile_L", "browDown_L"]),
        ("corrective_jawOpen", ["jawOpen"]),
        ("MyShape_jawOpen", ["MyShape", "jawOpen"]),
        ("AU12_L_AU26", ["AU12_L", "AU26"]),
    ],
)
def test_combinations_are_none_of_their_parts(combination: str, others: list[str]) -> None:
    names = [combination, *others]
    assert list(combinations_of_shapes(names)) == [combination]
    assert combination not in understood(names)


@pytest.mark.parametrize(
    ("combination", "others", "shapes"),
    [
        ("jawOpen_mouthClose", ["mouthClose", "jawOpen"], "jawOpen*mouthClose"),
        ("JawOpenMouthClose", ["JawOpen", "MouthClose"], "jawOpen*mouthClose"),
        ("mouthSmile_L-browDown_L", ["mouthSmile_L", "browDown_L"], "browDownLeft*mouthSmileLeft"),
        ("combo_jawOpen_mouthPucker", ["jawOpen", "mouthPucker"], "jawOpen*mouthPucker"),
        ("AU12_L_AU26", ["AU12_L", "AU26"], "jawOpen*mouthSmileLeft"),
        ("corrective_jawOpen", ["jawOpen"], ""),
        ("jawOpen_mouthClose", ["jawOpen"], ""),
        ("jawOpen_mouthSmile", ["jawOpen", "mouthSmile"], ""),
    ],
)
def test_combinations_are_driven_where_their_parts_are(combination: str, others: list[str], shapes: str) -> None:
    """A part that the file lacks, or that is divided at the middle of the face, leaves its combination alone."""
    mapping = guess_mapping([combination, *others])
    added = set(with_combinations(mapping, [combination, *others])) - set(mapping)
    assert added == ({f"combination*{shapes}"} if shapes else set())


def test_a_prefix_is_no_part_of_a_combination() -> None:
    assert not combinations_of_shapes(["Head_jawOpen", "Head_mouthSmileLeft", "blendShape1.mouthClose", "eyeBlink_L"])
    assert understood(["Head_jawOpen", "blendShape1.mouthClose"]) == ["Head_jawOpen", "blendShape1.mouthClose"]


def test_sums_and_alternatives() -> None:
    assert general_family().sources({"blinkleft": "blink_L", "eyesclosed": "eyesClosed"})["eyeBlinkLeft"] == (
        ShapeSource("blink_L"),
    )
    mapping = guess_mapping(["CTRL_expressions_jawOpen", *(f"CTRL_expressions_mouthFunnel{at}" for at in ("UL", "DR"))])
    assert [source.name[-2:] for source in mapping["mouthFunnel"]] == ["UL", "DR"]


def with_side_to_side(name: str, step: tuple[float, float, float], *, faces_back: bool = False) -> Character:
    """A character of three vertices that one shape moves by `step`."""
    moved = np.tile(np.array(step, np.float32), (3, 1))
    piece = MaterialPiece("skin", np.eye(3), np.arange(3)[None], None, None, 0, {JAW: moved}, np.zeros(3, np.int64))
    return Character((piece,), (Material("skin"),), {JAW: name}, {}, {}, {}, {}, faces_back, "")


@pytest.mark.parametrize("faces_back", [False, True])
@pytest.mark.parametrize("along", [1.0, -1.0])
def test_which_side_a_side_to_side_moves_to_is_read_from_the_mesh(along: float, faces_back: bool) -> None:
    character = with_side_to_side("eCTRLJawSide-Side", (along, 0.1, 0.2), faces_back=faces_back)
    mapping = guess_mapping(["eCTRLJawSide-Side", "eCTRLMouthOpen"])
    assert [mapping[shape][0].side for shape in ("jawLeft", "jawRight")] == ["", ""]
    turned = with_directions(mapping, character)
    to_left = -along if faces_back else along
    assert (turned["jawLeft"][0].gain, turned["jawRight"][0].gain) == (to_left, -to_left)
    assert turned["jawOpen"] == mapping["jawOpen"]


@pytest.mark.parametrize(
    ("name", "shape", "step", "gain"),
    [
        ("eCTRLTongueIn-Out", "tongueOut", (0.0, 0.0, -1.0), -1.0),
        ("eCTRLTongueIn-Out", "tongueOut", (0.0, 0.0, 1.0), 1.0),
        ("eCTRLLipTopIn-Out", "mouthRollUpper", (0.0, 0.0, 1.0), -1.0),
        ("facs_bs_JawLeft", "jawLeft", (-1.0, 0.0, 0.0), 1.0),
    ],
)
def test_only_names_of_two_directions_are_turned(
    name: str, shape: str, step: tuple[float, float, float], gain: float
) -> None:
    mapping = {shape: (ShapeSource(name),)}
    assert with_directions(mapping, with_side_to_side(name, step))[shape] == (ShapeSource(name, gain),)


def test_visemes_of_contacts_stand_beside_a_jaw() -> None:
    own = ["jawOpen", "mouthFunnel", "mouthPucker", "mouthSmile"]
    mapping = guess_mapping([*own, "viseme_aa", "viseme_FF", "viseme_PP"])
    assert [shape for shape in mapping if "Viseme" in shape] == ["mouthViseme_ff", "mouthViseme_pp"]


def test_many_visemes_speak_beside_a_mouth_that_opens_and_smiles() -> None:
    visemes = ["PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U"]
    names = ["mouthOpen", "mouthSmile", "eyesClosed", *(f"viseme_{viseme}" for viseme in visemes)]
    assert understood(names) == names
    assert not [shape for shape in guess_mapping([*names, *ARKIT_SHAPES]) if "Viseme" in shape]
