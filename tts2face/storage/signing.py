"""Signed statements of the making of files (C2PA), with the certificate and key of an operator, by extra ``[c2pa]``.

A manifest is made last: tags, XMP or a copy afterwards make it invalid. It has no thumbnail, which would be larger than
the rest. Sources: C2PA specification 2.2, sections 14.5 (certificates) and 18.15 (actions); c2pa-python 0.38.
"""

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError, DataError, InputError, import_of_extra
from lexicon.values.fields import check_fields
from lexicon.values.json_text import parse_json
from tts2face.storage.marks import COMPOSITE, SOURCE_TYPES, TRAINED, VERSION, Mark

if TYPE_CHECKING:
    from cryptography.x509 import Certificate

MISSING = "signatures of C2PA need c2pa-python; install it with: pip install 'tts2face[c2pa]'"
PASSWORD = "TTS2FACE_SIGN_PASSWORD"  # environment variable: flags are seen in lists of processes
MAX_PEM_BYTES = 100_000
# Media types by FFmpeg's name of the format: those that hold a manifest, and those beside which it lies.
EMBEDDED: Mapping[str, str] = MappingProxyType({
    "mp4": "video/mp4", "mov": "video/quicktime", "gif": "image/gif", "png": "image/png", "wav": "audio/wav",
    "mp3": "audio/mpeg", "flac": "audio/flac",
})  # fmt: skip
BESIDE: Mapping[str, str] = MappingProxyType(
    {"webm": "video/webm", "matroska": "video/webm", "ogg": "audio/ogg", "adts": "audio/aac"}
)
SIDECAR_SUFFIX = ".c2pa"
_NO_THUMBNAIL = json.dumps({"builder": {"thumbnail": {"enabled": False}}})
_USAGES = {"1.3.6.1.5.5.7.3.4": "email protection", "1.3.6.1.5.5.7.3.36": "document signing"}
_FAMILY = {"es256": "secp256r1", "es384": "secp384r1", "es512": "secp521r1"}
_LEAST_RSA_BITS = 2048
# Of files of others that are read; any other one has its sidecar checked by its bytes.
_READ: Mapping[str, str] = MappingProxyType({"jpeg": "image/jpeg", "webp": "image/webp", **EMBEDDED, **BESIDE})
_OTHER = "application/octet-stream"


@dataclass(frozen=True, slots=True)
class Credentials:
    """Files of an operator with which files are signed.

    Parameters
    ----------
    certificate
        PEM: the signer's certificate, then those of its authorities but for the last one.
    key
        PEM: the private key of the first certificate; it is never shown.
    password
        Of an encrypted key.
    authority
        Address of a time-stamp authority (RFC 3161); empty: the time of signing is not confirmed.
    """

    certificate: Path
    key: Path
    password: str = field(default="", repr=False)
    authority: str = ""

    def __post_init__(self) -> None:
        """Reject values of other types."""
        check_fields(self)

    def as_json(self) -> dict[str, str]:
        """Arguments for another process of this machine; not for a log."""
        return {"certificate": str(self.certificate), "key": str(self.key), "password": self.password,
                "authority": self.authority}  # fmt: skip

    @classmethod
    def from_json(cls, content: Mapping[str, str]) -> "Credentials":
        """Credentials of `as_json`."""
        return cls(Path(content["certificate"]), Path(content["key"]), content["password"], content["authority"])

    def open(self) -> "Signer":
        """Who signs, with files that are checked.

        Raises
        ------
        BackendError
            c2pa-python is not installed.
        InputError
            A file does not exist, the password is wrong, the key is not that of the certificate, the certificate lacks
            what C2PA demands or has ended, or the address is none of HTTP.
        DataError
            A file is no PEM.
        """
        with import_of_extra(MISSING):
            import c2pa  # noqa: F401
            from cryptography.x509 import load_pem_x509_certificates
        chain_pem, key_pem = _read(self.certificate, "certificate"), _read(self.key, "key")
        try:
            chain = load_pem_x509_certificates(chain_pem)
        except ValueError as wrong:
            raise DataError(f"{self.certificate} holds no certificate in PEM; convert it") from wrong
        algorithm, plain = _check_key(self, key_pem, chain[0])
        _check_certificate(chain[0], self.certificate)
        if self.authority and not self.authority.startswith(("http://", "https://")):
            raise InputError(f"a time-stamp authority has an address of HTTP, not {self.authority!r}; correct it")
        return Signer(chain_pem, plain, algorithm, self.authority, f"{chain[0].not_valid_after_utc:%Y-%m-%d}")


