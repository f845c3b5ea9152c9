"""Audio maps on voices outside their training data, compared with exemplar synthesis for the known phones.

Run: ``python tests/bench/bench_drive_voices.py me.talker`` with a talker that has audio maps.
"""

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from sentences import sentences

from tts2face.lips import explanation
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.models.landmarks import lip_opening, lip_width
from tts2face.models.talker import Talker, load_talker
from tts2face.session.recording import map_audio_to_motion
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Speech, frame_count


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("talker")
    parser.add_argument("--sentences", type=int, default=20)
    options = parser.parse_args()
    talker = load_talker(options.talker)
    print("| voice | drive | loudness | r opening | r width | range ratio |\n| --- | --- | --- | --- | --- | --- |")
    for name in ("heart", "espeak"):
        voice = load_voice(name, "en-us", {})
        speeches = [voice.speak(text, rate=1.0, seed=0) for text in sentences(options.sentences)]
        for drive in ("linear", "network"):
            for is_matched in (False, True):
                kept = talker.audio_maps[drive]
                used = kept if is_matched else replace(kept, loudness=float("nan"))
                figures = " | ".join(f"{value:.3f}" for value in lip_errors(speeches, talker, used))
                print(f"| {name} | {drive} | {'matched' if is_matched else 'as it is'} | {figures} |", flush=True)


def lip_errors(speeches: list[Speech], talker: Talker, drive: object) -> tuple[float, float, float]:
    known = build_exemplar_model(talker)
    exemplars, heard = [], []
    with tempfile.TemporaryDirectory() as folder:
        for speech in speeches:
            path = write_wave(Path(folder) / "said.wav", speech)
            n_frames = frame_count(speech.waveform.duration, talker.fps)
            exemplars.append(speech_trajectory(speech.phones, known, fps=talker.fps, n_frames=n_frames).values)
            heard.append(map_audio_to_motion(path, drive, talker, talker.fps)[1].values[:n_frames])
    n = [min(len(a), len(b)) for a, b in zip(exemplars, heard, strict=True)]
    shapes = [
        talker.model.shapes(np.concatenate([one[:k] for one, k in zip(ways, n, strict=True)]))
        for ways in (exemplars, heard)
    ]
    openings, widths = ([measure(one) for one in shapes] for measure in (lip_opening, lip_width))
    return (
        explanation.correlation(*openings),
        explanation.correlation(*widths),
        explanation.range_ratio(*openings),
    )


def write_wave(path: Path, speech: Speech) -> Path:
    import wave

    with wave.open(str(path), "wb") as file:
        file.setnchannels(1)
        file.setsampwidth(2)
        file.setframerate(speech.waveform.rate)
        file.writeframes((speech.waveform.samples * 32767).astype(np.int16).tobytes())
    return path


if __name__ == "__main__":
    main()
