"""How well lips are synthesised for a person: some recordings are held out, synthesised, and compared with the video.

    pip install '.[capture,report]'
    tts2face corpus setup
    python evaluate_recordings.py recordings

The folder holds videos with their words, as docs/recordings.md describes; the page is `evaluation.html`.
"""

import sys
from pathlib import Path

from corpus_tools.measures.splits import split_randomly
from corpus_tools.recordings.observe import observe
from corpus_tools.studies.evaluation.evaluate import evaluate
from corpus_tools.studies.evaluation.page import evaluation_page


def main(folder):
    found = observe(folder)
    for refusal in found.refused:
        print(f"{refusal.name} is left out: {refusal.reason}")
    train, held_out = split_randomly(found.kept, seed=0)  # a fifth is held out
    print(f"{len(train)} utterances to learn from; held out: {', '.join(one.name for one in held_out)}")

    result, runs = evaluate([(train, held_out)])
    print("correlation with the video, and the interval in which it lies with 95 %")
    for method in result.scores:
        opening, width = method.figures["r_opening"], method.figures["r_width"]
        interval = f"{opening.low:.2f} to {opening.high:.2f}"
        print(f"{method.method:<24} opening {opening.value:.2f} ({interval}), width {width.value:.2f}")
    Path("evaluation.html").write_text(evaluation_page(result, runs), encoding="utf-8")


if __name__ == "__main__":  # `observe` starts processes, which import this file
    main(Path(sys.argv[1]))
