"""The encoding of text that is not UTF-8: by the language, else by the letters that make words, and always said."""

import pytest

from tests.interchange.subtitles.conftest import ReadText, srt
from tts2face.interchange.subtitles.encodings import encoding_of_language, guess_encoding

TEXTS = {
    "cs": ("cp1250", "Dobrý den, můžeme začít? Příště přijďte dřív."),
    "pl": ("cp1250", "Dzień dobry, gdzie jest mój płaszcz? Już idę."),
    "hu": ("cp1250", "Jó napot, hol van az őrült nő? Nem tűnt el."),
    "hr": ("cp1250", "Dobro jutro, gdje je ključ? Što želiš?"),
    "ru": ("cp1251", "Добрый день, где мой плащ? Я уже иду."),
    "uk": ("cp1251", "Добрий день, де мій плащ? Я вже йду."),
    "el": ("cp1253", "Καλημέρα, πού είναι το παλτό μου; Έρχομαι."),
    "tr": ("cp1254", "Günaydın, paltom nerede? Şimdi geliyorum, değil mi?"),
    "he": ("cp1255", "בוקר טוב, איפה המעיל שלי? אני בא."),
    "ar": ("cp1256", "صباح الخير، أين معطفي؟ أنا قادم."),
    "lt": ("cp1257", "Labas rytas, kur mano paltas? Aš jau einu į mišką, ačiū."),
    "ja": ("cp932", "おはようございます。私のコートはどこですか。"),
    "ko": ("cp949", "안녕하세요, 제 코트는 어디에 있나요?"),
    "zh": ("gbk", "你好，我的外套在哪里？我现在就来。"),
    "zh-TW": ("big5hkscs", "你好，我的外套在哪裡？我現在就來。"),
    "fr": ("cp1252", "Bonjour, où est mon manteau ? Je suis déjà là."),
    "de": ("cp1252", "Guten Morgen, wo ist die grüne Tür? Schön."),
    "es": ("cp1252", "Buenos días, ¿dónde está el niño?"),
    "sv": ("cp1252", "God morgon, var är pojken? Jag är här på ön."),
    "pt": ("cp1252", "Bom dia, você não está à janela? Então não."),
}


@pytest.mark.parametrize("language", TEXTS)
@pytest.mark.parametrize("is_known", [True, False])
def test_the_encoding_is_guessed_and_said(language: str, is_known: bool, read: ReadText) -> None:
    name, text = TEXTS[language]
    found = read(srt((1, 3, text)).encode(name), language=language if is_known else None)
    assert found.cues[0].text == text
    assert [warning.message for warning in found.warnings] == [
        f"the encoding is not stated and was guessed as {name}; --encoding names another"
    ]


def test_an_encoding_of_the_language_that_cannot_be_is_not_used(read: ReadText) -> None:
    found = read(srt((1, 3, "Šťastný den, přítel.")).encode("cp1250"), language="ja")
    assert found.cues[0].text == "Šťastný den, přítel."


@pytest.mark.parametrize("name", ["utf-8", "utf-8-sig", "utf-16", "utf-32"])
def test_what_is_certain_is_not_said(name: str, read: ReadText) -> None:
    assert not read(srt((1, 3, "Půjdeme.")).encode(name)).warnings


def test_an_encoding_that_is_named_or_declared_is_no_guess(read: ReadText) -> None:
    content = srt((1, 3, "Půjdeme.")).encode("cp1250")
    assert not read(content, encoding="cp1250").warnings
    ttml = '<?xml version="1.0" encoding="iso-8859-2"?><tt><body><p begin="1s" end="3s">Půjdeme.</p></body></tt>'
    found = read(ttml.encode("iso-8859-2"), ".ttml")
    assert found.cues[0].text == "Půjdeme."
    assert not found.warnings


def test_damaged_utf_8_stays_utf_8(read: ReadText) -> None:
    content = srt((1, 3, "Žluťoučký kůň pěl"), (4, 5, "ďábelské ódy.")).encode() + b"\xff\n"
    found = read(content)
    assert found.cues[0].text == "Žluťoučký kůň pěl"
    assert found.warnings[0].message.startswith("1 bytes are no UTF-8")


@pytest.mark.parametrize(
    ("language", "name"),
    [
        ("pl", "cp1250"),
        ("ro", "cp1250"),
        ("sr", "cp1251"),
        ("vi", "cp1258"),
        ("et", "cp1257"),
        ("en-gb", "cp1252"),
        ("pt-br", "cp1252"),
        ("zh-Hant", "big5hkscs"),
        ("cmn", "gbk"),
        (None, None),
        ("xx", None),
    ],
)
def test_encodings_of_languages(language: str | None, name: str | None) -> None:
    assert encoding_of_language(language) == name


@pytest.mark.parametrize("text", ["It is £5.", "It cost me £ 20 then.", "Only 5£!", "He paid ¥300 for it."])
def test_money_is_no_letter(text: str) -> None:
    found = guess_encoding(text.encode("cp1252"))
    assert found is not None
    assert (found.text, found.encoding) == (text, "cp1252")
