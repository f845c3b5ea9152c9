"""SSML's phoneme, say-as, voice and lang: their meaning, and errors with name and line."""

import re
import time
from xml.sax.saxutils import escape, quoteattr

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from lexicon.dictionary import arpabet_segments, parse_dictionary
from lexicon.errors import InputError
from lexicon.given_phones import words_with_given_phones
from lexicon.ipa import parse_ipa
from lexicon.languages import language_code
from lexicon.marked_text import MarkedText, PhoneMark, StyleRun
from lexicon.say_as import KINDS, say_as
from lexicon.scripts import check_readable
from lexicon.sentences import split_sentences
from lexicon.spoken_words import pronounce_marked
from lexicon.ssml_values import MAX_ATTRIBUTE_CHARACTERS, VOICES
from lexicon.text_marks import parse_marks
from tts2face.sound.shipped_voices import SHIPPED_VOICES

ELEMENTS = (
    "speak", "p", "s", "break", "emphasis", "prosody", "mark", "sub", "express-as", "mstts:express-as", "phoneme",
    "say-as", "voice", "lang", "audio",
)  # fmt: skip
ATTRIBUTES = (
    "time", "strength", "level", "rate", "volume", "pitch", "name", "alias", "style", "alphabet", "ph", "interpret-as",
    "format", "gender", "language", "xml:lang", "xmlns", "foo",
)  # fmt: skip
VALUES = st.one_of(
    st.text(st.characters(blacklist_categories=["Cs", "Cc"]), max_size=20),
    st.sampled_from(
        ["ipa", "x-arpabet", "kæt", "AH0", "date", "mdy", "ordinal", "male", "de", "en-US", "ja", "1s", "50%"]
    ),
    st.builds(
        lambda piece, n: piece * n, st.sampled_from(["a", "ˈ", "1", "a.", "=", " ", "-"]), st.integers(1, 300_000)
    ),
)
PLAIN = st.text(st.characters(blacklist_categories=["Cs", "Cc"]), max_size=20).map(escape)


def ssml(inside: str, language: str = "en-us") -> MarkedText:
    return parse_marks(f"<speak>{inside}</speak>", language)


def test_phones_are_given_in_ipa_and_arpabet() -> None:
    found = ssml(
        'a <phoneme alphabet="ipa" ph="təˈmɑːtəʊ">tomato</phoneme>, '
        '<phoneme alphabet="x-arpabet" ph="T AH0 M EY1 T OW2">tomato</phoneme> <phoneme ph="bi">B</phoneme>'
    )
    assert found.text == "a tomato, tomato B"
    assert found.marks == (
        PhoneMark(2, 8, parse_ipa("təˈmɑːtəʊ")),
        PhoneMark(10, 16, arpabet_segments("T AH0 M EY1 T OW2")),
        PhoneMark(17, 18, parse_ipa("bi")),
    )
    assert not found.has_voice_changes


def test_as_many_words_as_phones_are_words_each() -> None:
    found = ssml('<phoneme ph="ˈhɛləʊ wɜːld">hello, world!</phoneme>')
    assert found.text == "hello world"
    assert [(mark.at, mark.end) for mark in found.marks] == [(0, 5), (6, 11)]
    assert ssml('<phoneme ph="eɪ bi si">hello world</phoneme>').text == "hello-world"
    assert ssml('<phoneme ph="pɪˈkɑːn"/>').text == "pɪkɑn"


def test_given_phones_stay_with_their_word_through_normalisation() -> None:
    (sentence,) = split_sentences(
        ssml('Dr. <phoneme ph="kæt">Who</phoneme>, 25 of <phoneme ph="dɒɡ">2</phoneme>.'), "en-us"
    )
    (part,) = sentence.utterances
    assert [(word.text, bool(word.segments), word.after) for word in part.words] == [
        ("Doctor", False, ""),
        ("Who", True, ","),
        ("twenty-five", False, ""),
        ("of", False, ""),
        ("2", True, "."),
    ]


def test_only_the_sentence_with_given_phones_is_spoken_word_by_word() -> None:
    first, second = split_sentences(ssml('One. Two <phoneme ph="kæt">x</phoneme>.'), "en-us")
    assert [bool(part.utterances[0].words) for part in (first, second)] == [False, True]


def test_a_text_that_holds_the_names_used_within_is_read_too() -> None:
    words = words_with_given_phones("qzx qzxaaa cat", [PhoneMark(11, 14, parse_ipa("dɒɡ"))], "de")
    assert [(word.text, bool(word.segments)) for word in words] == [("qzx", False), ("qzxaaa", False), ("cat", True)]


