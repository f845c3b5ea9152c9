"""Codes, tags and names of languages."""

import subprocess
import sys

import pytest

from lexicon.errors import InputError
from lexicon.g2p import languages, phonemize
from lexicon.languages import CODES_OF_NAMES, CODES_OF_TAGS, language_code
from lexicon.pronounce import pronounce


@pytest.mark.parametrize(
    ("written", "code"),
    [
        ("en-us", "en-us"), ("en-US", "en-us"), ("EN", "en-us"), ("en_US", "en-us"), ("en_US.UTF-8", "en-us"),
        ("English", "en-us"), ("english", "en-us"), ("American  English", "en-us"), ("en-GB", "en-gb"),
        ("British English", "en-gb"), ("English (Great Britain)", "en-gb"), ("en-AU", "en-gb"), ("en-UK", "en-gb"),
        ("de", "de"), ("DE-at", "de"), ("de_DE@euro", "de"), ("German", "de"), ("de-Latn-DE-1996", "de"),
        ("fr", "fr-fr"), ("fr-CA", "fr-fr"), ("fr-be", "fr-be"), ("FRENCH", "fr-fr"), ("fr-Latn-CH", "fr-ch"),
        ("pt", "pt"), ("pt-BR", "pt-br"), ("pt-PT", "pt"), ("Brazilian Portuguese", "pt-br"), ("Portuguese", "pt"),
        ("es-ES", "es"), ("es-MX", "es-419"), ("Spanish", "es"), ("zh", "cmn"), ("zh-Hans", "cmn"), ("zh-CN", "cmn"),
        ("zh-Hant-TW", "cmn"), ("zh-Hant-HK", "yue"), ("zh-HK", "yue"), ("Chinese", "cmn"), ("Cantonese", "yue"),
        ("cmn-Latn-pinyin", "cmn-latn-pinyin"), ("no", "nb"), ("nn-NO", "nb"), ("iw", "he"), ("sr-Cyrl-RS", "sr"),
        ("chr", "chr-US-Qaaa-x-west"), ("CHR-us-qaaa-X-west", "chr-US-Qaaa-x-west"), ("Greek", "el"),
        ("Norwegian", "nb"), ("Persian", "fa"), ("Vietnamese", "vi"), ("Burmese", "my"), ("ja-JP", "ja"),
        ("ja-JP-u-ca-japanese", "ja"),
    ],
)  # fmt: skip
def test_languages_as_people_write_them(written: str, code: str) -> None:
    assert language_code(written) == code


@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("xx-none", ""),
        ("tlh", ""),
        ("germn", r"did you mean de \(German\)"),
        ("swed", r"did you mean sv \(Swedish\)"),
        ("gaelic", r"did you mean ga \(Gaelic \(Irish\)\), gd \(Gaelic \(Scottish\)\)\?"),
        ("", "`tts2face languages` lists all"),
        ("de-", ""),
        ("de DE", ""),
        ("zzzzzz" * 1000, "`tts2face languages` lists all"),
    ],
)
def test_what_is_no_language_is_refused_with_near_ones(written: str, hint: str) -> None:
    with pytest.raises(InputError, match=f"there is no language '{written[:40]}'; .*{hint}"):
        language_code(written)


def test_every_code_and_every_name_of_espeak_leads_to_its_language() -> None:
    for code, name in languages().items():
        assert language_code(code) == language_code(code.upper()) == code
        assert language_code(name) == code
    assert set(CODES_OF_TAGS.values()) | set(CODES_OF_NAMES.values()) <= set(languages())


def test_phones_of_a_text_take_any_spelling() -> None:
    assert pronounce("Hallo Welt", "German").language == "de"
    assert pronounce("Hallo", "DE").words == pronounce("Hallo", "de").words
    assert phonemize(["Hallo"], "de")


def test_the_default_language_loads_no_espeak() -> None:
    check = "import sys; from tts2face.request import Request; Request(text='a'); print('phonemizer' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", check], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"
