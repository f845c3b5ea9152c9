"""Every cue of subtitle files as a clip that is fitted to its time, with a face and a voice for each speaker.

talk.srt:

    1
    00:00:00,500 --> 00:00:02,000
    ANN: Hello there.

    2
    00:00:02,500 --> 00:00:04,000
    JOHN: How are you?

cast.toml:

    [[role]]
    speaker = "JOHN*"
    face = "ben"
    voice = "espeak"
    style = "annoyed"

With these files, or your own:

    python subtitles.py talk.srt

The clips and their manifest are in the folder `clips`. Run again, it renders only cues that have changed.
"""

import json
import sys
from pathlib import Path

import tts2face

plan = tts2face.plan_batch(
    [Path(name) for name in sys.argv[1:]],
    tts2face.BatchOptions(overflow="cut-pauses", exports=("csv",)),
    request=tts2face.Request(fps=25),
    picture=tts2face.Picture(size="256x256"),
    cast=tts2face.read_cast(Path("cast.toml")),
)
for warning in plan.warnings:
    print(f"{warning.file}, line {warning.line}: {warning.message}")

result = tts2face.run_batch(plan, "clips")
print(f"{result.n_made} clips made, {result.n_current} unchanged, {len(result.failed)} failed")
for output in json.loads(Path("clips/manifest.json").read_text(encoding="utf-8"))["outputs"]:
    print(output["file"], output["status"], *(f"{cue['speaker']}: {cue['text']}" for cue in output["cues"]))
