"""Formulas in LaTeX and what is said of them."""

import pytest

from lexicon.latex import MAX_DEPTH, formula_words, is_formula
from lexicon.normalize import normalize
from lexicon.text_marks import parse_marks


@pytest.mark.parametrize(
    ("written", "english"),
    [
        (r"x^2 + y_1", "x^2 + y 1"),
        (r"\frac{1}{2}", "1/2"),
        (r"\frac12", "1/2"),
        (r"\dfrac{a+b}{c}", "a+b over c"),
        (r"E = mc^2", "E = m c^2"),
        (r"e^{i\pi} - 1", "e^i π minus 1"),
        (r"10^{-3}", "10^-3"),
        (r"\sqrt{2} \approx 1.41", "√2 ≈ 1.41"),
        (r"\sqrt[3]{8}", "the cube root of 8"),
        (r"\sum_{i=1}^{n} i", "∑ from i=1 to n of i"),
        (r"\int_0^1 x \, dx", "∫ from 0 to 1 of x d x"),
        (r"\lim_{x \to 0} \sin x", "lim as x → 0 of sin x"),
        (r"\max_x f(x)", "max over x of f(x)"),
        (r"90^\circ", "90°"),
        (r"\text{speed} = \frac{\text{way}}{t}", "speed = way over t"),
        (r"\begin{aligned} a &= b \\ c &= d \end{aligned}", "a = b, c = d"),
        (r"f'(x) \leq 5\%", "f prime (x) ≤ 5%"),
        (r"\left( \unknown \right)", "( unknown )"),
        ("", ""),
        ("}{^_", "^"),
    ],
)
def test_a_formula_is_words_and_signs(written: str, english: str) -> None:
    assert formula_words(written, "en-us") == english


def test_other_languages_have_signs_in_place_of_words() -> None:
    assert formula_words(r"\frac{a}{b} - \sum_{i=1}^n i", "de") == "a / b − ∑ i=1 n i"


def test_groups_are_read_up_to_a_depth() -> None:
    assert formula_words("{" * MAX_DEPTH + "x" + "}" * MAX_DEPTH, "en-us") == "x"
    assert formula_words("{" * 400 + "x", "en-us") == "x"


@pytest.mark.parametrize("written", ["x^2", r"3 \times 4", "2x + 1", "n", "x, y", "f(x)", "5 = a"])
def test_what_is_a_formula_between_dollars(written: str) -> None:
    assert is_formula(written)


@pytest.mark.parametrize("written", ["5 and then", "HOME or", "10-", "20, or 30", "price", "5k to"])
def test_what_is_an_amount_between_dollars(written: str) -> None:
    assert not is_formula(written)


@pytest.mark.parametrize(
    ("text", "spoken"),
    [
        ("The area is $x^2$.", "The area is x squared"),
        ("It costs $5 or $10, not $HOME.", "It costs five dollars or ten dollars, not dollars HOME"),
        ("So\n$$\n\\frac{3}{4}\n$$\nof it.", "So three quarters of it"),
        (r"Let \(a < b\) hold.", "Let a less than b hold"),
        ("\\[\nx = 1\n\\]\nThen stop.", "x equals one. Then stop"),
        ("Pay $$ and go.", "Pay dollars dollars and go"),
    ],
)
def test_formulas_stand_in_a_text(text: str, spoken: str) -> None:
    assert normalize(parse_marks(text).text).replace(".", "") == spoken.replace(".", "")
