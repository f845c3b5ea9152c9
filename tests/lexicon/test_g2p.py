"""espeak-ng through phonemizer: languages, scripts, and that all it writes is in the phone table."""

import threading

import pytest

from lexicon.errors import InputError
from lexicon.g2p import check_language, languages, parse_espeak_word, phonemize, segments_by_rules
from lexicon.scripts import check_script

SENTENCES = {
    "en-us": ["The quick brown fox jumps over the lazy dog.", "Thirty bird girls ordered boring little buttons."],
    "en-gb": ["The lot near the tour goat, fire and power.", "A higher idea."],
    "de": [
        "Schöne Grüße aus München, zwölf Boxkämpfer jagen Viktor.",
        "Ein Apfel, eine Pflaume, Häuser, Garage, Restaurant.",
    ],
    "fr-fr": [
        "Portez ce vieux whisky au juge blond qui fume.",
        "Les feuilles, huit heures, montagne, un bon vin blanc, parking.",
    ],
    "es": ["El pingüino Wenceslao hizo kilómetros bajo exhaustiva lluvia.", "Gracias, cinco perros, hielo, huevo."],
    "it": ["Gli gnocchi, la pizza, città, zio, famiglia.", "Quel vituperabile xenofobo assaggia il whisky."],
    "pt": ["Não há pão, muito bem, mãe, põe.", "Luís argüia à Júlia."],
    "pt-br": ["Não há pão, gente, tia, dia, Brasil.", "Zângão eram palavras do português."],
    "nl": ["Goedemorgen, huis, deur, school, vijf, leeuw, nieuw.", "Pa's wijze lynx bezag vroom het fikse aquaduct."],
    "pl": ["Pchnąć w tę łódź jeża lub ośm skrzyń fig.", "Cześć, dziękuję, wąż, źdźbło, dżem."],
    "ru": ["Съешь же ещё этих мягких французских булок.", "Здравствуйте, щука, объект."],
    "sv": ["Sju sjösjuka sjömän, kär, tjugo, barn.", "Flygande bäckasiner söka hwila på mjuka tuvor."],
    "da": ["Quizdeltagerne spiste jordbær med fløde.", "Rødgrød."],
    "tr": ["Pijamalı hasta yağız şoföre çabucak güvendi.", "Dağ, ışık, kâğıt."],
    "cs": ["Příliš žluťoučký kůň úpěl ďábelské ódy.", "Řeka, dcera, džbán."],
    "ja": ["こんにちは、ありがとう。", "ふじさん、がっこう、りょこう、つき"],
    "cmn": ["你好,世界。", "中国人去吃饭,日本是一个国家,儿子,女人,学习"],
    "yue": ["你好,廣東話。", "香港"],
    "ko": ["안녕하세요, 한국어를 배웁니다.", "빨리, 까치, 쓰다, 짜다, 의사"],
    "vi": ["Xin chào, tôi là người Việt Nam.", "nghĩa, phở, đường"],
    "th": ["สวัสดี", "ขอบคุณ"],
    "hi": ["नमस्ते, आप कैसे हैं? ठीक, भारत, घर, ढोल.", "छात्र, झील, पढ़ना, मुँह, ज्ञान"],
    "ar": ["مرحبا بالعالم، القرآن، عين، ضوء", "صباح، طريق، خبز، غرب، حب"],
    "fa": ["سلام دنیا، خوب، قلم", "ژاله، چای"],
    "he": ["שלום עולם", "תודה"],
    "ka": ["გამარჯობა, წყალი, ყავა, ჭიქა", "პური, კატა"],
    "qu": ["Ñuqa ñawi qhapaq", "t'anta p'acha"],
    "eu": ["Kaixo mundua, hitz, hots", "etxea"],
    "is": ["Halló heimur, það, hljóð", "köttur"],
    "cy": ["Llanfair, chwech, rhaglen", "bore da"],
    "sw": ["Jambo dunia, ng'ombe, nyumba", "mbwa"],
    "ta": ["தமிழ் மொழி, வணக்கம்", "நன்றி"],
}


@pytest.mark.parametrize("language", SENTENCES)
def test_what_espeak_writes_is_in_the_table(language: str) -> None:
    for sentence, words in zip(SENTENCES[language], phonemize(SENTENCES[language], language), strict=True):
        segments = [segment for word in words for segment in parse_espeak_word(word, language)]
        assert len(segments) >= 2, sentence
        assert any(segment.is_syllabic for segment in segments), sentence


