"""Words of a clip with their times and confidence as JSON lines."""

import json

from tts2face.interchange.exports.labels import part_words
from tts2face.interchange.exports.parts import Part, Target


class WordLinesWriter:
    """Writer of one JSON object for each word: start and end in seconds, and how probably a recording has it there."""

    def __init__(self, target: Target) -> None:
        self._file = target.open_lines()

    def add(self, part: Part) -> None:
        """Append the words of a part."""
        for word in part_words(part):
            record = {"start": round(word.start, 9), "end": round(word.end, 9), "word": word.text}
            record["confidence"] = round(word.confidence, 3)
            self._file.write(json.dumps(record, ensure_ascii=False) + "\n")

    def finish(self) -> None:
        """Close the file."""
        self._file.close()

    close = finish
