"""A face speaks in a voice of its sex and age: the one that is installed, else the language's in another pitch."""

import json
import shutil
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

import pytest

from cli.main import run
from lexicon.errors import InputError
from tts2face.interchange.characters.saving import state_person
from tts2face.models.face_loading import load_face
from tts2face.models.person import FEMALE, MALE, SHIPPED_PEOPLE, Person, parse_person, person_of, seed_of
from tts2face.request import Request, Spoken
from tts2face.session.catalogue import shipped_names
from tts2face.session.named_models import Models
from tts2face.session.prepared import prepare
from tts2face.session.shared_models import SessionModels
from tts2face.sound import fitting, voice_pool
from tts2face.sound.delivery import sound_with
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.prosody import PLAIN_PROSODY, Prosody
from tts2face.sound.voice_pool import load_voice
from tts2face.storage.shipped import find_file

WITHOUT = "a_module_that_nobody_has"


@pytest.fixture
def only_heart(monkeypatch: pytest.MonkeyPatch) -> None:
    """One neural voice is installed."""
    voices = dict(voice_pool.SHIPPED_VOICES)
    there = {name: voice if name == "heart" else replace(voice, package=WITHOUT) for name, voice in voices.items()}
    for module in (voice_pool, fitting):
        monkeypatch.setattr(module, "SHIPPED_VOICES", MappingProxyType(there))
    fitting_voice.cache_clear()
    yield
    fitting_voice.cache_clear()


@pytest.mark.usefixtures("only_heart")
@pytest.mark.parametrize(
    ("person", "lowest", "highest"),
    [
        (Person(MALE, 25), 110, 122),  # men: 132 Hz where women have 223, and heart 193
        (Person(MALE, 75), 120, 130),
        (Person(FEMALE, 75), 165, 178),
        (Person(FEMALE, 8), 220, 235),
    ],
)
def test_one_voice_is_changed_by_what_people_differ(person: Person, lowest: float, highest: float) -> None:
    found = fitting_voice(person, "en-us")
    assert found.name == "heart"
    assert lowest < 193 * 2 ** (found.prosody.pitch / 12) < highest
    assert (found.prosody.formants < 1) == (person.sex == MALE or person.age > 60)
    assert found.described.startswith("heart, " + ("lowered" if found.prosody.pitch < 0 else "raised"))
    assert found.described in found.sentence


@pytest.mark.usefixtures("only_heart")
def test_grown_up_women_and_unknown_people_have_the_voice_as_it_is() -> None:
    for person in (None, Person(FEMALE, 20), Person(FEMALE, 45)):
        assert fitting_voice(person, "en-us") == fitting.Fitting("heart", PLAIN_PROSODY, "")
    assert fitting_voice(None, "de").name == "espeak"


def test_a_boy_speaks_as_a_girl_does_in_any_language() -> None:
    for language in ("en-us", "de"):
        boy, girl = (fitting_voice(Person(sex, 9), language) for sex in (MALE, FEMALE))
        assert (boy.name, boy.prosody) == (girl.name, girl.prosody)
        assert "a boy of 9" in boy.sentence
        assert boy.prosody.pitch < 4
    assert fitting_voice(Person(MALE, 14), "de").name == "espeak"


@pytest.mark.usefixtures("only_heart")
def test_the_voice_that_is_recommended_is_of_the_sex() -> None:
    for sex, name in ((MALE, "fable"), (FEMALE, "emma")):
        assert f"voices add {name}`" in fitting_voice(Person(sex), "en-gb").sentence


def test_old_people_speak_more_slowly_in_any_voice() -> None:
    old = fitting_voice(Person(MALE, 80), "de")
    assert (old.name, old.prosody.rate, old.prosody.pitch) == ("espeak", 0.92, 1.5)
    assert fitting_voice(Person(FEMALE, 30), "de").name == "espeak-female"


def test_prosodies_are_combined_by_factors_and_steps() -> None:
    both = Prosody(0.9, -2.0, 1.2, 0.9).combined(Prosody(2.0, 1.0, 0.5, 0.8))
    assert (both.rate, both.pitch, both.range, both.formants) == pytest.approx((1.8, -1.0, 0.6, 0.72))


@pytest.mark.parametrize(
    ("written", "person"),
    [
        ("female", Person(FEMALE, 30)), ("man 70", Person(MALE, 70)), ("Girl", Person(FEMALE, 9)),
        ("woman, 25", Person(FEMALE, 25)), ("male:40", Person(MALE, 40)), (" boy 6 ", Person(MALE, 6)),
    ],
)  # fmt: skip
def test_people_are_written_as_sex_and_age(written: str, person: Person) -> None:
    assert parse_person(written) == person


@pytest.mark.parametrize("written", ["", "70", "person", "woman of 70", "man 121", "man -3", "woman 70 80"])
def test_other_words_are_refused(written: str) -> None:
    with pytest.raises(InputError, match="woman 70"):
        Models(person=written)


