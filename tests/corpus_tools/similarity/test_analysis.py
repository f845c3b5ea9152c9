"""The analysis of a talker whose answer is known."""

from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.studies.similarity.analysis import NamedTalker, SimilarityOptions, analyse, compare_tables
from corpus_tools.studies.similarity.consistency import MOVEMENTS, mode_names, movement_consistency, movement_weights
from corpus_tools.studies.similarity.page import similarity_page
from corpus_tools.studies.similarity.reliability import spearman_brown, split_half
from corpus_tools.studies.similarity.tables import NO_WORD, SimilarityTable, collect_spoken_tokens, similarity_table
from corpus_tools.studies.similarity.write import similarity_report
from lexicon.errors import InputError
from tests.corpus_tools.similarity.steady_talker import BLOCKS, POSES, made_model, made_talker
from tests.packages import needs
from tts2face.lips.exemplar import build_exemplar_model


@pytest.fixture(scope="module")
def spoken_tokens(talker):
    return collect_spoken_tokens(talker, "made")


@pytest.fixture(scope="module")
def found(talker):
    needs("sklearn")
    return analyse(NamedTalker("made", talker), SimilarityOptions(halves=4))


def test_the_table_is_the_one_that_synthesis_uses_without_silence(talker, spoken_tokens):
    table, used = similarity_table(spoken_tokens), build_exemplar_model(talker).similarity
    assert "sil" not in table.phones
    for i, a in enumerate(table.phones):
        assert table.silence[i] == used.matrix[used.phones.index(a), used.phones.index("sil")]
        for j, b in enumerate(table.phones):
            assert table.matrix[i, j] == used.matrix[used.phones.index(a), used.phones.index(b)]
    assert (table.counts == 60).all()


def test_the_classes_equal_the_generated_visemes(found):
    assert found.best.n_classes == 3
    groups = {frozenset(np.array(found.table.phones)[found.best.labels == k]) for k in range(3)}
    assert groups == {frozenset(block) for block in BLOCKS}
    assert found.best.silhouette > 0.7
    assert [classes.n_classes for classes in found.chosen] == [4, 6, 8]
    assert [classes.n_classes for classes in found.curve] == list(range(2, 9))


def test_neighbours_are_of_the_same_look(found):
    for phone, ranked in zip(found.table.phones, found.neighbours, strict=True):
        block = next(block for block in BLOCKS if phone in block)
        assert {near for near, _ in ranked[:2]} == block - {phone}


def test_articulatory_features_are_compared_for_recorded_phones(found):
    assert [name for name, _ in found.articulatory] == ["all phones", "consonants", "vowels"]
    assert found.articulatory[0][1].n_pairs == 36
    assert found.articulatory[1][1].n_pairs == 6


@pytest.mark.parametrize(("r", "whole"), [(0.5, 2 / 3), (1.0, 1.0), (0.0, 0.0), (0.8, 8 / 9)])
def test_spearman_brown(r, whole):
    assert spearman_brown(r) == pytest.approx(whole, rel=1e-12)


def test_halves_of_a_steady_talker_agree_and_each_holds_half(found):
    split = found.by_utterances
    assert len(split.correlations) == split.n_requested == 4
    assert (split.n_phones == len(POSES) - 1).all()
    assert split.mean > 0.98
    assert split.full_length_reliability == spearman_brown(split.mean)
    assert split.left_out == ()


def test_halves_by_words_share_no_word(spoken_tokens):
    units = np.where(spoken_tokens.word >= 0, spoken_tokens.word, NO_WORD)
    split = split_half(spoken_tokens, units, 3, np.random.default_rng(0))
    assert split is not None
    assert split.mean > 0.9


def test_halves_compare_only_the_phones_among_those_given(spoken_tokens):
    among = {"p", "b", "u", "w", "a"}
    split = split_half(spoken_tokens, spoken_tokens.utterance, 3, np.random.default_rng(0), among=among)
    assert split is not None
    assert set(split.phones) - set(split.left_out) == among
    assert (split.n_phones == 5).all()


@pytest.mark.needs("sklearn")
def test_a_talker_without_words_has_no_halves_of_words(talker):
    wordless = replace(
        talker, utterances=tuple(replace(spoken_tokens, words=()) for spoken_tokens in talker.utterances)
    )
    found = analyse(NamedTalker("made", wordless), SimilarityOptions(halves=2))
    assert found.by_words is None
    assert found.by_utterances_same_phones is None
    assert "too few phones with tokens in both halves" in similarity_page(found, "both")
    assert '"words": null' in similarity_report("both").formats[".json"](found).decode()


@pytest.mark.needs("sklearn")
def test_progress_runs_to_its_end(talker):
    steps = []
    analyse(
        NamedTalker("made", talker), SimilarityOptions(halves=2), on_progress=lambda done, of: steps.append((done, of))
    )
    assert steps == [(done, 6) for done in range(1, 7)]


def test_random_visemes_do_not_correlate(spoken_tokens):
    shuffled = replace(spoken_tokens, phone=np.random.default_rng(0).permutation(spoken_tokens.phone))
    split = split_half(shuffled, spoken_tokens.utterance, 10, np.random.default_rng(0))
    assert split is not None
    assert abs(split.mean) < 0.35


