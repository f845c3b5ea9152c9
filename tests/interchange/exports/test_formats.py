"""The suffix selects the format; names that are ambiguous or unknown are refused with the choices."""

from pathlib import Path

import pytest

from lexicon.errors import InputError
from tts2face.interchange.exports.table import FORMATS, find_format, is_export, split_format
from tts2face.interchange.exports.writer import plan_exports, sound_path


@pytest.mark.parametrize("one", FORMATS, ids=lambda one: one.name)
def test_every_suffix_selects_its_format_in_any_case(one):
    for suffix in one.suffixes:
        for name in (f"clip{suffix}", f"a.b.clip{suffix.upper()}"):
            assert find_format(Path(name)) is one
            assert is_export(name)
    assert find_format(Path("clip.xyz"), one.name) is one
    assert one.make_writer().__doc__


def test_names_and_suffixes_are_unique():
    names = [one.name for one in FORMATS]
    suffixes = [suffix for one in FORMATS for suffix in one.suffixes]
    assert len(set(names)) == len(names)
    assert len(set(suffixes)) == len(suffixes)


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        (
            "clip.jsonl",
            r"clip.jsonl may have several formats; end its name in .oculus.jsonl, .azure.jsonl, .curves.jsonl or "
            r".words.jsonl",
        ),
        ("clip.tsv", r"end its name in .rhubarb.tsv"),
        ("clip.fbx", "clip.fbx has no suffix of an export format"),
        ("clip", "clip has no suffix of an export format"),
    ],
)
def test_other_names_are_refused(name, reason):
    assert not is_export(name)
    with pytest.raises(InputError, match=reason):
        find_format(Path(name))


def test_a_format_before_a_colon_wins_over_the_suffix():
    assert split_format("track:clip.data") == (Path("clip.data"), "track")
    assert split_format("a:b.glb") == (Path("a:b.glb"), None)
    assert split_format(Path("track:clip.glb")) == (Path("track:clip.glb"), None)


def test_an_unknown_format_is_refused():
    with pytest.raises(InputError, match="no export format 'fbx'; choose one of track, livelink"):
        find_format(Path("clip.glb"), "fbx")


def test_the_sound_beside_a_mesh_is_planned_once(tmp_path):
    planned = plan_exports([tmp_path / "clip.glb", tmp_path / "clip.usda", tmp_path / "clip.csv"])
    assert [file.path.name for file in planned] == ["clip.glb", "clip.usda", "clip.csv", "clip.wav"]
    planned = plan_exports([tmp_path / "clip.wav", tmp_path / "clip.glb"])
    assert [file.path.name for file in planned] == ["clip.wav", "clip.glb"]
    assert sound_path(Path("a/b.scene.glb")) == Path("a/b.scene.wav")  # another scene has its own sound


@pytest.mark.parametrize(
    ("paths", "options", "reason"),
    [
        (["a.glb", "./a.glb"], {}, "two exports have the same path"),
        (["no/a.glb"], {}, "there is no folder no"),
        ([".glb"], {}, "is only a suffix"),
        (["folder.glb"], {}, "folder.glb is a folder"),
        (["a.vtt"], {"fps": 25}, "a.vtt has no frames, so fps has no effect"),
        (["a.glb"], {"fps": 0.5}, "fps must lie between 1 and 120"),
        (["sound.glb"], {}, "sound.wav is a folder"),
    ],
)
def test_paths_that_cannot_be_written_are_refused_before_work(paths, options, reason, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.glb").mkdir()
    (tmp_path / "sound.wav").mkdir()
    with pytest.raises(InputError, match=reason):
        plan_exports(paths, **options)
