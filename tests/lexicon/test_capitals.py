"""Texts in capitals are read as the same words in ordinary writing; initialisms of other texts stay spelled."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lexicon.capitals import is_in_capitals, sentence_case
from lexicon.growing_text import GrowingText
from lexicon.pronounce import pronounce
from lexicon.sentences import split_sentences
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks


def phones(text: str) -> list[tuple[str, ...]]:
    return [word.phones for word in pronounce_marked(parse_marks(text, "en-us")).words]


@pytest.mark.parametrize(
    ("capitals", "ordinary"),
    [
        ("MR. SMITH IS HERE.", "Mr. Smith is here."),
        ("CALL DR. JONES.", "Call Dr. Jones."),
        ("MRS. BROWN AND PROF. GREEN", "Mrs. Brown and Prof. Green"),
        ("MR SMITH MET MRS JONES", "Mr Smith met Mrs Jones"),
        ("THE U.S. ARMY IS COMING.", "The U.S. Army is coming."),
        ("THE US ARMY IS COMING.", "The U.S. Army is coming."),
        ("TELL US ABOUT IT.", "Tell us about it."),
        ("ST. MARY'S CHURCH IS OLD", "St. Mary's church is old"),
        ("MAIN ST. IS CLOSED", "Main St. is closed"),
        ("JOHN SMITH JR. IS HERE", "John Smith Jr. is here"),
        ("THANKS, HON. GO NOW.", "Thanks, hon. Go now."),
        ("COME HERE, MAX. SIT.", "Come here, Max. Sit."),
        ("SHE HAS A PH.D. IN MATH", "She has a Ph.D. in math"),
        ("AT 5 P.M. TODAY", "At 5 p.m. today"),
        ("10 KM/H IS SLOW", "10 km/h is slow"),
        ("JAN. 5 WAS COLD", "Jan. 5 was cold"),
        ("THE 10TH OF THE 1980S", "The 10th of the 1980s"),
        ("A BIG CAT SAT", "A big cat sat"),
        ("PSST! HMM, TSK. BRR, MMM. GRR!", "Psst! Hmm, tsk. Brr, mmm. Grr!"),
        ("THE UN'S DVDS AND THE FBI'S MEN", "The UN's DVDs and the FBI's men"),
        ("BUT I'M HERE AND IT'S US", "But I'm here and it's us"),
        ("HIS BUS IS HERS", "His bus is hers"),
        ("LT. DAN!", "Lt. Dan!"),
        ("O'BRIEN ISN'T AT McDONALD'S", "O'Brien isn't at McDonald's"),
        ("CHAPTER IV OF HENRY VIII", "Chapter IV of Henry VIII"),
        ("He ran. GET OUT, MR. SMITH! She left.", "He ran. Get out, Mr. Smith! She left."),
        ("I told you, DR. SMITH, to wait.", "I told you, Dr. Smith, to wait."),
    ],
)
def test_capitals_are_read_as_ordinary_writing(capitals: str, ordinary: str) -> None:
    assert phones(capitals) == phones(ordinary)
    assert len(list(split_sentences(parse_marks(capitals, "en-us"), "en-us"))) == len(
        list(split_sentences(parse_marks(ordinary, "en-us"), "en-us"))
    )


@pytest.mark.parametrize(
    ("text", "word", "arpabet"),
    [
        ("THE FBI IS HERE", "FBI", "EH2 F B IY2 AY1"),
        ("WE NEED AN ID NOW", "ID", "AY2 D IY1"),
        ("SHE IS AT THE UN TODAY", "UN", "Y UW2 EH1 N"),
        ("HE WORKS IN THE IT DEPARTMENT", "IT", "AY2 T IY1"),
        ("The US Army met the FBI.", "US", "Y UW2 EH1 S"),
        ("The IT department met the UN.", "UN", "Y UW2 EH1 N"),
        ("Please call the IT DEPARTMENT now.", "IT", "AY2 T IY1"),
        ("FBI CIA NSA", "NSA", "EH2 N EH2 S EY1"),
    ],
)
def test_initialisms_stay_spelled(text: str, word: str, arpabet: str) -> None:
    assert [" ".join(one.arpabet) for one in pronounce(text).words if one.text == word] == [arpabet]


def test_a_growing_text_keeps_a_title_with_its_name() -> None:
    growing = GrowingText("en-us")
    assert growing.add("CALL MR. SMITH NOW. GO") == ["CALL MR. SMITH NOW."]


def test_other_languages_change_their_abbreviations_alone() -> None:
    assert sentence_case("HERR DR. MÜLLER KOMMT.", "de") == "HERR Dr. MÜLLER KOMMT."


def test_a_short_text_is_in_capitals_where_its_file_is() -> None:
    assert is_in_capitals(["DAN!", "WHERE ARE YOU?", "NOT HERE."])
    assert not is_in_capitals(["Dan!", "WHERE ARE YOU?", "Not here."])
    assert not is_in_capitals(["FBI", "CIA"])
    assert sentence_case("DAN!", is_shouted=True) == "Dan!"
    assert sentence_case("DAN!") == "DAN!"


@given(st.text(st.sampled_from("ABCDEIMRSTUabc .,!?'’-0159\nÄßİΣ你") | st.characters(max_codepoint=0x2FF), max_size=60))
def test_every_character_keeps_its_place(text: str) -> None:
    for language in ("en-us", "de"):
        once = sentence_case(text, language)
        assert len(once) == len(text)
        assert once.casefold() == text.casefold() or not text.isascii()
        assert sentence_case(once, language) == once