@dataclass(frozen=True, slots=True)
class Signer:
    """Who signs files; made by `Credentials.open`."""

    chain: bytes = field(repr=False)
    key: bytes = field(repr=False)
    algorithm: str
    authority: str
    ends: str

    @property
    def fingerprint(self) -> str:
        """SHA-256 of the certificates."""
        return hashlib.sha256(self.chain).hexdigest()

    @property
    def note(self) -> str:
        """Sentence on signed files after the end of the certificate; empty where a time stamp keeps them valid."""
        if self.authority:
            return ""
        return (
            f"signed files turn invalid on {self.ends}, when the certificate ends; a time-stamp authority "
            "confirms that they were signed before"
        )

    def sign(self, path: Path, format: str, mark: Mark) -> None:
        """Replace a complete file by a signed one; formats that hold no manifest stay as they are.

        Raises
        ------
        InputError
            The mark states no synthetic source, which the library would sign all the same.
        BackendError
            The library, or the time-stamp authority, refuses.
        """
        if format not in EMBEDDED:
            return
        signed = path.with_name(f"{path.name}.signed")
        try:
            self._manifest(path, EMBEDDED[format], mark, signed)
            signed.replace(path)
        finally:
            signed.unlink(missing_ok=True)

    def sidecar(self, path: Path, format: str, mark: Mark) -> bytes:
        """Manifest that lies beside a complete file of a format that holds none; errors as `sign`."""
        return self._manifest(path, BESIDE[format], mark, None)

    def _manifest(self, path: Path, media_type: str, mark: Mark, signed: Path | None) -> bytes:
        import c2pa

        if mark.source not in {TRAINED, COMPOSITE}:
            raise InputError(f"files of tts2face are not signed as {mark.source!r}; state {TRAINED} or {COMPOSITE}")
        context = c2pa.Context(settings=c2pa.Settings.from_json(_NO_THUMBNAIL))
        try:
            info = c2pa.C2paSignerInfo(
                self.algorithm.encode(), self.chain, self.key, self.authority.encode() if self.authority else None
            )
            builder = c2pa.Builder(_statement(mark), context=context)
            if signed is None:
                builder.set_no_embed()
            with path.open("rb") as source, Path(signed or os.devnull).open("w+b") as target:
                return bytes(builder.sign(c2pa.Signer.from_info(info), media_type, source, target))
        except c2pa.C2paError as refused:
            stamp = f", or {self.authority} does not answer" if self.authority else ""
            raise BackendError(f"the file cannot be signed{stamp}: {str(refused)[:300]}") from refused


def _statement(mark: Mark) -> dict[str, Any]:
    agent = {"name": "tts2face", "version": VERSION}
    action = {"action": "c2pa.created", "digitalSourceType": mark.source_uri, "softwareAgent": agent}
    return {
        "claim_generator_info": [agent],
        "title": mark.notice,
        "assertions": [{"label": "c2pa.actions.v2", "data": {"actions": [action]}}],
    }


def _read(path: Path, what: str) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(MAX_PEM_BYTES)
    except OSError as refused:
        raise InputError(f"the {what} {path} cannot be read ({refused.strerror}); check the path") from refused


def _check_key(credentials: Credentials, pem: bytes, certificate: "Certificate") -> tuple[str, bytes]:
    """C2PA's name of the algorithm of a key, and the key without its password."""
    from cryptography.hazmat.primitives import serialization

    path, password = credentials.key, credentials.password.encode() or None
    try:
        key = serialization.load_pem_private_key(pem, password if b"ENCRYPTED" in pem else None)
    except TypeError as missing:
        raise InputError(f"the key {path} is encrypted; set its password in {PASSWORD}") from missing
    except ValueError as wrong:
        if password and b"ENCRYPTED" in pem:
            raise InputError(f"the password of the key {path} is wrong; correct it") from wrong
        raise DataError(f"{path} holds no private key in PEM; convert it") from wrong
    encoding, form = serialization.Encoding.DER, serialization.PublicFormat.SubjectPublicKeyInfo
    if key.public_key().public_bytes(encoding, form) != certificate.public_key().public_bytes(encoding, form):
        raise InputError(
            f"the key {path} is not that of the first certificate in {credentials.certificate}; give its own"
        )
    plain = key.private_bytes(
        serialization.Encoding.PEM, serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    )
    return _algorithm(key, path), plain


