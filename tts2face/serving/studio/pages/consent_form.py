"""Whose consent shows a face: one of three answers, with words behind it."""

from nicegui import ui

from tts2face.models.consent import AGREED, NOBODY, SELF

ANSWERS = {SELF: "It shows me", AGREED: "The person agreed", NOBODY: "Nobody: drawn or generated"}
MAX_WORDS = 500


class ConsentForm:
    """Fields for an answer; `statement` is what they say, as `tts2face.models.consent.parse_consent` reads it."""

    def __init__(self) -> None:
        ui.label("Consent to show this face").classes("quiet")
        self._answer = ui.radio(ANSWERS, on_change=self._show).props('inline dense aria-label="Consent"')
        with ui.row().classes("items-center") as self._agreement:
            self._person = ui.input("Who agreed").props("dense outlined maxlength=200")
            self._day = ui.input("On which day").props("dense outlined type=date stack-label")
        self._words = ui.input("More words, if you like").props(f"dense outlined maxlength={MAX_WORDS}")
        self._show()

    @property
    def statement(self) -> str:
        """The answer and its words; empty without an answer."""
        given = [(self._words.value or "").strip()]
        if self._answer.value == AGREED:
            given = [(self._person.value or "").strip(), self._day.value or "", *given]
        words = ", ".join(part for part in given if part)
        return f"{self._answer.value}: {words}" if words or self._answer.value == AGREED else self._answer.value or ""

    def clear(self) -> None:
        """Take back what was answered."""
        self._answer.value = None
        self._person.value = self._day.value = self._words.value = ""

    def _show(self) -> None:
        self._agreement.set_visibility(self._answer.value == AGREED)
        self._words.set_visibility(self._answer.value is not None)
