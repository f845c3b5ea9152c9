#!/usr/bin/env bash
# c2pa-python 0.38.1 (c2pa-rs 0.91.3) checks a manifest before it signs it: an action `c2pa.created` without a digital
# source type, a second one, and `c2pa.opened` without an ingredient are refused. The type itself is any text: "nonsense",
# or the address with a wrong letter, is signed, and read back as Valid, so that a reader that asks for IPTC's address of
# generated media finds none. Who signs has to compare the type with the list.
# Fails (exit code 1) if the package behaves otherwise. Needs Python 3.11 to 3.14, pip and a package index; loads 25 MB.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

python3 -m venv "$work/environment"
"$work/environment/bin/pip" install --quiet --only-binary=:all: c2pa-python==0.38.1 cryptography==48.0.0 pillow==13.0.0

cat > "$work/check.py" << 'PYTHON'
import datetime
import io
import json
import sys

import c2pa
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID
from PIL import Image

TYPE = "http://cv.iptc.org/newscodes/digitalsourcetype/trainedAlgorithmicMedia"
NOW = datetime.datetime.now(datetime.timezone.utc)


def certificate():
    """A signer's certificate by an authority of its own, and its key, in PEM."""
    authority, key = (ec.generate_private_key(ec.SECP256R1()) for _ in range(2))
    subject, issuer = (
        x509.Name([x509.NameAttribute(NameOID.ORGANIZATION_NAME, name)]) for name in ("Signer", "Authority")
    )
    usage = x509.KeyUsage(True, False, False, False, False, False, False, False, False)
    extensions = (
        (usage, True),
        (x509.ExtendedKeyUsage([ExtendedKeyUsageOID.EMAIL_PROTECTION]), False),
        (x509.AuthorityKeyIdentifier.from_issuer_public_key(authority.public_key()), False),
    )
    builder = x509.CertificateBuilder(
        issuer, subject, key.public_key(), 7, NOW - datetime.timedelta(1), NOW + datetime.timedelta(1)
    )
    for extension, is_critical in extensions:
        builder = builder.add_extension(extension, critical=is_critical)
    pem = serialization.Encoding.PEM
    secret = key.private_bytes(pem, serialization.PrivateFormat.PKCS8, serialization.NoEncryption())
    return builder.sign(authority, hashes.SHA256()).public_bytes(pem), secret


CHAIN, KEY = certificate()
PICTURE = io.BytesIO()
Image.new("RGB", (64, 64)).save(PICTURE, "PNG")


def signed(*actions):
    """State and types of a picture that is signed with actions, or the reason why it is refused."""
    builder = c2pa.Builder({
        "claim_generator_info": [{"name": "check", "version": "1"}],
        "assertions": [{"label": "c2pa.actions.v2", "data": {"actions": list(actions)}}],
    })
    signer = c2pa.Signer.from_info(c2pa.C2paSignerInfo(b"es256", CHAIN, KEY, None))
    made = io.BytesIO()
    try:
        builder.sign(signer, "image/png", io.BytesIO(PICTURE.getvalue()), made)
    except c2pa.C2paError as refused:
        return str(refused)
    with c2pa.Reader("image/png", io.BytesIO(made.getvalue())) as reader:
        store = json.loads(reader.json())
    active = store["manifests"][store["active_manifest"]]
    (written,) = [one["data"]["actions"] for one in active["assertions"] if one["label"].startswith("c2pa.actions")]
    codes = [status["code"] for status in store.get("validation_status", [])]
    return store["validation_state"], codes, [action["digitalSourceType"] for action in written]


def created(kind):
    return {"action": "c2pa.created", "digitalSourceType": kind}


refused = {
    "no type": signed({"action": "c2pa.created"}),
    "two": signed(created(TYPE), created(TYPE)),
    "opened": signed({"action": "c2pa.opened"}),
}
taken = {kind: signed(created(kind)) for kind in (TYPE, TYPE[:-1], "nonsense")}
for name, found in (refused | taken).items():
    print(f"{name}: {found}")
holds = all("assertion.action" in str(found) and isinstance(found, str) for found in refused.values())
holds &= all(found == ("Valid", ["signingCredential.untrusted"], [kind]) for kind, found in taken.items())
print("as described" if holds else "OTHERWISE")
sys.exit(not holds)
PYTHON
"$work/environment/bin/python" "$work/check.py"
