"""A line as a clip, with a mood, a nod and a pause, and its animation and captions for other programs.

    python clip.py

It writes `hello.mp4`, `hello.csv` and `hello.srt`.
"""

import tts2face

TEXT = "Hello there. [nod] [style:delighted] We were away a year ago. [/style] [pause 0.5] Good bye."

session = tts2face.Session(face="mara", hair_color="red")
written = session.write(
    TEXT,
    "hello.mp4",
    exports=["hello.csv", "hello.srt"],  # Live Link Face weights, captions
    size="384x384",
    gain="head=1.5",
)
print(f"{written.path}: {written.seconds:.2f} s, {written.n_frames} frames")

speech = session.clip(TEXT).speech  # the same clip in memory
for word in speech.words:
    edges, phones = speech.phones.edges, speech.phones.phones
    print(f"{edges[word.first]:6.2f} s  {word.text:<8} {' '.join(phones[word.first : word.last])}")