@pytest.mark.parametrize(
    ("language", "word", "phones"),
    [
        ("de", "Pferd", "p f eː ɾ t"),
        ("fr-fr", "bon", "b ɔ̃"),
        ("fr-fr", "parking", "p ɑː k ɪ ŋ"),  # read as English, between (en) and (fr)
        ("cmn", "中国", "ʈʂ oŋ k uo"),
        ("sv", "sju", "ɧ ʉ"),
        ("es", "año", "a ɲ o"),
    ],
)
def test_known_words(language: str, word: str, phones: str) -> None:
    (written,) = phonemize([word], language)
    found = [segment.phone for part in written for segment in parse_espeak_word(part, language)]
    wanted = [segment.phone for part in phones.split() for segment in parse_espeak_word(part, language)]
    assert "".join(found) == "".join(wanted)


def test_empty_lines_keep_their_place() -> None:
    assert phonemize([], "de") == ()
    first, empty, last = phonemize(["ja", "  ", "nein"], "de")
    assert (len(first), empty, len(last)) == (1, (), 1)


@pytest.mark.parametrize("mark", [",", ".", "("])
def test_a_hyphen_behind_a_mark_is_not_spoken(mark: str) -> None:
    assert phonemize([f"{mark}-Haus"], "de") == phonemize(["Haus"], "de")


def test_there_are_many_languages() -> None:
    assert len(languages()) > 120
    assert languages()["de"] == "German"


@pytest.mark.parametrize("language", ["en", "DE", "german", ""])
def test_what_is_no_code_is_refused(language: str) -> None:
    check_language("de")
    with pytest.raises(InputError, match=f"there is no language '{language}'; use a code such as en-us"):
        check_language(language)


@pytest.mark.parametrize(
    ("text", "language", "reason"),
    [
        ("Hello 世界", "en-us", r"'en-us' cannot read 世界 \(Chinese letters\)"),
        ("Привет, мир да", "en-us", r"cannot read Привет, мир, да \(Cyrillic letters\)"),
        ("日本", "ko", r"'ko' cannot read 日本"),
        ("A 日 is a word", "en-us", "cannot read 日 "),
        ("कि is no letter", "en-us", r"cannot read कि \(Devanagari letters\)"),
        ("مرحبا", "de", r"\(Arabic letters\)"),
    ],
)
def test_words_of_another_script_are_refused(text: str, language: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        check_script(text, language)


@pytest.mark.parametrize(
    ("text", "language"),
    [
        ("naïve ß 12, ٣ €!", "en-us"),
        ("Привет ok", "ru"),
        ("あア ok ー", "ja"),
        ("中文 abc", "cmn"),
        ("नमस्ते।", "hi"),
        ("hello Ω мир", "ru"),
        ("π, 5 µm, kΩ, μΩ, ℓ, Å, ㎛, Ж, א, あ, ä ﬁ Ａ", "en-us"),
        pytest.param("今日は", "ja", marks=pytest.mark.needs("pyopenjtalk")),
        ("Здраво zdravo", "sr"),
    ],
)
def test_own_scripts_single_letters_digits_and_marks_are_read(text: str, language: str) -> None:
    check_script(text, language)


def test_threads_get_their_own_answers() -> None:
    alone = {language: phonemize(SENTENCES[language], language) for language in ("de", "es", "ru")}
    wrong: list[str] = []

    def ask(language: str) -> None:
        for _ in range(5):
            if phonemize(SENTENCES[language], language) != alone[language]:
                wrong.append(language)

    threads = [threading.Thread(target=ask, args=(language,)) for language in [*alone] * 2]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


@pytest.mark.parametrize(("text", "language"), [("你好 world", "cmn"), ("สวัสดี bird", "th"), ("xin girl", "vi")])
def test_english_words_within_tone_languages_keep_their_vowel(text: str, language: str) -> None:
    (words,) = phonemize([text], language)
    assert "ɜ" in {segment.phone for segment in parse_espeak_word(words[-1], language)}


@pytest.mark.parametrize(
    ("text", "language", "phones"),
    [
        ("个", "cmn", "kɤ"), ("车", "cmn", "ʈʂɤ"), ("我", "cmn", "wo"), ("mưa", "vi", "mɯə"), ("tôi", "vi", "toj"),
        ("мы", "ru", "mɨ"), ("noite", "pt-br", "noɪtʃi"), ("gün", "tr", "ɟyn"), ("göl", "tr", "ɟœl"),
    ],
)  # fmt: skip
def test_rounded_vowels_are_those_of_the_language(text: str, language: str, phones: str) -> None:
    (segments,) = segments_by_rules([text], language)
    assert "".join(segment.phone for segment in segments) == phones
