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
    "EPISODE IV: a new hope.",
    "PART II: the return.",
    "Part Two of Three: the sea.",
    "ACT THREE: the storm.",
    "DAY ONE: we leave.",
    "SEASON 2: the end.",
    "WORLD WAR II: six years.",
    "DNA: the code of life.",
    "BBC: the news at ten.",
    "LIVE: from London.",
    "LATEST: rain.",
    "COMING UP: more.",
    "THE END: so it was.",
    "NASA: to the moon.",
    "FIRST OF ALL: no.",
    "WEDNESDAY: fish.",
    "HERE'S THE DEAL: no.",
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


HEADINGS = ("HERE'S THE DEAL:", "THREE WORDS:", "BOTTOM LINE:", "THE WEATHER:", "MY MOTTO:", "SHORT ANSWER:")


@pytest.mark.parametrize("heading", [*HEADINGS, "GOOD MORNING:", "MISSION ACCOMPLISHED:", "LONDON:"])
def test_capitals_are_no_sign_in_a_file_of_capitals(heading: str, read: ReadText) -> None:
    found = read(srt((1, 2, "IT IS LATE."), (3, 4, f"{heading} WE GO."), (5, 6, "[a door slams] SO WE DO.")))
    assert [(cue.speaker, cue.text) for cue in found.cues] == [
        ("", "IT IS LATE."), ("", f"{heading} WE GO."), ("", "SO WE DO.")
    ]  # fmt: skip


def test_headings_of_a_file_of_capitals_are_no_script(read: ReadText) -> None:
    found = read(srt(*[(at, at + 1, f"{heading} YES.") for at, heading in enumerate(HEADINGS)]))
    assert {cue.speaker for cue in found.cues} == {""}


@pytest.mark.parametrize(
    ("text", "speaker"),
    [
        (">> MARY: HELLO.", "MARY"),
        ("- MARY: HELLO.", "MARY"),
        ("MAN TWO: HELLO.", "MAN TWO"),
        ("MARY (OFF): HELLO.", "MARY"),
        ("DR. SMITH: HELLO.", "DR. SMITH"),
        ("JOHN: HELLO.", "JOHN"),
    ],
)
def test_signs_beside_capitals_tell_speakers_in_a_file_of_capitals(text: str, speaker: str, read: ReadText) -> None:
    found = read(srt((1, 2, text), (3, 4, "IT IS LATE."), (5, 6, "JOHN: SO IT IS."), (7, 8, "GO."), (9, 10, "NO.")))
    assert (found.cues[0].speaker, found.cues[0].text) == (speaker, "HELLO.")


def test_headings_in_a_script_of_capitals_are_words(read: ReadText) -> None:
    texts = ["JOHN: GO.", "EVE: NO.", "JOHN: WHY?", "TODAY'S TOPIC: BREAD.", "A QUICK WORD: STAY.", "MAN #2: COME."]
    found = read(srt(*[(at, at + 1, text) for at, text in enumerate(texts)]))
    assert [cue.speaker for cue in found.cues] == ["JOHN", "EVE", "JOHN", "", "", "MAN #2"]


def test_two_names_in_a_cue_of_capitals_are_speakers(read: ReadText) -> None:
    (cue, *_) = read(srt((1, 2, "EVE: HELLO.\nBOB: HI."), (3, 4, "IT IS LATE."))).cues
    assert [part.speaker for part in cue.parts] == ["EVE", "BOB"]


INNER = {
    "a known name": ("JOHN: Hi. MARY: Ho.", [("JOHN", "Hi."), ("MARY", "Ho.")]),
    "a question": ("JOHN: Is it? Dr. Smith: It is.", [("JOHN", "Is it?"), ("Dr. Smith", "It is.")]),
    "a quotation": ("“Come here.” MARY: No!", [("", "“Come here.”"), ("MARY", "No!")]),
    "three": ("MARY: A… JOHN: B! MARY: C.", [("MARY", "A…"), ("JOHN", "B!"), ("MARY", "C.")]),
    "a manner": ("JOHN: Hi. MARY (off): Ho.", [("JOHN", "Hi."), ("MARY", "Ho.")]),
    "nobody": ("JOHN: Hi. Remember: go.", [("JOHN", "Hi. Remember: go.")]),
    "a name after a title": ("JOHN: I met Mr. Mary: he ran.", [("JOHN", "I met Mr. Mary: he ran.")]),
    "no sentence before it": ("JOHN: I met MARY: she ran.", [("JOHN", "I met MARY: she ran.")]),
}


@pytest.mark.parametrize(("text", "said"), INNER.values(), ids=INNER)
def test_a_known_speaker_begins_after_a_sentence(text: str, said: list[tuple[str, str]], read: ReadText) -> None:
    (cue, *_) = read(srt((1, 2, text), (3, 4, "MARY: Yes."), (5, 6, "Dr. Smith: No."), (7, 8, "It is late."))).cues
    parts = [(part.speaker, part.text) for part in cue.parts] or [(cue.speaker, cue.text)]
    assert parts == said


def test_names_within_cues_alone_are_speakers_where_they_recur(read: ReadText) -> None:
    found = read(srt((1, 2, "JOHN: Hi. MARY: Ho."), (3, 4, "JOHN: So. MARY: No."), (5, 6, "Well. So. MARY: Yes.")))
    assert [[part.speaker for part in cue.parts] for cue in found.cues] == [["JOHN", "MARY"]] * 2 + [["", "MARY"]]
