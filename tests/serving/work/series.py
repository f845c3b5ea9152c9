"""Three subtitle files of a series from public-domain speeches, with twenty planted defects."""

import random
import re
from dataclasses import dataclass, field
from pathlib import Path

SPEECH = Path(__file__).with_name("speech.txt")
N_DEFECTS = 20


@dataclass
class Episode:
    """A subtitle file: what is spoken from when on, by cue."""

    path: Path
    spoken: dict[float, str] = field(default_factory=dict)  # seconds of the start -> words
    n_defects: int = 0


@dataclass
class _Cue:
    begin: float
    end: float
    text: str


def make_series(folder: Path, n_cues: int) -> tuple[Episode, ...]:
    """Write ``s1.srt``, ``s2.vtt`` and ``s3.ass`` with `n_cues` cues each; n_cues is at least 12."""
    words = SPEECH.read_text(encoding="utf-8").split()
    makers = (_subrip, _webvtt, _substation)
    episodes = []
    for number, make in enumerate(makers, start=1):
        generator = random.Random(number)
        cues, at, word = [], 0.5, 40 * number
        for _ in range(n_cues):
            n = generator.randint(3, 6)
            text = " ".join(words[(word + i) % len(words)] for i in range(n))
            length = round(0.42 * n + generator.uniform(0.3, 0.9), 2)
            cues.append(_Cue(round(at, 2), round(at + length, 2), text))
            word, at = word + n, at + length + generator.uniform(0.1, 0.6)
        episodes.append(make(folder, cues))
    assert sum(one.n_defects for one in episodes) == N_DEFECTS
    return tuple(episodes)


def _subrip(folder: Path, cues: list[_Cue]) -> Episode:
    episode = Episode(folder / "s1.srt", {one.begin: one.text for one in cues}, 10)
    blocks = [f"{n}\n{_stamp(c.begin, ',')} --> {_stamp(c.end, ',')}\n{c.text}\n" for n, c in enumerate(cues, start=1)]
    blocks[1] = blocks[1].rstrip("\n")  # 1: no blank line before the next cue
    blocks[3] = blocks[3].partition("\n")[2]  # 2: no number
    blocks[4] = blocks[4].replace(",", ".", 1)  # 3: a point in a time
    blocks[5] = blocks[5].replace(cues[5].text, f"<i>{cues[5].text}</i>")  # 4: tags
    blocks[6] = blocks[6].replace(cues[6].text, f"JOHN: {cues[6].text}")  # 5: a speaker
    blocks[7] = blocks[7].replace(cues[7].text, "[door slams]")  # 6: a noise
    blocks[8] = blocks[8].replace(cues[8].text, "♪ la la la ♪")  # 7: a song
    del episode.spoken[cues[7].begin], episode.spoken[cues[8].begin]
    blocks[9] = blocks[9].replace("-->", "->")  # 8: a short arrow
    blocks[10], blocks[11] = blocks[11], blocks[10]  # 9: backward times
    text = "\ufeff" + "\n".join(blocks)  # 10: byte order mark
    episode.path.write_text(text, encoding="utf-8")
    return episode


def _webvtt(folder: Path, cues: list[_Cue]) -> Episode:
    episode = Episode(folder / "s2.vtt", {one.begin: one.text for one in cues}, 5)
    blocks = [f"{_stamp(c.begin, '.')} --> {_stamp(c.end, '.')}\n{c.text}\n" for c in cues]
    blocks[1] = f"NOTE never spoken\n\n{blocks[1]}"  # 11: a comment
    blocks[2] = re.sub(r"\b00:(\d\d:\d\d\.)", r"\1", blocks[2])  # 12: no hours
    blocks[3] = blocks[3].replace(cues[3].text, f"<v Ann>{cues[3].text}")  # 13: a voice tag
    blocks[4] = blocks[4].replace(cues[4].text, cues[4].text.replace(" ", "\r\n", 1))  # 14: line ends of Windows
    episode.path.write_bytes("\n".join(blocks).encode())  # 15: no header
    return episode


def _substation(folder: Path, cues: list[_Cue]) -> Episode:
    episode = Episode(folder / "s3.ass", {one.begin: one.text for one in cues}, 5)
    lines = [
        f"Dialogue: 0,{_stamp(c.begin, '.')[1:-1]},{_stamp(c.end, '.')[1:-1]},Default,,0,0,0,,{c.text}" for c in cues
    ]
    lines[1] = lines[1].replace(",,0,0,0,,", r",,0,0,0,,{\an8\pos(10,10)}")  # 16: tags
    lines[2] = lines[2].replace(cues[2].text, cues[2].text.replace(" ", r"\N", 1))  # 17: a line break
    lines[3] = f"Comment: 0,0:00:01.00,0:00:02.00,Default,,0,0,0,,never spoken\n{lines[3]}"  # 18: a comment
    lines[4] = lines[4].replace("Default,,", "Default,ANN,")  # 19: an actor
    lines[5] = f"Dialogue: 0,nonsense\n{lines[5]}"  # 20: a damaged line
    head = (
        "[Script Info]\nScriptType: v4.00+\n\n[Events]\n"
        "Format: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, Effect, Text\n"
    )
    episode.path.write_text(head + "\n".join(lines) + "\n", encoding="utf-8")
    return episode


def _stamp(seconds: float, point: str) -> str:
    ms = round(seconds * 1000)
    return f"{ms // 3_600_000:02d}:{ms // 60_000 % 60:02d}:{ms // 1000 % 60:02d}{point}{ms % 1000:03d}"
