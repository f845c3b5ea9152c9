r"""Formulas in LaTeX, as language models write them: ``$x^2$``, ``\(a + b\)``, ``$$\frac{1}{2}$$``.

`formula_words` writes a formula with the signs and words that the front end reads; ``latex.tsv`` has the signs of
commands. Commands without a row or a rule are their own names (``\sin``), fonts and spaces are silent.
"""

import re

from lexicon.dictionary import word_set
from lexicon.written_forms import read_table

MAX_FORMULA_CHARACTERS = 500
MAX_DEPTH = 12  # of groups within groups; braces of deeper ones are read past
ENVIRONMENTS = r"(?:equation|align|aligned|gather|gathered|multline|eqnarray|displaymath)\*?"
_TOKEN = re.compile(r"\\[A-Za-z]+\*?|\\.|[A-Za-z]+|[0-9]+(?:[.,][0-9]+)*|\s+|.", re.DOTALL)
_COMMENT = re.compile(rf"\\(?:begin|end)\{{{ENVIRONMENTS}\}}|\\(?:label|tag)\{{[^{{}}]{{0,80}}\}}|&")
_SILENT = word_set(
    "left right big Big bigg Bigg displaystyle textstyle limits nolimits quad qquad hspace vspace mathrm mathbf mathit "
    "mathsf mathcal mathbb mathfrak boldsymbol operatorname boxed text textbf textit textrm mbox hat bar vec tilde "
    "overline underline dot ddot bigl bigr Bigl Bigr cancel nonumber notag"
)
_TEXTS = word_set("text textbf textit textrm mbox operatorname mathrm")  # whose letters are words
_FUNCTIONS = word_set("sin cos tan cot sec csc log ln exp lim max min sup inf mod gcd arg det dim ker")
_BOUNDED = word_set("sum prod int iint oint lim max min sup inf")
_MINUS = re.compile(r"\A(?:minus|−) (?=[0-9]+\Z)")
_NUMBER = re.compile(r"[0-9]{1,3}")
# Dollars around a formula, not before amounts: $x^2$, $3 \times 4$; not $5 and $10, $HOME or $PATH.
_EVIDENCE = re.compile(r"[\\^_=+<>{(|]|\A(?:[A-Za-z]'?(?:, ?|\Z)){1,6}\Z")
_AMOUNT = re.compile(r"[0-9][0-9.,]*(?!\s*[\\^_+*=<>]|[A-Za-z(])")


def is_formula(written: str) -> bool:
    """Whether what stands between two dollar signs is a formula."""
    return _AMOUNT.match(written) is None and _EVIDENCE.search(written) is not None


def formula_words(written: str, language: str) -> str:
    r"""Signs and words of a formula: ``\frac{1}{2}`` is 1/2, ``e^{i\pi} - 1`` e^i π minus 1.

    Words (minus, over, from, to) stand in English alone; in other languages signs stand in their places.
    """
    tokens = _TOKEN.findall(_COMMENT.sub(" ", written.replace(r"\\", ", "))[:MAX_FORMULA_CHARACTERS])
    words = _Formula(tokens, is_english=language.startswith("en")).words()
    return " ".join(words.split()).replace(" ,", ",").replace(" ^", "^")


class _Formula:
    """Reads the tokens of a formula from left to right; `_tokens` are reversed."""

    def __init__(self, tokens: list[str], *, is_english: bool) -> None:
        self._tokens, self._is_english = tokens[::-1], is_english
        self._depth = 0

    def words(self, end: str = "") -> str:
        """Words up to a closing token, or the end."""
        said: list[str] = []
        while self._tokens and self._tokens[-1] != end:
            said.append(self._next())
        if self._tokens:
            self._tokens.pop()
        return "".join(said)

    def _next(self) -> str:
        token = self._tokens.pop()
        if token.startswith("\\"):
            return self._command(token[1:].rstrip("*"))
        if token == "{":
            return self._group("}")
        if token in "^_":
            return self._raised() if token == "^" else f" {self._argument()} "
        if token == "-":
            return " minus " if self._is_english else " − "
        if token.isalpha() and 1 < len(token) <= 3 and token not in _FUNCTIONS:
            return f" {' '.join(token)} "  # a product
        return {"}": "", "~": " ", "'": " prime " if self._is_english else "'"}.get(token, token)

    def _group(self, end: str) -> str:
        if self._depth >= MAX_DEPTH:
            return " "
        self._depth += 1
        words = self.words(end)
        self._depth -= 1
        return words

    def _argument(self) -> str:
        """The group, the command or the single character that follows."""
        while self._tokens and self._tokens[-1].isspace():
            self._tokens.pop()
        if not self._tokens:
            return ""
        token = self._tokens.pop()
        if len(token) > 1 and token[0] != "\\":
            self._tokens.append(token[1:])
            token = token[0]
        self._tokens.append(token)
        return self._next().strip()

    def _raised(self) -> str:
        argument = _MINUS.sub("-", self._argument())  # as the front end reads powers
        return f"{argument} " if argument in {"°", "'"} else f"^{argument} "

    def _command(self, name: str) -> str:
        if name in {"frac", "dfrac", "tfrac"}:
            return self._fraction()
        if name == "sqrt":
            return self._root()
        if name in _TEXTS:
            return f" {self._text()} "
        if name in _BOUNDED:
            return self._bounded(name)
        if name in _SILENT or not name.isalpha():
            return {"%": "%", "$": "$", "#": "#", "|": "|", "{": " ", "}": " "}.get(name, " ")
        sign = read_table("latex.tsv").get(name, (name,))[0]
        return sign if sign in "°…:" else f" {sign} "

    def _text(self) -> str:
        """The letters of a group as they stand."""
        if not self._tokens or self._tokens[-1] != "{":
            return self._argument()
        self._tokens.pop()
        said: list[str] = []
        while self._tokens and (token := self._tokens.pop()) != "}":
            said.append(token)
        return "".join(said)

    def _fraction(self) -> str:
        top, bottom = self._argument(), self._argument()
        is_plain = _NUMBER.fullmatch(top) and _NUMBER.fullmatch(bottom)
        between = "/" if is_plain else " over " if self._is_english else " / "
        return f" {top}{between}{bottom} "

    def _root(self) -> str:
        if self._tokens and self._tokens[-1] == "[":
            self._tokens.pop()
            degree = self._group("]").strip()
            if self._is_english and degree == "3":
                return f" the cube root of {self._argument()} "
        return f" √{self._argument()} "

    def _bounded(self, name: str) -> str:
        """A sum, an integral or a limit with its bounds: the sum from i = 1 to n of."""
        sign = read_table("latex.tsv").get(name, (name,))[0]
        bounds: dict[str, str] = {}
        while self._tokens and (self._tokens[-1] in {"_", "^"} or self._tokens[-1].isspace()):
            mark = self._tokens.pop()
            if not mark.isspace():
                bounds[mark] = self._argument()
        if not self._is_english or not bounds:
            return f" {sign} {' '.join(bounds.values())} "
        first = {"lim": "as"}.get(name, "from" if "^" in bounds else "over")
        parts = [f"{first} {bounds['_']}"] if "_" in bounds else []
        parts += [f"to {bounds['^']}"] if "^" in bounds else []
        return f" {sign} {' '.join(parts)} of "
