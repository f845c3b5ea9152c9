"""Prompts are selected by their coverage of phones and triphones."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from corpus_tools.prompts.coverage import (
    PHONES_A_PROMPT,
    REPEATS,
    Units,
    count_units,
    select_sentences,
    sentence_units,
    unit_weights,
)
from corpus_tools.prompts.prompts import (
    MAX_MINUTES,
    choose_prompts,
    format_counts,
    n_prompts,
    shipped_counts,
    shipped_sentences,
)
from corpus_tools.prompts.sentences import easy_sentences, words_of
from lexicon.dictionary import cmudict_lookup
from lexicon.errors import InputError

GERMAN = """
Der alte Mann ging langsam durch den Wald. Die Kinder spielten jeden Tag am Fluss. Er kam 1912 nach Hause und schlief.
Wir haben heute schönes Wetter und gute Laune. Kurz!
"""

_units = st.lists(
    st.tuples(
        st.lists(st.sampled_from("abcdef"), min_size=1, max_size=5),
        st.lists(st.tuples(*[st.sampled_from("xyz")] * 3), max_size=5),
    ).map(lambda pair: Units(tuple(pair[0]), tuple(pair[1]))),
    min_size=1,
    max_size=8,
)


def value(selected, running):
    """Weighted occurrences, counted afresh."""
    weights = unit_weights(running)
    every = [unit for units in selected for unit in (*units.phones, *units.triphones)]
    return sum(weight * sum(REPEATS[: every.count(unit)]) for unit, weight in weights.items())


@given(_units)
@settings(max_examples=80, deadline=None)
def test_each_choice_is_the_best_of_all_that_are_left_and_coverage_never_falls(candidates):
    running = count_units(candidates)
    order = list(select_sentences(candidates, running))
    assert len(set(order)) == len(order)
    for n, chosen in enumerate(order):
        before = [candidates[at] for at in order[:n]]

        def rate(at, before=before):
            gain = value([*before, candidates[at]], running) - value(before, running)
            return gain / (PHONES_A_PROMPT + len(candidates[at].phones))

        left = [at for at in range(len(candidates)) if at not in order[:n]]
        assert rate(chosen) == pytest.approx(max(map(rate, left)), rel=1e-12)
        assert rate(chosen) > 0
        after = running.coverage([*before, candidates[chosen]])
        assert after.share >= running.coverage(before).share
        assert after.n_phones >= running.coverage(before).n_phones
    assert running.coverage([candidates[at] for at in order]) == running.coverage(candidates)


def test_triphones_are_visemes_of_neighbours_with_silence_at_marks():
    units = sentence_units("No, my boy.", "en-us")
    assert units.phones == ("n", "oʊ", "m", "aɪ", "b", "ɔɪ")
    assert units.triphones == (
        ("sil", "nn", "O"),
        ("nn", "O-U", "sil"),
        ("sil", "PP", "aa"),
        ("PP", "aa-I", "PP"),
        ("I", "PP", "O"),
        ("PP", "O-I", "sil"),
    )


@pytest.mark.parametrize(("minutes", "n"), [(2, 25), (5, 60), (10, 120), (15, 180)])
def test_minutes_are_prompts_and_less_is_the_beginning_of_more(minutes, n):
    chosen = choose_prompts(minutes)
    assert n_prompts(minutes) == len(chosen.texts) == n
    assert chosen.texts == shipped_sentences()[:n]
    assert choose_prompts(minutes).texts == chosen.texts


def test_shipped_prompts_hold_every_english_phone_and_most_of_running_text():
    *_, (_, _, cover) = choose_prompts(5).coverage_by_minute()
    assert cover.n_phones == cover.of_phones >= 39
    assert cover.share > 0.8
    shares = [cover.share for _, _, cover in choose_prompts(15).coverage_by_minute()]
    assert shares == sorted(shares)
    assert shares[9] > 0.9


def test_shipped_prompts_are_short_and_of_known_words():
    sentences = shipped_sentences()
    assert len({sentence.casefold() for sentence in sentences}) == len(sentences)
    for sentence in sentences:
        assert 5 <= len(sentence.split()) <= 12
        assert all(cmudict_lookup(word) for word in words_of(sentence)), sentence
        assert [word for word in sentence.split()[1:] if word[0].isupper() and word != "I"] == []


def test_the_counts_of_running_text_are_written_as_they_are_read():
    counts = shipped_counts()
    assert format_counts(counts).count("\n") == 1 + len(counts.phones) + len(counts.triphones)
    assert counts.coverage([]).share == 0.0


def test_a_text_of_another_language_is_selected_by_its_phones(tmp_path):
    text = tmp_path / "text.txt"
    base = list(easy_sentences(GERMAN, "de"))
    assert base == [
        "Der alte Mann ging langsam durch den Wald.",
        "Die Kinder spielten jeden Tag am Fluss.",
        "Wir haben heute schönes Wetter und gute Laune.",
    ]
    adjectives = ("grüne", "lange", "schöne", "kalte", "böse", "junge", "rote")
    nouns = ("Straße", "Brücke", "Tasche", "Möwe", "Kirche", "Zeitung", "Glocke")
    text.write_text(" ".join(f"Ich sehe dort eine {one} {two}." for one in adjectives for two in nouns))
    chosen = choose_prompts(1, language="de", text=text)
    assert len(chosen.texts) == 12
    assert "ʁ" in chosen.running.phones or "r" in chosen.running.phones
    first = chosen.running.coverage(chosen.units[:1]).share
    assert chosen.coverage_by_minute()[0][2].share > first


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"minutes": 0.5}, "for 0.5 minutes cannot be chosen"),
        ({"minutes": MAX_MINUTES + 1}, "for 61 minutes cannot be chosen"),
        ({"minutes": 16}, r"the shipped list has 180 prompts .* fewer than the 192 of 16 minutes; give --text"),
        ({"language": "de"}, "no shipped prompts in de; give a text"),
        ({"language": "xx"}, "xx"),
    ],
)
def test_wrong_requests_say_what_to_give(arguments, message):
    with pytest.raises(InputError, match=message):
        choose_prompts(**arguments)


def test_a_text_must_exist_and_be_long_enough(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        choose_prompts(2, text=tmp_path / "missing.txt")
    short = tmp_path / "short.txt"
    short.write_text("This is the only sentence of the text.")
    with pytest.raises(InputError, match=r"has 1 prompts .*; give a longer text"):
        choose_prompts(2, text=short)
