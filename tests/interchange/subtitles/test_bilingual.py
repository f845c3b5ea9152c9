"""Files that show two languages throughout are spoken in one of them."""

import pytest

from tests.interchange.subtitles.conftest import ReadText, ass, srt

ENGLISH = (
    "Where did you go last night?",
    "I was at home with my brother.",
    "That is not what they told me.",
    "We have to leave now.",
)
GERMAN = (
    "Wo bist du gestern Abend gewesen?",
    "Ich war mit meinem Bruder zu Hause.",
    "Das ist nicht, was sie mir gesagt haben.",
    "Wir müssen jetzt gehen.",
)
SPANISH = (
    "¿Dónde estuviste anoche?",
    "Yo estaba en casa con mi hermano.",
    "Eso no es lo que ellos me dijeron.",
    "Tenemos que irnos, porque es tarde.",
)
CHINESE = ("你昨晚去哪里了？", "我和我兄弟在家。", "他们不是这么跟我说的。", "我们现在得走了。")
RUSSIAN = ("Где ты был вчера вечером?", "Я был дома с братом.", "Мне сказали не это.", "Нам пора идти.")
TEXTS = {"en": ENGLISH, "de": GERMAN, "es": SPANISH, "cmn": CHINESE, "ru": RUSSIAN}

ONE_LANGUAGE = {
    "two sentences": [f"{one}\n{other}" for one, other in zip(ENGLISH, reversed(ENGLISH), strict=True)],
    "wrapped sentences": [
        "Where did you\ngo last night?",
        "I was at home\nwith my brother.",
        "That is not\nwhat they said.",
    ],
    "German": [f"{one}\n{other}" for one, other in zip(GERMAN, reversed(GERMAN), strict=True)],
    "names": ["Where is it?\nMamma mia.", "I was at home.\nSayonara!", "That is it.\nVoilà.", "We have it.\nPronto."],
    "a quotation": [*ENGLISH, "He said:\n你好", "And then:\n你好", "So it was:\n你好"],
    "relatives": [
        "Og det er ikke meg.\nOg det er ikke mig.",
        "Jeg har det.\nJeg har det ikke.",
        "Hvor er du?\nHvor er vi?",
    ],
}


def stacked(first: str, second: str) -> str:
    """SubRip with the lines of one language above those of another."""
    lines = zip(TEXTS[first], TEXTS[second], strict=True)
    return srt(*[(at, at + 0.9, f"{above}\n{below}") for at, (above, below) in enumerate(lines)])


@pytest.mark.parametrize(
    ("first", "second", "language", "spoken"),
    [
        ("cmn", "en", None, "en"),
        ("en", "cmn", "zh-CN", "cmn"),
        ("en", "de", None, "en"),
        ("de", "en", "de", "de"),
        ("es", "en", "en-gb", "en"),
        ("ru", "de", "ru", "ru"),
        ("ru", "de", "fr", "de"),
        ("cmn", "ru", None, "cmn"),
        ("es", "de", None, "es"),
    ],
)
def test_stacked_lines_of_one_language_are_spoken(
    first: str, second: str, language: str | None, spoken: str, read: ReadText
) -> None:
    found = read(stacked(first, second), language=language)
    assert [cue.text for cue in found.cues] == [*TEXTS[spoken]]
    (note,) = found.notes
    assert note.message.startswith(f"two languages: 4 cues are shown in '{first}' and in '{second}', of which")
    assert f"'{spoken}' is spoken (--language names the other one, --keep repeats speaks both)" in note.message
    kept = read(stacked(first, second), language=language, keep=("repeats",))
    assert len(kept.cues[0].text) > len(TEXTS[first][0])
    assert not kept.notes


def test_layers_of_two_languages_are_one(read: ReadText) -> None:
    lines = [
        (at, at + 0.9, style, TEXTS[tag][at]) for style, tag in (("Above", "de"), ("Main", "en")) for at in range(4)
    ]
    found = read(ass(*lines), ".ass", language="de")
    assert [cue.text for cue in found.cues] == [*GERMAN]
    assert not any("overlaps" in warning.message for warning in found.warnings)


def test_a_language_of_several_lines_and_cues_of_one_language_stay(read: ReadText) -> None:
    texts = [f"{above}\n{below}" for above, below in zip(CHINESE, ENGLISH, strict=True)]
    texts += ["你说什么？\nWhat did you\nsay to him?", "OK.", "[a bell]\nCome in."]
    found = read(srt(*[(at, at + 0.9, text) for at, text in enumerate(texts)]))
    assert [cue.text for cue in found.cues] == [*ENGLISH, "What did you say to him?", "OK.", "Come in."]


@pytest.mark.parametrize("texts", ONE_LANGUAGE.values(), ids=ONE_LANGUAGE)
def test_lines_that_are_not_clearly_of_two_languages_are_all_spoken(texts: list[str], read: ReadText) -> None:
    found = read(srt(*[(at, at + 0.9, text) for at, text in enumerate(texts)]))
    assert [cue.text for cue in found.cues] == [" ".join(text.split()) for text in texts]
    assert not found.notes