def test_every_shipped_face_is_somebody() -> None:
    assert {(name, None) for name in shipped_names("face")} <= SHIPPED_PEOPLE.keys()
    assert Models(identity="nia").shown_person() == Person(FEMALE, 9)
    assert Models(face="ben", person="woman 50").shown_person() == Person(FEMALE, 50)
    assert Models(face="self").shown_person() is None


def test_a_face_of_a_user_says_who_it_shows() -> None:
    assert person_of({"name": "mine", "person": "man 70"}) == Person(MALE, 70)
    assert person_of({"name": "ben", "character": {}}) is None
    assert person_of({"name": "mara", "consent": {}}) is None
    assert person_of({"name": "ada", "person": "a robot"}) is None


def test_faces_have_seeds_of_their_own() -> None:
    found = {seed_of(Models(face=name).description()) for name in shipped_names("face")}
    assert len(found) == len(shipped_names("face"))
    assert seed_of(Models().description()) == 0  # motion of the default face stays as it was
    assert seed_of(Models(identity="kofi").description()) != seed_of(Models(face="head").description())


def test_auto_is_the_same_as_no_voice() -> None:
    assert Request(text="Hello.", voice="auto") == Request(text="Hello.") == Request(source=Spoken("Hello.", "auto"))
    assert Request(voice="auto", idle=2.0) == Request(idle=2.0)


def test_a_face_file_holds_who_it_shows(tmp_path: Path) -> None:
    path = Path(shutil.copy(find_file("head", "face"), tmp_path / "mine.face"))
    assert Models(face=str(path)).shown_person() == Person(FEMALE, 30)
    state_person(path, "man 70")
    assert Models(face=str(path)).shown_person() == Person(MALE, 70)
    assert load_face(str(path)).metadata["person"] == "man 70"
    with pytest.raises(InputError, match="woman 70"):
        state_person(path, "somebody")


def test_sessions_speak_and_move_as_their_faces() -> None:
    models = {name: SessionModels("grid_s1", load_face("head", name), None) for name in (None, "kofi")}
    seeds = [one.seeded(Request(idle=1.0)).seed for one in models.values()]
    assert seeds == [seed_of(Models(face="head", identity=name).description()) for name in models]
    assert len(set(seeds)) == 2
    assert models[None].person != models["kofi"].person
    prepared = prepare(Request(text="Hello."))
    assert prepared.with_seed(7).request.seed == 7
    assert prepare(Request(text="Hello.", seed=3)).with_seed(7).request.seed == 3
    assert prepared.fitting(Person(FEMALE, 75)).prosody.pitch == -2.0
    assert prepare(Request(text="Hello.", voice="espeak")).fitting(Person(FEMALE, 75)) == fitting.Fitting("espeak")
    assert prepare(Request(idle=1.0)).fitting(None) is None


def test_the_command_line_says_who_speaks_once(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = ["Hello there. And here.", "--gestures", "none"]
    assert run([*text, "--face", "noor", "--explain", str(tmp_path / "a.txt")]) == 0
    said = capsys.readouterr().err
    assert said.count("the face shows an old woman and speaks as heart, lowered by 2 semitones") == 1
    assert (tmp_path / "a.txt").read_text(encoding="utf-8").startswith("voice: heart, lowered by 2 semitones")
    assert run([*text, "--person", "girl", "--out", str(tmp_path / "a.wav"), "--export", str(tmp_path / "a.vtt")]) == 0
    assert "a girl of 9 and speaks as heart, raised" in capsys.readouterr().err
    assert run([*text, "--voice", "espeak", "--explain", str(tmp_path / "a.json")]) == 0
    assert "speaks as" not in capsys.readouterr().err
    explained = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert {phone["voice"] for phone in explained} == {"espeak"}


@pytest.mark.parametrize("name", ["heart", "espeak"])
def test_a_changed_voice_gives_the_same_bytes_again(name: str) -> None:
    voice = load_voice(name, "en-us")
    changed = Prosody(1.2, -3.0, 1.0, 0.9)
    one, other = (sound_with(voice, "She sells sea shells.", changed, 1, language="en-us") for _ in range(2))
    assert one.samples.tobytes() == other.samples.tobytes()


@pytest.mark.usefixtures("only_heart")
def test_pitches_in_hertz_are_those_of_the_voice_that_speaks() -> None:
    text = '<speak><prosody pitch="150Hz">Hello.</prosody></speak>'
    changes = {}
    for person in (None, Person(FEMALE, 75), Person(MALE, 30)):
        prepared = prepare(Request(text=text), person)
        fitted = prepared.fitting(person)
        assert fitted is not None
        changes[person] = prepared.text.runs[0].tone.pitch + fitted.prosody.pitch
    first, *others = changes.values()
    assert others == pytest.approx([first] * 2, abs=0.01)
