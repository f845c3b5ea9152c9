"""Lips from sound alone, on synthetic voices and on other people.

On voices they are compared with those of the known phones, on people (``--people``: a folder of recordings, one of each
person) with the recorded ones. Run: ``python tests/bench/bench_drive_voices.py grid_s1``.
"""

import argparse
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sentences import sentences

from corpus_tools.recordings.observe import observe
from corpus_tools.studies.evaluation.people import evaluate_people
from corpus_tools.studies.evaluation.people_tables import people_table
from tts2face.lips import explanation
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.models.landmarks import lip_opening, lip_width
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.session.recording import map_audio_to_motion
from tts2face.sound.transcript import recognise_phones
from tts2face.sound.voice_pool import load_voice
from tts2face.source_options import AUDIO_MAP_NAMES, RECOGNISED
from tts2face.storage.wave_files import wave_bytes
from tts2face.types import Speech, frame_count

VOICES = ("heart", "joe", "espeak", "espeak-female")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("talker", nargs="?", default="grid_s1")
    parser.add_argument("--sentences", type=int, default=20)
    parser.add_argument("--people", type=Path)
    options = parser.parse_args()
    talker = load_talker(options.talker)
    if options.people is not None:
        kept = observe(options.people).kept
        found = evaluate_people(talker, [[one] for one in kept], sounds={one.name: one.video for one in kept})
        print(people_table(found))
    print("| voice | audio map | r opening | r width | range ratio |\n| --- | --- | --- | --- | --- |")
    for name in VOICES:
        voice = load_voice(name, "en-us", {})
        speeches = [voice.speak(text, rate=1.0, seed=0) for text in sentences(options.sentences)]
        for audio_map, figures in lip_figures(speeches, talker):
            print(f"| {name} | {audio_map} | {' | '.join(f'{value:.3f}' for value in figures)} |", flush=True)


def lip_figures(speeches: list[Speech], talker: Talker) -> Iterator[tuple[str, tuple[float, float, float]]]:
    """Correlations of opening and width with those of the known phones, and the ratio of ranges, by audio map."""
    known, fps = build_exemplar_model(talker), talker.fps

    def of_phones(speech: Speech) -> NDArray[np.float32]:
        n_frames = frame_count(speech.waveform.duration, fps)
        return speech_trajectory(speech.phones, known, fps=fps, n_frames=n_frames).values

    true = [of_phones(speech) for speech in speeches]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "said.wav"
        for name in AUDIO_MAP_NAMES:
            heard = []
            for speech in speeches:
                if name == RECOGNISED:
                    heard.append(of_phones(Speech(speech.waveform, recognise_phones(speech.waveform), ())))
                else:
                    path.write_bytes(wave_bytes(speech.waveform.samples, speech.waveform.rate))
                    heard.append(map_audio_to_motion(path, talker.audio_maps[name], talker, fps)[1].values)
            pairs = [(a[: len(b)], b[: len(a)]) for a, b in zip(true, heard, strict=True)]
            shapes = [talker.model.shapes(np.concatenate(one)) for one in zip(*pairs, strict=True)]
            openings, widths = ([measure(one) for one in shapes] for measure in (lip_opening, lip_width))
            yield (
                name,
                (
                    explanation.correlation(*openings),
                    explanation.correlation(*widths),
                    explanation.range_ratio(*openings),
                ),
            )


if __name__ == "__main__":
    main()
