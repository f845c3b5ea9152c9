"""An authority of tests, which issues certificates for signatures of C2PA."""

import datetime
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from tts2face.storage.signing import Credentials

NOW = datetime.datetime.now(datetime.UTC)
USAGES = ("digital_signature", "content_commitment", "key_encipherment", "data_encipherment", "key_agreement",
          "key_cert_sign", "crl_sign", "encipher_only", "decipher_only")  # fmt: skip


@dataclass(frozen=True)
class Wanted:
    """Certificate to issue; the defaults are what C2PA accepts."""

    usage: str = "digital_signature"
    purpose: Any = ExtendedKeyUsageOID.EMAIL_PROTECTION
    has_authority: bool = True
    days: tuple[int, int] = (-1, 30)
    key: Any = field(default_factory=lambda: ec.generate_private_key(ec.SECP256R1()))
    password: str = ""
    is_authority: bool = False


ROOT_KEY = ec.generate_private_key(ec.SECP256R1())


def issue(folder: Path, wanted: Wanted | None = None) -> Credentials:
    """Files of a signer "Ann" with a certificate of the authority."""
    wanted = wanted or Wanted()
    public = wanted.key.public_key()
    builder = _begun("Ann", public, wanted.days).issuer_name(_name("Authority"))
    builder = builder.add_extension(x509.BasicConstraints(wanted.is_authority, None), critical=True)
    builder = builder.add_extension(_usage(wanted.usage), critical=True)
    if wanted.purpose is not None:
        builder = builder.add_extension(x509.ExtendedKeyUsage([wanted.purpose]), critical=False)
    if wanted.has_authority:
        known = x509.AuthorityKeyIdentifier.from_issuer_public_key(ROOT_KEY.public_key())
        builder = builder.add_extension(known, critical=False)
    certificate, key = folder / "certificate.pem", folder / "key.pem"
    certificate.write_bytes(_pem(builder.sign(ROOT_KEY, hashes.SHA256())))
    secret = wanted.password.encode()
    protection = serialization.BestAvailableEncryption(secret) if secret else serialization.NoEncryption()
    form = serialization.PrivateFormat.PKCS8
    key.write_bytes(wanted.key.private_bytes(serialization.Encoding.PEM, form, protection))
    return Credentials(certificate, key)


def root() -> bytes:
    """Certificate of the authority, in PEM."""
    builder = _begun("Authority", ROOT_KEY.public_key(), (-2, 60)).issuer_name(_name("Authority"))
    builder = builder.add_extension(x509.BasicConstraints(True, None), critical=True)
    builder = builder.add_extension(_usage("key_cert_sign"), critical=True)
    identifier = x509.SubjectKeyIdentifier.from_public_key(ROOT_KEY.public_key())
    return _pem(builder.add_extension(identifier, critical=False).sign(ROOT_KEY, hashes.SHA256()))


def _begun(name: str, public: Any, days: tuple[int, int]) -> x509.CertificateBuilder:
    first, last = (NOW + datetime.timedelta(days=n) for n in days)
    return x509.CertificateBuilder(
        subject_name=_name(name), public_key=public, serial_number=7, not_valid_before=first, not_valid_after=last
    )


def _usage(name: str) -> x509.KeyUsage:
    return x509.KeyUsage(**{usage: usage == name for usage in USAGES})


def _name(common: str) -> x509.Name:
    parts = (NameOID.ORGANIZATION_NAME, "Tests"), (NameOID.COMMON_NAME, common)
    return x509.Name([x509.NameAttribute(*part) for part in parts])


def _pem(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(serialization.Encoding.PEM)
