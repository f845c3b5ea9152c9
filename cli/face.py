"""``tts2face face``: import characters of other programs as faces, and show faces."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from cyclopts import App, Parameter

from cli.flags import Hair, HairColor, Model, Person, add_option_flags, options_from_flags, switch
from cli.photo import Consent, Fit, Smile, Yes, agreed, make_face, warner
from cli.process import write_message
from cli.progress import progress_bar
from lexicon.errors import InputError
from tts2face.models.person import parse_person
from tts2face.picture.options import Picture
from tts2face.storage.output_paths import check_file_name, refuse_overwriting

if TYPE_CHECKING:
    from tts2face.models.face import Face

OUTPUTS = {
    "--out": ("a face", (".face",)),
    "--preview": ("a picture", (".png",)),
    "--sheet": ("a picture", (".png",)),
    "--write-landmarks": ("a table of landmarks", (".tsv",)),
    "--write-mapping": ("a mapping", (".tsv",)),
    "--write-fit": ("a fit", (".json",)),
}  # what each flag of a file that is written is, and its endings
face = App(name="face", help="Import characters as faces, show faces.")


@face.command(name="import")
def import_character(  # noqa: PLR0913 - one parameter a flag
    character: Annotated[
        Path,
        Parameter(help="Character: .glb, .gltf, .vrm, .obj, or a folder of neutral.obj and one .obj a shape."),
    ],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output face (.face).", alias="-o")],
    mapping: Annotated[
        Path | None, Parameter(help="Names of the character's shapes (.tsv or .toml), in place of the guessed ones.")
    ] = None,
    landmarks: Annotated[
        Path | None, Parameter(help="Table of landmark positions (.tsv), in place of tracking (extra [capture]).")
    ] = None,
    front: Annotated[
        str | None, Parameter(help="Axis that the character looks along: +z, -z, +x or -x; by default found.")
    ] = None,
    shapes: Annotated[
        Literal["transfer"] | None,
        Parameter(help="transfer: the shapes of a shipped head, for a head that has none; by default its own."),
    ] = None,
    preview: Annotated[Path | None, Parameter(help="Write a picture with the landmarks drawn (.png).")] = None,
    sheet: Annotated[Path | None, Parameter(help="Write a contact sheet of all shapes, with sources (.png).")] = None,
    write_landmarks: Annotated[Path | None, Parameter(help="Write the landmarks as a table to edit (.tsv).")] = None,
    write_mapping: Annotated[Path | None, Parameter(help="Write the used mapping as a table to edit (.tsv).")] = None,
    person: Person = None,
    model: Model = None,
    yes: Yes = False,
    quiet: Annotated[bool, switch("Print no report.")] = False,
) -> None:
    """Make a .face file of a character; print which shapes are found, replaced and missing."""
    _check_person(person)
    _check_outputs(
        {
            "--out": out,
            "--preview": preview,
            "--sheet": sheet,
            "--write-landmarks": write_landmarks,
            "--write-mapping": write_mapping,
        },
        {"the character": character, "--mapping": mapping, "--landmarks": landmarks, "--model": model},
    )
    from tts2face.interchange.characters.importing import import_face
    from tts2face.interchange.characters.landmark_table import landmark_table
    from tts2face.interchange.characters.preview import draw_import_sheet, png_bytes
    from tts2face.interchange.characters.report import report_text
    from tts2face.interchange.characters.saving import save_face
    from tts2face.interchange.characters.shapes import mapping_table
    from tts2face.storage.files import write_atomically

    with progress_bar("carrying shapes", quiet or shapes is None) as on_progress:
        imported = import_face(
            character, mapping=mapping, landmarks=landmarks, front=front, shapes=shapes, model=model,
            on_progress=on_progress,
        )  # fmt: skip
    _write_preview(preview, imported.face)
    if sheet is not None:
        with progress_bar("drawing", quiet) as on_progress:
            write_atomically(sheet, png_bytes(draw_import_sheet(imported, on_progress), imported.face.mark))
    if write_landmarks is not None:
        write_atomically(write_landmarks, landmark_table(imported.report.landmarks).encode())
    if write_mapping is not None:
        write_atomically(write_mapping, mapping_table(imported.report.mapping).encode())
    save_face(out, imported.face)
    _state_person(out, person)
    if not quiet:
        print(report_text(imported.report), end="")  # noqa: T201 - the result
        write_message(f"wrote {out}")


@face.command
def picture(  # noqa: PLR0913 - one parameter a flag
    photo: Annotated[str, Parameter(help="Picture of a person; photo.jpg@2 is its second largest face.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output face (.face).", alias="-o")],
    consent: Consent = None,
    name: Annotated[str | None, Parameter(help="The person's name; by default the file's name.")] = None,
    preview: Annotated[Path | None, Parameter(help="Write a picture with what was found drawn in it (.png).")] = None,
    fit: Fit = None,
    smile: Smile = None,
    write_fit: Annotated[Path | None, Parameter(help="Write what was found, to edit it for --fit (.json).")] = None,
    person: Person = None,
    model: Model = None,
    yes: Yes = False,
    quiet: Annotated[bool, switch("Print no warnings and no summary.")] = False,
) -> None:
    """Make a .face file of a picture of a person, who speaks in it."""
    from tts2face.photo.photograph import split_number

    _check_person(person)
    _check_outputs(
        {"--out": out, "--preview": preview, "--write-fit": write_fit},
        {"the photo": split_number(photo)[0], "--fit": fit, "--smile": smile, "--model": model},
    )
    from tts2face.interchange.characters.saving import save_face
    from tts2face.photo.fit import write_fit as write_fit_file

    made = make_face(photo, consent, name=name, fit=fit, smile=smile, model=model, quiet=quiet)
    _write_preview(preview, made)
    if write_fit is not None:
        write_fit_file(write_fit, made.metadata["fit"])
    save_face(out, made)
    _state_person(out, person)
    if not quiet:
        write_message(f"wrote {out}: {made.metadata['name']}, {made.metadata['consent']['date']}")


@face.command
def photo(  # noqa: PLR0913 - one parameter a flag
    photos: Annotated[
        list[str], Parameter(help="Pictures of one person, the first from the front; photo.jpg@2 is its second face.")
    ],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output face (.face).", alias="-o")],
    consent: Consent = None,
    name: Annotated[str | None, Parameter(help="The person's name; by default the first file's name.")] = None,
    eye_color: Annotated[
        str | None,
        Parameter(
            help="Eye colour: dark-brown, brown, hazel, green, grey, blue or #rrggbb; by default as in the picture."
        ),
    ] = None,
    age_keep: Annotated[bool, switch("Keep the wrinkles of the skin, which are softened otherwise.")] = False,
    no_glasses: Annotated[bool, switch("Leave off glasses that are seen.")] = False,
    preview: Annotated[Path | None, Parameter(help="Write a picture of the head with its landmarks (.png).")] = None,
    person: Person = None,
    model: Model = None,
    yes: Yes = False,
    quiet: Annotated[bool, switch("Print no warnings and no summary.")] = False,
) -> None:
    """Make a .face file of the person in pictures: a head that turns, with shape, skin, eyes, hair and clothes."""
    from tts2face.photo.photograph import split_number

    _check_person(person)
    inputs = {f"the photo {photo}": split_number(photo)[0] for photo in photos}
    _check_outputs({"--out": out, "--preview": preview}, inputs | {"--model": model})
    from corpus_tools.dense.avatar import build_avatar
    from tts2face.models.face_loading import load_face

    consent = agreed(photos[0], consent, name)
    result = build_avatar(
        photos, out, consent=consent, name=name, eye_color=eye_color, age_keep=age_keep, no_glasses=no_glasses,
        model=model, on_warning=warner(quiet=quiet),
    )  # fmt: skip
    _state_person(out, person)
    if preview is not None:
        _write_preview(preview, load_face(str(out)))
    if not quiet:
        write_message(result.look.summary())
        write_message(f"wrote {out}")


@face.command
def calibrate(
    name: Annotated[str, Parameter(name="face", help="Shipped face or .face file.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output face (.face); may be the face itself.", alias="-o")],
    talker: Annotated[str, Parameter(help="Talker whose speech gives the poses.")] = "grid_s1",
    model: Model = None,
    yes: Yes = False,
) -> None:
    """Measure what the face tracker reads in a face's mouth, so that it opens as the person's (some minutes)."""
    check_file_name(out, "a face", (".face",))
    refuse_overwriting({"--out": out}, {"--talker": talker, "--model": model})
    from corpus_tools.training.calibrate_file import calibrate_face_file

    with progress_bar("rendering poses") as on_progress:
        calibrate_face_file(name, out, source=talker, model=model, on_progress=on_progress)
    write_message(f"wrote {out}")


@face.command
def relink(
    name: Annotated[Path, Parameter(name="face", help="Imported face (.face), which is changed in place.")],
    character: Annotated[Path, Parameter(help="Where its character's file (.glb, .gltf or .vrm) is now.")],
    /,
    *,
    quiet: Annotated[bool, switch("Print nothing.")] = False,
) -> None:
    """Write the new place of a moved character into the face that was imported from it, for exports to its file."""
    check_file_name(name, "a face", (".face",))
    from tts2face.interchange.characters.saving import relink_face

    place = relink_face(name, character)
    if not quiet:
        print(f"{name} belongs to {place}")  # noqa: T201 - the result


@face.command
def show(
    name: Annotated[str, Parameter(help="Face: head, ada, or a .face file.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output picture (.png).", alias="-o")],
    landmarks: Annotated[bool, switch("Draw the landmarks instead of the shapes.")] = False,
    quiet: Annotated[bool, switch("Print no progress bar and no summary.")] = False,
) -> None:
    """Draw a contact sheet of all shapes of a face."""
    check_file_name(out, "a picture", (".png",))
    refuse_overwriting({"--out": out}, {"the face": name})
    from tts2face.interchange.characters.preview import draw_contact_sheet, draw_preview, png_bytes
    from tts2face.models.face_loading import load_face
    from tts2face.storage.files import write_atomically

    loaded = load_face(name)
    with progress_bar("drawing", quiet) as on_progress:
        drawn = draw_preview(loaded) if landmarks else draw_contact_sheet(loaded, on_progress)
    write_atomically(out, png_bytes(drawn, loaded.mark))
    if not quiet:
        write_message(f"wrote {out}: {len(loaded.shape_names)} shapes")


@face.command
@add_option_flags(("Picture", Picture))
def still(
    name: Annotated[str, Parameter(help="Face: one of `tts2face faces`, or a .face file.")] = "",
    /,
    *,
    out: Annotated[Path, Parameter(help="Output picture (.png).", alias="-o")],
    identity: Annotated[str | None, Parameter(help="Preset of the face's age, sex and ancestry.")] = None,
    hair: Hair = None,
    hair_color: HairColor = None,
    quiet: Annotated[bool, switch("Print no summary.")] = False,
    **picture: Any,
) -> None:
    """Draw one picture of a face at rest, which needs nobody's consent if the face is a shipped one."""
    check_file_name(out, "a picture", (".png",))
    refuse_overwriting({"--out": out}, {"the face": name, "--hair": hair})
    from tts2face.interchange.characters.preview import png_bytes
    from tts2face.picture.renderer import draw
    from tts2face.session.named_models import Models
    from tts2face.storage.files import write_atomically

    options = options_from_flags(Picture, picture)
    shown = Models(face=name, identity=identity, hair=hair, hair_color=hair_color).shown_face()
    if shown is None:
        raise InputError("a talker's own face has no picture at rest; choose one of `tts2face faces`, or a .face file")
    drawn = draw(shown, picture=options)
    write_atomically(out, png_bytes(drawn, shown.mark))
    if not quiet:
        write_message(f"wrote {out}: {drawn.shape[1]} x {drawn.shape[0]} pixels")


def _check_person(person: str | None) -> None:
    """Refuse an unknown person before the work."""
    if person is not None:
        parse_person(person)


def _state_person(out: Path, person: str | None) -> None:
    from tts2face.interchange.characters.saving import state_person

    if person is not None:
        state_person(out, person)


def _check_outputs(outputs: Mapping[str, Path | None], inputs: Mapping[str, str | Path | None]) -> None:
    """Refuse outputs, by their flags, with wrong endings, and those that would overwrite inputs or each other."""
    for flag, path in outputs.items():
        if path is not None:
            check_file_name(path, *OUTPUTS[flag])
    refuse_overwriting(outputs, inputs)


def _write_preview(preview: Path | None, made: "Face") -> None:
    from tts2face.interchange.characters.preview import draw_preview, png_bytes
    from tts2face.storage.files import write_atomically

    if preview is not None:
        write_atomically(preview, png_bytes(draw_preview(made), made.mark))
