"""Speakers before a colon: who is one, by form, case and repetition."""

import pytest

from tests.interchange.subtitles.conftest import ReadText, srt

SPEAKERS = {
    "Dr. Smith: Come in.": ("Dr. Smith", "Come in."),
    "MRS O'NEIL: Good evening.": ("MRS O'NEIL", "Good evening."),
    "Anna (off): Over here.": ("Anna", "Over here."),
    "MAN #2: Stop!": ("MAN #2", "Stop!"),
    "JEAN-LUC: Bonjour.": ("JEAN-LUC", "Bonjour."),
    "Mr. Van der Berg: Yes.": ("Mr. Van der Berg", "Yes."),
    "WOMAN ON TV: It rains.": ("WOMAN ON TV", "It rains."),
    "Narrator: Long ago.": ("Narrator", "Long ago."),
    "Speaker 1: Good morning.": ("Speaker 1", "Good morning."),
    "[JOHN]: Hello.": ("JOHN", "Hello."),
    "ÉMILE (V.O.): Entrez.": ("ÉMILE", "Entrez."),
    "J.R.: Well.": ("J.R.", "Well."),
    "FIRST OFFICER: Aye.": ("FIRST OFFICER", "Aye."),
    "ANNA & BOB: Hurry up!": ("ANNA & BOB", "Hurry up!"),
    "[a bell] EVE: Hello.": ("EVE", "Hello."),
}
WORDS = (
    "NOTE: Mind the gap.",
    "OK: go.",
    "WARNING: hot.",
    "P.S.: I love you.",
    "Remember: go.",
    "Dear all: thank you.",
    "At 10:30 we go.",
    "10:30: the train.",
    "Listen: it rains.",
    "He said. Then: nothing.",
    "REMEMBER: go.",
    "Step 1: wash it.",
    "THE POINT IS: no.",
    "My advice: stay.",
    "Hello everyone: welcome.",
    "Anna: once.",
    "NOTE TO SELF: buy bread.",
    "A: the first of all.",
    "BREAKING NEWS: it rains.",
)


@pytest.mark.parametrize(("text", "said"), SPEAKERS.items())
def test_names_before_a_colon_are_speakers(text: str, said: tuple[str, str], read: ReadText) -> None:
    found = read(srt((1, 2, text), (3, 4, "It is late.")))
    assert (found.cues[0].speaker, found.cues[0].text) == said
    assert f"{said[0]} (1)" in found.notes[-1].message
    plain = read(srt((1, 2, text), (3, 4, "It is late.")), speakers=False)
    assert plain.cues[0].speaker == ""
    assert said[1].split()[0] in plain.cues[0].text
    assert not any("speakers" in note.message for note in plain.notes)


@pytest.mark.parametrize("text", WORDS)
def test_words_before_a_colon_are_words(text: str, read: ReadText) -> None:
    found = read(srt((1, 2, text), (3, 4, "It is late."), (5, 6, "We remember it.")))
    assert (found.cues[0].speaker, found.cues[0].text) == ("", text)


def test_a_name_is_a_speaker_where_it_stands_twice(read: ReadText) -> None:
    found = read(
        srt((1, 2, "Anna: Hello."), (3, 4, "So it is."), (5, 6, "Anna: Bye."), (7, 8, "Well."), (9, 10, "No."))
    )
    assert [cue.speaker for cue in found.cues] == ["Anna", "", "Anna", "", ""]
    assert "Anna (2)" in found.notes[0].message


def test_letters_of_a_dialogue_are_speakers(read: ReadText) -> None:
    found = read(srt((1, 2, "A: Hello."), (3, 4, "B: Hi."), (5, 6, "A: Bye."), (7, 8, "B: Bye.")))
    assert [cue.speaker for cue in found.cues] == ["A", "B", "A", "B"]


def test_names_of_a_script_are_speakers(read: ReadText) -> None:
    found = read(srt((1, 2, "Anna: Hello."), (3, 4, "Bob: Hi."), (5, 6, "Carla: Bye.")))
    assert [cue.speaker for cue in found.cues] == ["Anna", "Bob", "Carla"]


def test_names_after_dashes_are_speakers(read: ReadText) -> None:
    found = read(srt((1, 2, "- Anna: Hello.\n- Bob: Hi."), (3, 4, "- Remember: go.\n- Yes."), (5, 6, "No.")))
    assert [part.speaker for part in found.cues[0].parts] == ["Anna", "Bob"]
    assert [part.text for part in found.cues[1].parts] == ["Remember: go.", "Yes."]


def test_a_word_that_the_file_has_in_small_letters_is_no_name(read: ReadText) -> None:
    found = read(srt((1, 2, "Water: it is cold."), (3, 4, "Water: it is hot."), (5, 6, "The water is warm.")))
    assert [cue.speaker for cue in found.cues] == ["", "", ""]


def test_speakers_of_the_format_stay_without_labels(read: ReadText) -> None:
    content = "WEBVTT\n\n00:01.000 --> 00:02.000\n<v Ann>NOTE: hi.</v>\n"
    (cue,) = read(content, ".vtt", speakers=False).cues
    assert (cue.speaker, cue.text) == ("Ann", "NOTE: hi.")
