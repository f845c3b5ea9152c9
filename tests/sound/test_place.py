"""Words placed into stretches of sound."""

import numpy as np
import pytest

from lexicon.errors import InputError
from tts2face.sound import word_assignment as place
from tts2face.sound.word_assignment import assign_words

PHONES = "pbtdkgfvszmnlrwiuaeo"


def edit_cost(written: str, sounded: str) -> float:
    """Cost of the cheapest edits: the whole table, in plain Python."""
    row = [place.GAP_COST * number for number in range(len(sounded) + 1)]
    for phone in written:
        before, row = row, [row[0] + place.GAP_COST]
        for number, other in enumerate(sounded):
            said = before[number] + (0.0 if phone == other else place.SUBSTITUTION_COST)
            row.append(min(said, before[number + 1] + place.GAP_COST, row[-1] + place.GAP_COST))
    return row[-1]


def cost_of(partners: np.ndarray, written: str, sounded: str, steps: list[int]) -> float:
    """Cost of the edits of an assignment."""
    missed = len(sounded) - sum(step == place.MATCHED for step in steps)
    said = sum(
        place.SUBSTITUTION_COST * (written[number] != sounded[partner])
        for number, (partner, step) in enumerate(zip(partners, steps, strict=True))
        if step == place.MATCHED
    )
    return said + place.GAP_COST * (missed + sum(step == place.DELETED for step in steps))


@pytest.mark.parametrize("seed", range(20))
def test_the_path_is_the_cheapest(seed: int) -> None:
    generator = np.random.default_rng(seed)
    written, sounded = ("".join(generator.choice(list("pba"), generator.integers(1, 9))) for _ in range(2))
    numbers = {phone: number for number, phone in enumerate("pba")}
    partners = np.zeros(len(written), np.int64)
    place._match_phones(
        np.array([numbers[one] for one in written]), np.array([numbers[one] for one in sounded]), 20, partners
    )
    assert (np.diff(partners) >= 0).all()
    costs = []
    for flags in np.ndindex(*[2] * len(written)):  # any choice of recognised phones; one of them has the least cost
        steps = [place.MATCHED if flag else place.DELETED for flag in flags]
        used = [int(partner) for partner, flag in zip(partners, flags, strict=True) if flag]
        if len(set(used)) == len(used):
            costs.append(cost_of(partners, written, sounded, steps))
    assert min(costs) == pytest.approx(edit_cost(written, sounded), abs=1e-5)


def test_words_are_placed_at_their_recognised_phones() -> None:
    generator = np.random.default_rng(1)
    words = [tuple(generator.choice(list(PHONES), generator.integers(2, 6))) for _ in range(300)]
    truth = np.sort(generator.integers(0, 12, len(words)))
    recognised: list[list[str]] = [[] for _ in range(12)]
    for word, at in zip(words, truth, strict=True):
        for phone in word:
            luck = generator.random()
            if luck < 0.1:
                continue  # not recognised
            recognised[at].append(phone if luck < 0.8 else str(generator.choice(list(PHONES))))
            if luck > 0.95:
                recognised[at].append(str(generator.choice(list(PHONES))))
    found = assign_words(words, recognised)
    assert (np.diff(found) >= 0).all()
    assert (found == truth).mean() > 0.99


def test_text_far_longer_than_the_sound_has_its_places(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(place, "BAND", 4)
    words = [tuple("pa")] * 40 + [tuple("si")] * 5
    found = assign_words(words, [list("papa"), list("sisisisisi")])
    assert found[0] == 0
    assert found[-5:].tolist() == [1] * 5


def test_a_word_is_never_in_a_part_between_its_phones() -> None:
    recognised = [list("pata"), [], list("i")]
    assert assign_words([tuple("pat"), tuple("ai")], recognised).tolist() == [0, 0]


def test_silence_holds_all_words() -> None:
    assert assign_words([("p",), ("a",)], [[], []]).tolist() == [0, 0]


def test_nothing_to_place() -> None:
    with pytest.raises(InputError, match="needs at least one word"):
        assign_words([], [["p"]])
