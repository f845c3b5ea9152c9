"""Texts of a check of an upload."""

from pathlib import Path

from lexicon.errors import DataError
from tts2face.serving.work.resource_texts import of_command, refusal


def test_options_that_uploads_do_not_have_are_said_to_be_of_the_command() -> None:
    assert of_command("its unit is not the metre") == "its unit is not the metre"
    error = DataError("/tmp/up/character.glb: two faces are recognised; give the positions with --landmarks")
    paths = Path("/tmp/up/upload"), Path("/tmp/up/out"), Path("/tmp/up/out/content")
    assert refusal(error, *paths) == (
        "two faces are recognised; give the positions with --landmarks "
        "(of the command `tts2face face import`, whose face can be sent)"
    )