def test_words_of_a_text_have_its_phones() -> None:
    own = parse_dictionary("bob  /dɒɡ/")
    found = pronounce_marked(ssml('The <phoneme ph="kæt">Bob</phoneme> saw Bob.'), dictionary=own)
    assert [(word.text, "".join(word.phones)) for word in found.words] == [
        ("The", "ðə"),
        ("Bob", "kæt"),
        ("saw", "sɔ"),
        ("Bob", "dɒɡ"),
    ]
    assert found.words[-1].mark == "."


@given(st.lists(st.sampled_from(["one", "Dr.", "$3.50,", "25", "<P>", "a-b", "Ph.D.", "x!"]), min_size=1, max_size=12))
def test_every_given_word_is_found_again(pieces: list) -> None:
    inside = " ".join('<phoneme ph="kæt">Bob</phoneme>' if piece == "<P>" else piece for piece in pieces)
    given_count = sum(
        bool(word.segments)
        for part in split_sentences(ssml(inside), "en-us")
        for u in part.utterances
        for word in u.words
    )
    assert given_count == pieces.count("<P>")


@pytest.mark.parametrize(
    ("kind", "written", "more", "said"),
    [
        ("cardinal", "1,234", "", "one thousand two hundred thirty-four"),
        ("cardinal", "VII", "", "seven"),
        ("number", "-3.5", "", "minus three point five"),
        ("ordinal", "3", "", "third"),
        ("ordinal", "21st", "", "twenty-first"),
        ("characters", "AB-1", "", "A B dash one"),
        ("spell-out", "a.b", "", "A dot B"),
        ("verbatim", "x@y", "", "X at Y"),
        ("digits", "007", "", "zero zero seven"),
        ("telephone", "+1 (555) 12-34", "", "plus one, five five five, one two, three four"),
        ("fraction", "3/4", "", "three quarters"),
        ("fraction", "1 1/2", "", "one and a half"),
        ("time", "3:05pm", "", "three oh five PM"),
        ("time", "15:00", "hms24", "fifteen hundred"),
        ("time", "1'21\"", "", "one minute twenty-one seconds"),
        ("date", "12/31/1999", "mdy", "December thirty-first, nineteen ninety-nine"),
        ("date", "31.12.1999", "dmy", "December thirty-first, nineteen ninety-nine"),
        ("date", "19991231", "ymd", "December thirty-first, nineteen ninety-nine"),
        ("date", "1999-12-31", "yyyymmdd", "December thirty-first, nineteen ninety-nine"),
        ("date", "31.12.1999", "DD.MM.YYYY", "December thirty-first, nineteen ninety-nine"),
        ("date", "????1231", "ymd", "December thirty-first"),
        ("date", "Dec 31", "md", "December thirty-first"),
        ("date", "5/2001", "my", "May two thousand one"),
        ("date", "1999", "y", "nineteen ninety-nine"),
        ("date", "2024-03-15", "", "March fifteenth, twenty twenty-four"),
        ("currency", "$12.50", "", "twelve dollars and fifty cents"),
        ("currency", "USD 3", "", "three US dollars"),
        ("money", "3", "EUR", "three euros"),
        ("unit", "5 km/h", "", "five kilometers per hour"),
        ("address", "150 Main St.", "", "one fifty Main Street."),
        ("expletive", "damn", "", "bleep"),
    ],
)
def test_say_as_determines_the_reading(kind: str, written: str, more: str, said: str) -> None:
    assert say_as(kind, written, more, "en-us") == said
    attributes = f'interpret-as="{kind}"' + (f' format="{more}"' if more else "")
    assert ssml(f"<say-as {attributes}>{escape(written)}</say-as>").text == said


def test_other_languages_read_what_needs_no_words() -> None:
    assert say_as("characters", "ab1", "", "de") == "a b 1"
    assert say_as("telephone", "+49 30-12", "", "de") == "4 9, 3 0, 1 2"
    assert say_as("cardinal", "1 234", "", "fr-fr") == "1234"
    assert ssml('<lang xml:lang="de"><say-as interpret-as="digits">12</say-as></lang>').text == "1 2"


