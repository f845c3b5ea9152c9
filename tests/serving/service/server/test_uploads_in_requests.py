"""Files in requests to a running service."""

import io
import json
import tempfile
from pathlib import Path

import av
import httpx
import numpy as np

import tts2face
from tests.serving.service.test_uploads import png, wav


def movie_bytes() -> bytes:
    session = tts2face.Session()
    small = tts2face.Picture(size="32x32", supersampling=1)
    return b"".join(chunk.content for chunk in session.stream_file("We were away.", "mp4", picture=small))


def test_a_recording_and_a_background_make_a_clip(client: httpx.Client) -> None:
    """The video's sound is spoken on a green wall; nothing of the uploads stays."""
    folders = set(Path(tempfile.gettempdir()).glob("tts2face-upload-*"))
    options = {"text": "We were away.", "size": "64x64", "supersampling": 1, "fps": 25}
    response = client.post(
        "/v1/clips",
        data={"request": json.dumps(options)},
        files={"audio": ("../../evil;name.mp4", movie_bytes()), "background": ("b.png", png(64, 64))},
    )
    assert response.status_code == 200, response.text
    with av.open(io.BytesIO(response.content)) as movie:
        frames = [frame.to_ndarray(format="rgb24") for frame in movie.decode(video=0)]
    assert len(frames) > 20
    assert np.abs(frames[0][2, 2].astype(int) - (10, 200, 30)).max() < 25
    assert set(Path(tempfile.gettempdir()).glob("tts2face-upload-*")) == folders


def test_words_of_a_recording_come_with_their_confidence(client: httpx.Client) -> None:
    form = {"request": json.dumps({"text": "We were away.", "format": "words"})}
    response = client.post("/v1/clips", data=form, files={"audio": ("a.mp4", movie_bytes())})
    assert response.status_code == 200, response.text
    words = [json.loads(line) for line in response.text.splitlines()]
    assert [one["word"] for one in words] == ["We", "were", "away"]
    assert all(0.5 < one["confidence"] <= 1.0 and one["start"] < one["end"] for one in words)


def test_a_timeline_moves_the_face(client: httpx.Client) -> None:
    timeline = json.dumps({"expressions": [{"expression": "happy", "weight": 1.0}]})
    options = {"text": "Hello there.", "format": "curves"}
    plain = client.post("/v1/clips", json=options).text
    form = {"request": json.dumps(options)}
    happy = client.post("/v1/clips", data=form, files={"timeline": ("t.json", timeline)}).text
    smiles = []
    for lines in (plain, happy):
        head, *frames = map(json.loads, lines.splitlines())
        smiles.append(max(frame["weights"][head["weights"].index("mouthSmileLeft")] for frame in frames))
    assert smiles[1] > smiles[0] + 0.1


def test_a_face_listens_to_an_uploaded_partner(client: httpx.Client) -> None:
    options = {"text": "", "listen": 3.0, "format": "curves"}
    form = {"request": json.dumps(options)}
    response = client.post("/v1/clips", data=form, files={"partner": ("other.wav", wav())})
    assert response.status_code == 200, response.text
    assert len(response.text.splitlines()) == 1 + 90
