"""Checks of takes through the real process of the tools."""

import asyncio
import shutil

import pytest

from lexicon.errors import InputError
from tts2face.serving.studio.recording_work import Recordings
from tts2face.serving.studio.recordings import CHECKING, REFUSED, RecordingStore
from tts2face.serving.studio.work import WorkList


def run(coroutine):
    return asyncio.run(asyncio.wait_for(coroutine, 120))


async def check_all(folder, store, number):
    """Check the takes of a recording as a server that starts."""
    work = WorkList(folder)
    recordings = Recordings(folder, work)
    await work.resume()
    recordings.start()
    while any(take.state == CHECKING for take in store.takes(number).values()):
        await asyncio.sleep(0.05)
    await work.close()
    await recordings.close()


def test_prompts_come_with_their_units(tmp_path):
    async def ask():
        recordings = Recordings(tmp_path, WorkList(tmp_path))
        try:
            with pytest.raises(InputError, match="no shipped prompts in de"):
                await recordings.prompts(2, "de", None)
            return await recordings.prompts(2, "en-us", None)
        finally:
            await recordings.close()

    found = run(ask())
    assert len(found["prompts"]) == 25
    first = found["prompts"][0]
    assert set(first["phones"]) <= set(found["running"]["phones"])
    assert set(first["triphones"]) <= set(found["running"]["triphones"])


@pytest.mark.server
def test_takes_that_were_not_checked_are_checked_after_a_restart(tmp_path, rendered_takes, face_model):
    clips = sorted((rendered_takes / "clips").glob("*.mkv"))[:3]
    words = dict(line.split(",")[:2] for line in (rendered_takes / "manifest.csv").read_text().splitlines()[1:])
    texts = [words[clips[0].stem], "We were away a year ago, but Bob may move five big maps.", words[clips[2].stem]]
    store = RecordingStore(tmp_path)
    prompts = {"prompts": [{"text": text, "phones": [], "triphones": []} for text in texts], "running": {}}
    number = store.create("ada", "Ada", prompts)
    for at, clip in enumerate(clips):
        upload = tmp_path / "upload"
        shutil.copy(clip, upload)
        store.add_take(number, at, upload, "video/webm")

    run(check_all(tmp_path, store, number))
    takes = store.takes(number)
    assert takes[1].state == REFUSED
    assert "read exactly what is shown" in takes[1].advice
    assert takes[0].state != REFUSED, takes[0].advice
    assert takes[0].key


def test_a_file_that_is_no_video_is_refused_with_one_sentence(tmp_path, face_model):
    store = RecordingStore(tmp_path)
    number = store.create("ada", "Ada", {"prompts": [{"text": "Hello there."}], "running": {}})
    (tmp_path / "upload").write_bytes(b"no video at all" * 100)
    take = store.add_take(number, 0, tmp_path / "upload", "video/webm")

    run(check_all(tmp_path, store, number))
    found = store.takes(number)[0]
    assert (found.file, found.state) == (take.file, REFUSED)
    assert "cannot be read as video or sound" in found.advice
    assert str(tmp_path) not in found.advice
