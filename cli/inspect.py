"""``tts2face inspect``: what a file says of its making."""

from json import dumps
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.flags import switch

TITLES = {
    "format": "format", "source": "digital source", "notice": "notice", "program": "made with", "created": "made on",
    "face": "face", "voice": "voice", "text": "text",
}  # fmt: skip
STATES = {
    "Trusted": "signed (C2PA): complete, by a signer of a list that is trusted here",
    "Valid": "signed (C2PA): complete; whether to trust the signer is for the reader to know",
    "Invalid": "signed (C2PA): INVALID, the file is not what was signed, or the certificate had ended",
    "not checked": "signed (C2PA): not checked; install pip install 'tts2face[c2pa]'",
}


def inspect(
    file: Annotated[Path, Parameter(help="File of sound, pictures, video or motion, of any program.")],
    /,
    *,
    json: Annotated[bool, switch("Print JSON.")] = False,
) -> None:
    """Print what a file says of its making: marks of synthesis, text, voice, face, program and signature."""
    from tts2face.session.inspection import inspect_file

    found = inspect_file(file)
    if json:
        print(dumps(found.as_json(), ensure_ascii=False, indent=2))  # noqa: T201 - the result
        return
    verdict = "says that it is synthetic" if found.is_synthetic else "says nothing of being synthetic"
    lines = [f"{file}: {verdict}"]
    lines += [f"  {title}: {value}" for name, title in TITLES.items() if (value := getattr(found, name))]
    signed = found.signature
    if signed is not None:
        by = f", signed by {signed.signer} with {signed.program}" if signed.signer else ""
        codes = f" ({', '.join(signed.codes)})" if signed.codes else ""
        lines.append(f"  {STATES.get(signed.state, signed.state)}{by}{codes}")
    print("\n".join(lines))  # noqa: T201 - the result
