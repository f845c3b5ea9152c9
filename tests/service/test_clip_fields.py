"""The fields of a clip over HTTP are options of a request, a picture and its models, with the same defaults."""

from dataclasses import fields

from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.service.orders.clip_options import ClipRequest
from tts2face.service.routes.clips import FILES
from tts2face.service.uploads.names import MODEL_FIELDS

NOT_OFFERED = {"audio_map", "context", "exemplars", "pitch", "renderer"}  # for studies and for windows of this machine
OPTIONS = {one.name: one.default for kind in (Request, Picture) for one in fields(kind)}


def test_every_option_is_a_field_a_file_or_not_offered() -> None:
    offered = ClipRequest.model_fields.keys() | set(FILES)
    assert OPTIONS.keys() - offered == NOT_OFFERED
    assert offered - OPTIONS.keys() - set(MODEL_FIELDS) == {"format"}


def test_fields_have_the_defaults_of_the_options() -> None:
    """A field with its default is not sent on, so that another default would be lost."""
    described = {name: one.default for name, one in ClipRequest.model_fields.items() if name in OPTIONS}
    assert described == {name: OPTIONS[name] for name in described}