def test_a_phone_with_few_tokens_is_omitted_from_the_halves(spoken_tokens):
    rare = spoken_tokens.inventory.index("w")
    few = np.flatnonzero(spoken_tokens.phone == rare)[12:]
    kept = ~np.isin(np.arange(len(spoken_tokens.phone)), few)
    thin = replace(
        spoken_tokens,
        samples=spoken_tokens.samples[kept],
        phone=spoken_tokens.phone[kept],
        utterance=spoken_tokens.utterance[kept],
        word=spoken_tokens.word[kept],
    )
    split = split_half(thin, thin.utterance, 3, np.random.default_rng(0))
    assert split is not None
    assert split.left_out == ("w",)
    assert (split.n_phones == len(POSES) - 2).all()
    assert np.isnan(split.per_phone[split.phones.index("w")])


def test_no_halves_where_all_is_one_word(spoken_tokens):
    assert split_half(spoken_tokens, np.zeros(len(spoken_tokens.phone), int), 3, np.random.default_rng(0)) is None


def test_the_seed_chooses_the_halves(talker, found):
    again = analyse(NamedTalker("made", talker), SimilarityOptions(halves=4))
    other = analyse(NamedTalker("made", talker), SimilarityOptions(halves=4, seed=1))
    assert (again.by_utterances.correlations == found.by_utterances.correlations).all()
    assert (other.by_utterances.correlations != found.by_utterances.correlations).any()


def test_movements_are_measured_in_millimetres():
    weights = movement_weights(made_model())
    kinds = list(MOVEMENTS)
    assert weights[kinds.index("opening")].tolist() == [1.0, 0.0, 0.0]
    assert weights[kinds.index("width")].tolist() == pytest.approx([0.0, 2**0.5, 0.0])  # corners part by half each
    assert mode_names(made_model()) == ("opening +6.0", "width +4.0", "fine detail")


def test_controlled_movements_are_held_and_noise_is_free(talker, spoken_tokens, found):
    held = movement_consistency(spoken_tokens, found.table.phones, talker.model)
    opening = held.names.index("opening")
    assert held.free_share[opening] < 0.05
    assert (held.free[:, opening] < 0.3).all()
    assert found.modes.free_share[2] > 0.95
    assert found.modes.free[:, 2] == pytest.approx(1.0, abs=0.2)
    values = spoken_tokens.samples[spoken_tokens.phone == spoken_tokens.inventory.index("a"), :, 2]
    total = spoken_tokens.samples[spoken_tokens.phone != spoken_tokens.inventory.index("sil"), :, 2]
    expected = np.sqrt(np.mean(values.std(axis=0) ** 2) / np.mean(total.std(axis=0) ** 2))
    assert found.modes.free[found.table.phones.index("a"), 2] == pytest.approx(expected, rel=1e-6)


def table(phones, values):
    matrix = np.eye(len(phones))
    matrix[np.triu_indices(len(phones), 1)] = values
    matrix = np.maximum(matrix, matrix.T)
    return SimilarityTable(tuple(phones), np.full(len(phones), 20), matrix, np.zeros(len(phones)))


def test_a_comparison_by_hand():
    one = table("pbaiu", [0.9, 0.1, 0.2, 0.3, 0.1, 0.2, 0.4, 0.5, 0.6, 0.7])
    two = table("bpaif", [0.8, 0.1, 0.2, 0.3, 0.6, 0.2, 0.4, 0.5, 0.6, 0.7])
    found = compare_tables(one, two, "two", np.random.default_rng(0))
    assert found.phones == ("p", "b", "a", "i")
    assert found.left_out == ("f", "u")
    # p-b .9 - .8, p-a .1 - .6, p-i .2 - .2, b-a .1 - .1, b-i .2 - .2, a-i .5 - .5
    assert found.largest_differences(2) == [("p", "a", pytest.approx(-0.5)), ("p", "b", pytest.approx(0.1))]
    assert found.per_phone[0] == pytest.approx(0.6 / 3)
    expected = np.corrcoef([0.9, 0.1, 0.2, 0.1, 0.2, 0.5], [0.8, 0.6, 0.2, 0.1, 0.2, 0.5])[0, 1]
    assert found.agreement.r == pytest.approx(expected)


@pytest.mark.needs("sklearn")
def test_the_phones_made_to_differ_differ_most(talker):
    other = NamedTalker("other", made_talker(seed=9, gain=20.0))
    compared = analyse(NamedTalker("made", talker), SimilarityOptions(halves=2), other).comparison
    assert compared is not None
    assert {compared.phones[at] for at in np.argsort(-compared.per_phone)[:2]} <= {"p", "b", "m"}
    assert compared.agreement.p < 0.01


def test_refuses_talkers_without_common_phones():
    with pytest.raises(InputError, match="have 2 phones in common; a comparison needs 4"):
        compare_tables(
            table("pbai", [0.5] * 6), table("pbou", [0.5] * 6), "two", np.random.default_rng(0)
        )  # fmt: skip


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (SimilarityOptions(classes=(4, 1)), "9 phones cannot make 1 classes; give a number from 2 to 9"),
        (SimilarityOptions(classes=(10,)), "9 phones cannot make 10 classes"),
        (SimilarityOptions(halves=1), "at least 2 random halves, not 1"),
        (SimilarityOptions(seed=-1), "a seed is a whole number from 0, not -1"),
    ],
)
def test_refuses_options_out_of_range(talker, options, reason):
    with pytest.raises(InputError, match=reason):
        analyse(NamedTalker("made", talker), options)


def test_refuses_a_talker_with_too_few_phones():
    with pytest.raises(InputError, match=r"the talker poor has .* 3 phones and 3 of them 20 times or more"):
        collect_spoken_tokens(made_talker(phones=("p", "a", "u")), "poor")


def test_refuses_a_talker_with_too_few_tokens():
    with pytest.raises(InputError, match=r"9 phones and 0 of them 20 times or more.*record more"):
        collect_spoken_tokens(made_talker(n_utterances=3), "short")