def _algorithm(key: Any, path: Path) -> str:
    from cryptography.hazmat.primitives.asymmetric import ec, ed25519, rsa

    if isinstance(key, ed25519.Ed25519PrivateKey):
        return "ed25519"
    if isinstance(key, rsa.RSAPrivateKey) and key.key_size >= _LEAST_RSA_BITS:
        return "ps256"
    curve = key.curve.name if isinstance(key, ec.EllipticCurvePrivateKey) else ""
    named = next((name for name, known in _FAMILY.items() if known == curve), None)
    if named is None:
        raise InputError(f"C2PA signs with P-256, P-384, P-521, Ed25519 or RSA of 2048 bits, which {path} is not")
    return named


def _check_certificate(certificate: "Certificate", path: Path) -> None:
    """Refuse a certificate that C2PA does not accept, with all that it lacks: the library does not say what."""
    import datetime

    from cryptography import x509

    usages = {usage.dotted_string for usage in _extension(certificate, x509.ExtendedKeyUsage) or ()}
    has = {
        "the key usage digitalSignature": getattr(_extension(certificate, x509.KeyUsage), "digital_signature", False),
        f"an extended key usage ({' or '.join(_USAGES.values())})": bool(_USAGES.keys() & usages),
        "an authority key identifier": _extension(certificate, x509.AuthorityKeyIdentifier) is not None,
    }
    lacking = [name for name, is_there in has.items() if not is_there]
    if lacking:
        raise InputError(f"C2PA refuses the certificate {path}: it lacks {', '.join(lacking)}; have one issued with it")
    is_authority = getattr(_extension(certificate, x509.BasicConstraints), "ca", False)
    if is_authority or certificate.issuer == certificate.subject:
        raise InputError(f"C2PA refuses the certificate {path}: it is that of an authority; give one that it issued")
    now = datetime.datetime.now(datetime.UTC)
    if not certificate.not_valid_before_utc <= now <= certificate.not_valid_after_utc:
        first, last = certificate.not_valid_before_utc, certificate.not_valid_after_utc
        raise InputError(f"the certificate {path} is valid from {first:%Y-%m-%d} to {last:%Y-%m-%d}; give a valid one")


def _extension(certificate: "Certificate", kind: Any) -> Any:
    """Extension of a certificate; None without it."""
    from cryptography import x509

    try:
        return certificate.extensions.get_extension_for_class(kind).value
    except x509.ExtensionNotFound:
        return None


@dataclass(frozen=True, slots=True)
class Signature:
    """Manifest of C2PA in a file or beside it.

    Parameters
    ----------
    state
        ``Trusted``, ``Valid`` (complete, by a signer whom the reader need not know), ``Invalid``, or ``not checked``
        without c2pa-python.
    signer, program, source
        Names of who signed it and by what, and IPTC's type of digital source; empty where it was not checked.
    codes
        C2PA's codes of what is wrong, such as ``signingCredential.untrusted``.
    """

    state: str
    signer: str = ""
    program: str = ""
    source: str = ""
    codes: tuple[str, ...] = ()


NOT_CHECKED = Signature("not checked")


def read_signature(path: Path, format: str, *, is_there: bool) -> Signature | None:
    """Manifest of a file, or of the sidecar beside it; None without one.

    Parameters
    ----------
    format
        FFmpeg's name of it, or ``jpeg``, ``webp``, ``png``.
    is_there
        Whether the structure of the file has a place with a manifest.
    """
    beside = path.with_suffix(SIDECAR_SUFFIX)
    manifest = beside.read_bytes() if format in BESIDE and beside.is_file() else None
    if not is_there and manifest is None:
        return None
    try:
        import c2pa
    except ImportError:
        return NOT_CHECKED
    try:
        with path.open("rb") as file, c2pa.Reader(_READ.get(format, _OTHER), file, manifest) as reader:
            return _signature(parse_json(reader.json(), str(path)))
    except c2pa.C2paError as damaged:
        return Signature("Invalid", codes=(str(damaged)[:100],))


def _signature(store: Mapping[str, Any]) -> Signature:
    active = store["manifests"][store["active_manifest"]]
    actions = [
        action
        for assertion in active.get("assertions", [])
        if str(assertion.get("label", "")).startswith("c2pa.actions")
        for action in assertion.get("data", {}).get("actions", [])
    ]
    sources = [str(action["digitalSourceType"]) for action in actions if action.get("digitalSourceType")]
    info, generators = active.get("signature_info") or {}, active.get("claim_generator_info") or [{}]
    return Signature(
        str(store.get("validation_state", "Invalid")),
        str(info.get("common_name") or info.get("issuer") or ""),
        " ".join(str(generators[0].get(key, "")) for key in ("name", "version")).strip(),
        sources[0].removeprefix(SOURCE_TYPES) if sources else "",
        tuple(str(status["code"]) for status in store.get("validation_status") or ()),
    )
