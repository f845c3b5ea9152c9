"""Excluded tokens are not used, and all others as before."""

import numpy as np
import pytest

from lexicon.errors import InputError
from lexicon.sequence import SILENCE, PhoneSequence
from tests.lips.exemplar.conftest import made_talker
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model, exclude_tokens, select_tokens
from tts2face.lips.explanation import explain_selection
from tts2face.lips.options import ExcludedToken

PHONES = PhoneSequence([SILENCE, "p", "ɑ", "s", "i", SILENCE], [0.0, 0.3, 0.4, 0.5, 0.6, 0.7, 1.0])


@pytest.fixture(scope="module")
def exemplars() -> ExemplarModel:
    return build_exemplar_model(made_talker())


def used(exemplars: ExemplarModel) -> list[list[tuple[str, float]]]:
    shown = explain_selection(select_tokens(PHONES, exemplars), exemplars)
    return [[(token.utterance, token.start) for token in phone.tokens] for phone in shown]


def test_an_excluded_token_is_replaced_by_the_next_best(exemplars: ExemplarModel) -> None:
    before = used(exemplars)
    best = before[1][0]
    after = used(exclude_tokens(exemplars, (ExcludedToken(*best),)))
    assert best not in after[1]
    assert after[1][:-1] == before[1][1:]
    assert [after[at] for at in (0, 2, 3, 4)] == [before[at] for at in (0, 2, 3, 4)]


def test_the_last_token_of_a_phone_cannot_be_excluded(exemplars: ExemplarModel) -> None:
    tokens = exemplars.tokens
    number = tokens.inventory.index("p")
    every = tuple(
        ExcludedToken(exemplars.names[tokens.utterance[at]], float(tokens.spans[at, 1]))
        for at in np.flatnonzero(tokens.phone == number)
    )
    with pytest.raises(InputError, match="all recorded examples of /p/ are excluded"):
        exclude_tokens(exemplars, every)


@pytest.mark.parametrize(
    ("token", "reason"),
    [
        (ExcludedToken("nobody", 0.4), "the talker has no recording 'nobody'"),
        (ExcludedToken("u000", 0.123), r"no phone of the recording u000 begins at 0\.123 s"),
    ],
)
def test_tokens_that_do_not_exist_are_refused(exemplars: ExemplarModel, token: ExcludedToken, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        exclude_tokens(exemplars, (token,))
