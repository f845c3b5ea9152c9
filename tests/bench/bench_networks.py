"""Seconds that a talker's phone networks take, from its own recordings alone and with the networks of a base.

Run: python tests/bench/bench_networks.py grid_s1
"""

import sys
import time
from dataclasses import replace

from corpus_tools.training.phone_network import add_phone_network
from corpus_tools.training.pooling.base_speech import base_speech
from tts2face.models.talker_file import load_talker


def main(name: str) -> None:
    """Print seconds of processor time; the kernels are compiled or loaded first."""
    known = load_talker(name)
    alone = replace(known, network=None)
    add_phone_network(replace(alone, utterances=alone.utterances[:60]))
    marks = [time.process_time()]
    add_phone_network(alone)
    marks.append(time.process_time())
    phrases = base_speech(known)
    marks.append(time.process_time())
    add_phone_network(alone, phrases)
    marks.append(time.process_time())
    minutes = sum(len(one.shape) for one in alone.utterances) / alone.fps / 60
    for stage, begin, end in zip(
        ("networks, own recordings alone", "phrases of the base", "networks, with the base"),
        marks[:-1],
        marks[1:],
        strict=True,
    ):
        sys.stdout.write(f"{stage:32} {end - begin:6.1f} s for {minutes:.0f} minutes of recordings\n")


if __name__ == "__main__":
    main(sys.argv[1])
