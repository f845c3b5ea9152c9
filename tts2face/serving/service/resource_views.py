"""JSON of the talkers, faces, palettes and dictionaries of the service, and of what a key uses."""

from datetime import UTC, datetime
from typing import Annotated, Generic, TypeVar

from pydantic import BaseModel, Field

from tts2face.serving.work.resource_check import DICTIONARY, FACE, PALETTE, TALKER, TEXT_MARKS
from tts2face.serving.work.resources import StoredResource


class TalkerFacts(BaseModel):
    """What is known about a talker."""

    language: Annotated[str, Field(description="Language of its recordings.", examples=["en-gb"])]
    licence: Annotated[str, Field(description="Licence that its file states.", examples=["CC BY 4.0"])]
    n_utterances: Annotated[int, Field(description="Number of its recorded utterances.", examples=[804])]
    minutes: Annotated[float, Field(description="Minutes of recorded speech.", examples=[40.2])]
    has_own_face: Annotated[
        bool, Field(description="Whether `face: self` shows the talker's own face.", examples=[False])
    ]


class FaceFacts(BaseModel):
    """What is known about a face."""

    identities: Annotated[list[str], Field(description="Values of `identity`.", examples=[["erik", "amara"]])]
    summary: Annotated[str, Field(description="What it is.", examples=["mesh with 52 shapes"])]
    takes_haircuts: Annotated[bool, Field(description="Whether `hair` and `hair_color` apply.", examples=[True])] = True
    person: Annotated[
        str,
        Field(
            description="Sex and age of the person, for the voice; empty: unknown.",
            examples=["female 25"],
        ),
    ] = ""
    licence: Annotated[str, Field(description="Licence that its file states.", examples=["CC0-1.0"])] = "not stated"
    notes: Annotated[list[str], Field(description="What the import of a character changed.", examples=[[]])] = []


class StyleFacts(BaseModel):
    """A style of a palette."""

    name: Annotated[str, Field(description="Value of `style`.", examples=["delighted"])]
    summary: Annotated[str, Field(description="What it looks like.", examples=["a smile, a livelier head"])]


class PaletteFacts(BaseModel):
    """What is known about a palette."""

    styles: Annotated[list[StyleFacts], Field(description="Its styles.")]


class DictionaryFacts(BaseModel):
    """What is known about a dictionary."""

    n_words: Annotated[int, Field(description="Number of its words.", examples=[12])]


class TextMarksFacts(BaseModel):
    """What is known about a table of marks."""

    n_marks: Annotated[int, Field(description="Number of its marks.", examples=[12])]


Facts = TypeVar("Facts", bound=BaseModel)
FACTS: dict[str, type[BaseModel]] = {
    TALKER: TalkerFacts, FACE: FaceFacts, PALETTE: PaletteFacts, DICTIONARY: DictionaryFacts,
    TEXT_MARKS: TextMarksFacts,
}  # fmt: skip


class Resource(BaseModel, Generic[Facts]):
    """A talker, face, palette, dictionary or table of marks."""

    name: Annotated[str, Field(description="Its name in requests.", examples=["anna"])]
    kind: Annotated[str, Field(description="talker, face, palette, dictionary or text_marks.", examples=["face"])]
    owner: Annotated[
        str | None, Field(description="Key that uploaded it; null: it is the service's own.", examples=["studio"])
    ] = None
    sha256: Annotated[
        str | None, Field(description="Hash of an upload's content as it is stored.", examples=["ab3f" * 16])
    ] = None
    bytes: Annotated[int | None, Field(description="Size of an upload with its picture.", examples=[5272651])] = None
    created: Annotated[
        datetime | None, Field(description="When it was uploaded.", examples=["2026-11-22T09:30:00Z"])
    ] = None
    about: Annotated[Facts, Field(description="What is known about it.")]


class ResourceList(BaseModel, Generic[Facts]):
    """Resources of a kind: the service's own, then the uploads by name."""

    data: Annotated[list[Resource[Facts]], Field(description="The resources.")]


class Share(BaseModel):
    """How much of something is used."""

    used: Annotated[int, Field(description="Used now.", examples=[3])]
    limit: Annotated[int, Field(description="Most that may be used.", examples=[100])]


class UsageAnswer(BaseModel):
    """What a key uses and may use."""

    key: Annotated[str, Field(description="Name of the key.", examples=["studio"])]
    scopes: Annotated[list[str], Field(description="What it may do.", examples=[["speak", "build"]])]
    resources: Annotated[Share, Field(description="Uploaded talkers, faces, palettes and dictionaries.")]
    resource_bytes: Annotated[Share, Field(description="Bytes of them and of their pictures.")]
    requests_per_minute: Annotated[int | None, Field(description="Requests a minute; null: no limit.", examples=[120])]
    concurrent: Annotated[int | None, Field(description="Requests at the same time; null: no limit.", examples=[4])]


def shipped_resource(kind: str, name: str, about: dict[str, object]) -> dict[str, object]:
    """JSON of a resource of the service itself."""
    return {"name": name, "kind": kind, "about": about}


def uploaded_resource(stored: StoredResource) -> dict[str, object]:
    """JSON of an upload."""
    return {
        "name": stored.name, "kind": stored.kind, "owner": stored.owner, "sha256": stored.content,
        "bytes": stored.n_bytes, "created": datetime.fromtimestamp(stored.created, UTC), "about": stored.description,
    }  # fmt: skip
