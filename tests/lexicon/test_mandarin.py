"""Characters of Mandarin by their context; readings from 现代汉语词典 (7th edition)."""

import pytest

from lexicon.g2p import segments_by_rules
from lexicon.mandarin import espeak_characters
from lexicon.pronounce import pronounce
from lexicon.written_words import written_words


def phones(text: str) -> list[str]:
    return ["".join(word.phones) for word in pronounce(text, "cmn").words]


@pytest.mark.parametrize(
    ("text", "syllables"),
    [
        ("还钱", "χuan tɕiɛn"), ("还有", "χai jiou"), ("便宜", "piɛn ji"), ("角色", "tɕyɛ sɤ"), ("角落", "tɕjɑu luo"),
        ("银行", "jin χɑŋ"), ("旅行", "ly ɕiŋ"), ("校长", "ɕjɑu ʈʂɑŋ"), ("长城", "ʈʂɑŋ ʈʂəŋ"), ("音乐", "jin jyɛ"),
        ("快乐", "kuai lə"), ("重要", "ʈʂoŋ jɑu"), ("都市", "tu ʂi"), ("了解", "ljɑu tɕiɛ"), ("会计", "kuai tɕi"),
        ("睡觉", "ʂwei tɕjɑu"), ("觉得", "tɕyɛ tə"), ("銀行", "jin χɑŋ"),
    ],
)  # fmt: skip
def test_characters_of_several_readings_have_that_of_their_word(text: str, syllables: str) -> None:
    assert "".join(phones(text)) == "".join(syllables.split())


@pytest.mark.parametrize("text", ["熊", "兄", "胸", "雄", "凶", "穷", "琼", "窘", "炯", "迥"])
def test_no_syllable_is_spoken_in_english(text: str) -> None:
    assert phones(text)[0] in {"ɕijoŋ", "tɕijoŋ"}


def test_words_are_written_characters_and_particles_stay() -> None:
    assert [word.text for word in written_words("我还钱，慢慢地走。", "cmn")] == list("我还钱慢慢地走")
    assert "".join(espeak_characters("慢慢地走，iPhone 15 好。")) == "慢慢地走，iPhone 15 好。"
    assert espeak_characters("土地")[1] != "地"


def test_every_character_that_stands_for_another_is_read_so() -> None:
    """One row of the table in nine, as espeak-ng takes a millisecond for each."""
    from lexicon.mandarin import _readings

    homophone, _ = _readings()
    rows = sorted(homophone)[::9]
    assert len(rows) > 100
    spoken = segments_by_rules([homophone[row] for row in rows], "cmn")
    initials = {
        "zh": "ʈʂ",
        "ch": "ʈʂ",
        "sh": "ʂ",
        "m": "m",
        "f": "f",
        "n": "n",
        "l": "l",
        "s": "s",
        "j": "tɕ",
        "q": "tɕ",
    }
    for row, segments in zip(rows, spoken, strict=True):
        wanted = next((phone for initial, phone in initials.items() if row.startswith(initial)), "")
        assert "".join(segment.phone for segment in segments).startswith(wanted), row
