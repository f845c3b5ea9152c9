"""Numbers of the utterances of a live face: which are open, and which are forgotten."""


class UtteranceNumbers:
    """Counts utterances from 1 on; 0 is none."""

    def __init__(self) -> None:
        self._last = self._all_forgotten = 0
        self._forgotten: set[int] = set()
        self._text = 0  # that grows
        self._sound = (0, 0)  # that grows, and its rate in Hz

    def next(self) -> int:
        """Number of a new utterance."""
        self._last += 1
        return self._last

    def open_text(self) -> int:
        """Number of the text that grows; a new one if none does."""
        self._text = self._text or self.next()
        return self._text

    def end_text(self) -> int:
        """Number of the text that has grown; 0 for none."""
        number, self._text = self._text, 0
        return number

    @property
    def open_rate(self) -> int:
        """Rate in Hz of the sound that grows; 0 for none."""
        return self._sound[1]

    def open_sound(self, rate: int) -> int:
        """Number of the sound that grows, of which more has its rate in Hz; a new one if none does."""
        self._sound = self._sound[0] or self.next(), rate
        return self._sound[0]

    def end_sound(self) -> int:
        """Number of the sound that has grown; 0 for none."""
        (number, _), self._sound = self._sound, (0, 0)
        return number

    def forget(self, number: int | None) -> None:
        """Forget an utterance, or all so far."""
        if number is None:
            self._all_forgotten = self._last
            self._forgotten.clear()
        elif number > self._all_forgotten:
            self._forgotten.add(number)
        self._text = 0 if self.is_forgotten(self._text) else self._text
        self._sound = (0, 0) if self.is_forgotten(self._sound[0]) else self._sound

    def is_forgotten(self, number: int) -> bool:
        """Whether an utterance is forgotten; 0 never is."""
        return number in self._forgotten or 0 < number <= self._all_forgotten