@pytest.mark.parametrize(
    ("kind", "written", "more", "reason"),
    [
        ("ssn", "1", "", "<say-as> has no kind 'ssn'; use cardinal"),
        ("cardinal", "many", "", "cannot read 'many' as a cardinal number; write it as in 1,234"),
        ("ordinal", "x", "", "as an ordinal number"),
        ("digits", "a1", "", "as digits"),
        ("telephone", "none", "", "as a telephone number"),
        ("fraction", "3", "", "as a fraction"),
        ("time", "26:90", "", "as a time"),
        ("time", "3:00", "hm", "no format 'hm' of times"),
        ("date", "soon", "", "as a date"),
        ("date", "31/31/1999", "mdy", "as a date of the format mdy"),
        ("date", "1/2", "mdy", "as a date of the format mdy"),
        ("date", "Foo 3", "md", "as a date of the format md"),
        ("date", "1/2/3", "qqq", "no format 'qqq' of dates"),
        ("currency", "much", "", "as money"),
        ("currency", "XYZ 3", "", "the currency 'XYZ' is not supported"),
        ("unit", "!", "", "as a measure"),
        ("cardinal", " ", "", "needs 1 to 300 characters, not 0"),
        ("characters", "a" * 301, "", "not 301"),
    ],
)
def test_what_is_none_of_a_kind_is_refused(kind: str, written: str, more: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        say_as(kind, written, more, "en-us")


def test_other_languages_refuse_kinds_that_need_words() -> None:
    with pytest.raises(InputError, match="<say-as> does not support date in sv; write it in words"):
        say_as("date", "1.2.2003", "dmy", "sv")


@given(st.sampled_from(sorted(KINDS)), st.text(max_size=30), st.sampled_from(["", "mdy", "hms12", "USD", "?"]))
@example("date", "٣/٤/٢٠٢٠", "mdy")
def test_every_text_is_read_or_refused(kind: str, written: str, more: str) -> None:
    for language in ("en-us", "de"):
        try:
            said = say_as(kind, written, more, language)
        except InputError:
            continue
        assert isinstance(said, str)


def test_spans_have_a_voice_and_a_language() -> None:
    found = ssml(
        'a<voice name="Jenny heart espeak">b</voice><voice gender="male">c<lang xml:lang="de-DE">d</lang></voice>'
        '<voice gender="female" language="fr-FR">e</voice><voice xml:lang="en-GB">f</voice>'
        '<voice languages="es it" required="languages">g</voice>'
    )
    assert found.text == "a b c d e f g"
    assert [(run.voice, run.language) for run in found.runs] == [
        (None, None),
        ("heart", None),
        ("espeak", None),
        ("espeak", "de"),
        ("espeak-female", "fr-fr"),
        (None, "en-gb"),
        (None, "es"),
        (None, None),
    ]
    assert found.has_voice_changes


def test_the_language_of_the_text_is_no_span() -> None:
    plain = ssml("Hello there.").runs
    assert ssml('<lang xml:lang="en-US">Hello</lang> there.').runs == plain
    assert ssml('<voice gender="neutral">Hello</voice> there.').runs == plain
    assert parse_marks('<speak><p xml:lang="en-GB">Hi.</p></speak>').runs == (StyleRun(0),)


def test_paragraphs_and_sentences_have_languages() -> None:
    found = ssml('<p xml:lang="de">Hallo. <s xml:lang="fr">Salut.</s></p><p>Hello.</p>')
    parts = [
        (part.source, part.language) for sentence in split_sentences(found, "en-us") for part in sentence.utterances
    ]
    assert parts == [("Hallo.", "de"), ("Salut.", "fr-fr"), ("Hello.", None)]


def test_a_span_is_read_in_its_own_language() -> None:
    found = ssml('See 3 <lang xml:lang="de">Bäume</lang> 5')
    (sentence,) = split_sentences(found, "en-us")
    assert [part.text for part in sentence.utterances] == ["See three", "Bäume", "five"]
    check_readable(ssml('<lang xml:lang="ru">Привет</lang> you <phoneme ph="x">мир</phoneme>'), "en-us")
    with pytest.raises(InputError, match="language 'en-us' cannot read мир"):
        check_readable(ssml('<lang xml:lang="ru">Привет</lang> мир'), "en-us")
    with pytest.raises(InputError, match="language 'de' cannot read мир"):
        check_readable(ssml('<lang xml:lang="de">мир</lang>'), "ru")


@pytest.mark.parametrize(
    ("tag", "code"),
    [
        ("en-US", "en-us"), ("EN", "en-us"), ("de-AT", "de"), ("zh-CN", "cmn"), ("zh-Hans-CN", "cmn"),
        ("pt_BR", "pt-br"), ("fr", "fr-fr"), ("es-MX", "es-419"), ("no-NO", "nb"), ("ja-JP", "ja"),
    ],
)  # fmt: skip
def test_language_tags(tag: str, code: str) -> None:
    assert language_code(tag) == code


def test_documents_may_name_the_voices_that_need_no_file() -> None:
    assert tuple(SHIPPED_VOICES) == VOICES


@pytest.mark.parametrize(
    ("inside", "reason"),
    [
        ("<phoneme>a</phoneme>", "a <phoneme> needs ph; write"),
        ('<phoneme ph="%">a</phoneme>', r"'%' \(PERCENT SIGN\) in '%' is not a phone"),
        ('<phoneme ph="ˈ">a</phoneme>', "the <phoneme> of 'a' contains no phone"),
        ('<phoneme alphabet="x-arpabet" ph="QQ">a</phoneme>', "QQ"),
        ('<phoneme ph="{}">a</phoneme>'.format("a" * 501), "have 501 characters"),
        ('<phoneme ph="a">{}</phoneme>'.format("a" * 61), "words of at most 60 characters, not 61"),
        ('<phoneme ph="a"><p/></phoneme>', "<p> within <phoneme> is not followed"),
        ("<say-as>1</say-as>", "a <say-as> needs interpret-as; write"),
        ('<voice name="heart" language="de">a</voice>', "heart speaks English, not de"),
        ("<lang>a</lang>", "a <lang> needs xml:lang; write <lang xml:lang="),
    ],
)
def test_what_cannot_be_done_is_noted_with_its_line_and_its_words_are_spoken(inside: str, reason: str) -> None:
    found = ssml(f"c\nb\n{inside}")
    assert any(re.match(rf"SSML, line 3: .*({reason})", note) for note in found.notes), found.notes
    assert found.text.split() == ["c", "b", re.sub("<[^>]*>", "", inside) or "a"]


def test_long_attributes_are_refused_with_their_line() -> None:
    with pytest.raises(InputError, match=r"^SSML, line 3: .*attribute alias of <sub> has 10001 characters"):
        ssml(f'a\nb\n<sub alias="{"a" * (MAX_ATTRIBUTE_CHARACTERS + 1)}">a</sub>')


def _written(tag: str, attributes: dict, content: str) -> str:
    given_ = "".join(f" {name}={quoteattr(value)}" for name, value in attributes.items())
    return f"<{tag}{given_}>{content}</{tag}>"


TREES = st.recursive(
    PLAIN,
    lambda inner: st.builds(
        _written,
        st.sampled_from(ELEMENTS),
        st.dictionaries(st.sampled_from(ATTRIBUTES), VALUES, max_size=3),
        st.lists(inner, max_size=3).map("".join),
    ),
    max_leaves=12,
)


@settings(max_examples=300, deadline=None)
@given(TREES, st.sampled_from(["en-us", "de"]))
def test_any_tree_of_elements_is_read_or_refused_with_its_line(inside: str, language: str) -> None:
    begin = time.perf_counter()
    reason = "line 1"
    try:
        ssml(inside, language)
    except InputError as refused:
        reason = str(refused)
    assert "line 1" in reason
    assert len(reason) < 1000
    assert time.perf_counter() - begin < 1


@pytest.mark.parametrize(
    ("element", "attribute"),
    [
        ("sub", "alias"), ("phoneme", "ph"), ("phoneme", "alphabet"), ("say-as", "interpret-as"), ("say-as", "format"),
        ("voice", "name"), ("voice", "gender"), ("voice", "language"), ("lang", "xml:lang"), ("mark", "name"),
        ("break", "time"), ("prosody", "rate"), ("prosody", "volume"), ("emphasis", "level"), ("express-as", "style"),
        ("p", "foo"),
    ],
)  # fmt: skip
@pytest.mark.parametrize("piece", ["a", "a.", "ˈ", "1"])
def test_an_attribute_of_a_megabyte_is_refused_at_once(element: str, attribute: str, piece: str) -> None:
    begin = time.perf_counter()
    with pytest.raises(InputError, match=f"attribute {attribute} of <{element}> has 1000000 characters"):
        ssml(f'<{element} {attribute}="{piece * (1_000_000 // len(piece))}">1</{element}>')
    assert time.perf_counter() - begin < 1


@pytest.mark.parametrize(
    ("kind", "text", "form", "language", "spoken"),
    [
        ("date", "1.2.2003", "dmy", "de", "erster Februar zweitausenddrei"),
        ("date", "02/01/2003", "mdy", "fr-fr", "premier février deux mille trois"),
        ("date", "20030201", "ymd", "es", "uno de febrero de dos mil tres"),
        ("ordinal", "3", "", "it", "terzo"),
        ("time", "14:30", "", "nl", "veertien uur dertig"),
        ("currency", "3,50", "EUR", "el", "τρία ευρώ και πενήντα λεπτά"),
        ("unit", "5 km", "", "ru", "пять километров"),
        ("fraction", "3/4", "", "pl", "trzy czwarte"),
    ],
)
def test_kinds_are_read_in_languages_with_a_table(kind: str, text: str, form: str, language: str, spoken: str) -> None:
    assert say_as(kind, text, form, language) == spoken


@pytest.mark.parametrize(("kind", "text"), [("date", "a.b"), ("ordinal", "x"), ("time", "hello")])
def test_a_text_of_another_kind_is_refused_in_languages_with_a_table(kind: str, text: str) -> None:
    with pytest.raises(InputError, match=f"cannot read '{text}' as a {kind}"):
        say_as(kind, text, "dmy" if kind == "date" else "", "de")
