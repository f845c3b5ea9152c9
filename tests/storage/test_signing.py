"""Signatures of C2PA, made with a certificate of a test authority and read by the library and by `inspect_file`."""

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

import tts2face
from lexicon.errors import BackendError, DataError, InputError
from tests.packages import package
from tests.world import World
from tts2face.picture.options import Picture
from tts2face.session.inspection import inspect_file
from tts2face.storage.marks import Mark
from tts2face.storage.signing import NOT_CHECKED, Credentials, Signature, Signer

c2pa = package("c2pa")
ec = package("cryptography.hazmat.primitives.asymmetric.ec")
ed25519 = package("cryptography.hazmat.primitives.asymmetric.ed25519")
rsa = package("cryptography.hazmat.primitives.asymmetric.rsa")
purposes = package("cryptography.x509.oid").ExtendedKeyUsageOID
authority = package("tests.storage.authority")
issue, Wanted = authority.issue, authority.Wanted

SMALL = Picture(size="64x64", supersampling=1)
KNOWN = Signature("Valid", "Ann", f"tts2face {tts2face.__version__}", "trainedAlgorithmicMedia",
                  ("signingCredential.untrusted",))  # fmt: skip


@pytest.fixture(scope="module")
def signer(tmp_path_factory: pytest.TempPathFactory) -> Signer:
    return issue(tmp_path_factory.mktemp("signer")).open()


@pytest.fixture(scope="module")
def session(world: World, signer: Signer) -> tts2face.Session:
    return world.session().signed_by(signer)


@pytest.mark.parametrize("name", ["a.mp4", "a.mov", "a.gif", "a.wav"])
def test_files_are_signed_as_what_they_are(name: str, session: tts2face.Session, tmp_path: Path) -> None:
    out = tmp_path / name
    if name.endswith("wav"):
        session.export("Bob may.", out)
    else:
        session.write("Bob may.", out, picture=SMALL)
    found = inspect_file(out)
    assert found.signature == KNOWN
    assert (found.source, found.text) == ("trainedAlgorithmicMedia", "Bob may.")  # its own marks outlive the signature
    assert not list(tmp_path.glob(".*"))
    with c2pa.Reader(str(out)) as reader:
        manifest = json.loads(reader.json())
    active = manifest["manifests"][manifest["active_manifest"]]
    assert "thumbnail" not in active
    out.write_bytes(out.read_bytes().replace(b"Bob may.", b"Bob may!"))
    changed = inspect_file(out).signature
    assert changed is not None
    assert changed.state == "Invalid"


@pytest.mark.parametrize("format", ["mp3", "flac", "wav", "mp4"])
def test_complete_files_of_streams_are_signed(format: str, session: tts2face.Session, tmp_path: Path) -> None:
    options = {} if format != "mp4" else {"picture": SMALL}
    out = tmp_path / f"a.{format}"
    out.write_bytes(
        b"".join(c.content for c in session.stream_file("Bob may.", format, is_complete=True, **options))  # type: ignore[arg-type]
    )
    assert inspect_file(out).signature == KNOWN


def test_the_manifest_of_webm_lies_beside_it(session: tts2face.Session, tmp_path: Path) -> None:
    session.write("Bob may.", tmp_path / "a.webm", picture=SMALL)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.c2pa", "a.webm"]
    assert inspect_file(tmp_path / "a.webm").signature == KNOWN
    (tmp_path / "a.webm").write_bytes((tmp_path / "a.webm").read_bytes() + b"\0")
    changed = inspect_file(tmp_path / "a.webm").signature
    assert changed is not None
    assert changed.state == "Invalid"


def test_each_picture_of_a_folder_is_signed(session: tts2face.Session, tmp_path: Path) -> None:
    session.write("", tmp_path / "frames", picture=SMALL, idle=0.1, fps=10.0)
    assert {inspect_file(path).signature for path in (tmp_path / "frames").iterdir()} == {KNOWN}


def test_readers_that_know_the_authority_trust_the_file(session: tts2face.Session, tmp_path: Path) -> None:
    session.export("Bob may.", tmp_path / "a.wav")
    trust = {"trust": {"trust_anchors": authority.root().decode()}, "verify": {"verify_trust": True}}
    context = c2pa.Context(settings=c2pa.Settings.from_json(json.dumps(trust)))
    with (tmp_path / "a.wav").open("rb") as file, c2pa.Reader("audio/wav", file, context=context) as reader:
        assert reader.get_validation_state() == "Trusted"


def test_without_the_package_a_signature_is_seen_and_not_checked(
    session: tts2face.Session, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    session.export("Bob may.", tmp_path / "a.wav")
    monkeypatch.setitem(sys.modules, "c2pa", None)
    assert inspect_file(tmp_path / "a.wav").signature == NOT_CHECKED
    with pytest.raises(BackendError, match=r"install it with: pip install 'tts2face\[c2pa\]'"):
        issue(tmp_path).open()


KEYS = {
    "P-384": lambda: ec.generate_private_key(ec.SECP384R1()),
    "Ed25519": ed25519.Ed25519PrivateKey.generate,
    "RSA": lambda: rsa.generate_private_key(65537, 2048),
    "encrypted": lambda: ec.generate_private_key(ec.SECP256R1()),
}


@pytest.mark.parametrize("name", KEYS)
def test_all_kinds_of_keys_sign(name: str, world: World, tmp_path: Path) -> None:
    password = "open sesame" if name == "encrypted" else ""
    credentials = replace(issue(tmp_path, Wanted(key=KEYS[name](), password=password)), password=password)
    world.session().signed_by(credentials.open()).export("Bob may.", tmp_path / "a.wav")
    assert inspect_file(tmp_path / "a.wav").signature == KNOWN


def test_the_end_of_the_certificate_is_said_where_no_time_is_confirmed(signer: Signer) -> None:
    assert signer.note == (
        f"signed files turn invalid on {signer.ends}, when the certificate ends; a time-stamp authority confirms that "
        "they were signed before"
    )
    assert replace(signer, authority="http://stamp.example").note == ""


def test_keys_and_passwords_are_never_shown(signer: Signer, tmp_path: Path) -> None:
    assert "PRIVATE" not in repr(signer)
    assert "sesame" not in repr(replace(issue(tmp_path), password="open sesame"))


LACKING: dict[str, tuple[Any, str]] = {
    "usage": (Wanted(usage="key_agreement"), r"it lacks the key usage digitalSignature; have one issued with it"),
    "purpose": (Wanted(purpose=purposes.SERVER_AUTH), r"it lacks an extended key usage \(email protection"),
    "no purpose": (Wanted(purpose=None, has_authority=False), r"document signing\), an authority key identifier; have"),
    "authority": (Wanted(is_authority=True), r"it is that of an authority; give one that it issued"),
    "ended": (Wanted(days=(-9, -2)), r"is valid from \d{4}-\d\d-\d\d to \d{4}-\d\d-\d\d; give a valid one"),
    "curve": (Wanted(key=ec.generate_private_key(ec.SECP256K1())), r"C2PA signs with P-256, .*key.pem is not"),
    "short": (Wanted(key=rsa.generate_private_key(65537, 1024)), r"C2PA signs with P-256, .*key.pem is not"),
}


@pytest.mark.parametrize("name", LACKING)
def test_a_certificate_that_c2pa_refuses_is_refused_with_what_it_lacks(name: str, tmp_path: Path) -> None:
    wanted, reason = LACKING[name]
    with pytest.raises(InputError, match=reason):
        issue(tmp_path, wanted).open()


def _other_key(good: Credentials) -> dict[str, Any]:
    other = good.key.with_name("other")
    other.mkdir()
    return {"key": issue(other).key}


def _no_pem(good: Credentials) -> Path:
    path = good.key.with_name("text.pem")
    path.write_text("no PEM")
    return path


WRONG: dict[str, tuple[Any, type[Exception], str]] = {
    "no key": (lambda good: {"key": good.key.with_name("absent.pem")}, InputError, r"absent.pem cannot be read"),
    "other key": (_other_key, InputError, r"is not that of the first certificate in .*certificate.pem; give its own"),
    "key": (lambda good: {"key": _no_pem(good)}, DataError, r"text.pem holds no private key in PEM; convert it"),
    "certificate": (lambda good: {"certificate": _no_pem(good)}, DataError, r"text.pem holds no certificate in PEM"),
    "authority": (lambda _: {"authority": "ftp://a"}, InputError, r"has an address of HTTP, not 'ftp://a'; correct it"),
}


@pytest.mark.parametrize("name", WRONG)
def test_wrong_credentials_are_refused_with_the_reason(name: str, tmp_path: Path) -> None:
    change, kind, reason = WRONG[name]
    good = issue(tmp_path)
    with pytest.raises(kind, match=reason):
        replace(good, **change(good)).open()


def test_passwords_are_missing_or_wrong(tmp_path: Path) -> None:
    good = issue(tmp_path, Wanted(password="open sesame"))
    with pytest.raises(InputError, match=r"is encrypted; set its password in TTS2FACE_SIGN_PASSWORD"):
        good.open()
    with pytest.raises(InputError, match=r"the password of the key .*key.pem is wrong; correct it"):
        replace(good, password="shut").open()


def test_an_authority_that_does_not_answer_leaves_no_file(world: World, tmp_path: Path) -> None:
    credentials = replace(issue(tmp_path), authority="http://127.0.0.1:9/stamp")
    session = world.session().signed_by(credentials.open())
    with pytest.raises(BackendError, match=r"cannot be signed, or http://127.0.0.1:9/stamp does not answer"):
        session.export("Bob may.", tmp_path / "a.wav")
    assert not (tmp_path / "a.wav").exists()


def test_only_synthetic_sources_are_signed(signer: Signer, tmp_path: Path) -> None:
    (tmp_path / "a.wav").write_bytes(b"RIFF")
    with pytest.raises(InputError, match=r"are not signed as 'digitalCapture'; state trainedAlgorithmicMedia or"):
        signer.sign(tmp_path / "a.wav", "wav", Mark("a", "digitalCapture"))
